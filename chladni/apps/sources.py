"""Samples of a log for averaging: whole when they fit in memory, block by block when they don't."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from typing import Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.io.log_reader import MostlyEmptyError
from chladni.io.shared_grid import SampleGrid, several_grids
from chladni.io.source import block_seconds, is_small
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.join import JoinMethod, join_note, join_resampled
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted

Progress = Callable[[float], None]
#: Samples that are held as a whole: a gigabyte, and a few times as much of what is made of them.
MOST_VALUES = 1 << 27
#: Samples of channels that are read together where each is worked on by itself.
VALUES_TOGETHER = 1 << 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Part of a log, in seconds from its start (None for its ends), and how its sampling grids become one.

    With a share, grids come as `Divided`: what is summed of them is summed by several computers.
    """

    start_s: float | None = None
    end_s: float | None = None
    join: JoinMethod = "auto"
    share: "Share | None" = None


class Share(Protocol):
    """Gives the grids of a log that several computers share."""

    def grids(self, log: Log, channels: Sequence[str] | None, span: Span) -> "Iterator[Watched]":
        """Give what `watched_grids` gives, divided."""


def no_progress(share: float) -> None:
    """Tell nobody how far it is."""


def moving_channels(series: TimeSeries) -> list[str]:
    """Names of the channels that show more than one value."""
    lowest = np.fmin.reduce(series.values, axis=1, initial=np.inf)
    highest = np.fmax.reduce(series.values, axis=1, initial=-np.inf)
    return [one.name for one, low, high in zip(series.channels, lowest, highest, strict=True) if low < high]


class Watched:
    """Passes blocks on, and remembers which channels moved at all, by how much, and how far it is."""

    def __init__(
        self,
        names: Sequence[str],
        blocks: Iterable[TimeSeries],
        *,
        duration_s: float,
        progress: Progress,
        notes: tuple[str, ...] = (),
    ) -> None:
        self.names = tuple(names)
        self.notes = notes
        self._blocks = blocks
        self.duration_s = duration_s
        self._progress = progress
        self._lowest: dict[str, float] = {}
        self._highest: dict[str, float] = {}
        self._moments: dict[str, tuple[float, float, float]] = {}

    def __iter__(self) -> Iterator[TimeSeries]:
        done_s = 0.0
        for block in self._blocks:
            self._watch(block)
            yield block
            done_s += block.duration_s
            self._progress(min(1.0, done_s / max(self.duration_s, 1e-9)))

    def constant(self) -> tuple[str, ...]:
        """Names of the channels that showed one value only."""
        return tuple(name for name in self._lowest if not self._lowest[name] < self._highest[name])

    def still_note(self, names: Collection[str]) -> tuple[str, ...]:
        """Say which of these channels never change; nothing where all do."""
        still = [name for name in self.constant() if name in names]
        if not still:
            return ()
        verb = "never changes" if len(still) == 1 else "never change"
        return (f"{some_of(still)} {verb}: zeros are for want of motion, as of a sensor that isn't connected",)

    def variance(self, name: str) -> float:
        """Variance of a channel over all its samples; 0 before any came."""
        samples, _, squares = self._moments.get(name, (0, 0.0, 0.0))
        return squares / samples if samples else 0.0

    def seen(self) -> Real:
        """``[channel, 5]`` lowest and highest sample, number of samples, mean, sum of squared deviations."""
        lowest, highest, moments = self._lowest, self._highest, self._moments
        rows = [(lowest.get(n, np.inf), highest.get(n, -np.inf), *moments.get(n, _NOTHING)) for n in self.names]
        return np.array(rows, np.float64).reshape(-1, 5)

    def add_seen(self, found: Real) -> None:
        """Take in what another one has `seen` of the same channels."""
        for name, (low, high, *moments) in zip(self.names, found.tolist(), strict=True):
            if low <= high:
                self._lowest[name] = min(low, self._lowest.get(name, np.inf))
                self._highest[name] = max(high, self._highest.get(name, -np.inf))
            else:
                # All its samples are missing: it's known, and shows no motion.
                self._lowest.setdefault(name, np.inf)
                self._highest.setdefault(name, -np.inf)
            self._moments[name] = _together(self._moments.get(name, _NOTHING), (moments[0], moments[1], moments[2]))

    def _watch(self, block: TimeSeries) -> None:
        # fmin and fmax look past the NaN of missing samples.
        lowest = np.fmin.reduce(block.values, axis=1, initial=np.inf)
        highest = np.fmax.reduce(block.values, axis=1, initial=-np.inf)
        for channel, low, high in zip(block.channels, lowest.tolist(), highest.tolist(), strict=True):
            self._lowest[channel.name] = min(low, self._lowest.get(channel.name, np.inf))
            self._highest[channel.name] = max(high, self._highest.get(channel.name, -np.inf))
        for channel, row in zip(block.channels, block.values, strict=True):
            self._moments[channel.name] = _with_moments(self._moments.get(channel.name, _NOTHING), row)


