"""Statistics of samples: RMS, peak, crest factor, skewness and kurtosis, by moments that merge exactly."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Self

import numpy as np

from chladni.signals.arrays import Index, Mask, Real


class Moments(NamedTuple):
    """Count, mean, sums of powers of deviations from the mean, and extremes: ``[..., window]`` each."""

    samples: Real
    mean: Real
    squares: Real
    cubes: Real
    fourths: Real
    low: Real
    high: Real

    @classmethod
    def of(cls, values: Real, valid: Mask | None, starts: Index) -> Self:
        """Take ``[channel, sample]`` in windows that begin at `starts`."""
        lengths = np.diff(starts, append=values.shape[1])
        low = np.minimum.reduceat(_or(values, valid, np.inf), starts, axis=1)
        high = np.maximum.reduceat(_or(values, valid, -np.inf), starts, axis=1)
        if valid is None:
            count = np.broadcast_to(lengths.astype(np.float64), low.shape)
        else:
            count = np.add.reduceat(valid, starts, axis=1, dtype=np.float64)
        mean = np.add.reduceat(_or(values, valid, 0.0), starts, axis=1) / np.maximum(count, 1)
        # The mean of equal numbers may differ from them by their last bit, which is no motion.
        mean = np.where(high > low, mean, np.where(count > 0, low, 0.0))
        apart = _or(values - np.repeat(mean, lengths, axis=1), valid, 0.0)
        squared = apart * apart
        sums = (np.add.reduceat(one, starts, axis=1) for one in (squared, squared * apart, squared * squared))
        return cls._make((count, mean, *sums, low, high))

    @classmethod
    def joined(cls, parts: Sequence[Self], join: Callable[[Sequence[Real]], Real]) -> Self:
        """Join several by joining their arrays."""
        return cls._make(map(join, zip(*parts, strict=True)))

    def grouped(self, starts: Index) -> Self:
        """Merge windows in groups that begin at `starts`."""

        def total(terms: Real) -> Real:
            return np.asarray(np.add.reduceat(terms, starts, axis=-1), dtype=np.float64)

        low, high = np.minimum.reduceat(self.low, starts, axis=-1), np.maximum.reduceat(self.high, starts, axis=-1)
        count = total(self.samples)
        mean = total(self.samples * self.mean) / np.maximum(count, 1)
        mean = np.where(high > low, mean, np.where(count > 0, low, 0.0))
        apart = self.mean - np.repeat(mean, np.diff(starts, append=self.mean.shape[-1]), axis=-1)
        shifted = self.samples * apart**2
        squares = total(self.squares + shifted)
        cubes = total(self.cubes + 3 * apart * self.squares + shifted * apart)
        fourths = total(self.fourths + 4 * apart * self.cubes + 6 * apart**2 * self.squares + shifted * apart**2)
        return type(self)(count, mean, squares, cubes, fourths, low, high)

    @property
    def rms(self) -> Real:
        """Root mean square about the mean; NaN without samples."""
        return np.sqrt(_ratio(self.squares, self.samples))

    @property
    def peak(self) -> Real:
        """Largest magnitude about the mean; NaN without samples."""
        return np.where(self.samples > 0, np.maximum(self.high - self.mean, self.mean - self.low), np.nan)

    @property
    def crest_factor(self) -> Real:
        """Peak over RMS; NaN where nothing moves."""
        return _ratio(self.peak, self.rms)

    @property
    def largest(self) -> Real:
        """Largest magnitude; 0 without samples."""
        return np.where(self.samples > 0, np.maximum(np.abs(self.high), np.abs(self.low)), 0.0)

    @property
    def skewness(self) -> Real:
        """Third moment about the mean over the cube of the RMS; NaN where nothing moves."""
        return _ratio(self.cubes / np.maximum(self.samples, 1), self.rms**3)

    @property
    def kurtosis(self) -> Real:
        """Fourth moment about the mean over the fourth power of the RMS; NaN where nothing moves."""
        return _ratio(self.fourths / np.maximum(self.samples, 1), self.rms**4)


def _or(values: Real, valid: Mask | None, other: float) -> Real:
    """Give the values, another one where they aren't valid."""
    return values if valid is None else np.where(valid, values, other)


def stacked(bands: Sequence[Moments]) -> Moments:
    """``[channel, band, window]`` of the moments of each band."""
    return Moments.joined(bands, lambda arrays: np.stack(arrays, axis=1))


def _ratio(numerator: Real, denominator: Real) -> Real:
    unknown = np.full(numerator.shape, np.nan)
    return np.asarray(np.divide(numerator, denominator, out=unknown, where=denominator > 0), dtype=np.float64)
