"""Streams of a log, read into memory: stamps of every message, and their samples if wanted."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.arrival import Arrivals, arrival_order, stored_late
from chladni.io.clock.shared_clocks import Key, Stamped, StreamClock
from chladni.io.clock.stamp_order import LEAP_NS, ClockSteps
from chladni.io.clock.stray_stamps import SLACK_NS, untimed
from chladni.io.clock.time_base import TimeBase
from chladni.io.placement import Placement, StatedRate, place_stream, without_grid
from chladni.io.publishers import at_once, count_by_stamps, evenly_in_turn, told_apart
from chladni.io.repeats import digests_of
from chladni.io.stream import Piece, Stream
from chladni.signals.arrays import Whole


@dataclass(slots=True, kw_only=True)
class LostMessages:
    """Messages that were read and could not be used, by topic and reason; and what is odd about those that could."""

    counts: dict[tuple[str, str], int] = field(default_factory=dict)
    told: dict[tuple[str, str], int] = field(default_factory=dict)

    def add(self, topic: str, piece: Piece) -> None:
        """Count what one piece lost."""
        for mine, found in ((self.counts, piece.lost), (self.told, piece.told)):
            for reason, messages in found.items():
                mine[topic, reason] = mine.get((topic, reason), 0) + messages

    def add_untimed(self, placements: Iterable[Placement]) -> None:
        """Count the messages whose stamps turned out to be no times beside all others of their topic."""
        for placement in placements:
            for messages, why in (
                (placement.untimed, "is no time in this log"),
                (placement.time_base.strays.size, "contradicts the count of the messages around"),
            ):
                if messages:
                    key = (placement.stream.topic.name, f"{placement.stream.choice.label} {why}")
                    self.counts[key] = max(messages, self.counts.get(key, 0))

    def merge(self, other: "LostMessages") -> None:
        """Keep the larger count of each: a log that is read again loses the same messages again."""
        for mine, found in ((self.counts, other.counts), (self.told, other.told)):
            for key, messages in found.items():
                mine[key] = max(messages, mine.get(key, 0))


@dataclass(slots=True, kw_only=True)
class Gathering:
    """What has been read of one stream.

    Attributes
    ----------
    stream
        The stream.
    stamps_ns, counts, values, arrivals
        As in `Piece`, one entry a piece; `values` stays empty when only stamps are wanted.
    digests
        As `digests_of` gives them, one entry a piece; may stay empty where `values` are kept, or no stamps are alike.
    eras
        As in `Piece`, one entry a piece; empty where no clock is known to have been set.
    period_s
        Time between samples as the first message said; 0 when each message has one.
    dtype
        That holds the samples of all pieces.
    untimed
        Messages whose stamps were no times by themselves.
    """

    stream: Stream
    stamps_ns: list[Whole] = field(default_factory=list)
    counts: list[Whole] = field(default_factory=list)
    values: list[NDArray[np.floating]] = field(default_factory=list)
    arrivals: list[Arrivals] = field(default_factory=list)
    digests: list[NDArray[np.uint64]] = field(default_factory=list)
    eras: list[NDArray[np.int32]] = field(default_factory=list)
    period_s: float = 0.0
    dtype: np.dtype[Any] = field(default_factory=lambda: np.dtype(np.float32))
    untimed: int = 0
    chosen: Whole | None = None

    def add(self, piece: Piece, *, with_values: bool) -> None:
        """Append a piece."""
        self.stamps_ns.append(piece.stamps_ns)
        self.arrivals.append(piece.arrivals)
        self.untimed += piece.untimed
        if piece.counts is not None:
            self.counts.append(piece.counts)
        if piece.eras is not None:
            self.eras.append(piece.eras)
        if with_values:
            self.values.append(piece.values)
        self.period_s = self.period_s or piece.period_s
        self.dtype = np.result_type(self.dtype, piece.values.dtype)

    def join_last(self) -> None:
        """Join the last pieces while the one before isn't much longer: of many short ones few long ones are left.

        Each message is copied as often as its piece doubles, and what a piece was a part of is let go.
        """
        while len(self.stamps_ns) > 1 and self.stamps_ns[-2].size < 2 * self.stamps_ns[-1].size:
            parts: list[Any]
            for parts in (self.stamps_ns, self.counts, self.values, self.digests, self.eras):
                parts[-2:] = [np.concatenate(parts[-2:], axis=-1)] if parts else []
            self.arrivals[-2:] = [Arrivals.joined(self.arrivals[-2:])]

    @property
    def stamps_alike(self) -> bool:
        """Whether two messages in a row have the same stamp."""
        stamps_ns = _concatenated(self.stamps_ns)
        return self.stream.layout is None and bool(np.any(stamps_ns[1:] == stamps_ns[:-1]))

    @property
    def set_before(self) -> bool:
        """Whether the clock was set before any of the messages; true where that isn't known."""
        return not self.eras or any(bool(one.any()) for one in self.eras)

    def stamped(self, base: TimeBase) -> Stamped:
        """Give the stamps with the time base that was fitted to them."""
        return Stamped(key=self.stream.key, stamps_ns=_concatenated(self.stamps_ns), base=base, chosen=self.chosen)

    def place(self, *, stated: StatedRate | None = None, clock: ClockSteps | None = None) -> Placement:
        """Fit the time base to the messages that have a time, in the order in which they came, and place them.

        A clock is given where it's known to have been set; a rate where the user states one.
        """
        stamps_ns = _concatenated(self.stamps_ns)
        if self._in_order(stamps_ns):
            return _of_one_publisher(self._placed(stamps_ns, stated, clock), stamps_ns)
        arrivals = Arrivals.joined(self.arrivals)
        away = untimed(stamps_ns, None if self.stream.choice.kind == "log" else arrivals.log_ns)
        chosen = np.arange(stamps_ns.size) if away is None else np.flatnonzero(~away)
        arrivals = arrivals if away is None else arrivals.kept(chosen)
        order, late = arrival_order(stamps_ns[chosen], arrivals), 0
        if order is not None:
            late = stored_late(order, arrivals)
            chosen, arrivals = chosen[order], arrivals.kept(order)
        if self.stream.publisher is not None:
            own = _published_by(self.stream.publisher, stamps_ns[chosen])
            chosen, arrivals = chosen[own], arrivals.kept(own)
        self.chosen = None if order is None and chosen.size == stamps_ns.size else chosen
        placement = self._placed(stamps_ns, stated, clock)
        return replace(
            _of_one_publisher(placement, stamps_ns[chosen], arrivals.channel),
            untimed=0 if away is None else int(np.count_nonzero(away)),
            stored_late=late,
        )

    def _placed(self, stamps_ns: Whole, stated: StatedRate | None, clock: ClockSteps | None) -> Placement:
        counts = _concatenated(self.counts) if self.stream.layout is not None else None
        digests = self.digests
        if not digests and self.values and self.stamps_alike:
            digests = [digests_of(values) for values in self.values]
        if self.eras:
            eras = np.concatenate(self.eras)
            clock = (
                _set_before(stamps_ns, eras)
                if self.chosen is None
                else _set_before(stamps_ns[self.chosen], eras[self.chosen])
            )
        own_clock = self.stream.choice.kind != "log"
        return place_stream(
            self.stream,
            stamps_ns,
            counts,
            self.period_s,
            chosen=self.chosen,
            digests=np.concatenate(digests) if digests and counts is None else None,
            stated=stated,
            clock=clock,
            logged_ns=np.concatenate([one.log_ns for one in self.arrivals]) if own_clock and self.arrivals else None,
        )

    def _in_order(self, stamps_ns: Whole) -> bool:
        """Whether all stamps are times, and rise in the file: mostly they do, and little has to be looked at."""
        if self.stream.publisher is not None or len(self.stream.topic.decoders) > 1 or stamps_ns.size < 2:
            return False
        logged_ns = int(self.arrivals[-1].log_ns[-1]) - int(self.arrivals[0].log_ns[0])
        together = stamps_ns[-1] - stamps_ns[0] <= SLACK_NS + min(max(0, logged_ns), LEAP_NS)
        return bool(together and np.all(stamps_ns[1:] >= stamps_ns[:-1]))