class _Spectrum(Protocol):
    @property
    def channels(self) -> tuple[Channel, ...]: ...
    def select(self, names: Sequence[str], /) -> Self: ...


_SpectrumT = TypeVar("_SpectrumT", bound=_Spectrum)


def moving_only(found: Iterable[tuple[_SpectrumT, Watched]]) -> tuple[_SpectrumT, ...]:
    """Give what was found of channels that change; what holds none of them is left out."""
    return tuple(kept for one, grid in found for kept in without(grid.constant(), [one]))


def without(still: Collection[str], found: Iterable[_SpectrumT]) -> tuple[_SpectrumT, ...]:
    """Leave these channels out; what holds none but them goes, too."""
    some = ((one, [channel.name for channel in one.channels if channel.name not in still]) for one in found)
    return tuple(one.select(names) for one, names in some if names)


_Moments = tuple[float, float, float]
_NOTHING: _Moments = (0, 0.0, 0.0)


def _with_moments(known: _Moments, row: NDArray[np.floating]) -> _Moments:
    """Add samples to a count, a mean and a sum of squared deviations."""
    finite = row[np.isfinite(row)].astype(np.float64, copy=False)
    if not finite.size:
        return known
    # Values too large to square are refused by name when they are averaged; here they only make an infinite variance.
    with np.errstate(over="ignore", invalid="ignore"):
        mean = float(finite.mean())
        return _together(known, (finite.size, mean, float(np.square(finite - mean).sum())))


def _together(known: _Moments, more: _Moments) -> _Moments:
    """Merge counts, means and sums of squared deviations (Chan, Golub & LeVeque 1983, eq. 2.1)."""
    (samples, mean, squares), (fresh, fresh_mean, fresh_squares) = known, more
    if not fresh:
        return known
    apart, total = fresh_mean - mean, samples + fresh
    return total, mean + apart * fresh / total, squares + (fresh_squares + apart * apart * samples * fresh / total)


