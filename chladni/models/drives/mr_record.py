"""A measured stroke of a magnetorheological damper: motion, force, coil current, and what was found about the log."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value

#: Degree of the spline through the positions; a prescribed motion is simulated along the same.
_DEGREE = 5
#: A velocity that is the difference of positions, to this share of its RMS, isn't one more measurement.
_SAME = 1e-4
_FEWEST_SAMPLES = 50


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MrRecord(Value):
    """One log at one current; made by `mr_record`.

    Attributes
    ----------
    name
        For tables.
    current_a
        Coil current, constant.
    times_s, displacement, velocity, force
        ``[sample]``: s, m, m/s, N. Force and velocity have one sign while the damper dissipates.
    notes
        Sentences about offset and drift of the position, the velocity, the offset of the force.
    """

    name: str
    current_a: float
    times_s: Real
    displacement: Real
    velocity: Real
    force: Real
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def rms_force(self) -> float:
        """Root-mean-square of the measured force, N."""
        return float(np.sqrt(np.mean(self.force**2)))

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return float((self.times_s.size - 1) / (self.times_s[-1] - self.times_s[0]))

    def thinned(self, rate_hz: float) -> Self:
        """Give every k-th sample, so that no fewer than `rate_hz` a second are left."""
        # Rates that are whole multiples but for rounding count as such.
        step = max(1, int(self.rate_hz / rate_hz + 1e-6))
        return type(self)(
            name=self.name,
            current_a=self.current_a,
            times_s=self.times_s[::step],
            displacement=self.displacement[::step],
            velocity=self.velocity[::step],
            force=self.force[::step],
            notes=self.notes,
        )


def mr_record(
    series: TimeSeries, *, current_a: float, position: str, force: str, velocity: str | None = None, name: str = ""
) -> MrRecord:
    """Take a stroke of a damper from measured channels.

    The velocity is the derivative of the spline of fifth degree through the positions: exact in phase, where the
    velocity of a log is often a difference of positions and half a sample late. Nothing is removed from position or
    force: an offset of the position shifts x0, an offset of the force is the accumulator's; both are told, and drift.

    Parameters
    ----------
    series
        Complete samples at one rate.
    current_a
        Coil current during the log, A.
    position, force
        Channels, m and N.
    velocity
        Channel to compare with the derivative of the position; it's told how they differ.
    name
        Empty for the current.

    Raises
    ------
    EstimateError
        When a channel isn't there, a sample is missing, nothing moves, or force and velocity have opposite signs.
    """
    # The velocity comes last, so that the rows of the others don't depend on it.
    names = [position, force, *([velocity] if velocity else [])]
    chosen = series.select(names)
    if not chosen.all_valid() or not np.all(np.isfinite(chosen.values)):
        raise EstimateError(f"{', '.join(names)}: samples are missing; take a window without gaps")
    if chosen.samples < _FEWEST_SAMPLES:
        raise EstimateError(
            f"{position}: {chosen.samples} samples are too few for a loop; at least {_FEWEST_SAMPLES}"
        )
    x, f = (np.asarray(row, dtype=np.float64) for row in chosen.values[:2])
    v = _rate(x, series.sample_rate_hz)
    _require_damper(position, force, x, v, f)
    logged = np.asarray(chosen.values[2], dtype=np.float64) if velocity else None
    notes = [_position_note(position, x, chosen.times_s()), _force_note(force, f)]
    if logged is not None and velocity:
        notes.append(_velocity_note(velocity, logged, v, x, series.sample_rate_hz))
    return MrRecord(
        name=name or f"{current_a:g} A",
        current_a=float(current_a),
        times_s=chosen.times_s(),
        displacement=x,
        velocity=v,
        force=f,
        notes=tuple(notes),
    )


def _rate(x: Real, rate_hz: float) -> Real:
    from scipy.interpolate import make_interp_spline

    places = np.arange(x.size)
    # Counted in samples the spline's equations are well scaled.
    return np.asarray(make_interp_spline(places, x, k=_DEGREE).derivative()(places) * rate_hz, dtype=np.float64)


def _require_damper(position: str, force: str, x: Real, v: Real, f: Real) -> None:
    if np.ptp(x) == 0.0 or np.ptp(f) == 0.0:
        raise EstimateError(f"{position}, {force}: nothing changes; a loop needs a motion and a force")
    # A sign turned around would be fitted by a damper that gives power, and badly.
    power = float(np.mean(f * v))
    if power <= 0.0:
        raise EstimateError(
            f"{position}, {force}: the mean power is {power:.3g} W, but a damper takes power; turn one sign around"
        )


def _position_note(channel: str, x: Real, times_s: Real) -> str:
    drift = float(np.polyfit(times_s, x, 1)[0])
    return (
        f"{channel}: mean {x.mean():.2g} m, drift {drift:.2g} m/s over {np.ptp(x):.3g} m; kept, x0 takes the offset"
    )


def _force_note(channel: str, f: Real) -> str:
    return f"{channel}: mean {f.mean():.2g} N of {np.ptp(f):.4g} N peak to peak; kept"


def _velocity_note(channel: str, logged: Real, v: Real, x: Real, rate_hz: float) -> str:
    level = float(np.sqrt(np.mean(v**2)))
    backward = float(np.sqrt(np.mean((np.diff(x) * rate_hz - logged[1:]) ** 2))) / level
    differs = float(np.sqrt(np.mean((logged - v) ** 2))) / level
    kind = (
        "the backward difference of the position, half a sample late" if backward < _SAME else "a signal of its own"
    )
    return f"{channel}: {kind}; differs from the position's derivative by {100 * differs:.2g} % RMS, which is used"
