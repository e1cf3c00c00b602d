"""Sums over segments: linear, exponential in time, and peak hold; of all pairs of channels, or of each alone."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from concurrent.futures import Executor
from copy import copy
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Real, Whole
from chladni.signals.errors import EstimateError
from chladni.spectral.segment_spectra import run_all

# Lines handled together, so that a product still sits in the cache when it's added to the sum.
LINES_TOGETHER = 128
LINES_TURNED = 64
# Channels squared in one call of BLAS: of fewer, the calls cost more than the pairs that nobody looks at.
SQUARED_TOGETHER = 4


class SegmentAverage(Protocol):
    """What is kept of the segments seen so far."""

    def add(self, spectra: Complex, executor: Executor | None = None) -> None:
        """Take in ``[frequency, segment, channel]`` spectra, in time order."""

    def merge(self, later: Self) -> None:
        """Take in what another average has seen of later (for linear sums and peak hold: other) segments."""

    def copy(self) -> Self:
        """Give an independent copy."""

    def select(self, rows: Whole) -> Self:
        """Give an independent copy of some of the channels."""

    def mean(self) -> NDArray[Any]:
        """Give ``[channel, channel, frequency]``, conj(X_i) X_j averaged or held, unscaled; or its real diagonal.

        The array is the caller's own.
        """

    def numbers(self) -> dict[str, NDArray[Any]]:
        """Give what was summed, for another one's `add_numbers`; `EstimateError` where that makes no sense."""

    def add_numbers(self, found: Mapping[str, NDArray[Any]]) -> None:
        """Add what another one gave; `EstimateError` when it doesn't fit."""