class WholeChannels:
    """Some channels of a sampling grid at a time, each with all its samples; read anew as often as they're asked for.

    Parameters
    ----------
    log, names, span
        Names share a grid.
    samples
        That each of them has.
    beside
        Names that are read with each of the others, and come first.
    """

    def __init__(self, log: Log, names: Sequence[str], span: Span, *, samples: int, beside: Sequence[str]) -> None:
        self.names = tuple(names)
        self._log, self._span, self._beside = log, span, tuple(beside)
        room = max(1, VALUES_TOGETHER // max(samples, 1) - len(self._beside))
        self._parts = [self.names[first : first + room] for first in range(0, len(self.names), room)]
        self._held: TimeSeries | None = None

    def __iter__(self) -> Iterator[TimeSeries]:
        if len(self._parts) == 1:
            self._held = self._read(self.names) if self._held is None else self._held
            yield self._held
            return
        yield from map(self._read, self._parts)

    def _read(self, names: Sequence[str]) -> TimeSeries:
        return self._log.read([*self._beside, *names], start_s=self._span.start_s, end_s=self._span.end_s)


def whole_channels(
    log: Log, names: Sequence[str] | None, span: Span, *, work: str, beside: Sequence[str] = ()
) -> tuple[WholeChannels, ...]:
    """Give channels that are worked on one by one, those of each sampling grid; see `WholeChannels`.

    Raises
    ------
    LogError
        When the samples of one channel, and of those beside it, are more than `MOST_VALUES`.
    """
    found = []
    for grid in log.grids(names, start_s=span.start_s, end_s=span.end_s):
        values = (1 + len(beside)) * grid.samples
        if values > MOST_VALUES:
            share_s = grid.duration_s * MOST_VALUES / values
            raise LogError(
                f"{log.path.name}: {work} takes all samples of {counted(1 + len(beside), 'channel')} at once, and "
                f"{values:.3g} are more than the {MOST_VALUES} that fit in memory; name a part of {share_s:.3g} s or "
                "less (--start, --end)"
            )
        others = [name for name in grid.names if name not in beside]
        found.append(WholeChannels(log, others, span, samples=grid.samples, beside=beside))
    return tuple(found)


class _Blocks:
    """Blocks of one sampling grid, read from the first on as often as they are asked for."""

    def __init__(self, log: Log, grid: SampleGrid, span: Span) -> None:
        self._log, self._grid, self._span = log, grid, span

    def __iter__(self) -> Iterator[TimeSeries]:
        seconds = block_seconds(len(self._grid.names), self._grid.sample_rate_hz)
        span = self._span
        return iter(self._log.blocks(self._grid.names, seconds=seconds, start_s=span.start_s, end_s=span.end_s))


def watched_grids(
    log: Log, channels: Sequence[str] | None, span: Span, *, progress: Progress = no_progress
) -> Iterator[Watched]:
    """Give the log's channels, one stream of blocks for each sampling grid."""
    if span.share is not None:
        yield from span.share.grids(log, channels, span)
        return
    if is_small(log):
        # Long pauses take memory, which blocks do without.
        with suppress(MostlyEmptyError):
            for series in log.read_groups(channels, start_s=span.start_s, end_s=span.end_s):
                names = tuple(channel.name for channel in series.channels)
                yield Watched(names, (series,), duration_s=series.duration_s, progress=progress)
            return
    for grid in log.grids(channels, start_s=span.start_s, end_s=span.end_s):
        yield Watched(grid.names, _Blocks(log, grid, span), duration_s=grid.duration_s, progress=progress)


def on_one_grid(log: Log, names: Sequence[str], span: Span, *, progress: Progress = no_progress) -> Watched:
    """Give named channels on the sampling grid that they share, or joined on one, with a note of how.

    Raises
    ------
    LogError
        When they don't share a grid and the log is too large to join in memory; the grids and remedies are named.
    """
    for grid in watched_grids(log, names, span, progress=progress):
        if set(names) <= set(grid.names):
            return grid
    series, notes = joined(log, names, span)
    return Watched(names, (series,), duration_s=series.duration_s, progress=progress, notes=notes)


def joined(log: Log, names: Sequence[str], span: Span, *, exact: bool = False) -> tuple[TimeSeries, tuple[str, ...]]:
    """Read named channels in memory, and join them where they have several sampling grids; a note says how.

    Raises
    ------
    LogError
        When the log is too large for that; with `exact`, when samples had to be computed and nobody asked for it.
    """
    if not is_small(log):
        return log.read(names, start_s=span.start_s, end_s=span.end_s), ()
    groups = log.read_groups(names, start_s=span.start_s, end_s=span.end_s)
    if len(groups) == 1:
        return groups[0], ()
    found = join_resampled(groups, method=span.join)
    if exact and span.join == "auto" and isfinite(found.attenuation_db):
        told = [(one.channels, one.sample_rate_hz, one.start_time_ns) for one in groups]
        raise LogError(
            f"{several_grids(log.path.name, told)}; or --join band-limited, whose error near half the lowest rate a "
            "diagnosis takes for one of the model"
        )
    note = join_note(groups, found)
    return found.series.select(list(names)), (
        f"{len(groups)} sampling grids joined: {note}; --join chooses another way",
    )