def _published_by(publisher: int, stamps_ns: Whole) -> Whole:
    """Messages of one publisher of those that their stamps tell apart; none where there's no such."""
    apart = told_apart(stamps_ns)
    return apart[publisher - 1] if publisher <= len(apart) else np.zeros(0, np.int64)


def _of_one_publisher(placement: Placement, stamps_ns: Whole, channel: NDArray[np.uint16] | None = None) -> Placement:
    """Take the grid away where several publish at once, since their samples are no single signal."""
    several = _publishers(placement, stamps_ns, channel)
    if len(several) < 2:
        return placement
    source = placement.stream.sources[0]
    # Who publishes stands right behind the topic, before what else filters the channel's messages.
    rest = source.field if source.field.startswith("{") else f".{source.field}"
    remedy = f"read one alone: {' or '.join(f'{source.topic}{{{one}}}{rest}' for one in several)}"
    if several[0].startswith("@publisher") and not told_apart(stamps_ns):
        remedy = "log each on a topic of its own, since nothing in the messages tells them apart throughout"
    advice = f"{len(several)} publish on {source.topic} at once; their samples are no single signal; {remedy}"
    return replace(
        placement,
        time_base=without_grid(placement.time_base, stamps_ns, advice),
        index=placement.index[:0],
        publishers=len(several),
    )


