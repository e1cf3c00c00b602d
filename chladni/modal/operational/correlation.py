"""Correlation functions between all channels and some references, with their scatter between blocks of a record."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from chladni.modal.operational.lag_sums import LagSums, SpectralSums, plan_lags
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.number_range import require_in_range
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value, require_shape
from chladni.spectral.accumulator import require_finite
from chladni.spectral.blocks import Source, leading_part, samples_known
from chladni.spectral.segmentation import Segmentation
from chladni.spectral.stretches import Stretch, valid_runs

# The scatter of fewer blocks says little: with 50, one sigma is known to a tenth.
BLOCKS = 50
FEWEST_BLOCKS = 10
# Values transformed together: some tens of megabytes.
VALUES_TOGETHER = 1 << 20
# Functions of all blocks together may take so much memory.
MOST_BYTES = 1 << 31
SAMPLES_TO_PLAN_FROM = 1 << 17


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorrelationFunctions(Value):
    """Correlation functions R_i = E[y(k+i) y_ref(k)^T] with their scatter.

    Attributes
    ----------
    values
        ``[lag, channel, reference]`` in the product of the two units, lag 0 first; unbiased.
    deviations
        ``[block, lag, channel, reference]``: scaled deviations of the blocks' own functions from `values`, such that
        the covariance of `values` is the sum over blocks of the products of deviations.
    variance
        ``[channel]`` mean square of each channel about its mean, after the filter.
    sample_rate_hz
        One over the step between two lags.
    channels
        Responses, one for each row.
    references
        ``[reference]`` rows of `channels` that are the columns.
    samples
        Samples of the record whose products were averaged.
    decimation
        Samples of the record for one step of the lag; with more than 1 the functions are those of the anti-alias
        filtered record.
    skipped
        Samples left out, because they were not valid or in a stretch shorter than the lags.
    """

    values: Real
    deviations: Real
    variance: Real
    sample_rate_hz: float
    channels: tuple[Channel, ...]
    references: Whole
    samples: int
    decimation: int = 1
    skipped: int = 0

    def __post_init__(self) -> None:
        expected = (self.values.shape[0], len(self.channels), self.references.size)
        require_shape("values", self.values, expected, "lags x channels x references")
        require_shape("variance", self.variance, expected[1:2], "channels")
        require_shape(
            "deviations", self.deviations, (self.blocks, *expected), "blocks x lags x channels x references"
        )
        self._freeze()

    @property
    def blocks(self) -> int:
        """Blocks whose scatter is known."""
        return int(self.deviations.shape[0])

    @property
    def lags(self) -> int:
        """Longest lag."""
        return int(self.values.shape[0]) - 1

    @property
    def duration_s(self) -> float:
        """Length of what was averaged."""
        return self.samples / (self.sample_rate_hz * self.decimation)

    def select(self, rows: Sequence[int] | Whole) -> Self:
        """Give the functions of these channels only, as rows and, as far as they are among them, as columns."""
        kept = np.asarray(rows, dtype=np.int64)
        columns = np.flatnonzero(np.isin(self.references, kept))
        place = np.full(len(self.channels), -1)
        place[kept] = np.arange(kept.size)
        return type(self)(
            values=self.values[:, kept][:, :, columns],
            deviations=self.deviations[:, :, kept][:, :, :, columns],
            variance=self.variance[kept],
            sample_rate_hz=self.sample_rate_hz,
            channels=tuple(self.channels[row] for row in kept),
            references=place[self.references[columns]],
            samples=self.samples,
            decimation=self.decimation,
            skipped=self.skipped,
        )


class CorrelationAccumulator:
    """Correlation functions of a stream of consecutive blocks, in memory that doesn't grow with the stream.

    Each valid sample of a run is multiplied with those that follow it by up to the longest lag; the last ones of a
    run, which have no such followers, only serve as such. The sums are gathered in blocks, and when there are twice
    as many blocks as needed, neighbours are joined. The mean of each block is removed. No product crosses a break in
    time or a sample that isn't valid.

    Parameters
    ----------
    channels
        Channels of the blocks.
    sample_rate_hz
        Samples a second.
    lags
        Longest lag, in steps of `decimation` samples, at least 1.
    references
        Rows of `channels` to correlate with, at least one; None for all.
    decimation
        Samples for one step of the lag, at least 1.
    blocks
        Blocks for the scatter, at least 2; up to twice as many are kept.
    samples
        Length of the record, or of its beginning, where it's known: it sets the length of a block.

    Raises
    ------
    SetupError
        When a number is out of its range, or the functions of all blocks would take too much memory.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        *,
        lags: int,
        references: Sequence[int] | Whole | None = None,
        decimation: int = 1,
        blocks: int = BLOCKS,
        samples: int | None = None,
    ) -> None:
        self.channels = tuple(channels)
        self.sample_rate_hz = sample_rate_hz
        self.blocks = blocks
        self.references = (
            np.arange(len(self.channels)) if references is None else np.array(references, dtype=np.int64)
        )
        _require_plan(self.channels, self.references, lags, decimation, blocks)
        self.plan = plan_lags(lags, decimation, blocks=blocks, samples=samples)
        self._stretch = Stretch(Segmentation(samples=max(self.plan.hop + self.plan.halo, 4), hop=self.plan.hop))
        self._pending = np.empty((len(self.channels), 0))
        self._open = SpectralSums(self.plan, len(self.channels), self.references)
        self._closed: tuple[LagSums, ...] = ()
        usable = 0 if samples is None else samples - self.plan.halo
        self._units_in_block = max(usable // self.plan.hop // blocks, 1)
        self._offset: Real | None = None
        self._samples = 0
        self._largest = np.zeros(len(self.channels))

    def update(self, block: TimeSeries) -> None:
        """Take the next block of the stream.

        Raises
        ------
        EstimateError
            When it has other channels or another rate, starts before the last one ended, or holds a sample that is
            not finite and not marked as invalid.
        """
        if block.channels != self.channels or block.sample_rate_hz != self.sample_rate_hz:
            raise EstimateError(
                f"a block of {len(block.channels)} channels at {block.sample_rate_hz:g} Hz doesn't continue "
                f"{len(self.channels)} channels at {self.sample_rate_hz:g} Hz; give consecutive blocks of one series"
            )
        runs = valid_runs(block)
        self._largest = np.maximum(self._largest, require_finite(block, runs))
        if self._stretch.breaks_at(block.start_time_ns, block.sample_rate_hz):
            self._end_run()
        self._stretch.extend(block, runs)
        self._samples += block.samples
        cursor = 0
        for first, last in runs:
            if first > cursor:
                self._end_run()
            self._continue_run(block.values[:, first:last])
            cursor = last
        if cursor < block.samples:
            self._end_run()

    def result(self) -> CorrelationFunctions:
        """Functions of all that was taken so far; more may follow.

        Raises
        ------
        EstimateError
            When there are too few samples for the scatter between blocks, or a channel's values are too small to be
            squared.
        """
        require_in_range(self.channels, self._largest)
        parts = self._parts()
        count = np.array([part.count for part in parts], dtype=np.float64)
        if len(parts) < min(FEWEST_BLOCKS, self.blocks):
            raise EstimateError(self._too_short())
        functions = np.stack([part.covariance() for part in parts])
        share = count / count.sum()
        values = np.einsum("b,blcr->lcr", share, functions)
        # The variance of sum(w_b R_b); with equal shares w_b = 1/n it is the usual s^2/n.
        functions -= values
        functions *= (share * np.sqrt(count.size / (count.size - 1)))[:, None, None, None]
        return CorrelationFunctions(
            values=values,
            deviations=functions,
            variance=np.stack([part.variance() for part in parts], axis=1) @ share,
            sample_rate_hz=self.sample_rate_hz / self.plan.decimation,
            channels=self.channels,
            references=self.references,
            samples=int(count.sum()),
            decimation=self.plan.decimation,
            skipped=self._samples - int(count.sum()),
        )

    def _continue_run(self, values: NDArray[np.floating]) -> None:
        if self._offset is None:
            # Sums of what is left after it lose no digits to an offset such as gravity.
            self._offset = values[:, : self.plan.hop].mean(axis=1, keepdims=True, dtype=np.float64)
        centred = values - self._offset
        self._pending = centred if not self._pending.shape[1] else np.concatenate([self._pending, centred], axis=1)
        units = max((self._pending.shape[1] - self.plan.halo) // self.plan.hop, 0)
        together = max(VALUES_TOGETHER // (self.plan.transform * len(self.channels)), 1)
        done = 0
        while done < units:
            # Never past the end of a block: a unit then lies in the same block however the stream is cut.
            some = min(together, self._units_in_block - self._open.units, units - done)
            self._sum(done, some, self.plan.hop)
            done += some
        # A copy, so that the long part that is done with can be freed.
        self._pending = self._pending[:, done * self.plan.hop :].copy()

    def _end_run(self) -> None:
        rest = self._pending.shape[1] - self.plan.halo
        if rest > 0:
            self._sum(0, 1, rest)
        self._pending = self._pending[:, :0]

    def _sum(self, first: int, units: int, samples: int) -> None:
        start, width = first * self.plan.hop, samples + self.plan.halo
        part = self._pending[:, start : start + (units - 1) * self.plan.hop + width]
        self._open.add(sliding_window_view(part, width, axis=1)[:, :: self.plan.hop], samples)
        if self._open.units < self._units_in_block:
            return
        self._closed += (self._open.in_lags(),)
        self._open = SpectralSums(self.plan, len(self.channels), self.references)
        if len(self._closed) >= 2 * self.blocks:
            pairs = zip(self._closed[::2], self._closed[1::2], strict=True)
            self._closed = tuple(one.joined(other) for one, other in pairs)
            self._units_in_block *= 2

    def _parts(self) -> list[LagSums]:
        """Sums of all blocks, the last run taken as ended, without touching what more samples would continue."""
        parts, still_open = list(self._closed), copy(self._open)
        rest = self._pending.shape[1] - self.plan.halo
        if rest > 0:
            still_open.add(self._pending[:, None], rest)
        if still_open.units:
            last = still_open.in_lags()
            # A block much shorter than the others would have a scatter of its own kind.
            parts.append(parts.pop().joined(last) if parts and last.count < parts[-1].count / 2 else last)
        return parts

    def _too_short(self) -> str:
        span = self.plan.lags * self.plan.decimation
        return (
            f"{self._samples} samples ({self._samples / self.sample_rate_hz:g} s) are too few for correlations over "
            f"{span} samples ({span / self.sample_rate_hz:g} s) and their scatter between {FEWEST_BLOCKS} blocks or "
            f"more; about {FEWEST_BLOCKS * self.plan.halo} unbroken ones are needed: take a longer record or fewer "
            "block rows"
        )


def correlation_functions(
    source: Source,
    *,
    lags: int,
    references: Sequence[int] | Whole | None = None,
    decimation: int = 1,
    blocks: int = BLOCKS,
) -> CorrelationFunctions:
    """Correlate all channels with the references, block by block.

    Parameters
    ----------
    source
        A series, or consecutive blocks of one (taken one at a time, so memory doesn't grow with the log).
    lags, references, decimation, blocks
        See `CorrelationAccumulator`.

    Returns
    -------
    CorrelationFunctions
        R_i = 1/N sum over k of y(k+i) y_ref(k)^T less the product of the means, at lags 0 to `lags`.

    Raises
    ------
    EstimateError, SetupError
        See `CorrelationAccumulator`; also when there is no sample.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal((1, 50_000))
    >>> series = TimeSeries(values=noise, sample_rate_hz=100.0, channels=(Channel(name="a", unit="m/s^2"),))
    >>> white = correlation_functions(series, lags=3)
    >>> white.values[:, 0, 0].round(1) + 0.0
    array([1., 0., 0., 0.])
    """
    lead, stream = leading_part(source, SAMPLES_TO_PLAN_FROM)
    known = samples_known(source, lead, SAMPLES_TO_PLAN_FROM)
    accumulator = CorrelationAccumulator(
        lead[0].channels,
        lead[0].sample_rate_hz,
        lags=lags,
        references=references,
        decimation=decimation,
        blocks=blocks,
        samples=SAMPLES_TO_PLAN_FROM if known is None else known,
    )
    for block in stream:
        accumulator.update(block)
    return accumulator.result()


def _require_plan(channels: tuple[Channel, ...], references: Whole, lags: int, decimation: int, blocks: int) -> None:
    for name, number, least in (("lags", lags, 1), ("decimation", decimation, 1), ("blocks", blocks, 2)):
        if number < least:
            raise SetupError(f"{name} {number} must be at least {least}")
    if not references.size or references.min() < 0 or references.max() >= len(channels):
        raise SetupError(
            f"references {references.tolist()} must be rows of the {len(channels)} channels, one or more"
        )
    if np.unique(references).size < references.size:
        raise SetupError(f"references {references.tolist()} must be different rows")
    size = 8 * 2 * blocks * (lags + 1) * len(channels) * references.size
    if size > MOST_BYTES:
        raise SetupError(
            f"correlations of {len(channels)} channels x {references.size} references x {lags} lags x "
            f"{2 * blocks} blocks would take {size / 2**30:.3g} GB; take fewer references or block rows"
        )
