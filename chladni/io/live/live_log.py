"""Messages as they come, turned into blocks of samples: topics that appear, clocks, gaps and all."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.catalog import Catalog, read_catalog
from chladni.io.channel_source import ChannelSource
from chladni.io.gathering import Gathering, LostMessages, place_all
from chladni.io.live.growing_grid import GrowingGrid
from chladni.io.live.held_messages import HeldMessages
from chladni.io.live.reception import MessageSource, Samples, Told
from chladni.io.live.stream_places import StreamPlaces, joined_pieces
from chladni.io.log_info import some_of
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.message_path import starts
from chladni.io.placement import Placement, StatedRate
from chladni.io.setup import Setup
from chladni.io.shared_grid import group_placements
from chladni.io.stamps import StampRequest
from chladni.io.stream import Piece, PieceReader, Stream
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import NS_PER_S
from chladni.signals.wording import counted, near_matches

if TYPE_CHECKING:
    from chladni.io.number_lists import NumberLists

#: The beginning that is held until channels and clocks are known.
SETTLE_S: Final = 2.0
#: Messages of a topic that tell its clock; with fewer it's waited for more of them.
ENOUGH_MESSAGES: Final = 64
#: ... and after so many without a rate there is none.
MOST_MESSAGES: Final = 1024
#: Bytes held of the beginning, at most.
MOST_HELD_BYTES: Final = 256 << 20
#: Reasons that are told where a source gave nothing.
MOST_REASONS: Final = 3


@dataclass(slots=True, kw_only=True, eq=False)
class _Part:
    """Topics that were understood at one time: who reads them, and where their samples go."""

    reader: PieceReader
    places: tuple[StreamPlaces | None, ...]
    grids: tuple[tuple[int, int] | None, ...]


class LiveLog:
    """Blocks of samples of a source of messages.

    Parameters
    ----------
    source
        Where messages come from.
    channels
        Message paths; None for every channel whose samples are uniform.
    setup
        Points, units, references.
    stamp
        Which time a sample has, see `chladni.io.log.open`.
    sample_rate_hz
        Rate that the user states, for what stamps leave open.
    settle_s
        Seconds of the log that are held until the channels and their clocks are known.
    """

    def __init__(
        self,
        source: MessageSource,
        *,
        channels: Sequence[str] | None = None,
        setup: Setup | None = None,
        stamp: StampRequest = "auto",
        sample_rate_hz: float | None = None,
        settle_s: float = SETTLE_S,
    ) -> None:
        self.name = source.name
        self._source = source
        self._wanted = None if channels is None else tuple(channels)
        self._setup = setup or Setup()
        self._stamp = stamp
        self._stated = None if sample_rate_hz is None else StatedRate(hz=sample_rate_hz, named=channels is not None)
        self._settle_s = settle_s
        self._parts: list[_Part] = []
        self._grids: list[GrowingGrid] = []
        self._waiting: dict[int, list[MessageBatch]] = {}
        self._given_up: set[str] = set()
        self._ignored: set[int] = set()
        # Topics of which messages came.
        self._heard: set[str] = set()
        self._tried: dict[int, int] = {}
        #: Lists of numbers in messages, an element for each joint or motor, of the topics known so far.
        self.number_lists: tuple[NumberLists, ...] = ()
        self._begun = False
        # First and last log time of what waits, and its bytes.
        self._held = (1 << 63, 0, 0)
        self._lost = LostMessages()
        self._lost_told: dict[tuple[str, str], int] = {}

    @property
    def geometry(self) -> Geometry:
        """Points and lines of the setup file."""
        return self._setup.geometry

    @property
    def silent_channels(self) -> tuple[str, ...]:
        """Channels that give nothing at present."""
        return tuple(name for grid in self._grids for name in grid.silent_channels)

    def rate_hz(self, channels: Sequence[Channel], /, *, fitted: bool = True) -> float | None:
        """Rate of a grid, given by its channels, as all stamps so far tell it; `fitted` takes a moment."""
        names = {channel.name for channel in channels}
        for grid in self._grids:
            if names <= {channel.name for channel in grid.channels}:
                return grid.rate_hz(fitted=fitted)
        return None

    def receive(self, timeout_s: float) -> Samples:
        """Give the blocks that are complete, at the latest after `timeout_s`.

        Raises
        ------
        LogError
            When the source is no log, or it ended and no channel had uniform samples.
        SetupError
            When the setup file doesn't fit.
        """
        found = self._source.receive(timeout_s)
        told = [Told(kind="source", text=text) for text in found.told]
        told += self._take(found.batches)
        told += self._understand(ended=found.ended)
        blocks = []
        if found.ended:
            self._flush()
        for grid in self._grids:
            complete, more = grid.blocks(last=found.ended)
            blocks += complete
            told += more
        told += self._losses()
        if found.ended and not self._grids:
            raise LogError(self._nothing(told))
        return Samples(blocks=tuple(blocks), told=tuple(told), ended=found.ended)

    def finish(self) -> Samples:
        """Give all that is held, where nobody waits for more."""
        told = self._understand(ended=True)
        self._flush()
        blocks = []
        for grid in self._grids:
            complete, more = grid.blocks(last=True)
            blocks += complete
            told += more
        return Samples(blocks=tuple(blocks), told=tuple(told), ended=True)

    def close(self) -> None:
        """Let go of the source."""
        self._source.close()

    # --- messages of topics that are understood ---

    def _take(self, batches: Iterable[MessageBatch]) -> list[Told]:
        told: list[Told] = []
        known: dict[int, tuple[_Part, list[MessageBatch]]] = {}
        of_channel = {channel: part for part in self._parts for channel in part.reader.channel_ids}
        for batch in batches:
            part = of_channel.get(batch.channel_id)
            if part is not None:
                known.setdefault(id(part), (part, []))[1].append(batch)
            elif batch.channel_id not in self._ignored:
                self._heard.add(self._source.channels[batch.channel_id].topic)
                self._waiting.setdefault(batch.channel_id, []).append(batch)
                first, last, size = self._held
                self._held = (
                    min(first, int(batch.log_time_ns.min())),
                    max(last, int(batch.log_time_ns.max())),
                    size + int(batch.lengths.sum()),
                )
        for part, some in known.values():
            for number, piece in part.reader.pieces(some):
                told += self._place(part, number, piece)
        return told

    def _place(self, part: _Part, number: int, piece: Piece) -> Sequence[Told]:
        places, grid = part.places[number], part.grids[number]
        if places is None or grid is None:
            return ()
        self._lost.add(places.stream.topic.name, piece)
        if not piece.stamps_ns.size:
            return ()
        self._grids[grid[0]].put(grid[1], places.add(piece))
        return places.tell()

    def _flush(self) -> None:
        for part in self._parts:
            for places, grid in zip(part.places, part.grids, strict=True):
                if places is not None and grid is not None:
                    self._grids[grid[0]].put(grid[1], places.rest())

    def _losses(self) -> list[Told]:
        """Messages that were read and couldn't be used, beyond those told before."""
        told = []
        for (topic, reason), messages in self._lost.counts.items():
            before = self._lost_told.get((topic, reason), 0)
            # Told at 1, 10, 100, ...: a topic that goes on so needn't be told of again and again.
            if messages >= max(1, 10 * before):
                self._lost_told[topic, reason] = messages
                told.append(Told(kind="late", text=f"{counted(messages, 'message')} of {topic} left out: {reason}"))
        return told

    # --- topics that aren't ---

    def _understand(self, *, ended: bool) -> list[Told]:
        """Look at the topics that wait, where there is enough of them."""
        if not self._waiting:
            return []
        if not self._begun:
            if not ended and not self._settled():
                return []
            self._begun = True
            told = self._look(self._waiting.keys(), first=True, ended=ended)
            if (missing := self._not_there()) and not ended:
                told.append(Told(kind="topic", text=f"{self._lacks(missing)}; waiting for it"))
            return told
        ripe = [channel for channel in self._waiting if ended or self._ripe(channel)]
        return self._look(ripe, first=False, ended=ended) if ripe else []

    def _settled(self) -> bool:
        first, last, size = self._held
        return last - first >= self._settle_s * NS_PER_S or size > MOST_HELD_BYTES

    def _ripe(self, channel: int) -> bool:
        held = self._waiting[channel]
        count = sum(map(len, held))
        span_ns = int(held[-1].log_time_ns[-1]) - int(held[0].log_time_ns[0])
        # Tried again when there are twice as many.
        return count >= 2 * self._tried.get(channel, 0) and (
            count >= ENOUGH_MESSAGES or (count >= 8 and span_ns >= self._settle_s * NS_PER_S)
        )

    def _look(self, channel_ids: Iterable[int], *, first: bool, ended: bool) -> list[Told]:
        chosen = set(channel_ids)
        channels = {number: one for number, one in self._source.channels.items() if number in chosen}
        held = HeldMessages(
            self.name, channels, [batch for number in sorted(chosen) for batch in self._waiting[number]]
        )
        catalog = read_catalog(held, setup=self._fitting_setup(channels.values()), request=self._stamp)
        sources = self._sources(catalog)
        self.number_lists = (*self.number_lists, *catalog.number_lists)
        told = [
            Told(kind="topic", text=f"{one.topic} can't be read: {one.reason}")
            for one in catalog.unread
            if "." not in one.topic and one.topic in catalog.refused
        ]
        streams = catalog.streams(sources)
        if self._wanted is None and (empty := _without_numbers(held, streams)):
            # Fields of a message type that nobody measures; averages need numbers of all channels at once.
            sources = [one for one in sources if one.channel.name not in empty]
            streams = catalog.streams(sources)
            told.append(Told(kind="topic", text=f"channels that hold no number are left out: {some_of(empty)}"))
        told += self._begin_streams(held, streams, sources, first=first, ended=ended)
        # No channel of the others is asked for, or can be read.
        for number in chosen - {one for stream in streams for one in stream.topic.decoders}:
            self._ignore(number)
        return told

    def _fitting_setup(self, channels: Iterable[object]) -> Setup:
        """Give what the setup says of topics that are there; others may come."""
        topics = {getattr(one, "topic", "") for one in channels}
        return replace(
            self._setup,
            channels=tuple(one for one in self._setup.channels if any(starts(topic, one.path) for topic in topics)),
            batches={topic: one for topic, one in self._setup.batches.items() if topic in topics},
        )

    def _sources(self, catalog: Catalog) -> Sequence[ChannelSource]:
        if self._wanted is None:
            return catalog.channels
        topics = tuple(catalog.topics)
        mine = [path for path in self._wanted if any(starts(topic, path) for topic in topics)]
        return tuple(catalog.resolve(path) for path in dict.fromkeys(mine))

    def _begin_streams(
        self,
        held: HeldMessages,
        streams: Sequence[Stream],
        sources: Sequence[ChannelSource],
        *,
        first: bool,
        ended: bool,
    ) -> list[Told]:
        """Start the streams whose clock the held messages tell; the others wait on, or are given up."""
        if not streams:
            return []
        reader = PieceReader(streams)
        pieces: dict[int, list[Piece]] = {number: [] for number in range(len(streams))}
        for number, piece in reader.pieces(held.batches(reader.channel_ids)):
            pieces[number].append(piece)
        gatherings = [Gathering(stream=stream) for stream in streams]
        for number, some in pieces.items():
            for piece in some:
                gatherings[number].add(piece, with_values=True)
        placements = place_all(gatherings, lambda _: {}, stated=self._stated)
        able = [number for number, one in enumerate(placements) if one.time_base.uniform and one.index.size]
        told = self._unable(streams, placements, able, ended=ended)
        if not able:
            return told
        kept = [streams[number] for number in able]
        lead = [joined_pieces(pieces[number]) for number in able]
        for number in able:
            for piece in pieces[number]:
                self._lost.add(streams[number].topic.name, piece)
        self._lost.add_untimed([placements[number] for number in able])
        told += self._begin(kept, [placements[number] for number in able], lead, sources)
        for stream in kept:
            for channel in stream.topic.decoders:
                self._waiting.pop(channel, None)
        if not first:
            told += [
                Told(kind="topic", text=f"{stream.label} appeared; it is averaged apart from the others")
                for stream in kept
            ]
        return told

    def _begin(
        self,
        streams: Sequence[Stream],
        placements: Sequence[Placement],
        lead: Sequence[Piece],
        sources: Sequence[ChannelSource],
    ) -> list[Told]:
        places: dict[int, StreamPlaces] = {}
        grids: dict[int, tuple[int, int]] = {}
        told: list[Told] = []
        numbers = {id(stream): number for number, stream in enumerate(streams)}
        order = [source.channel for source in sources]
        for group in group_placements(placements):
            members = [numbers[id(one.stream)] for one in group.placements]
            for one, number in zip(group.placements, members, strict=True):
                places[number] = StreamPlaces(one, lead[number], stated=self._stated)
            dtype = np.result_type(*(lead[number].values.dtype for number in members), np.float32)
            grid = GrowingGrid(group, [places[number] for number in members], order, dtype)
            for lane, (one, number) in enumerate(zip(group.placements, members, strict=True)):
                grid.put(lane, places[number].lead(one, lead[number]))
                grids[number] = (len(self._grids), lane)
                told += _of_beginning(one)
            self._grids.append(grid)
        self._parts.append(
            _Part(
                reader=PieceReader(streams),
                places=tuple(places.get(number) for number in range(len(streams))),
                grids=tuple(grids.get(number) for number in range(len(streams))),
            )
        )
        return told

    def _unable(
        self, streams: Sequence[Stream], placements: Sequence[Placement], able: Sequence[int], *, ended: bool
    ) -> list[Told]:
        told = []
        for number, (stream, placement) in enumerate(zip(streams, placements, strict=True)):
            if number in able:
                continue
            count = max((sum(map(len, self._waiting.get(one, ()))) for one in stream.topic.decoders), default=0)
            for channel in stream.topic.decoders:
                self._tried[channel] = count
            if (ended or count >= MOST_MESSAGES) and stream.label not in self._given_up:
                self._given_up.add(stream.label)
                told.append(Told(kind="topic", text=f"{stream.label} is left out: {placement.time_base.advice}"))
            if count >= MOST_MESSAGES:
                for channel in stream.topic.decoders:
                    self._ignore(channel)
        return told

    def _ignore(self, channel: int) -> None:
        """Read no more of a channel's messages."""
        self._waiting.pop(channel, None)
        self._ignored.add(channel)

    def _nothing(self, told: Sequence[Told]) -> str:
        reasons = [one.text.removeprefix(f"{self.name}: ") for one in told]
        if missing := self._not_there():
            reasons = [self._lacks(missing)]
        if not reasons:
            reasons = ["no channel has uniform samples; 'chladni info LOG' tells what a finished log holds"]
        more = f"; and {len(reasons) - MOST_REASONS} more" if len(reasons) > MOST_REASONS else ""
        return f"{self.name}: it ended without samples: {'; '.join(reasons[:MOST_REASONS])}{more}"

    def _not_there(self) -> list[str]:
        """Paths asked for of which no message has come."""
        return [path for path in self._wanted or () if not any(starts(topic, path) for topic in self._heard)]

    def _lacks(self, paths: Sequence[str]) -> str:
        topics = [one.topic for one in self._source.channels.values()]
        if any(starts(topic, paths[0]) for topic in topics):
            return f"no message of {some_of(paths)} has come"
        return f"no topic starts {some_of(paths)}; {near_matches(paths[0].split('.')[0], topics)}"


def _without_numbers(held: HeldMessages, streams: Sequence[Stream]) -> list[str]:
    """Names of the channels of which messages came, and not a single number."""
    reader = PieceReader(streams)
    seen: dict[str, bool] = {}
    for number, piece in reader.pieces(held.batches(reader.channel_ids)):
        for channel, row in zip(streams[number].channels, piece.values, strict=True):
            if row.size:
                seen[channel.name] = seen.get(channel.name, False) or bool(np.isfinite(row).any())
    return [name for name, known in seen.items() if not known]


def _of_beginning(placement: Placement) -> list[Told]:
    """What the ordinary fit found in the beginning."""
    base, told = placement.time_base, []
    if base.gap_count:
        what = f"{counted(base.missing, 'sample')} of {placement.stream.label} missing in the beginning"
        told.append(Told(kind="gap", time_ns=base.start_ns, text=what, samples=base.missing))
    if base.clock.count:
        what = f"the clock of {placement.stream.label} was set in the beginning"
        told.append(Told(kind="clock", time_ns=int(base.clock.after_ns[0]), text=what))
    return told
