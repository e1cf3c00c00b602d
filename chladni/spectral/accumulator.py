"""Averages spectra from consecutive blocks, of all channel pairs or of each alone, and merges with its kind."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from math import exp, isclose
from typing import Any, ClassVar, Generic, Literal, Self

import numpy as np
from numpy.typing import NDArray

from chladni.io.log_info import some_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, find_channel
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.number_range import LARGEST, largest_magnitudes, require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted, rounded_up
from chladni.spectral.averaging import require_shapes
from chladni.spectral.blocks import Margins, Numbers, Own
from chladni.spectral.effective_averages import EffectiveAverages
from chladni.spectral.held_samples import HeldSamples
from chladni.spectral.products import PAIRS, POWERS, Products, SpectraT
from chladni.spectral.segment_spectra import segment_spectra
from chladni.spectral.segmentation import SHORTEST_SEGMENT, Segmentation
from chladni.spectral.stretches import Stretch, valid_runs
from chladni.spectral.windows import noise_bandwidth_bins, window_name, window_samples

SegmentAveraging = Literal["linear", "exponential", "peak-hold"]
AVERAGINGS = ("linear", "exponential", "peak-hold")

# Segments of one matrix product: enough to make BLAS worth calling, and spectra of at most so many bytes.
MOST_SEGMENTS_TOGETHER = 128
BYTES_TOGETHER = 20 << 20
# More threads than this wait for memory.
MOST_THREADS = 8


class SpectraAccumulator(Generic[SpectraT]):
    """Abstract running average of spectra; mutable, the result is a frozen value.

    Blocks of one stretch of time may have any lengths: the end of each is kept until the next arrives, so that the
    result doesn't depend on where the blocks were cut. A break in time or an invalid sample in any channel ends a
    stretch: segments that would touch it are left out (and those that invalid samples cost are counted as skipped),
    and segmentation starts anew at the first valid sample after it.

    Parameters
    ----------
    channels
        Channels of every block, in this order.
    sample_rate_hz
        Rate of every block.
    segmentation
        Segments and their window; see `plan_segmentation` for one from seconds and hertz.
    averaging
        ``linear``: all segments count the same. ``exponential``: a segment fades with `time_constant_s`; time without
        data doesn't count. ``peak-hold``: the largest magnitude that any segment had, for each pair and line.
    time_constant_s
        For exponential averaging: after this time a segment's weight has fallen to 1/e.

    Raises
    ------
    SetupError
        When averaging, time constant or window are none there are.
    EstimateError
        When the result would take more than 2 GB.

    Examples
    --------
    >>> series = TimeSeries(values=np.ones((1, 64)), sample_rate_hz=64.0, channels=(Channel(name="a"),))
    >>> plan = Segmentation(samples=16, hop=16, window="boxcar", detrend="none")
    >>> average = CrossSpectraAccumulator(series.channels, 64.0, plan)
    >>> average.update(series)
    >>> average.result().density[0, 0, :2].real
    array([0.25, 0.  ])
    """

    products: ClassVar[Products[Any]]

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        segmentation: Segmentation,
        *,
        averaging: SegmentAveraging = "linear",
        time_constant_s: float | None = None,
    ) -> None:
        self.channels = tuple(channels)
        self.sample_rate_hz = float(sample_rate_hz)
        self.segmentation = segmentation
        self.averaging = averaging
        self.time_constant_s = time_constant_s
        self.products.require_fitting(len(self.channels), segmentation.samples)
        # The window is the first to be made: a wrong name is to be told before any memory is taken.
        self._window = window_samples(segmentation.window, segmentation.samples)
        decay = _decay(averaging, time_constant_s, segmentation.hop / self.sample_rate_hz)
        lines = segmentation.samples // 2 + 1
        self.average = (
            self.products.hold(lines, len(self.channels))
            if averaging == "peak-hold"
            else self.products.sum(lines, len(self.channels), decay)
        )
        self.count = EffectiveAverages(self._window, segmentation.hop, decay)
        self.stretch = Stretch(segmentation)
        # Samples of the unbroken run that later segments still need, and the number its next segment has in the run.
        self._held = HeldSamples()
        self._position = 0
        self._samples = 0
        # A stream may begin or end as quietly as it likes: what counts is the largest of all.
        self.largest = np.zeros(len(self.channels))
        self._company: tuple[SpectraAccumulator[Any], ...] = ()

    def accompany(self, *others: "SpectraAccumulator[Any]") -> None:
        """Let other averages of the same segments go along: each segment is transformed once for all of them.

        From here on this one alone is updated. What it holds back is missing in the others until `average_held`.

        Raises
        ------
        EstimateError
            When they average other channels or other segments.
        """
        for other in others:
            self._require_alike(other, ("channels", "sample_rate_hz", "segmentation"))
            other.stretch, other.largest = self.stretch, self.largest
        self._company = others

    @property
    def averages(self) -> int:
        """Segments averaged so far."""
        return self.count.segments + self.segmentation.count(self._held.samples)

    def update(self, block: TimeSeries) -> None:
        """Take in the next block.

        Raises
        ------
        EstimateError
            When channels or rate differ from those promised, the block starts before the last one ended, or a
            sample that isn't marked invalid isn't finite.
        """
        # All that can be refused is refused before anything is changed: a caller may mend the block and go on.
        self._require_agreement(block)
        runs = valid_runs(block)
        self.largest = np.maximum(self.largest, require_finite(block, runs))
        with _threads() as executor:
            if self.stretch.breaks_at(block.start_time_ns, block.sample_rate_hz):
                self._end_run(executor)
            self.stretch.extend(block, runs)
            for first, last in runs:
                if first > 0:
                    self._end_run(executor)
                self._take(block.values[:, first:last], executor)
            # A block that ends in invalid samples ends the run, even if the next one begins with valid ones.
            if block.samples > (runs[-1][1] if runs else 0):
                self._end_run(executor)
        for other in self._company:
            other.largest = self.largest

    def merge(self, other: Self) -> None:
        """Take in all that another accumulator has seen; `other` stays as it is.

        Its unfinished last segment is left out: "merged = whole" holds when the parts are cut where segments are, and
        each part holds its last segment to the end.

        Raises
        ------
        EstimateError
            When channels, rate, segments or averaging differ, or an exponential average is merged against time order.
        """
        self._require_mergeable(other)
        with _threads() as executor:
            self.average_held(executor)
            flushed = other.flushed(executor)
        # This one's held samples stay: its own stream goes on without a seam.
        self.average.merge(flushed.average)
        self.count.merge(flushed.count)
        self.stretch.merge(flushed.stretch)
        self.largest = np.maximum(self.largest, flushed.largest)

    @property
    def margins(self) -> Margins:
        """Of a part: its last segments reach into the next part."""
        return Margins(hop=self.segmentation.hop, after=self.segmentation.samples - self.segmentation.hop)

    def begin(self, own: Own) -> None:
        """See `chladni.spectral.blocks.Accumulator`."""
        self._samples = own.last

    def numbers(self) -> Numbers:
        """Give the sums of a part; see `chladni.spectral.blocks.Accumulator`.

        Raises
        ------
        EstimateError
            When the average isn't linear.
        """
        with _threads() as executor:
            flushed = self.flushed(executor)
        return {**flushed.average.numbers(), "largest": flushed.largest}

    def add_numbers(self, found: Numbers) -> None:
        """Take in the sums of a part; `EstimateError` when they don't fit."""
        require_shapes(found, {"largest": self.largest.shape})
        self.average.add_numbers(found)
        self.largest = np.maximum(self.largest, found["largest"])

    def settle(self, runs: Sequence[tuple[int, int]]) -> None:
        """Count the segments, and those that were left out, as in the whole record."""
        self.stretch = Stretch(self.segmentation)
        self.stretch.extend_by(self._samples, runs)
        for first, last in runs:
            self.count.add(0, self.segmentation.count(last - first))

    def result(self, *, sample_rate_hz: float | None = None) -> SpectraT:
        """Give the average so far; more blocks may follow.

        Parameters
        ----------
        sample_rate_hz
            True rate, where it's known better than when the first block came; None for that of the blocks. Sums over
            segments don't depend on it.

        Raises
        ------
        EstimateError
            When not a single whole segment of valid samples has come, or a channel's values are too small to be
            squared.
        """
        flushed = self
        if self.segmentation.count(self._held.samples):
            # A copy is finished, not this one: a live display asks often, and batches are to fill as before.
            with _threads() as executor:
                flushed = self.flushed(executor)
        if flushed.count.segments == 0:
            raise EstimateError(self._nothing_averaged())
        require_in_range(self.channels, self.largest)
        samples, rate = self.segmentation.samples, sample_rate_hz or self.sample_rate_hz
        density = flushed.average.mean()
        density *= one_sided_weights(samples) / (rate * np.sum(self._window**2))
        result: SpectraT = self.products.spectra(
            frequency_hz=line_frequencies_hz(samples, rate),
            density=density,
            channels=self.channels,
            bandwidth_hz=noise_bandwidth_bins(self._window) * rate / samples,
            provenance=self._provenance(flushed.count, rate),
        )
        return result

    def _take(self, values: NDArray[np.floating], executor: Executor) -> None:
        # Segments go to the average in batches of a fixed number, counted from the start of the run: so sums are
        # grouped in the same way however the blocks are cut, and the result is the same to the last bit.
        batch = self._segments_together()
        step, length = batch * self.segmentation.hop, self.segmentation.length_of(batch)
        while self._held.samples and self._held.samples + values.shape[1] >= length:
            missing = max(0, length - self._held.samples)
            joined = self._held.joined(values[:, :missing])
            self._average_batch(joined[:, :length], executor)
            # What the next batch needs starts in what was held, or beyond it in the new samples.
            used = step - self._held.samples
            self._held.replace(joined[:, step : joined.shape[1] - missing] if used < 0 else joined[:, :0])
            values = values[:, max(used, 0) :]
        # With nothing held, batches are views into the block: a whole record is averaged without a copy of it.
        if not self._held.samples:
            while values.shape[1] >= length:
                self._average_batch(values[:, :length], executor)
                values = values[:, step:]
        self._held.append(values)

    def _average_batch(self, values: NDArray[np.floating], executor: Executor | None) -> None:
        spectra = segment_spectra(values, self.segmentation, self._window, executor)
        count = self.segmentation.count(values.shape[1])
        for one in (self, *self._company):
            one.average.add(spectra, executor)
            one.count.add(self._position, count)
        self._position += count

    def average_held(self, executor: Executor | None = None) -> None:
        """Average now the whole segments that wait for their batch to fill."""
        count = self.segmentation.count(self._held.samples)
        if count:
            joined = self._held.joined()
            self._average_batch(joined[:, : self.segmentation.length_of(count)], executor)
            self._held.replace(joined[:, count * self.segmentation.hop :])

    def _end_run(self, executor: Executor) -> None:
        self.average_held(executor)
        self._held, self._position = HeldSamples(), 0

    def _segments_together(self) -> int:
        # The number hangs on the shape only, not on the machine: sums are to be the same everywhere.
        bytes_each = 16 * len(self.channels) * (self.segmentation.samples // 2 + 1)
        return min(MOST_SEGMENTS_TOGETHER, max(1, BYTES_TOGETHER // bytes_each))

    def select(self, channels: Sequence[str]) -> Self:
        """Give an independent accumulator of some of the channels, which goes on from here without the others.

        Raises
        ------
        EstimateError
            When there is no such channel.
        """
        rows = np.array([find_channel(self.channels, name) for name in channels])
        twin = type(self).__new__(type(self))
        twin.__dict__.update(
            self.__dict__,
            channels=tuple(self.channels[row] for row in rows),
            average=self.average.select(rows),
            count=self.count.copy(),
            stretch=self.stretch.copy(),
            largest=self.largest[rows],
            _held=self._held.select(rows),
            _company=(),
        )
        return twin

    def flushed(self, executor: Executor | None = None) -> Self:
        """Give an independent copy in which every whole segment has been averaged."""
        twin = type(self).__new__(type(self))
        twin.__dict__.update(
            self.__dict__,
            average=self.average.copy(),
            count=self.count.copy(),
            stretch=self.stretch.copy(),
            _held=self._held.copy(),
            _company=(),
        )
        twin.average_held(executor)
        return twin

    def _provenance(self, count: EffectiveAverages, rate_hz: float) -> Provenance:
        # The largest of many scatters like a single one, not like their mean.
        effective = 1.0 if self.averaging == "peak-hold" else count.value
        return Provenance(
            window=window_name(self.segmentation.window),
            segment_s=self.segmentation.samples / rate_hz,
            overlap=self.segmentation.overlap,
            averages=count.segments,
            effective_averages=effective,
            averaging=self.averaging,
            detrend=self.segmentation.detrend,
            skipped=self.stretch.skipped,
            longest_s=self.stretch.longest_run / rate_hz,
            notes=self._notes(count.segments),
        )

    def _notes(self, averages: int) -> tuple[str, ...]:
        skipped = self.stretch.skipped
        if not skipped:
            return ()
        of = f"{skipped} of {averages + skipped} segments"
        if skipped == 1:
            return (f"{of} is left out: samples are missing in it",)
        return (f"{of} are left out: samples are missing in them",)

    def _nothing_averaged(self) -> str:
        samples, longest = self.segmentation.samples, self.stretch.longest_run
        where = f"valid in all of {len(self.channels)} channels" if len(self.channels) > 1 else "valid"
        remedy = "leave out the channels that have gaps"
        if empty := self.stretch.never_measured(self.channels):
            return f"{some_of(empty)}: not one sample is a number; leave {'it' if len(empty) == 1 else 'them'} out"
        if longest >= SHORTEST_SEGMENT:
            remedy = f"ask for {rounded_up(self.sample_rate_hz / longest)} Hz or coarser, or {remedy}"
        return (
            f"no segment of {samples / self.sample_rate_hz:g} s ({counted(samples, 'sample')}) fits between gaps: "
            f"the longest stretch {where} has {counted(longest, 'sample')}; {remedy}"
        )

    def _require_agreement(self, block: TimeSeries) -> None:
        if block.channels != self.channels:
            raise EstimateError(
                f"the block has channels {_names(block.channels)}, the average {_names(self.channels)}; "
                "give blocks of the same channels in the same order"
            )
        # Rates of blocks of one log differ in the last digits when each was fitted for itself.
        if not isclose(block.sample_rate_hz, self.sample_rate_hz, rel_tol=1e-9):
            raise EstimateError(
                f"the block has {block.sample_rate_hz} samples/s, the average {self.sample_rate_hz}; "
                "resample one of them"
            )

    def _require_mergeable(self, other: Self) -> None:
        self._require_alike(other, ("channels", "sample_rate_hz", "segmentation", "averaging", "time_constant_s"))
        if self.averaging == "exponential":
            self.stretch.require_before(other.stretch)

    def _require_alike(self, other: "SpectraAccumulator[Any]", attributes: Sequence[str]) -> None:
        for what in attributes:
            mine, theirs = getattr(self, what), getattr(other, what)
            if mine != theirs:
                raise EstimateError(f"averages can't be merged: {what} {mine!r} here, {theirs!r} there")


class CrossSpectraAccumulator(SpectraAccumulator[CrossSpectra]):
    """Running average of the cross-spectra of all channel pairs; see `SpectraAccumulator`."""

    products = PAIRS


class AutoSpectraAccumulator(SpectraAccumulator[AutoSpectra]):
    """Running average of each channel's auto-spectrum alone; see `SpectraAccumulator`."""

    products = POWERS


def line_frequencies_hz(samples: int, sample_rate_hz: float) -> Real:
    """Give the frequencies of a real transform's lines, each computed from its number so that no error adds up."""
    return np.asarray(np.arange(samples // 2 + 1) * sample_rate_hz / samples, dtype=np.float64)


def one_sided_weights(samples: int) -> Real:
    """Give ``[frequency]`` 2 where a line has a negative twin; 1 at 0 and at an even length's last line."""
    weights = np.full(samples // 2 + 1, 2.0)
    weights[0] = 1.0
    if samples % 2 == 0:
        weights[-1] = 1.0
    return weights


def _decay(averaging: SegmentAveraging, time_constant_s: float | None, hop_s: float) -> float:
    if averaging not in AVERAGINGS:
        raise SetupError(f"averaging {averaging!r} is none of {', '.join(AVERAGINGS)}")
    if (averaging == "exponential") != (time_constant_s is not None):
        raise SetupError(f"time_constant_s is for exponential averaging and needed there; averaging is {averaging!r}")
    if time_constant_s is None:
        # No fading: one formula serves linear and exponential averages.
        return 1.0
    if not 0 < time_constant_s < float("inf"):
        raise SetupError(f"time constant {time_constant_s} s must be finite and above 0")
    return exp(-hop_s / time_constant_s)


def require_finite(block: TimeSeries, runs: Sequence[tuple[int, int]]) -> Real:
    """Give ``[channel]`` largest magnitudes within the runs.

    Raises
    ------
    EstimateError
        Naming the channel, when one of its samples isn't finite, or too large to be squared. What is too small is
        known at the end of a stream only: see `require_in_range`.
    """
    largest = largest_magnitudes(block.values, runs)
    for row in np.flatnonzero(~np.isfinite(largest)):
        first, bad = next(
            (first, places)
            for first, last in runs
            if (places := np.flatnonzero(~np.isfinite(block.values[row, first:last]))).size
        )
        more = sum(int(np.sum(~np.isfinite(block.values[row, one:end]))) for one, end in runs) - 1
        raise EstimateError(
            f"channel {block.channels[row].name!r} is {block.values[row, first + bad[0]]} at "
            f"{block.times_ns()[first + bad[0]] / NS_PER_S:.6f} s and {more} more times without "
            "being marked invalid; mark such samples in `valid`"
        )
    require_in_range(block.channels, np.where(largest > LARGEST, largest, 0.0))
    return largest


def _names(channels: Sequence[Channel]) -> str:
    return ", ".join(f"{channel.name} [{channel.unit}]" for channel in channels)


@contextmanager
def _threads() -> Iterator[Executor]:
    # A pool a call and not a pool an object: an accumulator can be pickled and sent to other machines.
    workers = min(
        MOST_THREADS, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    with ThreadPoolExecutor(workers) as executor:
        yield executor
