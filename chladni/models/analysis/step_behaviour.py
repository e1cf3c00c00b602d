"""Behaviour in time after a step: answer, rise, overshoot, acceleration, settling, errors that stay."""

from dataclasses import dataclass

import numpy as np

from chladni.models.analysis.horizon import horizon
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.step_response import step_trajectory
from chladni.models.analysis.trajectory import Trajectory
from chladni.models.core.reading import Quantity
from chladni.signals.arrays import Real

SETTLING_BAND = 0.02
# A final value this close to the command, or to zero beside the response's size, differs by rounding only.
EXACT = 1e-9
# How many rates stand between an output and the acceleration.
ACCELERATION_RATES = {"m": 2, "rad": 2, "m/s": 1, "rad/s": 1, "m/s^2": 0, "rad/s^2": 0}
# Settling is looked for through this many periods of a light damping.
LONGEST_PERIODS = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class StepMarks:
    """Where, after a unit step, things happen; times in seconds without dead time, None where they don't.

    Attributes
    ----------
    read
        Path to what is read: the output; its rate (or the rate of that) where the output integrates; the motion
        behind it where an acceleration or a velocity dies out.
    rates
        How many rates it is from the output; negative for integrals.
    final
        Value that the reading goes to.
    motion
        States after the step.
    answer, top, begun, nearly, settled
        First peak beyond the final value; greatest value; first passing of 10 % and of 90 %; entry into the settling
        band for good.
    fastest
        Time of the largest acceleration, for a read output that is a motion.
    missing
        Why there are none of these; empty when there are.
    """

    read: LinearPath
    rates: int
    final: float
    motion: Trajectory
    answer: float | None = None
    top: float | None = None
    begun: float | None = None
    nearly: float | None = None
    settled: float | None = None
    fastest: float | None = None
    missing: str = ""

    def row(self, rates: int = 0) -> Real:
        """Row whose product with a state of `motion` is the reading, or a rate of it."""
        row = np.append(self.read.c[0], self.read.d[0])
        return np.asarray(row @ np.linalg.matrix_power(self.motion.generator, rates))

    def acceleration_rates(self) -> int | None:
        """Count the rates from the reading to the acceleration; None when it's no motion or jumps at the step."""
        rates = ACCELERATION_RATES.get(self.read.outputs[0].unit)
        # A jump of the reading, or of its rate, at the step would be an infinite acceleration.
        signals = [self.row(order) @ self.motion.states for order in range(rates or 0)]
        jumps = any(abs(signal[0]) > EXACT * float(np.abs(signal).max()) for signal in signals)
        return None if jumps else rates


def step_marks(path: LinearPath, *, band: float = SETTLING_BAND) -> StepMarks:
    """Find what happens when after a unit step, each to rounding: on the grid first, then by the exact equations."""
    read, rates = _settling_reading(path)
    chosen = horizon(read.poles)
    if chosen.note:
        chosen = horizon(read.poles, periods=LONGEST_PERIODS)
    motion = step_trajectory(read, chosen)
    missing = _why_missing(read)
    if missing:
        return StepMarks(read=read, rates=rates, final=np.nan, motion=motion, missing=missing)
    marks = StepMarks(read=read, rates=rates, final=read.final_value(), motion=motion)
    return _marked(marks, band)


def _marked(marks: StepMarks, band: float) -> StepMarks:
    row, motion, final = marks.row(), marks.motion, marks.final
    towards = row * np.sign(final)
    acceleration = marks.acceleration_rates()
    fastest = None if acceleration is None else motion.largest(marks.row(acceleration))[0]
    if not _settles_away_from_zero(marks):
        return StepMarks(read=marks.read, rates=marks.rates, final=0.0, motion=motion, fastest=fastest)
    return StepMarks(
        read=marks.read,
        rates=marks.rates,
        final=final,
        motion=motion,
        answer=_first_peak_beyond(motion, towards, abs(final)),
        top=_top(motion, towards, abs(final)),
        begun=_first(motion.crossings(towards, 0.1 * abs(final), at_most=1)),
        nearly=_first(motion.crossings(towards, 0.9 * abs(final), at_most=1)),
        settled=motion.last_crossing(row - _constant(row, final), band * abs(final)),
        fastest=fastest,
    )


def step_quantities(
    path: LinearPath, marks: StepMarks, *, size: float = 1.0, band: float = SETTLING_BAND
) -> list[Quantity]:
    """Tell behaviour after a step of some size in numbers, with the definition of each in words."""
    name, delay = marks.read.outputs[0].name, float(path.dead_time_s[0])
    what = f"{'rate of ' * marks.rates}{'integral of ' * -marks.rates}{name}"
    times = {
        "answer_time": (marks.answer, f"first peak of {what} beyond its final value", "it has no such peak"),
        "peak_time": (marks.top, f"greatest value of {what}", "it never exceeds its final value"),
        "settling_time": (
            marks.settled,
            f"{what} stays within {100 * band:g} % of its final value",
            "it has no final value but 0, or does not settle in the time looked at",
        ),
        "acceleration_time": (
            marks.fastest,
            f"largest acceleration of {name}",
            "it's no motion, or jumps at the step",
        ),
    }
    return [
        *(_time(key, mark, delay, text, reason, marks.missing) for key, (mark, text, reason) in times.items()),
        _rise(marks, what),
        _overshoot(marks, what),
        _peak_acceleration(marks, name, size),
        _final(marks, what, size),
        *_errors(path, marks, size),
    ]


