"""Levels of a series or a stream of blocks: RMS, peak, crest factor, skewness and kurtosis, over all and running."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.missing_samples import MissingSamples
from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError
from chladni.signals.levels import Levels, RunningLevels
from chladni.signals.number_range import LARGEST, require_in_range
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.spectral.accumulator import require_finite
from chladni.spectral.averaging import require_shapes
from chladni.spectral.band_filter import BandFilter, SharedTransforms
from chladni.spectral.blocks import Margins, Numbers, Own, leading_part, sum_up
from chladni.spectral.statistics import Moments, stacked
from chladni.spectral.stretches import valid_runs

# Time constant "fast" of sound and vibration level meters (IEC 61672-1:2013, section 5.8).
FAST_S = 0.125
# Below it a window tells no kurtosis: its scatter, sqrt(24 / n), is then above 0.6 for Gaussian noise.
LEAST_SAMPLES = 64
# More windows than this a picture has no room for; two neighbours then become one.
MOST_WINDOWS = 1024
# Windows that are entered together.
WINDOWS_TOGETHER = 64
# Of the record, to tell the scatter of its RMS.
BATCHES = 32
WINDOW_NUMBERS = ("samples", "number", "moments")


def levels(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    bands_hz: Sequence[tuple[float, float]] | None = None,
    running_s: float | None = None,
    integrations: int = 0,
) -> Levels:
    """Measure levels: RMS, peak, peak-to-peak, crest factor, skewness and kurtosis.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, an array ``[channel, sample]``, or
        consecutive blocks of a series.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    bands_hz
        Edges of bands; None for all that was sampled, without a filter. See `BandFilter` for what passes.
    running_s
        Length of the windows of running levels; None for 0.125 s, or 64 samples where that is longer. Neighbours are
        joined two by two until at most 1024 windows are left.
    integrations
        How often motions are integrated first: 1 gives levels of velocity from acceleration. Needs bands above 0 Hz.

    Returns
    -------
    Levels
        ``[channel, band]``. Without bands each channel counts all its valid samples; a band takes those that are
        valid in all channels, less the filter's reach at the ends of each run.

    Raises
    ------
    EstimateError
        When there is no sample, a band isn't inside the spectrum, or no run is long enough for its filter.
    SetupError
        When a unit has no integral.

    Notes
    -----
    Moments are merged exactly over windows and blocks (Pébay 2008, Sandia report SAND2008-6212, eq. 2.1 to 2.9). One
    sigma of the RMS comes from the scatter of the mean squares of up to 32 parts of the record.

    Examples
    --------
    >>> t = np.arange(8000) / 1000
    >>> sine = 3.0 + 2.0 * np.sin(2 * np.pi * 25 * t)
    >>> found = levels(sine, sample_rate_hz=1000.0)
    >>> [float(one[0, 0].round(6)) for one in (found.mean, found.rms, found.peak, found.kurtosis)]
    [3.0, 1.414214, 2.0, 1.5]
    """
    source = blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    missing = MissingSamples()
    lead, blocks = leading_part(missing.watch(source), 1)
    first = lead[0]
    accumulator = LevelsAccumulator(
        first.channels, first.sample_rate_hz, bands_hz=bands_hz, running_s=running_s, integrations=integrations
    )
    sum_up(blocks, accumulator)
    found = accumulator.result()
    return replace(found, notes=(*found.notes, *missing.sentences(from_ns=first.start_time_ns)))


class LevelsAccumulator:
    """Running measure of levels, see `levels`; mutable, the result is a frozen value."""

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        *,
        bands_hz: Sequence[tuple[float, float]] | None = None,
        running_s: float | None = None,
        integrations: int = 0,
        transforms: SharedTransforms | None = None,
    ) -> None:
        if bands_hz is None and integrations:
            raise EstimateError("integration needs a band that begins above 0 Hz; below it a drift has no end")
        if bands_hz is not None and not bands_hz:
            raise EstimateError("no band is given; name one, or leave bands out for all that was sampled")
        if running_s is not None and not LEAST_SAMPLES / sample_rate_hz <= running_s < float("inf"):
            raise EstimateError(
                f"windows of {running_s:g} s are too short or no length; {LEAST_SAMPLES} samples, "
                f"{LEAST_SAMPLES / sample_rate_hz:.3g} s, are the least"
            )
        self.channels = tuple(channels)
        self.sample_rate_hz = sample_rate_hz
        self._filters = [
            BandFilter(sample_rate_hz, band, integrations=integrations, transforms=transforms)
            for band in bands_hz or ()
        ]
        window = max(LEAST_SAMPLES, round((running_s or FAST_S) * sample_rate_hz))
        self._windows = [_Windows(len(self.channels), window) for _ in range(max(1, len(self._filters)))]
        self._start_ns: int | None = None
        self._put_together = False
        self._passed = self.channels
        # Of a part of a record; None for all of it.
        self._own: Own | None = None

    @property
    def margins(self) -> Margins:
        """Of a part: as far as the filters reach."""
        reach = max((one.reach for one in self._filters), default=0)
        return Margins(before=reach, after=reach)

    def begin(self, own: Own) -> None:
        """See `chladni.spectral.blocks.Accumulator`."""
        self._start_ns, self._own = own.start_time_ns, own

    def numbers(self) -> Numbers:
        """See `chladni.spectral.blocks.Accumulator`."""
        for filter_, windows in zip(self._filters, self._windows, strict=False):
            for passed in filter_.rest_of_part():
                self._add(windows, passed)
        found = ((place, *named) for place, windows in enumerate(self._windows) for named in windows.numbers())
        return {f"{place}/{name}": one for place, name, one in found}

    def add_numbers(self, found: Numbers) -> None:
        """See `chladni.spectral.blocks.Accumulator`; `EstimateError` when they don't fit."""
        for place, windows in enumerate(self._windows):
            windows.add_numbers({name: found.get(f"{place}/{name}", np.empty(0)) for name in WINDOW_NUMBERS})
        self._put_together = True

    def settle(self, runs: Sequence[tuple[int, int]]) -> None:
        """See `chladni.spectral.blocks.Accumulator`; `EstimateError` when no run was long enough for a filter."""
        for filter_, windows in zip(self._filters, self._windows, strict=False):
            if not windows.number.size:
                filter_.require_long(max((last - first for first, last in runs), default=0))
            self._passed = filter_.passed(self.channels)

    def update(self, block: TimeSeries) -> None:
        """Take in the next block; `EstimateError` when it has other channels, or starts before the last one ended."""
        if block.channels != self.channels or block.sample_rate_hz != self.sample_rate_hz:
            raise EstimateError("blocks of a measure of levels need the same channels and rate; resample them first")
        self._start_ns = block.start_time_ns if self._start_ns is None else self._start_ns
        for filter_, windows in zip(self._filters, self._windows, strict=False):
            for passed in filter_.feed(block):
                self._add(windows, passed)
        if not self._filters:
            # A channel counts its own samples, so that those of others don't excuse it.
            measured = True if block.valid is None else block.valid
            for row in np.flatnonzero((~(np.abs(block.values) <= np.float64(LARGEST)) & measured).any(axis=1)):
                alone = block.select([block.channels[row].name])
                require_finite(alone, valid_runs(alone))
            self._add(self._windows[0], block)

    def result(self) -> Levels:
        """Give the levels; no more blocks may follow."""
        for filter_, windows in zip(self._filters, self._windows, strict=False):
            for passed in () if self._put_together else filter_.rest():
                self._add(windows, passed)
        for windows in self._windows:
            windows.join()
        if not any(windows.moments.samples.any() for windows in self._windows):
            raise EstimateError("no sample is a number (all are marked invalid); leave the channels out")
        samples = max(windows.samples for windows in self._windows)
        for windows in self._windows:
            windows.coarsen(samples)
        whole = stacked([windows.whole() for windows in self._windows])
        require_in_range(self.channels, whole.largest[..., 0].max(axis=1))
        one = Moments._make(array[..., 0] for array in whole)
        return Levels(
            channels=self._passed,
            bands_hz=self._bands_hz(),
            samples=one.samples.astype(np.int64),
            mean=np.where(one.samples > 0, one.mean, np.nan),
            rms=one.rms,
            rms_std=np.stack([windows.rms_std() for windows in self._windows], axis=1),
            peak=one.peak,
            peak_to_peak=np.where(one.samples > 0, one.high - one.low, np.nan),
            crest_factor=one.crest_factor,
            skewness=one.skewness,
            kurtosis=one.kurtosis,
            running=self._running(samples),
            notes=tuple(map(_edge_note, self._filters)),
        )

    def _add(self, windows: "_Windows", series: TimeSeries) -> None:
        start_s = (series.start_time_ns - (self._start_ns or 0)) / NS_PER_S
        first = round(start_s * self.sample_rate_hz)
        if self._own is not None:
            low, high = (min(max(one - first, 0), series.samples) for one in (self._own.first, self._own.last))
            series, first = series.samples_between(low, high), first + low
        windows.add(series, first)
        self._passed = series.channels

    def _bands_hz(self) -> tuple[tuple[float, float], ...]:
        return tuple(one.band_hz for one in self._filters) or ((0.0, self.sample_rate_hz / 2),)

    def _running(self, samples: int) -> RunningLevels:
        numbers = np.unique(np.concatenate([windows.number for windows in self._windows]))
        moments = stacked([windows.at(numbers) for windows in self._windows])
        return RunningLevels(
            window_s=samples / self.sample_rate_hz,
            time_s=(numbers + 0.5) * samples / self.sample_rate_hz,
            rms=moments.rms,
            peak=moments.peak,
            kurtosis=moments.kurtosis,
            channels=self._passed,
            bands_hz=self._bands_hz(),
            start_time_ns=self._start_ns or 0,
        )


