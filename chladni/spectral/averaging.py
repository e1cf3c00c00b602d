"""Sums over segments: linear, exponential in time, and peak hold."""

from concurrent.futures import Executor
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from chladni.spectral.segment_spectra import run_all

# Lines handled together, so that a product still sits in the cache when it's added to the sum.
LINES_TOGETHER = 512


class SegmentAverage(Protocol):
    """What is kept of the segments seen so far."""

    def add(self, spectra: NDArray[np.complex128], executor: Executor | None = None) -> None:
        """Take in ``[frequency, segment, channel]`` spectra, in time order."""

    def merge(self, later: Self) -> None:
        """Take in what another average has seen of later (for linear sums and peak hold: other) segments."""

    def copy(self) -> Self:
        """Give an independent copy."""

    def mean(self) -> NDArray[np.complex128]:
        """Give ``[channel, channel, frequency]``: conj(X_i) X_j averaged or held, unscaled."""


class WeightedSum:
    """Sum of X X^H with weights that shrink by `decay` with each later segment; 1 gives the linear average.

    The sum is kept as the real symmetric products of [Re X_1, Im X_1, Re X_2, ...]: one symmetric rank-k update of
    BLAS does half the work of the complex product, and real and imaginary parts are sorted out once at the end.
    """

    def __init__(self, lines: int, channels: int, decay: float = 1.0) -> None:
        self.decay = decay
        self.segments = 0
        self.weight = 0.0
        self.products = np.zeros((lines, 2 * channels, 2 * channels))

    def add(self, spectra: NDArray[np.complex128], executor: Executor | None = None) -> None:
        """See `SegmentAverage`."""
        count = spectra.shape[1]
        weights = self.decay ** np.arange(count - 1, -1, -1)
        # A root of the weight on each spectrum puts the whole weight on each product.
        if self.decay != 1:
            spectra = spectra * np.sqrt(weights)[:, np.newaxis]
        self._fade(count)
        self.weight += float(weights.sum())
        # Seen as reals, the last axis is Re, Im of the first channel, Re, Im of the second, ...
        parts = spectra.view(np.float64)

        def accumulate(first: int) -> None:
            lines = parts[first : first + LINES_TOGETHER]
            # NumPy sees a matrix times its own transpose and calls the symmetric product.
            self.products[first : first + LINES_TOGETHER] += np.matmul(lines.transpose(0, 2, 1), lines)

        run_all(accumulate, range(0, len(parts), LINES_TOGETHER), executor)

    def merge(self, later: Self) -> None:
        """See `SegmentAverage`."""
        self._fade(later.segments)
        self.weight += later.weight
        self.products += later.products

    def copy(self) -> Self:
        """See `SegmentAverage`."""
        twin = type(self)(0, 0, self.decay)
        twin.segments, twin.weight, twin.products = self.segments, self.weight, self.products.copy()
        return twin

    def mean(self) -> NDArray[np.complex128]:
        """See `SegmentAverage`."""
        # conj(a + jb)(c + jd) = (ac + bd) + j(ad - bc)
        products = self.products.transpose(1, 2, 0)
        density = np.empty((products.shape[0] // 2, products.shape[1] // 2, products.shape[2]), dtype=np.complex128)
        density.real = products[0::2, 0::2] + products[1::2, 1::2]
        density.imag = products[0::2, 1::2] - products[1::2, 0::2]
        # The sum of weights, not the number of segments: right from the first segment of an exponential average.
        density /= self.weight
        return density

    def _fade(self, segments: int) -> None:
        self.segments += segments
        if self.decay != 1:
            fading = self.decay**segments
            self.weight *= fading
            self.products *= fading


class PeakHold:
    """For each pair and line the product of largest magnitude that any segment had."""

    def __init__(self, lines: int, channels: int) -> None:
        self.held = np.zeros((lines, channels, channels), dtype=np.complex128)

    def add(self, spectra: NDArray[np.complex128], executor: Executor | None = None) -> None:
        """See `SegmentAverage`."""

        def hold(first: int) -> None:
            lines = slice(first, first + LINES_TOGETHER)
            # A segment at a time: all at once would take as many matrices as there are segments.
            for segment in spectra[lines].transpose(1, 0, 2):
                self._keep_larger(lines, segment.conj()[:, :, np.newaxis] * segment[:, np.newaxis, :])

        run_all(hold, range(0, len(spectra), LINES_TOGETHER), executor)

    def merge(self, later: Self) -> None:
        """See `SegmentAverage`."""
        self._keep_larger(slice(None), later.held)

    def copy(self) -> Self:
        """See `SegmentAverage`."""
        twin = type(self)(0, 0)
        twin.held = self.held.copy()
        return twin

    def mean(self) -> NDArray[np.complex128]:
        """See `SegmentAverage`."""
        return np.ascontiguousarray(self.held.transpose(1, 2, 0))

    def _keep_larger(self, lines: slice, candidate: NDArray[np.complex128]) -> None:
        held = self.held[lines]
        np.copyto(held, candidate, where=np.abs(candidate) > np.abs(held))
