"""Averages whole periods of a repeating excitation: mean, and scatter from period to period."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Generic

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from chladni.signals.arrays import Complex, Real
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import largest_magnitudes, require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.spectral.accumulator import (
    line_frequencies_hz,
    one_sided_weights,
    require_finite,
)
from chladni.spectral.blocks import Source, leading_part
from chladni.spectral.period import LARGEST_RESIDUAL, Period, find_period
from chladni.spectral.products import PAIRS, POWERS, Products, SpectraT
from chladni.spectral.stretches import valid_runs

__all__ = ["Period", "find_period", "periodic_auto_spectra", "periodic_cross_spectra"]


def periodic_cross_spectra(source: Source, period: Period) -> CrossSpectra:
    """Average the cross-spectra of whole periods, without window.

    Each period is one segment, freed of its mean; nothing leaks, and lines between those of the excitation hold noise
    only. Periods that touch an invalid sample, or in which the excitation doesn't repeat, are skipped and counted.

    Parameters
    ----------
    source
        A series, or consecutive blocks of one, beginning where the series began in which the period was found.
    period
        From `find_period`.

    Returns
    -------
    CrossSpectra
        ``density`` is the mean over M periods of conj(X_i) X_j, so that Parseval holds; ``noise_density`` the
        covariance of one period about the mean period, divided by M - 1. What repeats is
        ``density - noise_density (M - 1)/M`` (Pintelon & Schoukens 2012, chapter 2).

    Raises
    ------
    EstimateError
        When the period is no whole number of samples, fewer than two whole periods are there, or values are too large
        or too small to be squared.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> one = np.random.default_rng(1).standard_normal(500)
    >>> series = TimeSeries(values=np.tile(one, 6)[np.newaxis], sample_rate_hz=1e3, channels=(Channel(name="x"),))
    >>> spectra = periodic_cross_spectra(series, find_period(series, channel="x"))
    >>> float(spectra.frequency_hz[1]), spectra.provenance.averages
    (2.0, 6)
    """
    return _average(source, period, PAIRS)


def periodic_auto_spectra(source: Source, period: Period) -> AutoSpectra:
    """Average each channel's auto-spectrum alone; see `periodic_cross_spectra`."""
    return _average(source, period, POWERS)


def _average(source: Source, period: Period, products: Products[SpectraT]) -> SpectraT:
    if not period.whole:
        raise EstimateError(
            f"the period {period.period_s:.9g} s of {period.channel} drifts by {period.drift_samples:.2g} samples "
            "over the record; average with a window, or resample so that it is a whole number of samples"
        )
    (first, *_), blocks = leading_part(source, 1)
    products.require_fitting(len(first.channels), period.samples)
    scatter = _PeriodScatter(products, row=first.index(period.channel), largest=np.zeros(len(first.channels)))
    # A period at a time: memory holds one, and the matrix, however long the log is.
    for cut in _periods(iter(blocks), period):
        scatter.add(cut)
    if scatter.count < 2:
        raise EstimateError(
            f"{scatter.count} whole periods of {period.period_s:g} s repeat; their scatter needs two, so take a "
            "longer record or average with a window"
        )
    require_in_range(first.channels, scatter.largest)
    return _spectra(first, period, scatter)


@dataclass(slots=True)
class _PeriodScatter(Generic[SpectraT]):
    """Running mean of period spectra ``[channel, frequency]`` and sum of products about it (Welford 1962)."""

    products: Products[SpectraT]
    _: KW_ONLY
    row: int
    largest: Real
    count: int = 0
    skipped: int = 0
    mean: Complex = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))
    total: NDArray[Any] = field(default_factory=lambda: np.zeros(0))

    def add(self, period: Real | None) -> None:
        if period is None:
            self.skipped += 1
            return
        self.largest = np.maximum(self.largest, largest_magnitudes(period))
        spectra = fft.rfft(period - period.mean(axis=-1, keepdims=True), axis=-1)
        if self.count == 0:
            self.mean = np.zeros_like(spectra)
            self.total = self.products.zeros(*spectra.shape)
        elif self._differs(spectra[self.row]):
            self.skipped += 1
            return
        self.count += 1
        # Deviations from the running mean, before and after it moves: no difference of large sums loses the scatter.
        before = spectra - self.mean
        self.mean += before / self.count
        self.products.add(self.total, before, spectra - self.mean)

    def _differs(self, excitation: Complex) -> bool:
        # Twice the limit of the search: the first mean is a single period, with noise of its own.
        residual = np.sum(np.abs(excitation[1:] - self.mean[self.row, 1:]) ** 2)
        return bool(residual > 2 * LARGEST_RESIDUAL * np.sum(np.abs(self.mean[self.row, 1:]) ** 2))


