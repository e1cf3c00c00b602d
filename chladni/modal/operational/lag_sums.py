"""Sums of products of samples at all lags, gathered on spectral lines."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from chladni.modal.operational.anti_alias import power_transfer, reach
from chladni.signals.arrays import Complex, Real, Whole

# A transform so many times as long as the lags wastes little of it on the overlap.
SPANS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class LagPlan:
    """How products are summed unit by unit, in samples.

    Attributes
    ----------
    lags
        Longest lag, in steps of `decimation` samples.
    decimation
        Samples for one step of the lag.
    hop
        Samples of a unit; each is multiplied with the `lags` that follow it.
    """

    lags: int
    decimation: int
    hop: int

    @property
    def margin(self) -> int:
        """Samples before and after that the filter needs."""
        return reach(self.decimation)

    @property
    def halo(self) -> int:
        """Samples that a unit needs beside its own."""
        return self.lags * self.decimation + 2 * self.margin

    @property
    def steps(self) -> int:
        """Lags that a transform gives: at least those of a unit with its halo."""
        return int(next_fast_len(-(-(self.hop + self.halo) // self.decimation), real=True))

    @property
    def transform(self) -> int:
        """Length of the transform in samples."""
        return self.steps * self.decimation


def plan_lags(lags: int, decimation: int, *, blocks: int, samples: int | None) -> LagPlan:
    """Choose units that are efficient, and short enough for as many blocks as are wanted."""
    halo = LagPlan(lags=lags, decimation=decimation, hop=1).halo
    hop = (SPANS - 1) * halo
    if samples is not None:
        # Not shorter than half the halo: then most of the work would be overlap, and blocks would hang together.
        hop = min(hop, max((samples - halo) // blocks, halo // 2))
    return LagPlan(lags=lags, decimation=decimation, hop=max(hop, 1))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LagSums:
    """Sums over part of a record.

    Attributes
    ----------
    products
        ``[lag, channel, reference + 1]`` sums of y(k+i) y_ref(k); the last column is the sum of y(k+i) alone.
    early
        ``[reference]`` sum of y_ref(k).
    squares, late
        ``[channel]`` sums of y^2 and y, after the filter, scaled to `count` samples.
    count
        Samples k that were summed over, the same for every lag.
    """

    products: Real
    early: Real
    squares: Real
    late: Real
    count: int

    def joined(self, other: Self) -> Self:
        """Sums over both parts."""
        return type(self)(
            products=self.products + other.products,
            early=self.early + other.early,
            squares=self.squares + other.squares,
            late=self.late + other.late,
            count=self.count + other.count,
        )

    def covariance(self) -> Real:
        """``[lag, channel, reference]`` mean product less the product of the means."""
        mean = self.products / self.count
        return mean[..., :-1] - mean[..., -1:] * (self.early / self.count)

    def variance(self) -> Real:
        """``[channel]`` variance of the filtered samples about their mean."""
        spread: Real = np.maximum(self.squares / self.count - (self.late / self.count) ** 2, 0.0)
        return spread


class SpectralSums:
    """Sums of one block while it is open, by zero-padded transforms (Rader 1970; Stockham 1966)."""

    def __init__(self, plan: LagPlan, channels: int, references: Whole) -> None:
        self.plan, self.references = plan, references
        self.units = 0
        self.count = 0
        self._lines = plan.steps // 2 + 1
        self._spectrum = np.zeros((self._lines, channels, references.size + 1), dtype=np.complex128)
        self._power = np.zeros((self._lines, channels))
        self._late = np.zeros(channels)
        self._early = np.zeros(references.size)

    def add(self, late: Real, samples: int) -> None:
        """Add units, ``[channel, unit, sample]`` with their halo; `samples` of each are multiplied with followers."""
        plan, units, width = self.plan, late.shape[1], late.shape[2]
        early = late[self.references, :, plan.margin : plan.margin + samples]
        early = np.concatenate([early, np.ones((1, units, samples))])
        late_lines, early_lines = self._on_lines(late), self._on_lines(early)
        # New arrays, so that a copy of the sums stays as it was.
        self._spectrum = self._spectrum + late_lines @ early_lines.conj().transpose(0, 2, 1)
        self._power = self._power + (np.abs(late_lines) ** 2).sum(axis=2) * (samples / width)
        self._late = self._late + late.sum(axis=(1, 2)) * (samples / width)
        self._early = self._early + early[:-1].sum(axis=(1, 2))
        self.units += units
        self.count += units * samples

    def in_lags(self) -> LagSums:
        """Sums at each lag, filtered when decimated."""
        plan, passed = self.plan, power_transfer(self._lines, self.plan.decimation)
        # Fewer lines than the samples had give every `decimation`-th lag, `decimation` times as high.
        products = irfft(self._spectrum * passed[:, None, None], plan.steps, axis=0) / plan.decimation
        first = plan.margin // plan.decimation
        # Every line but the first stands for its negative frequency too.
        weights = np.where(np.arange(self._lines) == 0, 1.0, 2.0) * passed / plan.transform
        return LagSums(
            products=products[first : first + plan.lags + 1],
            early=self._early,
            squares=weights @ self._power,
            late=self._late,
            count=self.count,
        )

    def _on_lines(self, values: Real) -> Complex:
        """``[line, channel, unit]`` transforms, up to the half of the decimated rate."""
        transformed = rfft(values, self.plan.transform, axis=-1)[..., : self._lines]
        return np.ascontiguousarray(transformed.transpose(2, 0, 1))
