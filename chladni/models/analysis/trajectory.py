"""Exact motion of linear equations by the matrix exponential, and where it crosses a level."""

from dataclasses import dataclass
from math import ceil, log2

import numpy as np

from chladni.models.analysis.bracketed_root import bracketed_root
from chladni.models.analysis.exponential import exponential, moved
from chladni.signals.arrays import Real
from chladni.signals.value import Value

# Points of each stage of the grid whose step doubles from stage to stage: a fast start and a slow end both show.
STAGE_POINTS = 32
# Of the shortest time constant: the first step.
FIRST_STEP = 0.1
# Of the time, when a crossing is found.
ROUNDING = 2e-16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory(Value):
    """``w' = M w`` from ``w(0)``: a step response is one whose last state is the constant input.

    Attributes
    ----------
    generator
        M, ``[state, state]``.
    time_s
        ``[point]``, rising from 0, not uniform.
    states
        ``[state, point]``, exact at each time.
    """

    generator: Real
    time_s: Real
    states: Real

    def __post_init__(self) -> None:
        self._freeze()

    def at(self, time_s: float) -> Real:
        """Give the state at one time, exactly."""
        point = max(int(np.searchsorted(self.time_s, time_s, side="right")) - 1, 0)
        return moved(self.generator * (time_s - self.time_s[point]), self.states[:, point])

    def crossings(self, row: Real, level: float = 0.0, *, at_most: int = 0) -> list[float]:
        """Times at which ``row . w`` passes `level`, to rounding; the first `at_most` unless that is 0."""
        signal = row @ self.states - level
        found = np.flatnonzero((signal[:-1] < 0) != (signal[1:] < 0))
        return [self.crossing(row, level, int(point)) for point in (found[:at_most] if at_most else found)]

    def last_crossing(self, row: Real, level: float) -> float | None:
        """Last time at which ``abs(row . w)`` falls under `level`; None when it ends above, 0 when never above."""
        above = np.flatnonzero(np.abs(row @ self.states) > level)
        if not above.size:
            return 0.0
        if above[-1] == self.time_s.size - 1:
            return None
        sign = 1.0 if row @ self.states[:, above[-1]] > 0 else -1.0
        return self.crossing(sign * row, level, int(above[-1]))

    def largest(self, row: Real) -> tuple[float, float]:
        """Time and value of the largest ``abs(row . w)``, refined to where its rate is zero."""
        signal = row @ self.states
        top = int(np.argmax(np.abs(signal)))
        sign = -1.0 if signal[top] < 0 else 1.0
        time_s, value = self.greatest(sign * row)
        return time_s, sign * value

    def greatest(self, row: Real) -> tuple[float, float]:
        """Time and value of the greatest ``row . w``, refined to where its rate is zero."""
        signal = row @ self.states
        top = int(np.argmax(signal))
        rate = row @ self.generator
        best = float(self.time_s[top]), float(signal[top])
        for point in (top - 1, top):
            inside = 0 <= point < self.time_s.size - 1
            if inside and rate @ self.states[:, point] > 0 >= rate @ self.states[:, point + 1]:
                time_s = self.crossing(rate, 0.0, point)
                best = max(best, (time_s, float(row @ self.at(time_s))), key=lambda pair: pair[1])
        return best

    def crossing(self, row: Real, level: float, point: int) -> float:
        """Time between a point and the next at which ``row . w`` passes `level`."""
        start, begun = self.states[:, point], float(self.time_s[point])
        width, rate = float(self.time_s[point + 1]) - begun, row @ self.generator
        ends = self.states[:, point : point + 2]
        (before, after), (first, last) = (row @ ends - level).tolist(), (width * (rate @ ends)).tolist()

        def measure(after_s: float) -> tuple[float, float]:
            state = moved(self.generator * after_s, start)
            return float(row @ state) - level, float(rate @ state)

        below, rounding = before < 0, ROUNDING * (begun + width)
        guess = width * _cubic_root(before, after, first, last)
        return begun + bracketed_root(measure, 0.0, width, begins_below=below, guess=guess, rounding=rounding)


def trajectory(
    generator: Real, start: Real, *, seconds: float, fastest_s: float, longest_step_s: float
) -> Trajectory:
    """Follow ``w' = M w`` for some seconds, with steps that double from a tenth of `fastest_s` to `longest_step_s`.

    Exact at each point: every step is a power of one matrix exponential.
    """
    first = min(FIRST_STEP * fastest_s, longest_step_s)
    doublings = max(ceil(log2(longest_step_s / first)), 0)
    step_s = longest_step_s / 2**doublings
    transition = np.asarray(exponential(generator * step_s))
    times, states = [np.zeros(1)], [start[:, None]]
    for _ in range(doublings):
        _extend(times, states, transition, step_s, STAGE_POINTS)
        if times[-1][-1] >= seconds:
            break
        transition, step_s = transition @ transition, 2 * step_s
    remaining = ceil(max(seconds - times[-1][-1], 0.0) / step_s - 1e-9)
    if remaining > 0:
        _extend(times, states, transition, step_s, remaining)
    return Trajectory(generator=generator, time_s=np.concatenate(times), states=np.concatenate(states, axis=1))


def _cubic_root(before: float, after: float, first: float, last: float) -> float:
    """Where, from 0 to 1, the cubic with these values and slopes at its ends passes zero."""
    square, cube = 3 * (after - before) - 2 * first - last, 2 * (before - after) + first + last

    def measure(x: float) -> tuple[float, float]:
        return before + x * (first + x * (square + x * cube)), first + x * (2 * square + 3 * x * cube)

    line = before / (before - after) if before != after else 0.0
    return bracketed_root(measure, 0.0, 1.0, begins_below=before < 0, guess=line, rounding=1e-9)


def powers(transition: Real, start: Real, count: int) -> Real:
    """``[state, count]``: start, T start, T^2 start, ... by doubling, in log2(count) products."""
    block = start[:, None]
    while block.shape[1] < count:
        block = np.concatenate([block, transition @ block], axis=1)
        transition = transition @ transition
    return block[:, :count]


def _extend(times: list[Real], states: list[Real], transition: Real, step_s: float, count: int) -> None:
    times.append(times[-1][-1] + step_s * np.arange(1, count + 1))
    states.append(powers(transition, transition @ states[-1][:, -1], count))
