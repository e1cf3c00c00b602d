"""Reading of chosen channels of a log: stamps first, then samples, whole or block by block."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.shared_clocks import Key, Stamped, StreamClock
from chladni.io.first_pass import FirstPass, PiecePlaces
from chladni.io.gathering import Gathering, LostMessages, gather, place_all, running_on, windowed
from chladni.io.grid_blocks import BlockGrid, PlacedPiece, blocks_of, complete
from chladni.io.grid_buffer import GridBuffer, grid_rows
from chladni.io.mcap.container import McapContainer
from chladni.io.placement import Placement, StatedRate
from chladni.io.repeats import digests_of
from chladni.io.shared_grid import Group, SampleGrid, group_placements, several_grids
from chladni.io.stream import Piece, Stream, read_pieces
from chladni.signals.arrays import Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted

#: Grids may hold this many values more than there are samples, and this many times as many.
EMPTY_VALUES = 1 << 24
SPARSE = 100
#: ... in memory, where each of them takes as much as a sample.
SPARSE_IN_MEMORY = 10


class MostlyEmptyError(LogError):
    """Grids would hold many times more values than the log has samples."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """What part of a log is read.

    Attributes
    ----------
    start_ns, end_ns
        Samples with ``start_ns <= time < end_ns``; None is without bound.
    log_start_ns, log_end_ns
        Messages with log times in between are looked at, since a log is indexed by them.
    told
        The window in words, for messages.
    """

    start_ns: int | None = None
    end_ns: int | None = None
    log_start_ns: int | None = None
    log_end_ns: int | None = None
    told: str = "in the log"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StampedSamples:
    """Samples at the times that their messages give.

    Attributes
    ----------
    channels
        One for each row of `values`.
    times_ns
        ``[sample]``, rising, nanoseconds since the Unix epoch.
    values
        ``[channel, sample]``, in each channel's unit.
    """

    channels: tuple[Channel, ...]
    times_ns: Whole
    values: NDArray[np.floating]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogReader:
    """Chosen channels in a window of a log.

    Attributes
    ----------
    container
        The log.
    streams
        Of the channels.
    order
        The channels in the order asked for.
    window
        What part is read.
    lost
        Counts messages that can't be used.
    required
        Whether every channel was asked for by name, so that one that isn't uniform is an error.
    clocks
        Finds the clocks of the log that were set, and the streams stamped by each, those given among others.
    known_clocks
        Those clocks, where they have to be known before a window of time can be read; else empty.
    rate_hz
        Sampling rate that the user states, None without.
    log_start_ns
        Zero of all times in seconds.
    """

    container: McapContainer
    streams: Sequence[Stream]
    order: Sequence[Channel]
    window: Window
    lost: LostMessages
    required: bool
    clocks: Callable[[Sequence[Stream]], Mapping[Key, StreamClock]]
    known_clocks: Mapping[Key, StreamClock] = field(default_factory=dict)
    rate_hz: float | None = None
    log_start_ns: int = 0

    def pieces(
        self, *, with_values: bool = True, every: list[int] | None = None, wanted: Sequence[bool] | None = None
    ) -> Iterator[tuple[int, Piece]]:
        """What each batch of messages holds of each stream, inside the window, in the order of the file.

        Sizes of all pieces are noted in `every`, see `FirstPass`; of those that aren't `wanted` nothing is decoded.
        """
        found = read_pieces(
            self.container,
            self.streams,
            start_ns=self.window.log_start_ns,
            end_ns=self.window.log_end_ns,
            with_values=with_values,
            wanted=wanted,
        )
        found = found if every is None else _sized(found, every)
        if self.known_clocks:
            found = running_on(self.streams, found, self.known_clocks)
        lost = LostMessages()
        try:
            yield from windowed(self.streams, found, lost, window_ns=(self.window.start_ns, self.window.end_ns))
        finally:
            self.lost.merge(lost)

    def series(self, *, one_clock: bool = False) -> tuple[TimeSeries, ...]:
        """Everything, one series for each grid; `LogError` where they are to have one clock and don't."""
        gatherings = gather(self.streams, self.pieces(), with_values=True)
        groups = self.groups(self._placements(gatherings))
        if one_clock:
            self._require_one_clock(groups)
        self._require_filled(groups, SPARSE_IN_MEMORY)
        by_stream = {id(one.stream): one for one in gatherings}
        series = [self._laid_out(group, by_stream) for group in groups]
        return self._some([one for one in series if one is not None])

    def stamped(self) -> tuple[StampedSamples, ...]:
        """Everything as it was stamped, a stream each; of several messages with one stamp the last counts."""
        found = []
        for one in gather(self.streams, self.pieces(), with_values=True):
            times_ns = np.concatenate(one.stamps_ns) if one.stamps_ns else np.zeros(0, np.int64)
            values = np.concatenate(one.values, axis=1) if one.values else np.zeros((len(one.stream.channels), 0))
            order = np.argsort(times_ns, kind="stable")
            last = np.append(np.diff(times_ns[order]) > 0, times_ns.size > 0)
            kept = order[last[: order.size]]
            found.append(
                StampedSamples(channels=one.stream.channels, times_ns=times_ns[kept], values=values[:, kept])
            )
        return tuple(found)

    def first_pass(self) -> FirstPass:
        """Read stamps alone and fit the time bases: all that must be known before blocks can be given."""
        every: list[int] = []
        sizes: list[tuple[int, int]] = []

        def pieces() -> Iterator[tuple[int, Piece]]:
            for number, piece in self.pieces(with_values=False, every=every):
                sizes.append((number, piece.stamps_ns.size))
                yield number, piece

        gatherings = gather(self.streams, pieces(), with_values=False)
        alike = {number for number, one in enumerate(gatherings) if one.stamps_alike}
        if alike:
            # Whether their samples are alike, too, takes reading them; a log with such stamps is rare.
            for number, piece in self.pieces():
                if number in alike:
                    gatherings[number].digests.append(digests_of(piece.values))
        return FirstPass(
            placements=self._placements(gatherings),
            sizes=tuple(sizes),
            every=tuple(every),
            dtype=np.result_type(*(one.dtype for one in gatherings)),
        )

    def _placements(self, gatherings: Sequence[Gathering]) -> tuple[Placement, ...]:
        def clocks(_: Sequence[Stamped]) -> Mapping[Key, StreamClock]:
            return self.known_clocks or self.clocks(self.streams)

        stated = None if self.rate_hz is None else StatedRate(hz=self.rate_hz, named=self.required)
        placements = place_all(gatherings, clocks, stated=stated)
        lost = LostMessages()
        lost.add_untimed(placements)
        self.lost.merge(lost)
        return placements

    def blocks(
        self, known: FirstPass, seconds: float, between: tuple[int, int] | None = None
    ) -> Iterator[TimeSeries]:
        """Everything, or what lies between two numbers of samples, block by block, in a second pass.

        Raises
        ------
        LogError
            When the channels don't share one grid, besides what `groups` raises.
        """
        group = self.one_group(self.groups(known.placements))
        first, last = group.extent(self.window.start_ns, self.window.end_ns)
        if between is not None:
            first, last = (min(first + max(one, 0), last) for one in between)
        rows = grid_rows(group, self.order)
        grid = BlockGrid(
            group=group,
            channels=rows.channels,
            first=first,
            last=last,
            block_samples=max(1, round(seconds * group.rate_hz)),
            dtype=known.dtype,
        )
        # Where stamps or a window decide what a piece holds, each has to be decoded.
        apart = between is not None and self.window == Window() and not self.known_clocks
        places = known.places(group.placements, within=(first, last) if apart else None)
        return chain.from_iterable(
            blocks_of(part, self._placed(places, group.placements, rows.rows), complete(places.lowest, last))
            for part in grid.parts(places.lowest, places.highest)
        )

    def grids(self, known: FirstPass) -> tuple[SampleGrid, ...]:
        """What grids the channels lie on; see `groups`."""
        found = []
        for group in self.groups(known.placements):
            first, last = group.extent(self.window.start_ns, self.window.end_ns)
            if last > first:
                names = tuple(channel.name for channel in grid_rows(group, self.order).channels)
                found.append(
                    SampleGrid(
                        names=names,
                        sample_rate_hz=group.rate_hz,
                        start_time_ns=group.time_ns(first),
                        samples=last - first,
                    )
                )
        return tuple(found)

    def groups(self, placements: Sequence[Placement]) -> tuple[Group, ...]:
        """Put streams on their grids; leave out those without one, unless they were asked for by name.

        Raises
        ------
        LogError
            When a channel that was asked for has no samples in the window, or no uniform ones; when none has.
        """
        for placement in placements:
            if self.required:
                self._require_uniform(placement)
        groups = group_placements([one for one in placements if one.time_base.uniform and one.index.size])
        if not groups:
            raise LogError(self._nothing_uniform(placements))
        self._require_filled(groups, SPARSE)
        return groups

    def one_group(self, groups: Sequence[Group]) -> Group:
        """The only group there is.

        Raises
        ------
        LogError
            When there are several.
        """
        self._require_one_clock(groups)
        if len(groups) > 1:
            told = [(grid_rows(group, self.order).channels, group.rate_hz, group.start_ns) for group in groups]
            raise LogError(f"{several_grids(self.container.path.name, told)}, or read channels that share one")
        return groups[0]

    def _require_one_clock(self, groups: Sequence[Group]) -> None:
        first = groups[0].placements[0]
        for other in groups[1:]:
            placement = other.placements[0]
            if placement.clock != first.clock:
                often = [f"{counted(one.time_base.clock.count, 'time')}" for one in (first, placement)]
                raise LogError(
                    f"{self.container.path.name}: the clock of {first.stream.label} was set {often[0]} and that of "
                    f"{placement.stream.label} {often[1]}, so it isn't known which samples belong together. Take one "
                    "after the other, a part before the first time (--end S), or all by the log's times (--stamp log)"
                )

    def _nothing_uniform(self, placements: Sequence[Placement]) -> str:
        reasons = [
            f"{one.stream.label}: {one.time_base.advice if one.time_base.samples else 'no sample'}"
            for one in placements
        ]
        more = f"; and {len(reasons) - 3} more" if len(reasons) > 3 else ""
        told = f"{'; '.join(reasons[:3])}{more}"
        return f"{self.container.path.name}: no channel has uniform samples {self.window.told}: {told}"

    def _require_uniform(self, placement: Placement) -> None:
        base, label = placement.time_base, placement.stream.label
        file = self.container.path.name
        if not base.samples:
            raise LogError(f"{file}: {label} has no sample {self.window.told}")
        if not base.uniform:
            raise LogError(
                f"{file}: {label} isn't sampled uniformly (by {placement.stream.choice.kind} time): {base.advice}"
            )

    def _require_filled(self, groups: Sequence[Group], times: int) -> None:
        """Refuse grids that are nearly all gaps: stamps leap, and they would take memory for years of nothing."""
        sizes = [_values_on(group, group.extent(self.window.start_ns, self.window.end_ns)) for group in groups]
        held = sum(placement.values for group in groups for placement in group.placements)
        if sum(sizes) <= EMPTY_VALUES + times * held:
            return
        group = groups[int(np.argmax(sizes))]
        first = group.placements[0].stream
        pause = group.longest_pause()
        cut_s = f"{(group.time_ns(pause.middle) - self.log_start_ns) / NS_PER_S:.6g}"
        other_clock = "" if first.choice.kind == "log" else ", or take the log's own times (--stamp log)"
        raise MostlyEmptyError(
            f"{self.container.path.name}: {first.label}: {pause.later} of {pause.messages} messages lie "
            f"{pause.samples / group.rate_hz:.6g} s after the others, so {sum(sizes)} values would be laid out for "
            f"{held} samples: read the part before (--end {cut_s}) or after (--start {cut_s}){other_clock}"
        )

    def _laid_out(self, group: Group, gatherings: dict[int, Gathering]) -> TimeSeries | None:
        first, last = group.extent(self.window.start_ns, self.window.end_ns)
        if first == last:
            return None
        rows = grid_rows(group, self.order)
        members = [gatherings[id(placement.stream)] for placement in group.placements]
        dtype = np.result_type(*(one.dtype for one in members))
        buffer = GridBuffer(group, rows.channels, first, last, dtype)
        for placement, gathering, row in zip(group.placements, members, rows.rows, strict=True):
            start = 0
            # Let go of as they are laid out: all samples twice would be the most memory that a log takes.
            gathering.values.reverse()
            for messages in gathering.stamps_ns:
                part = slice(start, start + messages.size)
                buffer.put(row, placement.samples_index(part), gathering.values.pop())
                start = part.stop
        return buffer.series()

    def _some(self, series: list[TimeSeries]) -> tuple[TimeSeries, ...]:
        if not series:
            raise LogError(f"{self.container.path.name}: no sample {self.window.told}")
        return tuple(series)

    def _placed(
        self, places: PiecePlaces, placements: Sequence[Placement], rows: Sequence[tuple[int, ...]]
    ) -> Iterator[PlacedPiece]:
        """Read samples a second time, now with their places."""
        for (member, part), (_, piece) in zip(places.parts, self.pieces(wanted=places.wanted), strict=True):
            if member is not None:
                index = placements[member].samples_index(part)
                yield PlacedPiece(rows=rows[member], index=index, values=piece.values)


def _values_on(group: Group, extent: tuple[int, int]) -> int:
    return (extent[1] - extent[0]) * sum(len(placement.stream.sources) for placement in group.placements)


def _sized(pieces: Iterable[tuple[int, Piece]], sizes: list[int]) -> Iterator[tuple[int, Piece]]:
    """Note the number of messages of each piece in passing."""
    for stream, piece in pieces:
        sizes.append(piece.stamps_ns.size)
        yield stream, piece
