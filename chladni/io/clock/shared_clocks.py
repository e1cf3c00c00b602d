"""Clocks of a log that were set while it was recorded: which streams they stamped, and how their time runs on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stamp_order import ClockSteps
from chladni.io.clock.time_base import TimeBase
from chladni.signals.arrays import Real, Whole
from chladni.signals.time_series import NS_PER_S

Key = tuple[str, ...]

# Periods of the fastest stream that may be left out where the clock was set, so that all streams keep their phases.
_LEFT_OUT = 1000
# Phases that are kept within this share of a period are as good as kept.
_IN_PHASE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StreamClock:
    """Where the clock of a stream was set, and the clock's number in the log.

    Attributes
    ----------
    number
        Streams of one number were stamped by one clock: it was set as often, and at the same times.
    steps
        With shifts that are the same for all streams of the clock.
    messages
        Of the stream, in all of the log.
    chosen
        Their numbers in the file in the order of arrival, those without a time left out; None for all as stored.
    """

    number: int
    steps: ClockSteps
    messages: int
    chosen: Whole | None = None

    def eras(self) -> NDArray[np.int32]:
        """``[message]`` in the order of the file, how often the clock had been set before."""
        if self.chosen is None:
            return self.steps.eras(self.messages)
        eras = np.zeros(self.messages, np.int32)
        eras[self.chosen] = self.steps.eras(self.chosen.size)
        return eras


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stamped:
    """Stamps of a stream, and what they tell by themselves.

    Attributes
    ----------
    key
        Of the stream.
    stamps_ns
        ``[message]`` in the order of the file.
    base
        Fitted to those chosen.
    chosen
        Messages that have a time, in the order of arrival; None for all as stored.
    """

    key: Key
    stamps_ns: Whole
    base: TimeBase
    chosen: Whole | None = None

    @property
    def arrived_ns(self) -> Whole:
        """Stamps in the order of arrival."""
        return self.stamps_ns if self.chosen is None else self.stamps_ns[self.chosen]

    def extents(self) -> Whole:
        """``[2, stretch]`` earliest and latest stamp between two steps of the clock."""
        starts = np.append(0, self.base.clock.message)
        return np.stack((np.minimum.reduceat(self.arrived_ns, starts), np.maximum.reduceat(self.arrived_ns, starts)))


def clocks_of(streams: Sequence[Stamped]) -> dict[Key, StreamClock]:
    """Find the clocks that were set, and make each run on for all of its streams together.

    Two streams share a clock when it was set as often in both, and their stamps overlap, or nearly so, in every
    stretch between. Then the same time is added to the stamps of both, so that they stay as far apart as they were.

    Parameters
    ----------
    streams
        All streams of a log.

    Returns
    -------
    dict
        Only streams whose clock was set.
    """
    clocks: list[list[Stamped]] = []
    for stream in streams:
        if not stream.base.clock.count:
            continue
        for members in clocks:
            if _same_clock(members[0], stream):
                members.append(stream)
                break
        else:
            clocks.append([stream])
    found = {}
    for number, members in enumerate(clocks):
        shift_ns = _common_shift(members) if len(members) > 1 else members[0].base.clock.shift_ns
        for one in members:
            steps = replace(one.base.clock, shift_ns=shift_ns)
            found[one.key] = StreamClock(number=number, steps=steps, messages=one.stamps_ns.size, chosen=one.chosen)
    return found


def _same_clock(one: Stamped, other: Stamped) -> bool:
    if one.base.clock.count != other.base.clock.count:
        return False
    (low, high), (other_low, other_high) = one.extents(), other.extents()
    overlap = np.minimum(high, other_high) - np.maximum(low, other_low)
    # A slow stream has its first and last messages up to a period from those of a fast one.
    reach = 2 * max(_period_ns(one.base), _period_ns(other.base)) + 0.5 * np.minimum(
        high - low, other_high - other_low
    )
    apart = np.maximum(np.abs(low - other_low), np.abs(high - other_high))
    return bool(np.all((overlap >= 0) & (apart <= reach)))


def _period_ns(base: TimeBase) -> float:
    return NS_PER_S / base.rate_hz if base.rate_hz > 0 else 0.0


def _common_shift(members: Sequence[Stamped]) -> Whole:
    """``[step]`` what to add to all stamps after each step: time runs on, and phases are kept as well as they can be.

    At least two periods lie between the samples of every stream, so that one of its grid is left out.
    """
    extents = np.stack([one.extents() for one in members])
    periods_ns = np.array([_period_ns(one.base) for one in members])
    low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
    # What is between the last sample of a stream and the first one after, beside what is left out for all.
    slack = (high - extents[:, 1])[:, :-1] + (extents[:, 0] - low)[:, 1:]
    gap = (2 * periods_ns[:, None] - slack).max(axis=0)
    lead = [one for one in members if one.base.uniform]
    phases = [_phases(one, extents[0, 0, 0]) for one in lead]
    shifts = np.zeros(low.size, np.int64)
    for era in range(1, low.size):
        least = int(shifts[era - 1]) + int(high[era - 1] - low[era]) + int(np.ceil(gap[era - 1]))
        shifts[era] = least if not lead else _in_phase(least, [one.base for one in lead], [p[era] for p in phases])
    return shifts[1:]


def _phases(stamped: Stamped, origin_ns: int) -> Real:
    """``[stretch]`` phase of a stream's stamps, in periods, against that of the first stretch."""
    period_ns = _period_ns(stamped.base)
    turns = (stamped.arrived_ns - origin_ns) / period_ns
    starts = np.append(0, stamped.base.clock.message)
    phases = np.angle(np.add.reduceat(np.exp(2j * np.pi * turns), starts)) / (2 * np.pi)
    relative: Real = phases - phases[0]
    return relative


def _in_phase(least_ns: int, bases: Sequence[TimeBase], phases: Sequence[float]) -> int:
    """Smallest shift, from `least_ns` on, that moves every stream by nearly whole periods; else the best one."""
    periods_ns = np.array([_period_ns(base) for base in bases])
    fastest = int(np.argmin(periods_ns))
    # Whole periods of the fastest are tried, which so keeps its phase.
    first = np.ceil(least_ns / periods_ns[fastest] + phases[fastest]) - phases[fastest]
    shifts_ns = (first + np.arange(_LEFT_OUT)) * periods_ns[fastest]
    turns = shifts_ns[:, None] / periods_ns + np.array(phases)
    off = np.abs(turns - np.rint(turns)).max(axis=1)
    good = np.flatnonzero(off <= _IN_PHASE)
    return round(float(shifts_ns[good[0] if good.size else np.argmin(off)]))
