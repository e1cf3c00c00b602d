"""Behaviour after a step read off samples, for responses that no closed form gives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.analysis.step_behaviour import ACCELERATION_RATES, SETTLING_BAND, none
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Quantity
from chladni.signals.arrays import Real

# The last tenth of a settled response stays within the settling band.
LAST_SHARE = 0.1
_SOURCE = "; read off a simulation with laws"


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledStep:
    """One output after a step, at equidistant times from 0 s on.

    Attributes
    ----------
    time_s, values
        ``[sample]``.
    output, source
        Terminals.
    size
        Of the step.
    """

    time_s: Real
    values: Real
    output: Terminal
    source: Terminal
    size: float

    def final(self, band: float) -> float | None:
        """Mean of the last tenth, where that stays within the band about it; else None."""
        last = self.values[-max(int(LAST_SHARE * self.values.size), 2) :]
        mean = float(last.mean())
        scale = float(np.abs(self.values).max())
        # A value that is small beside what was before it is rest at zero, not a final value to be a share of.
        rests = float(np.abs(last - mean).max()) <= band * abs(mean) and abs(mean) > 1e-6 * scale
        return mean if rests else None


def sampled_quantities(step: SampledStep, *, band: float = SETTLING_BAND) -> list[Quantity]:
    """Give the same quantities as `chladni.models.analysis.step_behaviour.step_quantities`, to a sample's precision.

    Peaks are refined by a parabola, crossings by a line. What the samples can't tell has the value None.
    """
    final = step.final(band)
    rated = [_acceleration(step)]
    if final is None or final == 0:
        reason = "the response doesn't come to rest away from zero in the time looked at" + _SOURCE
        names = ("answer_time", "peak_time", "settling_time", "rise_time")
        missing = [none(name, "s", f"{name.replace('_', ' ')} of {step.output.name}", reason) for name in names]
        return [*missing, none("overshoot", "%", f"overshoot of {step.output.name}", reason), *rated]
    relative = step.values / final
    top = int(np.argmax(relative))
    return [*_times(step, relative, band), _overshoot(relative, top, step.output.name), *rated, *_final(step, final)]


def _times(step: SampledStep, relative: Real, band: float) -> list[Quantity]:
    name, time_s = step.output.name, step.time_s
    inner = np.flatnonzero(
        (relative[1:-1] > relative[:-2]) & (relative[1:-1] >= relative[2:]) & (relative[1:-1] > 1 + 1e-6)
    )
    outside = np.flatnonzero(np.abs(relative - 1) > band)
    begun, nearly = (_first_above(time_s, relative, level) for level in (0.1, 0.9))
    top = int(np.argmax(relative))
    answer = _parabola(time_s, relative, int(inner[0]) + 1)[0] if inner.size else None
    settled = float(time_s[outside[-1] + 1]) if outside.size else 0.0
    rise = None if begun is None or nearly is None else nearly - begun
    return [
        _time("answer_time", answer, f"time from the step to the first peak of {name} beyond its final value"),
        _time("peak_time", _parabola(time_s, relative, top)[0] if inner.size else None, f"greatest value of {name}"),
        _time("settling_time", settled, f"time from the step until {name} stays within {100 * band:g} %"),
        _time("rise_time", rise, f"time in which {name} goes from 10 % to 90 % of its final value"),
    ]


def _time(name: str, value: float | None, definition: str) -> Quantity:
    if value is None:
        return none(name, "s", definition, "it has no such point" + _SOURCE)
    return Quantity(name=name, value=value, unit="s", definition=definition + _SOURCE)


def _overshoot(relative: Real, top: int, name: str) -> Quantity:
    highest = _parabola(np.arange(relative.size, dtype=np.float64), relative, top)[1]
    definition = f"greatest value of {name} above its final value, over that" + _SOURCE
    return Quantity(name="overshoot", value=100 * max(highest - 1, 0.0), unit="%", definition=definition)


def _acceleration(step: SampledStep) -> Quantity:
    unit = "rad/s^2" if step.output.unit.startswith("rad") else "m/s^2"
    definition = f"largest magnitude of the acceleration of {step.output.name}"
    rates = ACCELERATION_RATES.get(step.output.unit)
    if rates is None:
        return none("peak_acceleration", unit, definition, "it's no motion")
    signal = step.values
    for _ in range(rates):
        signal = np.gradient(signal, step.time_s)
    return Quantity(
        name="peak_acceleration", value=float(np.abs(signal).max()), unit=unit, definition=definition + _SOURCE
    )


def _final(step: SampledStep, final: float) -> list[Quantity]:
    unit, name = step.output.unit, step.output.name
    told = [Quantity(name="final_value", value=final, unit=unit, definition=f"value that {name} goes to" + _SOURCE)]
    if unit == step.source.unit:
        definition = "command minus output long after a step" + _SOURCE
        told.append(Quantity(name="steady_state_error", value=step.size - final, unit=unit, definition=definition))
    return told


def with_sampled(linear: Sequence[Quantity], sampled: Sequence[Quantity]) -> tuple[Quantity, ...]:
    """Put what a simulation says in place of what the linear equations say."""
    instead = {quantity.name: quantity for quantity in sampled}
    return tuple(instead.get(quantity.name, quantity) for quantity in linear)


def _first_above(time_s: Real, relative: Real, level: float) -> float | None:
    above = np.flatnonzero(relative >= level)
    if not above.size or above[0] == 0:
        return None
    place = int(above[0])
    share = (level - relative[place - 1]) / (relative[place] - relative[place - 1])
    return float(time_s[place - 1] + share * (time_s[place] - time_s[place - 1]))


def _parabola(x: Real, y: Real, place: int) -> tuple[float, float]:
    """Top of the parabola through a sample and its neighbours."""
    if not 0 < place < y.size - 1:
        return float(x[place]), float(y[place])
    before, here, after = y[place - 1 : place + 2]
    bend = before - 2 * here + after
    shift = 0.5 * (before - after) / bend if bend else 0.0
    return float(x[place] + shift * (x[1] - x[0])), float(here - 0.25 * (before - after) * shift)
