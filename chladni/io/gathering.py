"""Streams of a log, read into memory: stamps of every message, and their samples if wanted."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.placement import Placement, place_stream
from chladni.io.stream import Piece, Stream


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
    stamps_ns, counts, values
        As in `Piece`, one entry a piece; `values` stays empty when only stamps are wanted.
    period_s
        Time between samples as the first message said; 0 when each message has one.
    dtype
        That holds the samples of all pieces.
    """

    stream: Stream
    stamps_ns: list[NDArray[np.int64]] = field(default_factory=list)
    counts: list[NDArray[np.int64]] = field(default_factory=list)
    values: list[NDArray[np.floating[Any]]] = field(default_factory=list)
    period_s: float = 0.0
    dtype: np.dtype[Any] = field(default_factory=lambda: np.dtype(np.float32))

    def add(self, piece: Piece, *, with_values: bool) -> None:
        """Append a piece."""
        self.stamps_ns.append(piece.stamps_ns)
        if piece.counts is not None:
            self.counts.append(piece.counts)
        if with_values:
            self.values.append(piece.values)
        self.period_s = self.period_s or piece.period_s
        self.dtype = np.result_type(self.dtype, piece.values.dtype)

    def first_ns(self, otherwise: int) -> int:
        """Stamp of the first message to arrive."""
        return int(self.stamps_ns[0][0]) if self.stamps_ns else otherwise

    def end_ns(self, rate_hz: float) -> int:
        """End of the last sample, at least its stamp."""
        period_ns = 1e9 / rate_hz if rate_hz > 0 else 0.0
        if not self.counts:
            return max(int(stamps.max()) for stamps in self.stamps_ns) + round(period_ns)
        ends = (
            stamps + np.rint(counts * period_ns) for stamps, counts in zip(self.stamps_ns, self.counts, strict=True)
        )
        return max(int(end.max()) for end in ends)

    def place(self) -> Placement:
        """Fit the time base and give each message its place."""
        batches = self.stream.layout is not None
        counts = _concatenated(self.counts) if batches else None
        return place_stream(self.stream, _concatenated(self.stamps_ns), counts, self.period_s)


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
