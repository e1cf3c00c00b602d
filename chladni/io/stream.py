"""A stream: channels of one topic whose samples come in the same messages, and so at the same times."""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.arrival import Arrivals, numbered
from chladni.io.batch_messages import BatchLayout, expand
from chladni.io.channel_source import ChannelSource
from chladni.io.decoding import Decoded
from chladni.io.field_selector import FieldFilter
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.messages import Messages
from chladni.io.selected_numbers import kept_messages, select
from chladni.io.stamps import LATEST_NS, StampChoice, own_stamps_ns, plausible
from chladni.io.topic import Topic
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import NS_PER_S

#: Fields of messages that are decoded at a time: chunks say how many messages come together, not how wide they are.
VALUES_AT_ONCE: Final = 1 << 21


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """What one batch of messages holds of a stream.

    Attributes
    ----------
    stamps_ns
        ``[message]``, time of the first sample of each message.
    counts
        ``[message]``, samples of each message; None when each has one.
    period_s
        Time between the samples of a message, as the messages say; 0 when each has one.
    values
        ``[channel, sample]``, SI, messages one after another; NaN where a message doesn't hold the channel.
    lost
        Messages that are not in it, by the reason why.
    told
        What is odd about messages that are in it, and about how many.
    arrivals
        ``[message]``, when they were logged, and more that the log says of each.
    untimed
        Messages that are not in it because their stamp is no time; counted in `lost`, too.
    eras
        ``[message]``, how often the clock had been set before, where that is known and `stamps_ns` run on; else None.
    """

    stamps_ns: Whole
    counts: Whole | None
    period_s: float
    values: NDArray[np.floating]
    lost: Mapping[str, int]
    arrivals: Arrivals
    untimed: int = 0
    told: Mapping[str, int] = field(default_factory=dict)
    eras: NDArray[np.int32] | None = None

    def within(self, start_ns: int | None, end_ns: int | None) -> "Piece":
        """Give the messages that have a sample with ``start_ns <= time < end_ns``."""
        if start_ns is None and end_ns is None:
            return self
        last = self.stamps_ns
        if self.counts is not None:
            last = last + _span_ns(self.counts, self.period_s)
        keep = np.ones(len(last), np.bool_)
        if start_ns is not None:
            keep &= last >= start_ns
        if end_ns is not None:
            keep &= self.stamps_ns < end_ns
        return self.kept(keep)

    def kept_slice(self, part: slice) -> "Piece":
        """Give some messages in a row."""
        if self.counts is None:
            samples, counts = part, None
        else:
            ends = np.append(0, np.cumsum(self.counts))
            first, last, _ = part.indices(self.stamps_ns.size)
            samples, counts = slice(int(ends[first]), int(ends[max(first, last)])), self.counts[part]
        return replace(
            self,
            stamps_ns=self.stamps_ns[part],
            counts=counts,
            values=self.values[:, samples],
            arrivals=self.arrivals.kept(part),
            eras=None if self.eras is None else self.eras[part],
        )

    def kept(self, keep: Mask) -> "Piece":
        """Give some of the messages."""
        if keep.all():
            return self
        samples = keep if self.counts is None else np.repeat(keep, self.counts)
        counts = None if self.counts is None else self.counts[keep]
        return replace(
            self,
            stamps_ns=self.stamps_ns[keep],
            counts=counts,
            values=self.values[:, samples],
            arrivals=self.arrivals.kept(keep),
            eras=None if self.eras is None else self.eras[keep],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """Channels of one topic that share their sample times.

    Attributes
    ----------
    topic
        Where they come from.
    choice
        Which time of a message is its sample's.
    sources
        The channels.
    layout, names
        Of batch messages; None and empty when a message holds one sample.
    filters
        Messages that fail one of them don't belong to the stream.
    """

    topic: Topic
    choice: StampChoice
    sources: tuple[ChannelSource, ...]
    layout: BatchLayout | None = None
    names: tuple[str, ...] = ()
    filters: tuple[FieldFilter, ...] = ()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, in the order of the rows of a piece."""
        return tuple(source.channel for source in self.sources)

    @property
    def publisher(self) -> int | None:
        """Whose messages these are, of several publishers that their stamps tell apart; None for all."""
        selector = self.sources[0].selector
        return None if selector is None else selector.publisher

    @property
    def label(self) -> str:
        """What people know the stream by."""
        whole = not self.filters and self.publisher is None
        return self.topic.name if whole else self.sources[0].channel.name

    @property
    def no_time(self) -> str:
        """What is said of messages without a possible stamp."""
        return f"{self.choice.label} is no time between 1970 and 2116"

    @property
    def key(self) -> tuple[str, ...]:
        """Tells streams of one log apart."""
        return (self.topic.name, *(f"{source.field} {source.channel.name}" for source in self.sources))

    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        selected = [leaf for source in self.sources if source.selector is not None for leaf in source.selector.leaves]
        layout = () if self.layout is None else self.layout.leaves
        return tuple(dict.fromkeys((*selected, *layout, *self.stamp_leaves())))

    def stamp_leaves(self) -> tuple[str, ...]:
        """Leaves that the stamps and the filters need."""
        return tuple(dict.fromkeys((*self.choice.leaves, *(one.leaf for one in self.filters))))

    @np.errstate(invalid="ignore")  # a damaged number may be a NaN that signals
    def piece(self, batch: MessageBatch, decoded: Decoded, *, stretch: int = 0, with_values: bool = True) -> Piece:
        """Take the stream's samples out of a batch of its topic.

        Without values the piece has the same messages, counts and type of samples, but no rows. The number of the
        stretch of the log orders messages of several MCAP channels.
        """
        stamps_ns, usable = self._stamps_ns(batch, decoded)
        arrivals = Arrivals.of(batch, stretch if len(self.topic.decoders) > 1 else None)
        wanted = kept_messages(decoded, self.filters)
        lost = dict(decoded.reasons)
        unstamped = int(np.count_nonzero(wanted & ~usable))
        if unstamped:
            lost[self.no_time] = unstamped
        if self.layout is not None:
            piece = self._blocks(decoded, stamps_ns, usable, lost, arrivals, with_values=with_values)
        else:
            piece = self._single_samples(decoded, stamps_ns, wanted & usable, lost, arrivals)
            piece = piece if with_values else replace(piece, values=piece.values[:0])
        return replace(piece, untimed=unstamped, told=decoded.told)

    def without(self, messages: int, reason: str) -> Piece:
        """Give an empty piece that says why `messages` of them are not in it."""
        return Piece(
            stamps_ns=np.zeros(0, np.int64),
            counts=None if self.layout is None else np.zeros(0, np.int64),
            period_s=0.0,
            values=np.zeros((len(self.sources), 0), np.float32),
            lost={reason: messages},
            arrivals=Arrivals.joined([]),
        )

    def _stamps_ns(self, batch: MessageBatch, decoded: Decoded) -> tuple[Whole, Mask]:
        if self.choice.own is not None:
            stamps_ns, usable = own_stamps_ns(self.choice.own, decoded)
            stamps_ns = stamps_ns + self.choice.shift_ns
        else:
            stamps_ns = batch.log_time_ns if self.choice.kind == "log" else batch.publish_time_ns
            usable = ~decoded.bad
        return stamps_ns, usable & plausible(stamps_ns)

    def _single_samples(
        self,
        decoded: Decoded,
        stamps_ns: Whole,
        keep: Mask,
        lost: dict[str, int],
        arrivals: Arrivals,
    ) -> Piece:
        columns = [_column(decoded, source, keep, lost) for source in self.sources]
        somewhere = [present for _, present in columns if present is not None]
        if len(somewhere) == len(columns):
            keep = keep & np.logical_or.reduce(somewhere)
        values = np.empty((len(columns), int(np.count_nonzero(keep))), np.result_type(*(v for v, _ in columns)))
        whole = bool(keep.all())
        for row, (numbers, present) in enumerate(columns):
            wanted = numbers if present is None else np.where(present, numbers, np.nan)
            values[row] = wanted if whole else wanted[keep]
        return Piece(
            stamps_ns=stamps_ns if whole else stamps_ns[keep],
            counts=None,
            period_s=0.0,
            values=values,
            lost=lost,
            arrivals=arrivals if whole else arrivals.kept(keep),
        )

    def _blocks(
        self,
        decoded: Decoded,
        stamps_ns: Whole,
        usable: Mask,
        lost: dict[str, int],
        arrivals: Arrivals,
        *,
        with_values: bool,
    ) -> Piece:
        if self.layout is None:
            raise AssertionError("only batch messages hold blocks")
        part = replace(decoded, bad=~usable)
        sources = self.sources if with_values else ()
        wanted = [source.column for source in sources if source.column is not None]
        expanded = expand(self.layout, part, self.names, wanted)
        contradictory = int(np.count_nonzero(expanded.bad & usable))
        if contradictory:
            lost["number of samples, names of columns or rate contradict the other messages"] = contradictory
        keep = ~expanded.bad & (expanded.counts > 0)
        factors = np.array([source.factor for source in sources])[:, None]
        if np.any(factors != 1.0):
            values = expanded.values * factors.astype(expanded.values.dtype)
        else:
            values = expanded.values
        periods_s = expanded.periods_s[keep]
        piece = Piece(
            stamps_ns=self._first_ns(stamps_ns[keep], expanded.counts[keep], periods_s),
            counts=expanded.counts[keep],
            period_s=float(np.median(periods_s)) if periods_s.size else 0.0,
            values=values,
            lost=lost,
            arrivals=arrivals if keep.all() else arrivals.kept(keep),
        )
        return piece.kept(plausible(piece.stamps_ns))

    def _first_ns(self, stamps_ns: Whole, counts: Whole, periods_s: Real) -> Whole:
        if self.layout is None or self.layout.stamp == "first":
            return stamps_ns
        return stamps_ns - _span_ns(counts, periods_s)


def _span_ns(counts: Whole, periods_s: Real | float) -> Whole:
    """From the first sample of each message to its last one."""
    # A period is what the message claims; a length of centuries mustn't overflow.
    span_ns = np.minimum((counts - 1) * (periods_s * NS_PER_S), LATEST_NS)
    whole: Whole = np.rint(span_ns).astype(np.int64)
    return whole


def _column(
    decoded: Decoded, source: ChannelSource, wanted: Mask, lost: dict[str, int]
) -> tuple[NDArray[np.floating], Mask | None]:
    """Floating point and SI; single precision stays single unless a factor calls for more."""
    if source.selector is None:
        raise AssertionError("a channel of single samples has a selector")
    selected = select(decoded, source.selector, wanted)
    lost.update(selected.lost)
    numbers, present = selected.values, selected.present
    floating = numbers if numbers.dtype in (np.float32, np.float64) else numbers.astype(np.float64)
    if source.factor != 1.0:
        floating = floating * floating.dtype.type(source.factor)
    return floating, present


def read_pieces(
    container: Messages,
    streams: Sequence[Stream],
    *,
    start_ns: int | None = None,
    end_ns: int | None = None,
    with_values: bool = True,
    wanted: Sequence[bool] | None = None,
) -> Iterator[tuple[int, Piece]]:
    """Read streams in the order of the file.

    Parameters
    ----------
    container
        The log.
    streams
        What to read; streams of the same topic are decoded together.
    start_ns, end_ns
        Only messages with ``start_ns <= log time < end_ns``.
    with_values
        Whether samples are wanted, or only their times.
    wanted
        Of each piece that would be given, whether it's to be; None for all.

    Yields
    ------
    index : int
        Of the stream.
    piece : Piece
    """
    reader = PieceReader(streams)
    batches = container.batches(reader.channel_ids, start_time_ns=start_ns, end_time_ns=end_ns)
    yield from reader.pieces(batches, with_values=with_values, wanted=wanted)


class PieceReader:
    """Takes the samples of streams out of batches of messages.

    Parameters
    ----------
    streams
        What to read; streams of the same topic are decoded together.
    """

    def __init__(self, streams: Sequence[Stream]) -> None:
        self._streams = tuple(streams)
        of_channel: dict[int, dict[int, Stream]] = {}
        for number, stream in enumerate(streams):
            for channel_id in stream.topic.decoders:
                of_channel.setdefault(channel_id, {})[number] = stream
        self._readers = {channel_id: _Readers.of(channel_id, some) for channel_id, some in of_channel.items()}

    @property
    def channel_ids(self) -> frozenset[int]:
        """MCAP channels whose messages are read."""
        return frozenset(self._readers)

    def pieces(
        self, batches: Iterable[MessageBatch], *, with_values: bool = True, wanted: Sequence[bool] | None = None
    ) -> Iterator[tuple[int, Piece]]:
        """Give the number of a stream and what each batch holds of it, in the order of the batches.

        Those that aren't wanted, by their number, are left out; messages of which none is wanted aren't decoded, and
        batches behind the last number aren't read.
        """
        flags = deque(wanted or ())
        for stretch, batch in numbered(batches) if wanted is None or flags else ():
            yield from self._of_batch(batch, stretch, None if wanted is None else flags, with_values=with_values)
            if wanted is not None and not flags:
                return

    def _of_batch(
        self, batch: MessageBatch, stretch: int, flags: deque[bool] | None, *, with_values: bool
    ) -> Iterator[tuple[int, Piece]]:
        reader, streams = self._readers[batch.channel_id], self._streams
        for index, why in reader.refused.items():
            if _next(flags):
                yield index, streams[index].without(len(batch), why)
        for part in batch.parts(max(1, VALUES_AT_ONCE // max(1, len(reader.leaves)))) if reader.streams else ():
            wanted = [_next(flags) for _ in reader.streams]
            if not any(wanted):
                continue
            decoded = streams[reader.streams[0]].topic.decode(part, reader.leaves)
            counted = _Counted()
            for index in compress(reader.streams, wanted):
                piece = streams[index].piece(part, decoded, stretch=stretch, with_values=with_values)
                yield index, counted.once(piece, streams[index])
                if decoded.reasons or decoded.told:
                    decoded = replace(decoded, reasons={}, told={})


def _next(flags: deque[bool] | None) -> bool:
    """Whether the next piece is wanted: all are without flags, and none behind the last flag."""
    return flags is None or (bool(flags) and flags.popleft())


class _Counted:
    """What the streams of a topic have in common of one batch is counted once."""

    def __init__(self) -> None:
        self._filters: set[tuple[FieldFilter, ...]] = set()

    def once(self, piece: Piece, stream: Stream) -> Piece:
        """Leave out the messages without time, where a stream of the same messages has told them."""
        if stream.filters not in self._filters:
            self._filters.add(stream.filters)
            return piece
        return replace(piece, lost={reason: lost for reason, lost in piece.lost.items() if reason != stream.no_time})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Readers:
    """Which streams read the messages of one MCAP channel, and why others of its topic can't."""

    streams: tuple[int, ...]
    leaves: tuple[str, ...]
    refused: Mapping[int, str]

    @classmethod
    def of(cls, channel_id: int, of_topic: Mapping[int, Stream]) -> "_Readers":
        known = set[str]().union(*(one.topic.known_to(channel_id) for one in of_topic.values()))
        absent = {index: [leaf for leaf in one.leaves() if leaf not in known] for index, one in of_topic.items()}
        able = tuple(index for index, lacks in absent.items() if not lacks)
        return cls(
            streams=able,
            leaves=tuple(dict.fromkeys(leaf for index in able for leaf in of_topic[index].leaves())),
            refused={
                index: f"a second schema on the topic has no field {lacks[0]}"
                for index, lacks in absent.items()
                if lacks
            },
        )