def none(name: str, unit: str, definition: str, reason: str) -> Quantity:
    """Give a quantity that there is none of, with the reason in its definition."""
    return Quantity(name=name, value=None, unit=unit, definition=f"{definition}; none here: {reason}")


def _time(name: str, mark: float | None, delay: float, text: str, reason: str, missing: str) -> Quantity:
    definition = (
        f"time from the step to the {text}" if name != "settling_time" else f"time from the step until {text}"
    )
    if mark is None:
        return none(name, "s", definition, missing or reason)
    return Quantity(name=name, value=mark + delay, unit="s", definition=definition)


def _rise(marks: StepMarks, what: str) -> Quantity:
    definition = f"time in which {what} goes from 10 % to 90 % of its final value"
    if marks.begun is None or marks.nearly is None:
        return none(
            "rise_time", "s", definition, marks.missing or "it has no final value but 0, or begins above 10 %"
        )
    return Quantity(name="rise_time", value=marks.nearly - marks.begun, unit="s", definition=definition)


def _overshoot(marks: StepMarks, what: str) -> Quantity:
    definition = f"greatest value of {what} above its final value, over that"
    if marks.top is None:
        if marks.missing or not _settles_away_from_zero(marks):
            return none("overshoot", "%", definition, marks.missing or "its final value is 0")
        return Quantity(name="overshoot", value=0.0, unit="%", definition=definition)
    top = float(marks.row() @ marks.motion.at(marks.top))
    return Quantity(name="overshoot", value=100 * (top / marks.final - 1), unit="%", definition=definition)


def _peak_acceleration(marks: StepMarks, name: str, size: float) -> Quantity:
    rates = marks.acceleration_rates()
    unit = "rad/s^2" if marks.read.outputs[0].unit.startswith("rad") else "m/s^2"
    definition = f"largest magnitude of the acceleration of {name} after a step of {size:g} {marks.read.source.unit}"
    if marks.fastest is None or rates is None:
        return none("peak_acceleration", unit, definition, marks.missing or "it's no motion, or jumps at the step")
    value = abs(size * float(marks.row(rates) @ marks.motion.at(marks.fastest)))
    return Quantity(name="peak_acceleration", value=value, unit=unit, definition=definition)


def _final(marks: StepMarks, what: str, size: float) -> Quantity:
    unit, definition = marks.read.outputs[0].unit, f"value that {what} goes to"
    if marks.missing:
        return none("final_value", unit, definition, marks.missing)
    return Quantity(name="final_value", value=size * marks.final, unit=unit, definition=definition)


def _errors(path: LinearPath, marks: StepMarks, size: float) -> list[Quantity]:
    unit = path.outputs[0].unit
    texts = (
        ("steady_state_error", unit, "command minus output long after a step"),
        ("tracking_error", "s", "command minus output long after the start of a ramp, over the ramp's slope"),
    )
    reason = marks.missing
    if unit != path.source.unit:
        reason = reason or f"the output ({unit}) can't follow an input of another unit ({path.source.unit})"
    elif marks.rates:
        reason = reason or "the output doesn't come to rest away from zero after a step"
    if reason:
        return [none(*text, reason) for text in texts]
    # Without error up to rounding is without error.
    stays = 1 - marks.final if abs(1 - marks.final) > EXACT else 0.0
    step = Quantity(name=texts[0][0], value=size * stays, unit=unit, definition=texts[0][2])
    if stays:
        return [step, none(*texts[1], "it grows for ever, since a step isn't followed without error")]
    twice = np.linalg.solve(path.a, np.linalg.solve(path.a, path.b)) if path.b.size else path.b
    lag = float(path.c[0] @ twice + path.dead_time_s[0])
    return [step, Quantity(name=texts[1][0], value=lag, unit="s", definition=texts[1][2])]


def _settling_reading(path: LinearPath) -> tuple[LinearPath, int]:
    """Go from the output to what comes to rest away from zero after a step.

    Of an output that integrates the rate does; of an acceleration or a velocity that dies out, the motion behind it.
    """
    read, rates = path, 0
    while read.integrators() and (further := read.rate()) is not None and rates < path.b.size:
        read, rates = further, rates + 1
    while rates <= 0 and read.dies_out():
        read, rates = read.integral(), rates - 1
    return read, rates


def _why_missing(read: LinearPath) -> str:
    if read.looped:
        return "a dead time acts inside a loop: its response is simulated"
    if not read.stable():
        return "the response grows, or swings for ever"
    return "it integrates and is reached directly" if read.integrators() else ""


def _settles_away_from_zero(marks: StepMarks) -> bool:
    scale = float(np.abs(marks.row() @ marks.motion.states).max())
    return abs(marks.final) > EXACT * scale


def _constant(row: Real, value: float) -> Real:
    """Row whose product with any state of a unit step is `value`: the last state is the input, 1."""
    constant = np.zeros_like(row)
    constant[-1] = value
    return constant


def _first_peak_beyond(motion: Trajectory, towards: Real, final: float) -> float | None:
    signal, rate = towards @ motion.states, towards @ motion.generator @ motion.states
    falls = np.flatnonzero((rate[:-1] > 0) & (rate[1:] <= 0) & (np.maximum(signal[:-1], signal[1:]) > 0.99 * final))
    for point in falls:
        time_s = motion.crossing(towards @ motion.generator, 0.0, int(point))
        if float(towards @ motion.at(time_s)) > final * (1 + 1e-9):
            return time_s
    return None


def _top(motion: Trajectory, towards: Real, final: float) -> float | None:
    time_s, value = motion.greatest(towards)
    return time_s if value > final * (1 + 1e-9) else None


def _first(times: list[float]) -> float | None:
    return times[0] if times else None
