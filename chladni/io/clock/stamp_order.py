"""Untangling of message stamps: steps of the clock undone, order restored, repeats counted."""

from dataclasses import dataclass, field, replace
from math import inf
from statistics import median
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value, require_shape

#: A step forward that nobody waits for: eleven days, in a log of seconds to hours. Clocks that start in 1970 do it.
LEAP_NS = 1_000_000_000_000_000
#: Thirty years: no log lasts as long, so stamps that span more are garbage.
LONGEST_NS = 1_000_000_000_000_000_000
#: A log in which more messages than this go back in ways that need a look has no clock.
MAX_CANDIDATES = 100_000
# Messages on either side whose median tells the level of the clock: three of them may be late.
_LEVEL = 7
# With fewer on a side it can't be told whether the clock was set or they were late.
_FEWEST = 3
# Messages that a network may hold up together; also how long a reader waits for late ones.
_HELD_UP = 64
# Periods that a step ahead takes at least: one message may be lost, and stamps scatter.
_AHEAD = 2.5
# Messages before one that tell of it: more than a queue holds, and few enough for two clocks not to drift.
_EARLIER = 512
# Messages between the ends of an interval: enough to average bursts.
_LAG = 32
_SAMPLE = 50_000


def _none() -> Whole:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClockSteps(Value):
    """Steps of a clock, undone.

    Attributes
    ----------
    message
        ``[step]`` the first message after each, counted in the order of arrival, rising.
    before_ns, after_ns
        ``[step]`` stamps of the messages on either side.
    shift_ns
        ``[step]`` what to add to the stamps from there to the next step, so that time runs on from the first message.
        How long a step took is unknown; what is added leaves out at least one sample, so that nothing is averaged
        across.
    """

    message: Whole = field(default_factory=_none)
    before_ns: Whole = field(default_factory=_none)
    after_ns: Whole = field(default_factory=_none)
    shift_ns: Whole = field(default_factory=_none)

    def __post_init__(self) -> None:
        for name in ("before_ns", "after_ns", "shift_ns"):
            require_shape(name, getattr(self, name), self.message.shape, "message")
        self._freeze()

    @property
    def count(self) -> int:
        """How often the clock was set."""
        return int(self.message.size)

    @property
    def sizes_s(self) -> Real:
        """``[step]`` seconds by which the clock was off the next message; negative when it was set back."""
        return np.asarray(self.after_ns - self.before_ns, dtype=np.float64) * 1e-9

    def run_on(self, stamps_ns: Whole, *, first: int = 0) -> Whole:
        """Undo the steps in the stamps of the messages from number `first` on, in the order of arrival."""
        if not self.count:
            return stamps_ns
        cuts = np.clip(self.message - first, 0, stamps_ns.size)
        lengths = np.diff(cuts, prepend=0, append=stamps_ns.size)
        time_ns: Whole = stamps_ns + np.repeat(np.append(0, self.shift_ns), lengths)
        return time_ns

    def eras(self, messages: int) -> NDArray[np.int32]:
        """Count the steps before each of so many messages, in the order of arrival."""
        return np.repeat(np.arange(self.count + 1, dtype=np.int32), np.diff(self.message, prepend=0, append=messages))

    def among(self, kept: Whole) -> Self:
        """Count the messages among some of them, whose numbers rise."""
        return replace(self, message=np.searchsorted(kept, self.message))

    def moved(self, by_ns: Whole) -> Self:
        """Add to the shift after each step."""
        return replace(self, shift_ns=self.shift_ns + by_ns)