def _edge_note(one: BandFilter) -> str:
    return (
        f"band {one.band_hz[0]:g} to {one.band_hz[1]:g} Hz: the first and last {one.reach_s:.3g} s of each unbroken "
        "run are not judged. The filter leans on what is outside"
    )


class _Windows:
    """Moments of consecutive windows of a stream; neighbours are joined when there are too many."""

    def __init__(self, channels: int, samples: int) -> None:
        self.samples = samples
        self.number: Whole = np.empty(0, dtype=np.int64)
        self.moments = Moments._make(np.empty((len(Moments._fields), channels, 0)))
        # Since the last join: a join copies all windows, and short blocks are many.
        self._fresh: list[tuple[Whole, Moments]] = []

    def add(self, series: TimeSeries, first: int) -> None:
        """Take samples in, the first of which is number `first` of the stream."""
        if not series.samples:
            return
        number = np.arange(first // self.samples, (first + series.samples - 1) // self.samples + 1)
        starts = np.maximum(number * self.samples - first, 0)
        self._fresh.append((number, Moments.of(series.values.astype(np.float64, copy=False), series.valid, starts)))
        if sum(number.size for number, _ in self._fresh) >= WINDOWS_TOGETHER:
            self.join()

    def join(self) -> None:
        """Enter what came since the last join."""
        numbers, fresh = zip((self.number, self.moments), *self._fresh, strict=True)
        self._fresh = []
        self.moments = Moments.joined(fresh, lambda arrays: np.concatenate(arrays, axis=-1))
        self.number = np.concatenate(numbers)
        self.coarsen(self.samples)
        while self.number.size > MOST_WINDOWS:
            self.coarsen(2 * self.samples)

    def numbers(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """Give what stands in the windows, for another's `add_numbers`."""
        self.join()
        yield from zip(WINDOW_NUMBERS, (np.array([self.samples]), self.number, np.stack(self.moments)), strict=True)

    def add_numbers(self, found: Numbers) -> None:
        """Add later windows, or those of which samples are in the last ones here, too."""
        samples, number, moments = (found[name] for name in WINDOW_NUMBERS)
        whole = samples.shape == (1,) and samples.dtype == number.dtype == np.int64 and number.ndim == 1
        require_shapes({"moments": moments}, {"moments": (*np.stack(self.moments).shape[:2], number.size)})
        size = int(samples[0]) if whole else 0
        if not whole or (size % self.samples and self.samples % size) or not np.all(np.diff(number) > 0):
            raise EstimateError("sums of a part don't fit: they have other windows; do the log anew")
        other = _Windows(moments.shape[1], size)
        other.number, other.moments = number, Moments._make(moments)
        for one in (self, other):
            one.coarsen(max(self.samples, size))
        self._fresh.append((other.number, other.moments))
        self.join()

    def coarsen(self, samples: int) -> None:
        """Join windows to those of so many samples, a multiple of what they have."""
        number = self.number * self.samples // samples
        starts = np.flatnonzero(np.diff(number, prepend=-1))
        if starts.size < number.size:
            self.moments, number = self.moments.grouped(starts), number[starts]
        self.number, self.samples = number, samples

    def whole(self) -> "Moments":
        """Give the moments of all windows together, as one."""
        return self.moments.grouped(np.zeros(1, dtype=np.intp))

    def at(self, numbers: Whole) -> "Moments":
        """Give windows of these numbers; those that hold no sample are empty."""
        place = np.minimum(np.searchsorted(self.number, numbers), self.number.size - 1)
        there = self.number[place] == numbers
        return Moments._make(np.where(there, array[..., place], 0.0) for array in self.moments)

    def rms_std(self) -> Real:
        """Give ``[channel]`` one sigma of the RMS, by the scatter of the mean squares of parts of the record."""
        edges = np.linspace(0, self.number.size, min(self.number.size, BATCHES) + 1).astype(np.intp)
        parts, whole = self.moments.grouped(edges[:-1]), self.whole()
        known = parts.samples > 0
        power = (parts.squares / np.maximum(parts.samples, 1)) + (parts.mean - whole.mean) ** 2
        weight = parts.samples / np.maximum(whole.samples, 1)
        apart = np.where(known, weight * (power - whole.rms**2), 0.0)
        number = known.sum(axis=-1)
        variance = (apart**2).sum(axis=-1) * number / np.maximum(number - 1, 1)
        # d sqrt(P) = dP / (2 sqrt(P)).
        std = np.sqrt(variance) / (2 * np.maximum(whole.rms[:, 0], np.finfo(np.float64).tiny))
        return np.asarray(np.where(number > 1, std, np.inf), dtype=np.float64)
