"""Untangling of message stamps: steps of the clock undone, order restored, repeats counted."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Whole
from chladni.signals.clock_steps import LEAP_NS, ClockSteps, find_clock_steps, sample_period
from chladni.signals.errors import EstimateError


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
