"""How far a shaft has turned."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.value import Value, require_shape

RotationSource = Literal["tacho", "phase", "speed", "ridge"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rotation(Value):
    """Angle of a shaft over time.

    Attributes
    ----------
    time_s
        ``[point]``, seconds since `start_time_ns`, strictly rising: pulses, or samples.
    revolutions
        ``[point]``, angle in revolutions, growing; NaN where it isn't known.
    start_time_ns
        Nanoseconds since the Unix epoch.
    source
        What tells it. Of ``speed`` and ``ridge`` the zero is arbitrary, and so is the phase of an order.
    notes
        What to know of how it was made.
    """

    AXES: ClassVar = {"revolutions": ("time_s",)}
    ROWS: ClassVar = "time_s"

    time_s: Real
    revolutions: Real
    start_time_ns: int
    source: RotationSource
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("revolutions", self.revolutions, self.time_s.shape, "time_s")
        if self.time_s.ndim != 1 or np.any(np.diff(self.time_s) <= 0):
            raise EstimateError("time_s must be one-dimensional and strictly rising")
        self._freeze()

    def at(self, series: TimeSeries) -> Real:
        """Give the revolutions at each sample of a series, by a cubic spline; NaN where they aren't known."""
        from scipy.interpolate import CubicSpline

        late_s = (series.start_time_ns - self.start_time_ns) / NS_PER_S
        when_s = series.times_s() + late_s
        found = np.full(when_s.size, np.nan)
        known = np.isfinite(self.revolutions)
        edges = np.flatnonzero(np.diff(known, prepend=False, append=False))
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if last - first < 2:
                continue
            begin = int(np.searchsorted(when_s, self.time_s[first], side="left"))
            end = int(np.searchsorted(when_s, self.time_s[last - 1], side="right"))
            spline = CubicSpline(self.time_s[first:last], self.revolutions[first:last])
            found[begin:end] = spline(when_s[begin:end])
        return found
