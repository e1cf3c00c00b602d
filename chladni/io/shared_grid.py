"""Which streams share one grid, how far it reaches, and what is said of several."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.clock.time_base import TimeBase
from chladni.io.placement import Placement
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import NS_PER_S

#: Two grids are one when their points are never farther apart than this share of a period: 1.8 degrees at Nyquist.
ALIGNED = 0.01
#: ... or than their stamps' scatter can tell, up to this share.
LOOSELY_ALIGNED = 0.05
#: ... and whose rates differ by at most this share.
RATES_ALIKE = 0.01
#: A grid over two recordings has at most so many places for a message.
SPARSEST = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleGrid:
    """Channels that share sampling rate and sample times.

    Attributes
    ----------
    names
        Of the channels.
    sample_rate_hz, start_time_ns, samples
        As the `TimeSeries` of these channels will have them.
    """

    names: tuple[str, ...]
    sample_rate_hz: float
    start_time_ns: int
    samples: int

    @property
    def duration_s(self) -> float:
        """Number of samples over the rate."""
        return self.samples / self.sample_rate_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class Pause:
    """A stretch of a grid without samples.

    Attributes
    ----------
    samples
        Its length.
    middle
        Grid index in it.
    later, messages
        Messages behind it, and in all.
    """

    samples: int
    middle: int
    later: int
    messages: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Group:
    """Streams on one grid.

    Attributes
    ----------
    rate_hz
        Of the grid.
    start_ns
        Time of grid index 0.
    placements
        With indices on this grid.
    first, last, messages
        Grid index of the first sample of all streams and the one after the last, and how many messages they have.
    misalignment
        Largest distance of a stream's samples from the grid of the first, in periods.
    """

    rate_hz: float
    start_ns: int
    placements: tuple[Placement, ...]
    first: int
    last: int
    messages: int
    misalignment: float = 0.0

    @classmethod
    def of(cls, placement: Placement) -> "Group":
        """One stream on its grid."""
        base = placement.time_base
        return cls(
            rate_hz=base.rate_hz,
            start_ns=base.start_ns,
            placements=(placement,),
            first=placement.first,
            last=placement.last,
            messages=placement.index.size,
        )

    def time_ns(self, index: int) -> int:
        """Time of a grid point."""
        return self.start_ns + round(index / self.rate_hz * NS_PER_S)

    def index_from(self, time_ns: int) -> int:
        """First grid point not before a time; one a thousandth of a period before it still counts."""
        return int(np.ceil((time_ns - self.start_ns) / NS_PER_S * self.rate_hz - 1e-3))

    def longest_pause(self) -> "Pause":
        """Longest stretch of the grid between two messages in which none of its streams has a sample."""
        starts = np.concatenate([one.index for one in self.placements])
        counts = [np.ones_like(one.index) if one.counts is None else one.counts for one in self.placements]
        there = starts > NOWHERE // 2
        order = np.argsort(starts[there], kind="stable")
        starts, ends = starts[there][order], (starts + np.concatenate(counts))[there][order]
        empty = np.append(0, starts[1:] - np.maximum.accumulate(ends)[:-1])
        behind = int(np.argmax(empty))
        samples = int(empty[behind])
        return Pause(
            samples=samples,
            middle=int(starts[behind]) - samples // 2,
            later=starts.size - behind,
            messages=starts.size,
        )

    def extent(self, start_ns: int | None, end_ns: int | None) -> tuple[int, int]:
        """First grid index and the one after the last, cut to a window of time."""
        first, last = self.first, self.last
        if start_ns is not None:
            first = max(first, self.index_from(start_ns))
        if end_ns is not None:
            last = min(last, self.index_from(end_ns))
        return first, max(first, last)


def group_placements(placements: Sequence[Placement]) -> tuple[Group, ...]:
    """Put streams that share rate and grid together, in the order of their first stream."""
    groups: list[Group] = []
    members: list[list[Placement]] = []
    near = _Near(len(placements))
    for placement in placements:
        for position in near.positions(placement):
            moved = _moved_onto(groups[position], placement)
            if moved is not None:
                groups[position], more = moved
                members[position].append(more)
                near.put(position, groups[position])
                break
        else:
            groups.append(Group.of(placement))
            members.append([placement])
            near.put(len(groups) - 1, groups[-1])
    return tuple(replace(group, placements=tuple(some)) for group, some in zip(groups, members, strict=True))


class _Near:
    """Rates, extents and messages of groups, which rule most of them out before a grid is compared."""

    def __init__(self, most: int) -> None:
        self._count = 0
        self._rate_hz, self._first_s, self._last_s, self._messages = np.zeros((4, most))

    def put(self, position: int, group: Group) -> None:
        """Note a group, or what became of it."""
        self._count = max(self._count, position + 1)
        self._rate_hz[position], self._messages[position] = group.rate_hz, group.messages
        self._first_s[position], self._last_s[position] = _extent_s(group)

    def positions(self, placement: Placement) -> list[int]:
        """Groups that a stream may join, in their order."""
        rate_hz, first_s, last_s, messages = (
            one[: self._count] for one in (self._rate_hz, self._first_s, self._last_s, self._messages)
        )
        base = placement.time_base
        may = np.abs(rate_hz - base.rate_hz) <= RATES_ALIKE * rate_hz
        if placement.counts is None and may.any():
            begin_s, end_s = _extent_s(Group.of(placement))
            together_s = np.maximum(last_s, end_s) - np.minimum(first_s, begin_s)
            # A hundredth for the clocks of two streams, by which the index of one on the grid of the other differs.
            may &= together_s * rate_hz * 0.99 <= SPARSEST * (messages + placement.index.size) + 1
        return [int(position) for position in np.flatnonzero(may)]


def _extent_s(group: Group) -> tuple[float, float]:
    start_s = group.start_ns / NS_PER_S
    return start_s + group.first / group.rate_hz, start_s + group.last / group.rate_hz


def _moved_onto(group: Group, placement: Placement) -> tuple[Group, Placement] | None:
    """What a group becomes with one more stream beside its first, and the stream on its grid; None on another."""
    ours, theirs = group.placements[0].time_base, placement.time_base
    if group.placements[0].clock != placement.clock:
        return None
    if abs(ours.rate_hz - theirs.rate_hz) > RATES_ALIKE * ours.rate_hz:
        return None
    times_ns = _common_times(ours, theirs)
    distance = _index_at(ours, times_ns) - _index_at(theirs, times_ns)
    offset = round(float(np.median(distance)))
    misalignment = float(np.max(np.abs(distance - offset)))
    if misalignment > max(ALIGNED, min(LOOSELY_ALIGNED, _scatter(ours) + _scatter(theirs))):
        return None
    moved = placement.shifted(offset)
    together = replace(
        group,
        first=min(group.first, moved.first),
        last=max(group.last, moved.last),
        messages=group.messages + moved.index.size,
        misalignment=max(group.misalignment, misalignment),
    )
    # Two recordings that lie hours apart aren't one measurement; a grid over both would be mostly empty.
    if together.last - together.first > SPARSEST * together.messages and placement.counts is None:
        return None
    return together, moved


def _common_times(ours: TimeBase, theirs: TimeBase) -> Whole:
    """Times at which two clocks are compared: where both run, or everywhere when they don't overlap."""
    times = np.union1d(ours.knots_ns, theirs.knots_ns)
    low = max(ours.knots_ns[0], theirs.knots_ns[0])
    high = min(ours.knots_ns[-1], theirs.knots_ns[-1])
    inside = times[(times >= low) & (times <= high)]
    return inside if inside.size else times


