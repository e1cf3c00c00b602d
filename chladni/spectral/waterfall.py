"""Spectra over time: the waterfall."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.missing_samples import MissingSamples
from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import LARGEST, require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.waterfall import Waterfall
from chladni.signals.wording import counted
from chladni.spectral.accumulator import line_frequencies_hz, one_sided_weights
from chladni.spectral.blocks import leading_part, samples_known
from chladni.spectral.held_samples import HeldSamples
from chladni.spectral.segment_spectra import segment_spectra
from chladni.spectral.segmentation import SAMPLES_TO_CHOOSE_FROM, Detrend, Segmentation, plan_segmentation
from chladni.spectral.windows import Window, noise_bandwidth_bins, window_name, window_samples

# A waterfall is looked at: more lines than a screen has pixels cost time resolution and show nothing.
DEFAULT_SEGMENT = 2048
# Samples transformed at once; bounds the memory that a long block takes.
PORTION = 1 << 20
# Silence longer than this between two blocks is two measurements.
LONGEST_GAP_SAMPLES = 100_000_000


def waterfall(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    detrend: Detrend = "constant",
    max_slices: int = 512,
) -> Waterfall:
    """Compute spectra over time (STFT).

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
    resolution_hz
        Spacing of the lines; None chooses segments of a power of two, 2048 samples or a 16th of the record at most.
    window, overlap, detrend
        As for `cross_spectra`.
    max_slices
        Most slices to give, at least 2. A longer log is not skipped over: neighbouring segments are averaged in
        groups of 2, 4, 8, ..., which `provenance` tells.

    Returns
    -------
    Waterfall
        ``[channel, time, frequency]`` in unit^2/Hz, in single precision where that holds them: each slice is the
        Welch estimate of its segments. NaN in every slice, and of those channels only, that touches an invalid sample
        or a gap between blocks.

    Raises
    ------
    EstimateError
        When there is no sample, blocks don't fit together, values are too large or too small to be squared, or
        `max_slices` is below 2.
    SetupError
        When an option is out of its range, or the source is shorter than a segment.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(8000)
    >>> waterfall(noise, sample_rate_hz=1000.0, resolution_hz=10.0).values.shape
    (1, 159, 51)
    """
    if max_slices < 2:
        raise EstimateError(f"max_slices is {max_slices}; a waterfall needs at least 2")
    source = blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    missing = MissingSamples()
    lead, blocks = leading_part(missing.watch(source), SAMPLES_TO_CHOOSE_FROM)
    known = samples_known(source, lead, SAMPLES_TO_CHOOSE_FROM)
    plan = _plan(lead[0].sample_rate_hz, known, resolution_hz, window=window, overlap=overlap, detrend=detrend)
    accumulator = WaterfallAccumulator(lead[0].channels, lead[0].sample_rate_hz, plan, max_slices=max_slices)
    for block in blocks:
        accumulator.update(block)
    found = accumulator.result()
    notes = missing.sentences(from_ns=lead[0].start_time_ns)
    return replace(found, provenance=found.provenance.with_notes(*notes))


class WaterfallAccumulator:
    """Running waterfall, see `waterfall`; mutable, the result is a frozen value.

    Parameters
    ----------
    channels, sample_rate_hz
        Of every block.
    segmentation
        Segments and their window.
    max_slices
        As for `waterfall`.
    reserved_slices
        Slices whose memory is taken with the first segments already, so that it stays as it is from then on.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        segmentation: Segmentation,
        *,
        max_slices: int = 512,
        reserved_slices: int = 16,
    ) -> None:
        self.channels = tuple(channels)
        self.sample_rate_hz = sample_rate_hz
        self.segmentation = segmentation
        self._window = window_samples(segmentation.window, segmentation.samples)
        # An even number can always be halved by averaging pairs.
        self._slices = _Slices(max_slices - max_slices % 2, reserved_slices)
        self._start_ns: int | None = None
        self._position = 0
        self._held = HeldSamples()
        self._largest = np.zeros(len(self.channels))

    def update(self, block: TimeSeries) -> None:
        """Take in the next block.

        Raises
        ------
        EstimateError
            When it has other channels or another rate, doesn't follow the one before, or holds values too large to be
            squared.
        """
        for values in self._portions(block):
            # NaN stands for what is missing, and is passed over.
            largest = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
            self._largest = np.fmax(self._largest, largest)
            require_in_range(self.channels, np.where(self._largest > LARGEST, self._largest, 0.0))
            count = self.segmentation.count(self._held.samples + values.shape[1])
            if not count:
                self._held.append(values)
                continue
            held = self._held.joined(values)
            whole = held[:, : self.segmentation.length_of(count)]
            spectra = segment_spectra(whole, self.segmentation, self._window)
            self._slices.add((spectra.real**2 + spectra.imag**2).transpose(1, 2, 0))
            # What the next segment begins with stays; it overlaps the last one done.
            self._held.replace(held[:, count * self.segmentation.hop :])

    def result(self, *, sample_rate_hz: float | None = None) -> Waterfall:
        """Give the waterfall so far; more blocks may follow.

        Parameters
        ----------
        sample_rate_hz
            True rate, where it's known better than when the first block came.

        Raises
        ------
        EstimateError
            When no whole segment has come.
        """
        if not self._slices.count:
            raise EstimateError("not a single segment has come; wait, or take a coarser resolution")
        require_in_range(self.channels, self._largest)
        return self._assembled(sample_rate_hz or self.sample_rate_hz)

    def _portions(self, block: TimeSeries) -> Iterator[Real]:
        """Samples in portions of bounded size, NaN where nothing was measured, gaps between blocks included."""
        size = max(1, PORTION // len(self.channels))
        if block.channels != self.channels or block.sample_rate_hz != self.sample_rate_hz:
            raise EstimateError(
                "blocks of a waterfall need the same channels and rate; resample or select them first"
            )
        if self._start_ns is None:
            self._start_ns = block.start_time_ns
        start = round((block.start_time_ns - self._start_ns) / NS_PER_S * self.sample_rate_hz)
        if not 0 <= start - self._position <= LONGEST_GAP_SAMPLES:
            raise EstimateError(
                f"a block starts {(start - self._position) / self.sample_rate_hz:g} s after the one before ended; "
                "give consecutive blocks, and measurements far apart one by one"
            )
        # A gap is silence of known length: time must go on, or everything after it would be drawn too early.
        for missing in range(self._position, start, size):
            yield np.full((len(self.channels), min(size, start - missing)), np.nan)
        for begin in range(0, block.samples, size):
            yield _marked(block, slice(begin, begin + size))
        self._position = start + block.samples

    def _assembled(self, rate_hz: float) -> Waterfall:
        plan, slices = self.segmentation, self._slices
        scale = one_sided_weights(plan.samples) / (rate_hz * np.sum(self._window**2))
        return Waterfall(
            time_s=(slices.numbers() * plan.hop + plan.samples / 2) / rate_hz,
            frequency_hz=line_frequencies_hz(plan.samples, rate_hz),
            values=slices.scaled(scale),
            channels=self.channels,
            start_time_ns=self._start_ns or 0,
            bandwidth_hz=noise_bandwidth_bins(self._window) * rate_hz / plan.samples,
            provenance=Provenance(
                estimator="PSD over time",
                window=window_name(plan.window),
                segment_s=plan.samples / rate_hz,
                overlap=plan.overlap,
                averages=slices.group,
                effective_averages=float(slices.group),
                detrend=plan.detrend,
                notes=_grouping_note(slices, plan, rate_hz),
            ),
        )


def _plan(rate_hz: float, known: int | None, resolution_hz: float | None, **options: Any) -> Segmentation:
    plan = plan_segmentation(rate_hz, samples_available=known, resolution_hz=resolution_hz, **options)
    # Spectra over time trade lines for moments; a finer grid than the screen's has the worse of both.
    if resolution_hz is None and plan.samples > DEFAULT_SEGMENT:
        coarser_hz = rate_hz / DEFAULT_SEGMENT
        return plan_segmentation(rate_hz, samples_available=known, resolution_hz=coarser_hz, **options)
    return plan


class _Slices:
    """A bounded run of power spectra, which halves itself by averaging neighbours when it's full.

    Parameters
    ----------
    most
        Slices at most, an even number.
    reserved
        Slices whose memory is taken at the first, and written to, so that it doesn't grow up to there.
    """

    def __init__(self, most: int, reserved: int) -> None:
        self.most = most
        self.group = 1
        self.count = 0
        self._reserved = min(reserved, most)
        #: ``[slice, channel, frequency]``, of which so many are whole.
        self._means = np.empty((0, 0, 0))
        self._whole = 0
        # Sum of the segments of the group that is open, and how many they are. The segments themselves would be as
        # many as the log is long.
        self._sum = np.empty((0, 0))
        self._open = 0

    def add(self, segments: Real) -> None:
        """Add powers ``[segment, channel, frequency]``, in order."""
        if not self._means.size:
            self._sum = np.zeros(segments.shape[1:])
            self._means = np.full((self._reserved, *segments.shape[1:]), 0.0)
        for power in segments:
            self.count += 1
            self._open += 1
            self._sum += power
            if self._open == self.group:
                self._close()

    def scaled(self, scale: Real) -> NDArray[np.floating]:
        """Give ``[channel, slice, frequency]`` times a factor ``[frequency]``; last the mean of what is open."""
        _, channels, lines = self._means.shape
        whole = self._means[: self._whole]
        given = np.empty(
            (channels, self._whole + (self._open > 0), lines), _precision(whole, self._sum / max(self._open, 1))
        )
        # Straight to its place: for a live source this comes again and again, and copies would swell its memory.
        np.multiply(whole.transpose(1, 0, 2), scale, out=given[:, : self._whole], casting="same_kind")
        if self._open:
            given[:, self._whole] = self._sum / self._open * scale
        return given

    def numbers(self) -> Real:
        """Give the mean segment number of each slice."""
        first = np.arange(self._whole + (self._open > 0)) * self.group
        last = np.minimum(first + self.group, self.count) - 1
        return np.asarray((first + last) / 2, dtype=np.float64)

    def _close(self) -> None:
        if self._whole == self.most:
            self._whole //= 2
            # A pair is read no later than its mean is written.
            for place in range(self._whole):
                np.add(self._means[2 * place], self._means[2 * place + 1], out=self._means[place])
                self._means[place] /= 2
            # What is open becomes the first half of a group twice as long.
            self.group *= 2
            return
        if self._whole == len(self._means):
            grown = np.empty((min(self.most, 2 * self._whole), *self._sum.shape))
            grown[: self._whole] = self._means
            self._means = grown
        np.divide(self._sum, self._open, out=self._means[self._whole])
        self._whole += 1
        self._sum[:], self._open = 0.0, 0


def _precision(whole: Real, last: Real) -> type[np.float32 | np.float64]:
    """Single precision where it holds the powers of all slices, and those 16 digits below them."""
    single = np.finfo(np.float32)
    largest = np.fmax(np.fmax.reduce(whole, axis=(0, 2), initial=0.0), np.fmax.reduce(last, axis=1, initial=0.0))
    fits = (largest == 0) | ((largest > single.tiny / np.finfo(np.float64).eps) & (largest < single.max))
    return np.float32 if fits.all() else np.float64


def _marked(block: TimeSeries, part: slice) -> Real:
    values = block.values[:, part].astype(np.float64)
    if block.valid is not None:
        values[~block.valid[:, part]] = np.nan
    return values


def _grouping_note(slices: _Slices, plan: Segmentation, rate_hz: float) -> tuple[str, ...]:
    if slices.group == 1:
        return ()
    note = (
        f"each slice of the waterfall is the average of {counted(slices.group, 'segment')} of "
        f"{plan.samples / rate_hz:g} s, "
        f"one every {slices.group * plan.hop / rate_hz:g} s, so that {counted(slices.most, 'slice')} hold the log"
    )
    return (note,)