def find_clock_steps(stamps_ns: Whole, before: Whole | None = None, *, logged_ns: Whole | None = None) -> ClockSteps:
    """Find where a clock was set back, leapt ahead by more than eleven days, or was set ahead as another clock tells.

    A message that goes back is *late* when the others go on from where they were: the run of messages behind ends in
    a leap, and those in it fill a hole or are three at most. The clock was *set* when those that follow stay behind:
    by the count of samples, the median of seven messages after it is further back than that of the seven before by
    more than a period, three times the scatter allowed for.

    Parameters
    ----------
    stamps_ns
        ``[message]`` in the order of arrival.
    before
        ``[message]`` samples that came before each; None when every message is one sample.
    logged_ns
        ``[message]`` times of another clock, that of the log; None without.

    Returns
    -------
    ClockSteps
        With shifts that leave out one sample or two at each step.
    """
    steps = np.diff(stamps_ns)
    back = np.flatnonzero(steps < 0) + 1
    leaps = np.flatnonzero(steps > LEAP_NS) + 1
    some = steps[:: max(1, steps.size // _SAMPLE)]
    some = some[some > 0]
    # The usual log is done here; steps of the clock are longer than any interval is.
    usual_ns = float(np.median(some)) if some.size else 0.0
    witnessed = logged_ns is not None and usual_ns > 0 and int(steps.max()) > _AHEAD * usual_ns
    if not back.size and not leaps.size and not witnessed:
        return ClockSteps()
    period_ns = sample_period(stamps_ns, before, back)
    if before is None:
        # Means of many intervals are right for bursts and ticks, single ones where stretches are short.
        period_ns = min(period_ns, usual_ns or inf)
        before = np.arange(stamps_ns.size)
    message = _none()
    if back.size or leaps.size:
        candidates = np.sort(np.concatenate((_unclear(stamps_ns, back, period_ns), leaps)))
        message = _set_at(stamps_ns, before, candidates, period_ns)
    if witnessed and logged_ns is not None:
        message = np.union1d(message, _set_ahead(stamps_ns, logged_ns, message, period_ns))
    return _running_on(stamps_ns, message, round(2 * period_ns))


def _set_ahead(stamps_ns: Whole, logged_ns: Whole, set_back: Whole, period_ns: float) -> Whole:
    """Messages before which the clock was set ahead, by the times at which they were logged."""
    steps, logged = np.diff(stamps_ns), np.diff(logged_ns)
    # A clock that was set itself tells nothing of another.
    if logged.min() < 0:
        return _none()
    some = steps[:: max(1, steps.size // _SAMPLE)]
    going = some > 0
    # A simulator's time may run faster or slower than the log's.
    pace = float(np.median(logged[:: max(1, steps.size // _SAMPLE)][going] / some[going])) if going.any() else 0.0
    if pace <= 0:
        return _none()
    ahead = np.flatnonzero((steps > _AHEAD * period_ns) & (logged < 0.5 * pace * steps)) + 1
    found = [
        place
        for place in ahead[:MAX_CANDIDATES].tolist()
        if _logged_sooner(stamps_ns, logged_ns, set_back, place, pace)
    ]
    return np.array(found, dtype=np.int64)


def _logged_sooner(stamps_ns: Whole, logged_ns: Whole, set_back: Whole, place: int, pace: float) -> bool:
    start = (
        int(set_back[np.searchsorted(set_back, place, "right") - 1]) if set_back.size and set_back[0] <= place else 0
    )
    later = set_back[np.searchsorted(set_back, place, "right") :]
    first, end = max(start, place - _EARLIER), min(int(later[0]) if later.size else stamps_ns.size, place + _LEVEL)
    if place - first < _FEWEST or end - place < _FEWEST:
        return False
    part = slice(first, end)
    lag = (logged_ns[part] - logged_ns[place]) - pace * (stamps_ns[part] - stamps_ns[place])
    step = pace * float(stamps_ns[place] - stamps_ns[place - 1])
    return float(np.median(lag[place - first :])) < float(lag[: place - first].min()) - 0.5 * step


def sample_period(stamps_ns: Whole, before: Whole | None, back: Whole) -> float:
    """Median over the log of the mean interval of samples, right for bursts; at least 1 ns.

    Parameters
    ----------
    stamps_ns, before
        As in `find_clock_steps`.
    back
        Messages that go back: intervals across one are left out as far as there are enough others.
    """
    every = max(1, stamps_ns.size // _SAMPLE)
    moved = int(np.count_nonzero(stamps_ns[1::every] != stamps_ns[:-1:every]))
    # As many samples as share a stamp are one interval, and a few of them tell no mean.
    shared = -(-stamps_ns.size // every) // max(1, int(moved))
    lag = max(1, min(_LAG * shared, (stamps_ns.size - 1) // 2))
    while True:
        starts = np.arange(0, stamps_ns.size - lag, every)
        whole = starts[np.searchsorted(back, starts, "right") == np.searchsorted(back, starts + lag, "right")]
        # A quarter of the intervals is enough, when they are chosen by nothing but where the clock was set.
        if 4 * whole.size >= starts.size or lag == 1:
            break
        lag //= 2
    chosen = whole if whole.size else starts
    samples = lag if before is None else before[chosen + lag] - before[chosen]
    return max(1.0, float(np.median(np.abs(stamps_ns[chosen + lag] - stamps_ns[chosen]) / samples)))


def _unclear(stamps_ns: Whole, back: Whole, period_ns: float) -> Whole:
    """Messages that go back, without those that surely are late: alone, before a leap to where the others are."""
    inside = back[(back > 0) & (back < stamps_ns.size - 1)]
    after = stamps_ns[inside + 1]
    late = (after > stamps_ns[inside - 1]) & (after - stamps_ns[inside] > 1.5 * period_ns)
    return np.setdiff1d(back, inside[late], assume_unique=True)


def _set_at(stamps_ns: Whole, before: Whole, candidates: Whole, period_ns: float) -> Whole:
    if candidates.size > MAX_CANDIDATES:
        return _none()
    found: list[int] = []
    start = 0
    for place in candidates.tolist():
        if _is_set(stamps_ns, before, start, place, period_ns):
            found.append(place)
            start = place
    return np.array(found, dtype=np.int64)


def _is_set(stamps_ns: Whole, before: Whole, start: int, place: int, period_ns: float) -> bool:
    first, end = max(start, place - _LEVEL), min(stamps_ns.size, place + _LEVEL)
    if place - first < _FEWEST or end - place < _FEWEST:
        # Of the first messages of a log one may well have an old stamp; those after it are many.
        return end - place >= _FEWEST and int(stamps_ns[place] - stamps_ns[place - 1]) > LEAP_NS
    origin_ns, origin = int(stamps_ns[place]), int(before[place])
    levels = [
        stamp - origin_ns - (samples - origin) * period_ns
        for stamp, samples in zip(stamps_ns[first:end].tolist(), before[first:end].tolist(), strict=True)
    ]
    earlier, later = levels[: place - first], levels[place - first :]
    level, level_later = median(earlier), median(later)
    if stamps_ns[place] > stamps_ns[place - 1]:
        return bool(level_later - level > 0.5 * LEAP_NS)
    if _late(stamps_ns, start, place, first, period_ns):
        return False
    scatter = 1.4826 * median([*(abs(one - level) for one in earlier), *(abs(one - level_later) for one in later)])
    return bool(level - level_later > 1.02 * period_ns + 3 * scatter)


def _late(stamps_ns: Whole, start: int, place: int, first: int, period_ns: float) -> bool:
    """Whether the messages from `place` on that are behind the others were held up."""
    reached_ns = int(stamps_ns[first:place].max())
    following = stamps_ns[place : place + _HELD_UP + 1]
    returned = np.flatnonzero(following > reached_ns)
    if not returned.size:
        return False
    run = following[: returned[0]]
    # Who was set back grows to where the others were, and doesn't leap there.
    if following[run.size] - run[-1] <= 1.5 * period_ns:
        return False
    return run.size <= _FEWEST or _fills_a_hole(run, stamps_ns[max(start, place - _EARLIER) : place], period_ns)


def _fills_a_hole(run: Whole, known_ns: Whole, period_ns: float) -> bool:
    """Whether messages that were held up together are those that are missing among the ones before.

    A clock that was set back tells times that were told before, or others that don't follow on a known one.
    """
    low, high = int(run.min()), int(run.max())
    inside = (known_ns > low - 0.5 * period_ns) & (known_ns < high + 0.5 * period_ns)
    earlier, later = known_ns[known_ns < low], known_ns[known_ns > high]
    if 2 * np.count_nonzero(inside) >= run.size or not earlier.size or not later.size:
        return False
    # A message may be lost on either side.
    return bool(max(low - earlier.max(), later.min() - high) < 2.5 * period_ns)


def _running_on(stamps_ns: Whole, message: Whole, gap_ns: int) -> ClockSteps:
    """Shift each stretch so that its earliest stamp comes `gap_ns` after the latest one of the stretch before."""
    if not message.size:
        return ClockSteps()
    starts = np.append(0, message)
    lowest, highest = np.minimum.reduceat(stamps_ns, starts), np.maximum.reduceat(stamps_ns, starts)
    # Stretches of garbage, one after another, could be longer than 64 bits hold.
    if float(np.sum((highest - lowest).astype(np.float64)) + gap_ns * message.size) > 4 * LONGEST_NS:
        return ClockSteps()
    return ClockSteps(
        message=message,
        before_ns=stamps_ns[message - 1],
        after_ns=stamps_ns[message],
        shift_ns=np.cumsum(highest[:-1] - lowest[1:] + gap_ns),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Untangled:
    """Stamps on one clock that only runs forward.

    Attributes
    ----------
    time_ns
        ``[message]`` stamps in rising order, steps of the clock undone.
    steps
        Differences of `time_ns`.
    order
        ``[message]`` place of arrival of each, None when none came late.
    clock
        Where the clock was set. Messages don't change places across such a step, so that each stretch between two
        begins at the same number in `time_ns` as in the order of arrival.
    out_of_order
        Messages that came after a later one.
    duplicates
        Messages with the stamp of another.
    """

    time_ns: Whole
    steps: Whole
    order: Whole | None
    clock: ClockSteps
    out_of_order: int
    duplicates: int

    def within(self) -> Whole:
        """Steps from message to message, without those across a step of the clock."""
        return np.delete(self.steps, self.clock.message - 1) if self.clock.count else self.steps

    def moved(self, by_ns: Whole) -> Self:
        """Move the stretch after each step of the clock, by so much in all."""
        if not by_ns.any():
            return self
        time_ns = replace(self.clock, shift_ns=by_ns).run_on(self.time_ns)
        return replace(self, time_ns=time_ns, steps=np.diff(time_ns), clock=self.clock.moved(by_ns))


def require_stamps(stamps_ns: NDArray[Any]) -> Whole:
    """Give the stamps as int64; `EstimateError` when they are no whole nanoseconds in one dimension."""
    if stamps_ns.ndim != 1 or stamps_ns.dtype.kind not in "iu":
        raise EstimateError(
            f"stamps_ns must be whole nanoseconds in one dimension, got {stamps_ns.dtype} {stamps_ns.shape}"
        )
    if stamps_ns.size and (int(stamps_ns.min()) < 0 or int(stamps_ns.max()) >= 2**62):
        raise EstimateError("stamps_ns must lie between 0 and 2^62 (year 2116); a stamp outside is no time")
    return stamps_ns.astype(np.int64, copy=False)


def untangle(
    stamps_ns: Whole,
    before: Whole | None = None,
    *,
    known: ClockSteps | None = None,
    logged_ns: Whole | None = None,
) -> Untangled:
    """Undo steps of the clock, sort what came late, and count both.

    Parameters
    ----------
    stamps_ns
        ``[message]`` int64 nanoseconds, in the order of arrival, at least one.
    before
        ``[message]`` samples that came before each; None when every message is one sample.
    known
        Steps of the clock; None looks for them.
    logged_ns
        As for `find_clock_steps`.
    """
    steps = np.diff(stamps_ns)
    rises = steps.size == 0 or (steps.min() >= 0 and steps.max() < LEAP_NS)
    if known is None and (not rises or logged_ns is not None):
        known = find_clock_steps(stamps_ns, before, logged_ns=logged_ns)
    # The usual log passes here without a copy.
    if rises and (known is None or not known.count):
        repeats = steps.size - int(np.count_nonzero(steps))
        return Untangled(
            time_ns=stamps_ns, steps=steps, order=None, clock=ClockSteps(), out_of_order=0, duplicates=repeats
        )
    clock = ClockSteps() if known is None else known
    time_ns = clock.run_on(stamps_ns)
    late = int(np.count_nonzero(np.diff(time_ns) < 0))
    order = np.argsort(time_ns, kind="stable") if late else None
    time_ns = time_ns if order is None else time_ns[order]
    steps = np.diff(time_ns)
    return Untangled(
        time_ns=time_ns,
        steps=steps,
        order=order,
        clock=clock,
        out_of_order=late,
        duplicates=steps.size - int(np.count_nonzero(steps)),
    )


def arrival_order(stamps_ns: Whole) -> Whole | None:
    """Places of arrival in the order of time, steps of the clock undone; None when all came in order."""
    return untangle(stamps_ns).order if stamps_ns.size else None


def typical_period(tangled: Untangled) -> float:
    """Median over the log of the mean interval of 32 messages: right for bursts, at least 1 ns."""
    return sample_period(tangled.time_ns, None, tangled.clock.message)