def _index_at(base: TimeBase, times_ns: Whole) -> Real:
    reference = base.knots_ns[0]
    near = np.clip(times_ns, reference, base.knots_ns[-1])
    index: Real = np.interp(
        (near - reference).astype(np.float64), (base.knots_ns - reference).astype(np.float64), base.knots_index
    )
    index += (times_ns - near) * (base.rate_hz / NS_PER_S)
    return index


def _scatter(base: TimeBase) -> float:
    """Four sigma of the end of a fitted line, in periods: 2 sigma/sqrt(n) at the ends of a straight line."""
    return 8.0 * base.jitter_s * base.rate_hz / float(np.sqrt(max(1, base.samples)))


def several_grids(file: str, told: Sequence[tuple[Sequence[Channel], float, int]]) -> str:
    """Say that channels, with rates and times of a sample in ns, don't share one grid, in what, and what to do."""
    _, first_hz, first_ns = told[0]
    grids = [
        f"{_names(channels)} at {_beside(rate_hz, start_ns, first_hz, first_ns) if place else f'{rate_hz:.6g} Hz'}"
        for place, (channels, rate_hz, start_ns) in enumerate(told)
    ]
    highest_hz = f"{max(rate_hz for _, rate_hz, _ in told):.6g}"
    return (
        f"{file}: channels have {len(grids)} different sampling grids: {'; '.join(grids)}; bring them to one: "
        f"chladni convert {file} OUT.mcap --resample {highest_hz}, in Python sample_rate_hz={highest_hz} or "
        'join="auto"'
    )


def _beside(rate_hz: float, start_ns: int, first_hz: float, first_ns: int) -> str:
    """Say a rate, and in what the grid differs from the first where the rate alone doesn't show it."""
    if f"{rate_hz:.6g}" != f"{first_hz:.6g}":
        return f"{rate_hz:.6g} Hz"
    later = (start_ns - first_ns) / NS_PER_S * rate_hz
    between = later - round(later)
    if abs(between) > ALIGNED:
        when = "after" if between > 0 else "before"
        return f"{rate_hz:.6g} Hz, {1e3 * abs(between) / rate_hz:.3g} ms {when} those of the first"
    # Grids that agree where they begin drift apart, or are too far apart to be one.
    return f"{rate_hz:.10g} Hz, beginning {later / rate_hz:.6g} s after the first, which is at {first_hz:.10g} Hz"


def _names(channels: Sequence[Channel]) -> str:
    more = f" and {len(channels) - 3} more" if len(channels) > 3 else ""
    return ", ".join(channel.name for channel in channels[:3]) + more
