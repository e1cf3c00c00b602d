"""Where the samples of streams lie on a grid, and which streams share one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from chladni.io.stream import Stream
from chladni.signals.time_base import TimeBase, fit_batch_time_base, fit_time_base
from chladni.signals.time_series import NS_PER_S
from chladni.signals.uniform import message_index

#: Index of samples that have no place on the grid.
NOWHERE = -(1 << 62)

#: Two grids are one when their points are never farther apart than this share of a period: 1.8 degrees at Nyquist.
ALIGNED = 0.01
#: ... or than their stamps' scatter can tell, up to this share.
LOOSELY_ALIGNED = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """Grid places of one stream's messages.

    Attributes
    ----------
    stream
        The stream.
    time_base
        Fitted to its stamps.
    index
        ``[message]``, grid index of each message's (first) sample, in the order of the file, counted from the
        origin of the group, `NOWHERE` for messages without a time; empty when the stream has no uniform time base.
    counts
        ``[message]``, samples of each; None when each has one.
    taken
        ``[message]``, samples at its start that are left out because an earlier message has their place; None when
        there are none.
    first_ns, end_ns
        First stamp in the order of arrival, and the end of the last sample; None when there is none.
    untimed
        Messages left out because their stamps are no times beside the others.
    stored_late
        Messages that the file holds behind later ones.
    publishers
        How many publish at once, by their stamps alone.
    """

    stream: Stream
    time_base: TimeBase
    index: NDArray[np.int64]
    counts: NDArray[np.int64] | None
    taken: NDArray[np.int64] | None = None
    first_ns: int | None = None
    end_ns: int | None = None
    untimed: int = 0
    stored_late: int = 0
    publishers: int = 1

    @property
    def first(self) -> int:
        """Grid index of the first sample."""
        return lowest_index(self.index, 0)

    @property
    def last(self) -> int:
        """One more than the grid index of the last sample."""
        return int((self.index + (1 if self.counts is None else self.counts)).max())

    @property
    def left_out(self) -> int:
        """Samples left out because an earlier one has their place."""
        return 0 if self.taken is None else int(self.taken.sum())

    def samples_index(self, part: slice) -> NDArray[np.int64]:
        """Grid index of every sample of some messages, message after message; `NOWHERE` for those left out."""
        index = self.index[part]
        if self.counts is None:
            return index if self.taken is None else np.where(self.taken[part], NOWHERE, index)
        counts = self.counts[part]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        samples = np.repeat(index, counts) + within
        return (
            samples
            if self.taken is None
            else np.where(within < np.repeat(self.taken[part], counts), NOWHERE, samples)
        )

    def shifted(self, samples: int) -> "Placement":
        """Count the index from another origin."""
        return replace(self, index=self.index + samples) if samples else self


def lowest_index(index: NDArray[np.int64], otherwise: int) -> int:
    """Lowest grid index of messages that have a place on the grid."""
    lowest = int(index.min(initial=-NOWHERE))
    if lowest < NOWHERE // 2:
        lowest = int(index[index > NOWHERE // 2].min(initial=-NOWHERE))
    return lowest if lowest < -NOWHERE else otherwise


def place_stream(
    stream: Stream,
    stamps_ns: NDArray[np.int64],
    counts: NDArray[np.int64] | None,
    period_s: float,
    *,
    chosen: NDArray[np.int64] | None = None,
) -> Placement:
    """Fit the time base of a stream and give each message its place.

    Parameters
    ----------
    stream
        The stream.
    stamps_ns
        ``[message]``, time of each message's first sample, in the order of the file.
    counts
        ``[message]``, samples of each; None when each has one.
    period_s
        Time between the samples of a batch message, as it says itself.
    chosen
        Indices of the messages that have a time, in the order in which they came; None for all in file order.
    """
    timed_ns = stamps_ns if chosen is None else stamps_ns[chosen]
    sizes = counts if counts is None or chosen is None else counts[chosen]
    if sizes is None:
        base = fit_time_base(timed_ns)
    else:
        base = fit_batch_time_base(timed_ns, sizes, nominal_rate_hz=1 / period_s if period_s > 0 else None)
    placement = Placement(
        stream=stream,
        time_base=base,
        index=np.zeros(0, np.int64),
        counts=counts,
        first_ns=int(timed_ns[0]) if timed_ns.size else None,
        end_ns=_end_ns(timed_ns, sizes, base.rate_hz),
    )
    if not (base.uniform and timed_ns.size):
        return placement
    index = message_index(timed_ns, base, counts=sizes)
    taken = _taken(timed_ns, index, sizes)
    if chosen is None:
        return replace(placement, index=index, taken=taken)
    return replace(
        placement,
        index=_in_file(index, chosen, stamps_ns.size, otherwise=NOWHERE),
        taken=None if taken is None else _in_file(taken, chosen, stamps_ns.size, otherwise=0),
    )


def without_grid(base: TimeBase, stamps_ns: NDArray[np.int64], advice: str) -> TimeBase:
    """Give the time base of messages that have no grid, and the reason in place of its advice."""
    span_s = float(np.ptp(stamps_ns)) / NS_PER_S
    return replace(
        base,
        verdict="irregular",
        advice=advice,
        rate_hz=(stamps_ns.size - 1) / span_s if span_s else 0.0,
        rate_std_hz=inf,
        gaps=(),
        gap_count=0,
        missing=0,
    )


def _in_file(
    numbers: NDArray[np.int64], chosen: NDArray[np.int64], messages: int, *, otherwise: int
) -> NDArray[np.int64]:
    """Bring what belongs to the chosen messages into the order of the file."""
    spread = np.full(messages, otherwise, np.int64)
    spread[chosen] = numbers
    return spread


def _end_ns(stamps_ns: NDArray[np.int64], counts: NDArray[np.int64] | None, rate_hz: float) -> int | None:
    """End of the last sample, at least its stamp."""
    if not stamps_ns.size:
        return None
    period_ns = NS_PER_S / rate_hz if rate_hz > 0 else 0.0
    if counts is None:
        return int(stamps_ns.max()) + round(period_ns)
    return int((stamps_ns + np.rint(counts * period_ns)).max())


def _taken(
    stamps_ns: NDArray[np.int64], index: NDArray[np.int64], counts: NDArray[np.int64] | None
) -> NDArray[np.int64] | None:
    """Samples at the start of each message whose grid place an earlier message has; None when there are none."""
    if np.all(index[1:] - index[:-1] >= (1 if counts is None else counts[:-1])):
        return None
    sizes = np.ones(index.size, np.int64) if counts is None else counts
    order = np.lexsort((stamps_ns, index))
    reached = np.maximum.accumulate(index[order] + sizes[order])
    taken = np.zeros(index.size, np.int64)
    taken[order[1:]] = np.clip(reached[:-1] - index[order[1:]], 0, sizes[order[1:]])
    return taken if taken.any() else None


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
    misalignment
        Largest distance of a stream's samples from the grid of the first, in periods.
    """

    rate_hz: float
    start_ns: int
    placements: tuple[Placement, ...]
    misalignment: float = 0.0

    def time_ns(self, index: int) -> int:
        """Time of a grid point."""
        return self.start_ns + round(index / self.rate_hz * NS_PER_S)

    def index_from(self, time_ns: int) -> int:
        """First grid point not before a time; one a thousandth of a period before it still counts."""
        return int(np.ceil((time_ns - self.start_ns) / NS_PER_S * self.rate_hz - 1e-3))

    def extent(self, start_ns: int | None, end_ns: int | None) -> tuple[int, int]:
        """First grid index and the one after the last, cut to a window of time."""
        first = min(placement.first for placement in self.placements)
        last = max(placement.last for placement in self.placements)
        if start_ns is not None:
            first = max(first, self.index_from(start_ns))
        if end_ns is not None:
            last = min(last, self.index_from(end_ns))
        return first, max(first, last)


