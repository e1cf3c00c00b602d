"""Untangling of message stamps: clock jumps undone, order restored, repeats counted."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.errors import EstimateError

# A message later than this many periods that the others don't follow is late; when they do, the clock was set back.
NEIGHBOURS = 16
# A log with more candidates than this has no clock worth untangling.
MAX_CANDIDATES = 1000
#: A step forward that nobody waits for: eleven days, in a log of seconds to hours. Clocks that start in 1970 do it.
LEAP_NS = 1_000_000_000_000_000
#: Thirty years: no log lasts as long, so stamps that span more are garbage.
LONGEST_NS = 1_000_000_000_000_000_000
_SAMPLE = 50_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockJump:
    """A step of the clock between two neighbouring messages.

    How long it took is unknown; one missing sample marks it, so that nothing is averaged across.

    Attributes
    ----------
    before_ns, after_ns
        Stamps on either side.
    shift_ns
        What to add to every later stamp so that time runs on; 0 for a step forward that may as well be a pause.
    """

    before_ns: int
    after_ns: int
    shift_ns: int

    @property
    def step_s(self) -> float:
        """Size of the step, negative when the clock was set back."""
        return (self.after_ns - self.before_ns) * 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Untangled:
    """Stamps on one clock that only runs forward.

    Attributes
    ----------
    time_ns
        ``[message]`` stamps in rising order, jumps undone.
    steps
        Differences of `time_ns`.
    order
        ``[message]`` place of arrival of each, None when none came late.
    jumps
        Steps back, and leaps forward of more than eleven days, that were undone.
    out_of_order
        Messages that came after a later one.
    duplicates
        Messages with the stamp of another.
    """

    time_ns: NDArray[np.int64]
    steps: NDArray[np.int64]
    order: NDArray[np.int64] | None
    jumps: tuple[ClockJump, ...]
    out_of_order: int
    duplicates: int


def require_stamps(stamps_ns: NDArray[Any]) -> NDArray[np.int64]:
    """Give the stamps as int64; `EstimateError` when they are no whole nanoseconds in one dimension."""
    if stamps_ns.ndim != 1 or stamps_ns.dtype.kind not in "iu":
        raise EstimateError(
            f"stamps_ns must be whole nanoseconds in one dimension, got {stamps_ns.dtype} {stamps_ns.shape}"
        )
    if stamps_ns.size and (int(stamps_ns.min()) < 0 or int(stamps_ns.max()) >= 2**62):
        raise EstimateError("stamps_ns must lie between 0 and 2^62 (year 2116); a stamp outside is no time")
    return stamps_ns.astype(np.int64, copy=False)


def untangle(stamps_ns: NDArray[np.int64]) -> Untangled:
    """Undo steps back of the clock, sort what came late, and count both.

    Parameters
    ----------
    stamps_ns
        ``[message]`` int64 nanoseconds, in the order of arrival, at least one.
    """
    # The usual log passes here without a copy.
    time_ns, steps = stamps_ns, np.diff(stamps_ns)
    if steps.size == 0 or (steps.min() >= 0 and steps.max() < LEAP_NS):
        repeats = steps.size - int(np.count_nonzero(steps))
        return Untangled(time_ns=stamps_ns, steps=steps, order=None, jumps=(), out_of_order=0, duplicates=repeats)
    backward = int(np.count_nonzero(steps < 0))
    jumps = find_jumps(stamps_ns)
    if jumps:
        time_ns, _ = run_on(stamps_ns, jumps)
    order = np.argsort(time_ns, kind="stable")
    time_ns = time_ns[order]
    steps = np.diff(time_ns)
    return Untangled(
        time_ns=time_ns,
        steps=steps,
        order=order,
        jumps=jumps,
        out_of_order=backward - sum(jump.shift_ns > 0 for jump in jumps),
        duplicates=steps.size - int(np.count_nonzero(steps)),
    )


def find_jumps(stamps_ns: NDArray[np.int64]) -> tuple[ClockJump, ...]:
    """Find where the clock was set: the messages after stay behind, or ages ahead of, those before."""
    period_ns = typical_period(stamps_ns)
    steps = np.diff(stamps_ns)
    candidates = np.flatnonzero((steps < -NEIGHBOURS * period_ns) | (steps > LEAP_NS))
    if candidates.size > MAX_CANDIDATES:
        return ()
    jumps = []
    for last in candidates:
        before = stamps_ns[max(0, last + 1 - NEIGHBOURS) : last + 1]
        after = stamps_ns[last + 1 : last + 1 + NEIGHBOURS]
        # One or two messages at an end can't show whether the clock was set back or they were late.
        moved = float(np.median(after - before[0]) - np.median(before - before[0]))
        set_back = moved < 0 and min(before.size, after.size) > 2
        if set_back or (moved > 0.5 * LEAP_NS and after.size > 2):
            at, to = int(stamps_ns[last]), int(stamps_ns[last + 1])
            jumps.append(ClockJump(before_ns=at, after_ns=to, shift_ns=at - to + round(2 * period_ns)))
    # Shifts of garbage could add up to more than 64 bits hold.
    return tuple(jumps) if sum(abs(jump.shift_ns) for jump in jumps) < 4 * LONGEST_NS else ()


def run_on(
    stamps_ns: NDArray[np.int64], jumps: tuple[ClockJump, ...], *, done: int = 0
) -> tuple[NDArray[np.int64], int]:
    """Add the shifts of the jumps that occur among the stamps, and of the `done` first ones before them.

    Returns
    -------
    time_ns, done
        Stamps on a clock that runs on, and how many jumps lie behind it.
    """
    # The pair of stamps tells a jump; its number would depend on where reading began.
    if not jumps:
        return stamps_ns, done
    time_ns = stamps_ns + sum(jump.shift_ns for jump in jumps[:done])
    place = 0
    for jump in jumps[done:]:
        here = np.flatnonzero((stamps_ns[place:-1] == jump.before_ns) & (stamps_ns[place + 1 :] == jump.after_ns))
        if not here.size:
            break
        place += int(here[0]) + 1
        time_ns[place:] += jump.shift_ns
        done += 1
    return time_ns, done


def typical_period(time_ns: NDArray[np.int64]) -> float:
    """Median over the log of the mean interval of 32 messages: right for bursts, at least 1 ns."""
    lag = max(1, min(2 * NEIGHBOURS, (time_ns.size - 1) // 2))
    starts = np.arange(0, time_ns.size - lag, max(1, time_ns.size // _SAMPLE))
    return max(1.0, float(np.median(np.abs(time_ns[starts + lag] - time_ns[starts]))) / lag)
