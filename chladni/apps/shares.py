"""A large log that several computers share: each sums a part of it, and one puts the sums together.

Each runs the same step on the same log, and so comes to the same decisions: channels, grid, segments. They differ in
where sums come from: a part has those of its own samples, and leaves off there; whoever puts them together has all.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.apps.sources import Span, Watched, no_progress
from chladni.io.log import Log
from chladni.io.shared_grid import SampleGrid
from chladni.io.source import block_seconds
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.blocks import Accumulator, Divided, Margins, Own, leading_part
from chladni.spectral.stretches import Run, valid_runs

#: Behind the name of a grid, what its channels showed.
SEEN = "seen"


class NeedsWholeError(Exception):
    """What is asked for isn't a sum over parts, or a part of it is missing: one computer does all of the log."""


class PartSummedError(EstimateError):
    """Ends a step behind its sums: the rest is for whoever has all of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedGrid:
    """What a part tells of a grid besides sums.

    Attributes
    ----------
    samples
        Of the whole record.
    hop
        See `Margins`.
    cuts
        Numbers of the samples at which parts begin, and the record's end.
    runs
        Of valid samples among its own, as first and one past the last.
    """

    samples: int
    hop: int
    cuts: tuple[int, ...]
    runs: tuple[Run, ...]


class DividedGrid(Watched, Divided):
    """Abstract grid of a log whose blocks are summed in parts."""

    def __init__(self, log: Log, grid: SampleGrid, span: Span) -> None:
        Watched.__init__(self, grid.names, (), duration_s=grid.duration_s, progress=no_progress)
        self.log = log
        self.grid = grid
        self._lead: tuple[TimeSeries, ...] = ()
        self.span = span

    def __iter__(self) -> Iterator[TimeSeries]:
        """See `Divided`."""
        raise NeedsWholeError

    def lead(self, samples: int) -> tuple[TimeSeries, ...]:
        """See `Divided`."""
        if sum(block.samples for block in self._lead) < min(samples, self.grid.samples):
            self._lead = leading_part(self.blocks(None), samples)[0]
        # It may have been asked for a longer one before.
        return leading_part(self._lead, samples)[0]

    def blocks(self, between: tuple[int, int] | None) -> Iterator[TimeSeries]:
        """Read blocks as they are where nothing is shared, or of some of the samples."""
        seconds = block_seconds(len(self.names), self.grid.sample_rate_hz)
        start_s, end_s = self.span.start_s, self.span.end_s
        return self.log.blocks(self.names, seconds=seconds, start_s=start_s, end_s=end_s, between=between)

    @abstractmethod
    def sum_up(self, accumulators: Sequence[Accumulator]) -> None:
        """See `Divided`."""


@dataclass(slots=True, kw_only=True)
class Part:
    """Sums one part; is what `chladni.apps.sources.Share` asks for.

    Attributes
    ----------
    number, of
        Of this part, from 0, and how many there are.
    cuts
        Where parts begin, by the name of the grid; where it isn't known, as if no sample were missing.
    step
        Name of the step that is at work.
    sums, told
        What was found.
    """

    number: int
    of: int
    cuts: Mapping[str, Sequence[int]] = field(default_factory=dict)
    step: str = ""
    sums: dict[str, NDArray[Any]] = field(default_factory=dict)
    told: dict[str, SharedGrid] = field(default_factory=dict)

    def grids(self, log: Log, channels: Sequence[str] | None, span: Span) -> Iterator[Watched]:
        """See `Share`."""
        for grid in log.grids(channels, start_s=span.start_s, end_s=span.end_s):
            yield _PartOfGrid(log, grid, span, self)


class _PartOfGrid(DividedGrid):
    def __init__(self, log: Log, grid: SampleGrid, span: Span, part: Part) -> None:
        super().__init__(log, grid, span)
        self.part = part

    def sum_up(self, accumulators: Sequence[Accumulator]) -> None:
        """Sum the part, and end the step there."""
        part, name = self.part, grid_name(self.part.step, self.names)
        margins = _joint(accumulators)
        planned = _planned(self.grid.samples, part.of, margins.hop)
        cuts = tuple(part.cuts.get(name, planned))
        own, counted = planned[part.number : part.number + 2], cuts[part.number : part.number + 2]
        for one in accumulators:
            one.begin(Own(start_time_ns=self.grid.start_time_ns, first=counted[0], last=counted[1]))
        fed = (counted[0] - margins.before, counted[1] + margins.after) if counted[0] < counted[1] else (0, 0)
        runs: list[Run] = []
        for first, block in self._numbered(max(0, min(own[0], fed[0])), max(own[1], fed[1])):
            mine, offset = _cut(block, first, own)
            self._watch(mine)
            runs += [(offset + low, offset + high) for low, high in valid_runs(mine)]
            given, _ = _cut(block, first, fed)
            for one in accumulators if given.samples else ():
                one.update(given)
        part.sums[f"{name}/{SEEN}"] = self.seen()
        for place, one in enumerate(accumulators):
            part.sums |= {f"{name}/{place}/{what}": found for what, found in one.numbers().items()}
        part.told[name] = SharedGrid(samples=self.grid.samples, hop=margins.hop, cuts=cuts, runs=_joined(runs))
        raise PartSummedError

    def _numbered(self, first: int, last: int) -> Iterator[tuple[int, TimeSeries]]:
        for block in self.blocks((first, last)):
            yield first, block
            first += block.samples


@dataclass(frozen=True, slots=True, kw_only=True)
class Gathered:
    """Puts the sums of all parts together; is what `chladni.apps.sources.Share` asks for.

    Attributes
    ----------
    step
        Name of the step that is at work.
    sums, told
        Of each part, in order.
    """

    step: str
    sums: Sequence[Mapping[str, NDArray[Any]]]
    told: Sequence[Mapping[str, SharedGrid]]

    def grids(self, log: Log, channels: Sequence[str] | None, span: Span) -> Iterator[Watched]:
        """See `Share`."""
        for grid in log.grids(channels, start_s=span.start_s, end_s=span.end_s):
            yield _GatheredGrid(log, grid, span, self)


class _GatheredGrid(DividedGrid):
    def __init__(self, log: Log, grid: SampleGrid, span: Span, gathered: Gathered) -> None:
        super().__init__(log, grid, span)
        self.gathered = gathered

    def sum_up(self, accumulators: Sequence[Accumulator]) -> None:
        """Give accumulators the sums of all parts."""
        gathered, name = self.gathered, grid_name(self.gathered.step, self.names)
        if not all(name in told and told[name].samples == self.grid.samples for told in gathered.told):
            raise NeedsWholeError
        for one in accumulators:
            one.begin(Own(start_time_ns=self.grid.start_time_ns, first=0, last=self.grid.samples))
        for sums in gathered.sums:
            seen = sums[f"{name}/{SEEN}"]
            if seen.shape != (len(self.names), 5):
                raise NeedsWholeError
            self.add_seen(seen)
            for place, one in enumerate(accumulators):
                mine = f"{name}/{place}/"
                one.add_numbers({key.removeprefix(mine): some for key, some in sums.items() if key.startswith(mine)})
        runs = _joined([run for told in gathered.told for run in told[name].runs])
        for one in accumulators:
            one.settle(runs)


def grid_name(step: str, channels: Sequence[str]) -> str:
    """Name a grid of a step by its first channel: each lies on one grid."""
    return f"{step}/{channels[0]}"


def right_cuts(told: Sequence[SharedGrid]) -> tuple[int, ...]:
    """Say where the parts of a grid must begin, now that it's known where samples are missing.

    Segments begin at whole multiples of the hop, counted from the start of their run. Where a run goes on over the
    start of a part, its next segment begins the part.
    """
    first = told[0]
    runs = _joined([run for one in told for run in one.runs])
    planned = _planned(first.samples, len(told), first.hop)
    cuts = [0]
    for place in planned[1:-1]:
        start, end = next(((low, high) for low, high in runs if low < place < high), (place, place))
        cuts.append(min(start - (start - place) // first.hop * first.hop, end))
    # A short part may lie before the next segment as a whole.
    return tuple(np.maximum.accumulate([*cuts, first.samples]).tolist())


def _planned(samples: int, parts: int, hop: int) -> tuple[int, ...]:
    return (*(number * samples // parts // hop * hop for number in range(parts)), samples)


def _joint(accumulators: Sequence[Accumulator]) -> Margins:
    """Margins that are enough for all; segments of several lengths aren't cut at once."""
    margins = [one.margins for one in accumulators]
    hops = {one.hop for one in margins if one.hop > 1}
    if len(hops) > 1 or (hops and len(margins) > 1):
        raise NeedsWholeError
    return Margins(
        hop=max(hops, default=1), before=max(one.before for one in margins), after=max(one.after for one in margins)
    )


def _cut(block: TimeSeries, first: int, wanted: Sequence[int]) -> tuple[TimeSeries, int]:
    """Give the samples of a block, whose own number is `first`, that are wanted, and the number of the first."""
    low, high = (min(max(one - first, 0), block.samples) for one in wanted)
    return block.samples_between(low, high), first + low


def _joined(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Join runs that go on over the seam of two blocks or parts."""
    if not runs:
        return ()
    starts = [runs[0][0]]
    ends = []
    for (_, end), (start, _) in pairwise(runs):
        if start != end:
            ends.append(end)
            starts.append(start)
    return tuple(zip(starts, [*ends, runs[-1][1]], strict=True))