def group_placements(placements: Sequence[Placement]) -> tuple[Group, ...]:
    """Put streams that share rate and grid together, in the order of their first stream."""
    groups: list[Group] = []
    for placement in placements:
        for position, group in enumerate(groups):
            joined = _joined(group, placement)
            if joined is not None:
                groups[position] = joined
                break
        else:
            base = placement.time_base
            groups.append(Group(rate_hz=base.rate_hz, start_ns=base.start_ns, placements=(placement,)))
    return tuple(groups)


def _joined(group: Group, placement: Placement) -> Group | None:
    """The group with one more stream, or None when its grid is another."""
    ours, theirs = group.placements[0].time_base, placement.time_base
    if abs(ours.rate_hz - theirs.rate_hz) > 0.01 * ours.rate_hz:
        return None
    times_ns = _common_times(ours, theirs)
    distance = _index_at(ours, times_ns) - _index_at(theirs, times_ns)
    offset = round(float(np.median(distance)))
    misalignment = float(np.max(np.abs(distance - offset)))
    if misalignment > max(ALIGNED, min(LOOSELY_ALIGNED, _scatter(ours) + _scatter(theirs))):
        return None
    moved = placement.shifted(offset)
    samples = sum(one.index.size for one in (*group.placements, moved))
    together = replace(group, placements=(*group.placements, moved))
    first, last = together.extent(None, None)
    # Two recordings that lie hours apart aren't one measurement; a grid over both would be mostly empty.
    if last - first > 100 * samples and placement.counts is None:
        return None
    return replace(together, misalignment=max(group.misalignment, misalignment))


def _common_times(ours: TimeBase, theirs: TimeBase) -> NDArray[np.int64]:
    """Times at which two clocks are compared: where both run, or everywhere when they don't overlap."""
    times = np.union1d(ours.knots_ns, theirs.knots_ns)
    low = max(ours.knots_ns[0], theirs.knots_ns[0])
    high = min(ours.knots_ns[-1], theirs.knots_ns[-1])
    inside = times[(times >= low) & (times <= high)]
    return inside if inside.size else times


def _index_at(base: TimeBase, times_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    reference = base.knots_ns[0]
    near = np.clip(times_ns, reference, base.knots_ns[-1])
    index: NDArray[np.float64] = np.interp(
        (near - reference).astype(np.float64), (base.knots_ns - reference).astype(np.float64), base.knots_index
    )
    index += (times_ns - near) * (base.rate_hz / NS_PER_S)
    return index


def _scatter(base: TimeBase) -> float:
    """Four sigma of the end of a fitted line, in periods: 2 sigma/sqrt(n) at the ends of a straight line."""
    return 8.0 * base.jitter_s * base.rate_hz / float(np.sqrt(max(1, base.samples)))
