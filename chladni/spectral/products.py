"""What is averaged of the channels' spectra: products of all pairs, or each channel's power alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.spectral.averaging import PeakHold, PowerHold, SegmentAverage, WeightedPowers, WeightedSum

SpectraT = TypeVar("SpectraT", CrossSpectra, AutoSpectra)
# An average of more than this is a mistyped resolution more often than a wish.
MOST_RESULT_BYTES = 2 << 30


@dataclass(frozen=True, slots=True, kw_only=True)
class Products(Generic[SpectraT]):
    """Products of channels' spectra, `PAIRS` or `POWERS`.

    Attributes
    ----------
    spectra
        Value that holds their average.
    axes
        Axes of channels that it has: 2 for all pairs, 1 for each channel alone.
    sum, hold
        Make empty averages of lines and channels; a sum fades by its third argument with each later segment.
    """

    spectra: type[SpectraT]
    axes: int
    sum: Callable[[int, int, float], SegmentAverage]
    hold: Callable[[int, int], SegmentAverage]

    def zeros(self, channels: int, lines: int) -> NDArray[Any]:
        """Give an empty sum, with the lines last."""
        return np.zeros((*self.axes * (channels,), lines), dtype=np.complex128 if self.axes == 2 else np.float64)

    def add(self, total: NDArray[Any], before: Complex, after: Complex) -> None:
        """Add the products of conj(`before`) and `after`, both ``[channel, frequency]``."""
        if self.axes == 1:
            total += (before.conj() * after).real
            return
        # One row at a time: the whole outer product would double the memory of the largest array.
        for row, conjugate in enumerate(before.conj()):
            total[row] += conjugate * after

    def make_hermitian(self, total: NDArray[Any]) -> None:
        """Take off by what sums of rounded products differ from their transpose, in their last digits."""
        if self.axes == 2:
            for row in range(len(total)):
                total[row, row].imag = 0.0
                total[row + 1 :, row] = total[row, row + 1 :].conj()

    def require_fitting(self, channels: int, samples: int) -> None:
        """Raise `EstimateError` when averages of segments of so many samples take more than `MOST_RESULT_BYTES`."""
        lines = samples // 2 + 1
        size = 16 * channels**self.axes * lines
        if size > MOST_RESULT_BYTES:
            raise EstimateError(
                f"{channels} channels x {lines} lines would take {size / 2**30:.3g} GB; "
                "ask for a coarser resolution or fewer channels"
            )


PAIRS = Products(spectra=CrossSpectra, axes=2, sum=WeightedSum, hold=PeakHold)
POWERS = Products(spectra=AutoSpectra, axes=1, sum=WeightedPowers, hold=PowerHold)