def _spectra(first: TimeSeries, period: Period, scatter: _PeriodScatter[SpectraT]) -> SpectraT:
    samples, rate, count = period.samples, first.sample_rate_hz, scatter.count
    scale = one_sided_weights(samples) / (rate * samples)
    products, noise_density = scatter.products, scatter.total
    noise_density *= scale
    # The mean of products is the product of means and the scatter about them. Times inverses, as NumPy divides
    # complex numbers: so the powers are those of the matrix to rounding.
    density = products.zeros(*scatter.mean.shape)
    products.add(density, scatter.mean, scatter.mean)
    density *= scale
    density += noise_density * (1 / count)
    noise_density *= 1 / (count - 1)
    products.make_hermitian(density)
    products.make_hermitian(noise_density)
    return products.spectra(
        frequency_hz=line_frequencies_hz(samples, rate),
        density=density,
        channels=first.channels,
        bandwidth_hz=rate / samples,
        noise_density=noise_density,
        provenance=Provenance(
            window="boxcar",
            segment_s=samples / rate,
            averages=count,
            effective_averages=float(count),
            averaging="periodic",
            detrend="constant",
            skipped=scatter.skipped,
            notes=_notes(period, scatter),
        ),
    )


def _notes(period: Period, scatter: _PeriodScatter[SpectraT]) -> tuple[str, ...]:
    transient = f", {period.dropped} transient left out" if period.dropped else ""
    repeats = f"{period.channel} repeats every {period.period_s:.6g} s"
    notes = [f"{repeats}: {scatter.count} whole periods averaged without window{transient}"]
    if scatter.skipped:
        notes.append(
            f"{scatter.skipped} periods skipped: samples are missing, or the excitation doesn't repeat there"
        )
    return tuple(notes)


def _periods(blocks: Iterator[TimeSeries], period: Period) -> Iterator[Real | None]:
    """Cut a stream into periods; None stands for one with missing samples.

    The grid of periods is counted in time from the first block on: the source of the excitation goes on while the
    recorder has a gap.
    """
    start_ns: int | None = None
    held: NDArray[np.floating] = np.empty((0, 0))
    good = np.empty(0, dtype=bool)
    position = 0
    for block in blocks:
        require_finite(block, valid_runs(block))
        start_ns = block.start_time_ns if start_ns is None else start_ns
        begins = round((block.start_time_ns - start_ns) * block.sample_rate_hz / NS_PER_S)
        if position + good.size != begins:
            _require_later(begins - position - good.size, block)
            # The period that the break cuts is lost, and counted.
            if good.size:
                yield None
            held, good, position = held[:, :0], good[:0], begins
        fresh = np.ones(block.samples, dtype=bool) if block.valid is None else block.valid.all(axis=0)
        held = np.concatenate([held, block.values], axis=1) if good.size else block.values
        good = np.concatenate([good, fresh])
        wait = _samples_to_start(position, period)
        while good.size >= wait + period.samples:
            cut = slice(wait, wait + period.samples)
            yield np.asarray(held[:, cut], dtype=np.float64) if good[cut].all() else None
            held, good, position = held[:, cut.stop :], good[cut.stop :], position + cut.stop
            wait = 0


def _samples_to_start(position: int, period: Period) -> int:
    ahead = period.first_sample - position
    return ahead if ahead >= 0 else ahead % period.samples


def _require_later(gap: int, block: TimeSeries) -> None:
    if gap < 0:
        raise EstimateError(
            f"a block starts {-gap / block.sample_rate_hz:g} s before the last one ended; give blocks in time order, "
            "none twice (TimeSeries.window keeps the time of a part)"
        )
