"""Streams of a log, read into memory: stamps of every message, and their samples if wanted."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.clocks import Key, Stamped, StreamClock
from chladni.io.placement import Placement, StatedRate, digests_of, place_stream
from chladni.io.stream import Piece, Stream
from chladni.signals.clock_steps import ClockSteps
from chladni.signals.time_base import TimeBase


@dataclass(slots=True, kw_only=True)
class LostMessages:
    """Messages that were read and could not be used, by topic and reason."""

    counts: dict[tuple[str, str], int] = field(default_factory=dict)

    def add(self, topic: str, piece: Piece) -> None:
        """Count what one piece lost."""
        for reason, messages in piece.lost.items():
            key = (topic, reason)
            self.counts[key] = self.counts.get(key, 0) + messages

    def merge(self, other: "LostMessages") -> None:
        """Keep the larger count of each: a log that is read again loses the same messages again."""
        for key, messages in other.counts.items():
            self.counts[key] = max(messages, self.counts.get(key, 0))


@dataclass(slots=True, kw_only=True)
class Gathering:
    """What has been read of one stream.

    Attributes
    ----------
    stream
        The stream.
    stamps_ns, counts, values
        As in `Piece`, one entry a piece; `values` stays empty when only stamps are wanted.
    logged_ns
        As in `Piece`, one entry a piece; empty when these are the stamps.
    digests
        As `digests_of` gives them, one entry a piece; may stay empty where `values` are kept, or no stamps are alike.
    eras
        As in `Piece`, one entry a piece; empty where no clock is known to have been set.
    period_s
        Time between samples as the first message said; 0 when each message has one.
    dtype
        That holds the samples of all pieces.
    """

    stream: Stream
    stamps_ns: list[NDArray[np.int64]] = field(default_factory=list)
    counts: list[NDArray[np.int64]] = field(default_factory=list)
    values: list[NDArray[np.floating[Any]]] = field(default_factory=list)
    logged_ns: list[NDArray[np.int64]] = field(default_factory=list)
    digests: list[NDArray[np.uint64]] = field(default_factory=list)
    eras: list[NDArray[np.int32]] = field(default_factory=list)
    period_s: float = 0.0
    dtype: np.dtype[Any] = field(default_factory=lambda: np.dtype(np.float32))

    def add(self, piece: Piece, *, with_values: bool) -> None:
        """Append a piece."""
        self.stamps_ns.append(piece.stamps_ns)
        if piece.counts is not None:
            self.counts.append(piece.counts)
        if piece.logged_ns is not None:
            self.logged_ns.append(piece.logged_ns)
        if piece.eras is not None:
            self.eras.append(piece.eras)
        if with_values:
            self.values.append(piece.values)
        self.period_s = self.period_s or piece.period_s
        self.dtype = np.result_type(self.dtype, piece.values.dtype)

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
        return Stamped(key=self.stream.key, stamps_ns=_concatenated(self.stamps_ns), base=base)

    def place(self, *, stated: StatedRate | None = None, clock: ClockSteps | None = None) -> Placement:
        """Fit the time base and give each message its place; a clock is given where it's known to have been set."""
        stamps_ns = _concatenated(self.stamps_ns)
        counts = _concatenated(self.counts) if self.stream.layout is not None else None
        digests = self.digests
        if not digests and self.values and self.stamps_alike:
            digests = [digests_of(values) for values in self.values]
        known = _set_before(stamps_ns, np.concatenate(self.eras)) if self.eras else clock
        return place_stream(
            self.stream,
            stamps_ns,
            counts,
            self.period_s,
            digests=np.concatenate(digests) if digests and counts is None else None,
            stated=stated,
            clock=known,
            logged_ns=_concatenated(self.logged_ns) if self.logged_ns else None,
        )


def _set_before(time_ns: NDArray[np.int64], eras: NDArray[np.int32]) -> ClockSteps:
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
    eras = [None if one is None else one.steps.eras(one.messages) for one in known]
    read = [0] * len(streams)
    for index, piece in pieces:
        clock, era = known[index], eras[index]
        part = slice(read[index], read[index] + piece.stamps_ns.size)
        read[index] = part.stop
        if clock is not None and era is not None:
            stamps_ns = clock.steps.run_on(piece.stamps_ns, first=part.start)
            piece = replace(piece, stamps_ns=stamps_ns, eras=era[part])
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


def _concatenated(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate(parts) if parts else np.zeros(0, np.int64)