def _publishers(placement: Placement, stamps_ns: Whole, channel: NDArray[np.uint16] | None) -> tuple[str, ...]:
    """What tells the publishers of a stream apart, in a path; empty where there's one."""
    if channel is not None and at_once(stamps_ns, channel) and not evenly_in_turn(stamps_ns, channel):
        return tuple(f"@channel=={number}" for number in np.unique(channel).tolist())
    verdict = placement.time_base.verdict
    if placement.counts is not None or placement.stream.publisher is not None or verdict in ("still", "short"):
        return ()
    count = count_by_stamps(stamps_ns, in_bursts=verdict == "bursts")
    return tuple(f"@publisher=={number}" for number in range(1, count + 1))


def _set_before(time_ns: Whole, eras: NDArray[np.int32]) -> ClockSteps:
    """Steps of a clock whose stamps run on already."""
    message = np.flatnonzero(np.diff(eras)) + 1
    return ClockSteps(
        message=message,
        before_ns=time_ns[message - 1],
        after_ns=time_ns[message],
        shift_ns=np.zeros_like(message),
    )


def place_all(
    gatherings: Sequence[Gathering],
    clocks: Callable[[Sequence[Stamped]], Mapping[Key, StreamClock]],
    *,
    stated: StatedRate | None = None,
) -> tuple[Placement, ...]:
    """Place streams; those whose clock was set on time that runs on for all streams of the clock together.

    Parameters
    ----------
    gatherings
        What was read.
    clocks
        Finds the clocks of the log; called when stamps show that one was set, with what they tell.
    stated
        Rate that the user states.
    """
    placements = tuple(one.place(stated=stated) for one in gatherings)
    both = tuple(zip(gatherings, placements, strict=True))
    if not any(len(one.eras) or placement.time_base.clock.count for one, placement in both):
        return placements
    known = clocks([one.stamped(placement.time_base) for one, placement in both])
    # Before any clock was set, all of them may be one.
    set_here = {known[one.stream.key].number for one in gatherings if one.set_before and one.stream.key in known}
    return tuple(_on_clock(one, placement, known.get(one.stream.key), set_here, stated) for one, placement in both)


def _on_clock(
    gathering: Gathering,
    placement: Placement,
    clock: StreamClock | None,
    set_here: Collection[int],
    stated: StatedRate | None,
) -> Placement:
    if clock is None or clock.number not in set_here:
        return placement
    steps = clock.steps
    if not gathering.eras and not np.array_equal(steps.shift_ns, placement.time_base.clock.shift_ns):
        placement = gathering.place(stated=stated, clock=steps)
    return replace(placement, clock=clock.number)


def gather(streams: Sequence[Stream], pieces: Iterable[tuple[int, Piece]], *, with_values: bool) -> list[Gathering]:
    """Read all pieces.

    Parameters
    ----------
    streams
        What is read.
    pieces
        As `windowed` gives them.
    with_values
        Whether samples are kept, too.
    """
    gatherings = [Gathering(stream=stream) for stream in streams]
    for index, piece in pieces:
        gatherings[index].add(piece, with_values=with_values)
    return gatherings


def running_on(
    streams: Sequence[Stream], pieces: Iterable[tuple[int, Piece]], clocks: Mapping[Key, StreamClock]
) -> Iterator[tuple[int, Piece]]:
    """Give all pieces of a log with stamps that run on where their clock is known to have been set."""
    known = [clocks.get(stream.key) for stream in streams]
    eras = [None if one is None else one.eras() for one in known]
    read = [0] * len(streams)
    for index, piece in pieces:
        clock, era = known[index], eras[index]
        part = slice(read[index], read[index] + piece.stamps_ns.size)
        read[index] = part.stop
        if clock is not None and era is not None:
            shifts_ns = np.append(0, clock.steps.shift_ns)
            piece = replace(piece, stamps_ns=piece.stamps_ns + shifts_ns[era[part]], eras=era[part])
        yield index, piece


def windowed(
    streams: Sequence[Stream],
    pieces: Iterable[tuple[int, Piece]],
    lost: LostMessages,
    *,
    window_ns: tuple[int | None, int | None],
) -> Iterator[tuple[int, Piece]]:
    """Give what pieces have inside a window of time, and count what they lost."""
    for index, piece in pieces:
        lost.add(streams[index].topic.name, piece)
        inside = piece.within(*window_ns)
        if inside.stamps_ns.size:
            yield index, inside


def _concatenated(parts: list[Whole]) -> Whole:
    return np.concatenate(parts) if parts else np.zeros(0, np.int64)