def require_shapes(found: Mapping[str, NDArray[Any]], shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise `EstimateError` unless sums that came from elsewhere are numbers of these shapes."""
    for name, shape in shapes.items():
        if name not in found or found[name].shape != shape or found[name].dtype != np.float64:
            raise EstimateError(f"sums of a part don't fit: {name} isn't {shape} numbers; do the log anew")


class _Sum(ABC):
    """Sum of products with weights that shrink by `decay` with each later segment; 1 gives the linear average.

    They are real products of [Re X_1, Im X_1, Re X_2, ...], whose parts are sorted out once at the end.
    """

    def __init__(self, products: Real, decay: float) -> None:
        self.decay = decay
        self.segments = 0
        self.weight = 0.0
        self.products = products

    def add(self, spectra: Complex, executor: Executor | None = None) -> None:
        """See `SegmentAverage`."""
        count = spectra.shape[1]
        weights = self.decay ** np.arange(count - 1, -1, -1)
        self._fade(count)
        self.weight += float(weights.sum())
        # Seen as reals, the last axis is Re, Im of the first channel, Re, Im of the second, ...
        parts = spectra.view(np.float64)

        def accumulate(first: int) -> None:
            lines = slice(first, first + LINES_TOGETHER)
            some = parts[lines]
            if self.decay != 1:
                # A root of the weight on each spectrum puts the whole weight on each product.
                some = some * np.sqrt(weights)[:, np.newaxis]
            self.products[lines] += self._of(some)

        run_all(accumulate, range(0, len(parts), LINES_TOGETHER), executor)

    def merge(self, later: Self) -> None:
        """See `SegmentAverage`."""
        self._fade(later.segments)
        self.weight += later.weight
        self.products += later.products

    def copy(self) -> Self:
        """See `SegmentAverage`."""
        twin = copy(self)
        twin.products = self.products.copy()
        return twin

    def select(self, rows: Whole) -> Self:
        """See `SegmentAverage`."""
        twin = copy(self)
        # Re and Im of each channel stand side by side.
        parts = np.stack((2 * rows, 2 * rows + 1), axis=1).ravel()
        twin.products = _selected(self.products, parts)
        return twin

    def numbers(self) -> dict[str, NDArray[Any]]:
        """See `SegmentAverage`."""
        if self.decay != 1:
            raise EstimateError("a fading average isn't summed in parts; average linearly")
        return {"products": self.products, "segments": np.array([self.segments], np.float64)}

    def add_numbers(self, found: Mapping[str, NDArray[Any]]) -> None:
        """See `SegmentAverage`."""
        require_shapes(found, {"products": self.products.shape, "segments": (1,)})
        self.products += found["products"]
        self.segments += int(found["segments"][0])
        self.weight += float(found["segments"][0])

    def mean(self) -> NDArray[Any]:
        """See `SegmentAverage`."""
        # The sum of weights, not the number of segments: right from the first segment of an exponential average.
        # Times its inverse, as NumPy divides complex numbers: so the powers are those of the matrix to rounding.
        density = self._density()
        density *= 1 / self.weight
        return density

    def _fade(self, segments: int) -> None:
        self.segments += segments
        if self.decay != 1:
            fading = self.decay**segments
            self.weight *= fading
            self.products *= fading

    @abstractmethod
    def _of(self, parts: Real) -> Real:
        """Products of ``[line, segment, part]``, summed over segments."""

    @abstractmethod
    def _density(self) -> NDArray[Any]:
        """Sum of conj(X_i) X_j, with the lines last."""


class WeightedSum(_Sum):
    """Sum of X X^H, all pairs of channels.

    One symmetric rank-k update of BLAS does half the work of the complex product.
    """

    def __init__(self, lines: int, channels: int, decay: float = 1.0) -> None:
        super().__init__(np.zeros((lines, 2 * channels, 2 * channels)), decay)

    def _of(self, parts: Real) -> Real:
        # NumPy sees a matrix times its own transpose and calls the symmetric product.
        return np.asarray(np.matmul(parts.transpose(0, 2, 1), parts), dtype=np.float64)

    def _density(self) -> Complex:
        # conj(a + jb)(c + jd) = (ac + bd) + j(ad - bc)
        lines, parts, _ = self.products.shape
        density = np.empty((parts // 2, parts // 2, lines), dtype=np.complex128)
        # Turned over in portions that the cache holds: memory has lines first, the result has them last.
        for first in range(0, lines, LINES_TURNED):
            some = slice(first, first + LINES_TURNED)
            products = self.products[some]
            density.real[..., some] = (products[:, 0::2, 0::2] + products[:, 1::2, 1::2]).transpose(1, 2, 0)
            density.imag[..., some] = (products[:, 0::2, 1::2] - products[:, 1::2, 0::2]).transpose(1, 2, 0)
        return density


class WeightedPowers(_Sum):
    """Sum of |X|^2, each channel alone: the diagonal of `WeightedSum` to rounding, without the pairs."""

    def __init__(self, lines: int, channels: int, decay: float = 1.0) -> None:
        super().__init__(np.zeros((lines, 2 * channels)), decay)

    def _of(self, parts: Real) -> Real:
        # The same product of BLAS as for the pairs, of a few channels each: a sum of squares would be summed in
        # another order, and be slower.
        lines, segments, count = parts.shape
        powers = np.empty((lines, count))
        whole = count - count % (2 * SQUARED_TOGETHER)
        for some, width in ((slice(0, whole), 2 * SQUARED_TOGETHER), (slice(whole, count), count - whole)):
            if some.start < some.stop:
                groups = parts[..., some].reshape(lines, segments, -1, width)
                squares = np.matmul(groups.transpose(0, 2, 3, 1), groups.transpose(0, 2, 1, 3))
                powers[:, some] = squares.diagonal(axis1=2, axis2=3).reshape(lines, -1)
        return powers

    def _density(self) -> Real:
        return np.ascontiguousarray((self.products[:, 0::2] + self.products[:, 1::2]).T)


class _Hold(ABC):
    """The product of largest magnitude that any segment had, on each line."""

    def __init__(self, held: NDArray[Any]) -> None:
        self.held = held

    def add(self, spectra: Complex, executor: Executor | None = None) -> None:
        """See `SegmentAverage`."""

        def hold(first: int) -> None:
            lines = slice(first, first + LINES_TOGETHER)
            # A segment at a time: all at once would take as many matrices as there are segments.
            for segment in spectra[lines].transpose(1, 0, 2):
                self._keep_larger(lines, self._of(segment))

        run_all(hold, range(0, len(spectra), LINES_TOGETHER), executor)

    def merge(self, later: Self) -> None:
        """See `SegmentAverage`."""
        self._keep_larger(slice(None), later.held)

    def copy(self) -> Self:
        """See `SegmentAverage`."""
        twin = copy(self)
        twin.held = self.held.copy()
        return twin

    def select(self, rows: Whole) -> Self:
        """See `SegmentAverage`."""
        twin = copy(self)
        twin.held = _selected(self.held, rows)
        return twin

    def numbers(self) -> dict[str, NDArray[Any]]:
        """See `SegmentAverage`."""
        return {"held": self.held.view(np.float64)}

    def add_numbers(self, found: Mapping[str, NDArray[Any]]) -> None:
        """See `SegmentAverage`."""
        require_shapes(found, {"held": self.held.view(np.float64).shape})
        self._keep_larger(slice(None), np.ascontiguousarray(found["held"]).view(self.held.dtype))

    def mean(self) -> NDArray[Any]:
        """See `SegmentAverage`."""
        return np.array(np.moveaxis(self.held, 0, -1), order="C")

    def _keep_larger(self, lines: slice, candidate: NDArray[Any]) -> None:
        held = self.held[lines]
        np.copyto(held, candidate, where=np.abs(candidate) > np.abs(held))

    @abstractmethod
    def _of(self, segment: Complex) -> NDArray[Any]:
        """Products of the spectra of one segment, ``[line, channel]``."""


class PeakHold(_Hold):
    """Peak hold of all pairs of channels."""

    def __init__(self, lines: int, channels: int) -> None:
        super().__init__(np.zeros((lines, channels, channels), dtype=np.complex128))

    def _of(self, segment: Complex) -> NDArray[Any]:
        return np.asarray(segment.conj()[:, :, np.newaxis] * segment[:, np.newaxis, :])


class PowerHold(_Hold):
    """Peak hold of each channel alone: the diagonal of `PeakHold`."""

    def __init__(self, lines: int, channels: int) -> None:
        super().__init__(np.zeros((lines, channels)))

    def _of(self, segment: Complex) -> NDArray[Any]:
        return np.asarray((segment.conj() * segment).real)


def _selected(products: NDArray[Any], rows: Whole) -> NDArray[Any]:
    """Some of the channels of ``[line, channel]`` or ``[line, channel, channel]``."""
    chosen = products[:, rows] if products.ndim == 2 else products[:, rows[:, np.newaxis], rows]
    return np.ascontiguousarray(chosen)
