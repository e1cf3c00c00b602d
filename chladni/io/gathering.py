"""Streams of a log, read into memory: stamps of every message, and their samples if wanted."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.arrival import Arrivals, arrival_order, stored_late
from chladni.io.placement import Placement, place_stream, without_grid
from chladni.io.publishers import at_once, count_by_stamps, evenly_in_turn, told_apart
from chladni.io.stream import Piece, Stream
from chladni.io.untimed import SLACK_NS, untimed
from chladni.signals.stamp_order import LEAP_NS


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
            if placement.untimed:
                key = (placement.stream.topic.name, f"{placement.stream.choice.label} is no time in this log")
                self.counts[key] = max(placement.untimed, self.counts.get(key, 0))

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
    period_s
        Time between samples as the first message said; 0 when each message has one.
    dtype
        That holds the samples of all pieces.
    untimed
        Messages whose stamps were no times by themselves.
    """

    stream: Stream
    stamps_ns: list[NDArray[np.int64]] = field(default_factory=list)
    counts: list[NDArray[np.int64]] = field(default_factory=list)
    values: list[NDArray[np.floating[Any]]] = field(default_factory=list)
    arrivals: list[Arrivals] = field(default_factory=list)
    period_s: float = 0.0
    dtype: np.dtype[Any] = field(default_factory=lambda: np.dtype(np.float32))
    untimed: int = 0

    def add(self, piece: Piece, *, with_values: bool) -> None:
        """Append a piece."""
        self.stamps_ns.append(piece.stamps_ns)
        self.arrivals.append(piece.arrivals)
        self.untimed += piece.untimed
        if piece.counts is not None:
            self.counts.append(piece.counts)
        if with_values:
            self.values.append(piece.values)
        self.period_s = self.period_s or piece.period_s
        self.dtype = np.result_type(self.dtype, piece.values.dtype)

    def place(self) -> Placement:
        """Fit the time base to the messages that have a time, in the order in which they came, and place them."""
        stamps_ns = _concatenated(self.stamps_ns)
        counts = _concatenated(self.counts) if self.stream.layout is not None else None
        if self._in_order(stamps_ns):
            return _of_one_publisher(place_stream(self.stream, stamps_ns, counts, self.period_s), stamps_ns)
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
        placement = place_stream(self.stream, stamps_ns, counts, self.period_s, chosen=chosen)
        return replace(
            _of_one_publisher(placement, stamps_ns[chosen], arrivals.channel),
            untimed=0 if away is None else int(np.count_nonzero(away)),
            stored_late=late,
        )

    def _in_order(self, stamps_ns: NDArray[np.int64]) -> bool:
        """Whether all stamps are times, and rise in the file: mostly they do, and little has to be looked at."""
        if self.stream.publisher is not None or len(self.stream.topic.decoders) > 1 or stamps_ns.size < 2:
            return False
        logged_ns = int(self.arrivals[-1].log_ns[-1]) - int(self.arrivals[0].log_ns[0])
        together = stamps_ns[-1] - stamps_ns[0] <= SLACK_NS + min(max(0, logged_ns), LEAP_NS)
        return bool(together and np.all(stamps_ns[1:] >= stamps_ns[:-1]))


def _published_by(publisher: int, stamps_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Messages of one publisher of those that their stamps tell apart; none where there's no such."""
    apart = told_apart(stamps_ns)
    return apart[publisher - 1] if publisher <= len(apart) else np.zeros(0, np.int64)


def _of_one_publisher(
    placement: Placement, stamps_ns: NDArray[np.int64], channel: NDArray[np.uint16] | None = None
) -> Placement:
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


def _publishers(
    placement: Placement, stamps_ns: NDArray[np.int64], channel: NDArray[np.uint16] | None
) -> tuple[str, ...]:
    """What tells the publishers of a stream apart, in a path; empty where there's one."""
    if channel is not None and at_once(stamps_ns, channel) and not evenly_in_turn(stamps_ns, channel):
        return tuple(f"@channel=={number}" for number in np.unique(channel).tolist())
    verdict = placement.time_base.verdict
    if placement.counts is not None or placement.stream.publisher is not None or verdict in ("still", "short"):
        return ()
    count = count_by_stamps(stamps_ns, in_bursts=verdict == "bursts")
    return tuple(f"@publisher=={number}" for number in range(1, count + 1))


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


def _concatenated(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate(parts) if parts else np.zeros(0, np.int64)
