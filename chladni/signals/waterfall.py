"""Spectra over time."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, Names, find_channels
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.signals.units import power_density_unit
from chladni.signals.value import Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Waterfall(Value):
    """Short-time power spectral densities.

    Attributes
    ----------
    time_s
        ``[time]``, centre of each slice in seconds since `start_time_ns`, strictly rising.
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[channel, time, frequency]`` in unit^2/Hz; NaN in slices that touch a missing sample.
    channels
        One for each first index.
    start_time_ns
        Time of the first sample of the series, nanoseconds since the Unix epoch.
    bandwidth_hz
        Effective noise bandwidth of a line.
    provenance
        How it was made.
    """

    AXES: ClassVar = {"values": ("channels", "time_s", "frequency_hz")}
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"values": power_density_unit}

    time_s: Real
    frequency_hz: Real
    values: NDArray[np.floating]
    channels: tuple[Channel, ...]
    start_time_ns: int
    bandwidth_hz: float
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        if self.time_s.ndim != 1 or np.any(np.diff(self.time_s) <= 0):
            raise EstimateError("time_s must be one-dimensional and strictly rising")
        expected = (len(self.channels), self.time_s.size, self.frequency_hz.size)
        require_shape("values", self.values, expected, "channels x times x frequencies")
        self._freeze()

    def select(self, names: Names) -> Self:
        """Give the spectra of the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        return replace(self, values=self.values[rows], channels=tuple(self.channels[row] for row in rows))
