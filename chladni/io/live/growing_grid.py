"""A grid that grows: samples of its streams as they come, given in blocks once all live streams have reached them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.grid_buffer import GridBuffer, grid_rows
from chladni.io.live.reception import Told
from chladni.io.live.stream_places import PlacedMessages, StreamPlaces
from chladni.io.shared_grid import Group
from chladni.signals.arrays import Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted

#: A stream so far behind the others is silent: the others go on without it.
SILENT_S: Final = 2.0
#: ... but not before it missed this many of its messages.
SILENT_MESSAGES: Final = 3
#: Where nothing was measured for longer, blocks are left out rather than filled.
LONGEST_FILLED_S: Final = 10.0
#: Values of a block, at most.
BLOCK_VALUES: Final = 1 << 20


@dataclass(slots=True, kw_only=True, eq=False)
class _Lane:
    """One stream of a grid: its places, and samples that aren't given yet."""

    places: StreamPlaces
    rows: tuple[int, ...]
    message_samples: float
    held: list[PlacedMessages] = field(default_factory=list)
    silent: bool = False
    too_late: int = 0

    @property
    def reach(self) -> int:
        return self.places.next_index

    def hold(self, placed: PlacedMessages) -> None:
        if placed.index.size:
            self.held.append(placed)


class GrowingGrid:
    """Streams on one grid.

    Parameters
    ----------
    group
        As grouped by their first messages.
    places
        For each placement of the group, who places what comes.
    order
        Channels in the order asked for.
    dtype
        Of the samples.
    """

    def __init__(
        self, group: Group, places: Sequence[StreamPlaces], order: Sequence[Channel], dtype: np.dtype[np.floating]
    ) -> None:
        rows = grid_rows(group, order)
        self.channels = rows.channels
        self.group = group
        self._dtype = dtype
        self._next = group.first
        self._lanes = [
            _Lane(places=one, rows=own, message_samples=_message_samples(placement.counts))
            for one, own, placement in zip(places, rows.rows, group.placements, strict=True)
        ]

    def rate_hz(self, *, fitted: bool) -> float:
        """Rate of the grid, as the stamps so far tell it; fitted as that of a finished log, or quickly."""
        rate = self._lanes[0].places.rate
        return rate.rate_hz() if fitted else rate.quick_rate_hz()

    def put(self, number: int, placed: PlacedMessages) -> None:
        """Take samples of one of the streams."""
        self._lanes[number].hold(placed)

    def reach(self, number: int) -> int:
        """Grid index behind the last sample of a stream."""
        return self._lanes[number].reach

    def blocks(self, *, last: bool = False) -> tuple[list[TimeSeries], list[Told]]:
        """Give what is complete, and what there is to tell; with `last`, all that is held."""
        told = self._silences()
        live = [lane.reach for lane in self._lanes if not lane.silent]
        end = max((lane.reach for lane in self._lanes), default=self._next)
        frontier = end if last or not live else min(live)
        found: list[TimeSeries] = []
        most = max(1, BLOCK_VALUES // len(self.channels))
        while self._next < frontier:
            self._leave_out(frontier)
            stop = min(frontier, self._next + most)
            if stop > self._next:
                found.append(self._block(stop))
        return found, [*told, *self._late()]

    def _leave_out(self, frontier: int) -> None:
        """Go on behind a long stretch in which nothing was measured."""
        first = frontier
        for lane in self._lanes:
            for placed in lane.held:
                there = placed.index[(placed.index >= self._next) & (placed.index < frontier)]
                first = min(first, int(there.min(initial=frontier)))
        if first - self._next > LONGEST_FILLED_S * self.group.rate_hz:
            self._next = first

    def _block(self, stop: int) -> TimeSeries:
        buffer = GridBuffer(self.group, self.channels, self._next, stop, self._dtype)
        for lane in self._lanes:
            rest = []
            for placed in lane.held:
                now = (placed.index >= self._next) & (placed.index < stop)
                lane.too_late += int(np.count_nonzero((placed.index < self._next) & (placed.index > NOWHERE // 2)))
                if now.all():
                    buffer.put(lane.rows, placed.index, placed.values)
                    continue
                if now.any():
                    buffer.put(lane.rows, placed.index[now], placed.values[:, now])
                later = placed.index >= stop
                if later.any():
                    rest.append(PlacedMessages(index=placed.index[later], values=placed.values[:, later]))
            lane.held = rest
        self._next = stop
        return buffer.series()

    def _silences(self) -> list[Told]:
        """Note which streams give nothing while others do."""
        told = []
        front = max(lane.reach for lane in self._lanes)
        rate_hz = self.group.rate_hz
        for lane in self._lanes:
            patience = max(SILENT_S * rate_hz, SILENT_MESSAGES * lane.message_samples)
            silent = front - lane.reach > patience and not lane.places.waits
            label = lane.places.stream.label
            if silent and not lane.silent:
                at_ns = self.group.time_ns(lane.reach)
                told.append(
                    Told(kind="silent", time_ns=at_ns, text=f"{label} gives nothing any more; the others go on")
                )
            elif lane.silent and not silent:
                told.append(Told(kind="back", time_ns=self.group.time_ns(lane.reach), text=f"{label} is back"))
            lane.silent = silent
        return told

    def _late(self) -> list[Told]:
        told = []
        for lane in self._lanes:
            if lane.too_late:
                what = f"{counted(lane.too_late, 'sample')} of {lane.places.stream.label}"
                text = f"{what} came after their place was given; they are left out"
                told.append(Told(kind="late", text=text, samples=lane.too_late))
                lane.too_late = 0
        return told

    @property
    def silent_channels(self) -> tuple[str, ...]:
        """Channels of the streams that give nothing."""
        return tuple(channel.name for lane in self._lanes if lane.silent for channel in lane.places.stream.channels)

    @property
    def end_s(self) -> float:
        """Seconds from the grid's start to the last block given."""
        return (self._next - self.group.first) / self.group.rate_hz


def _message_samples(counts: Whole | None) -> float:
    return 1.0 if counts is None or not counts.size else float(np.median(counts))
