"""Frequency lines mapped onto an arc of the unit circle, where polynomials in z are well conditioned."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Real
from chladni.signals.value import Value

# A band that filled the circle would force the polynomials to be periodic in it, and a jump from its end to its start
# would cost orders; much less than the circle makes the powers of z nearly dependent (Verboven 2002).
ARC = 0.9
# Lines count as equidistant when they lie this close to a grid, in steps.
ON_GRID = 1e-3
# A grid with more than this many places for each line costs more by FFT than the direct sum.
SPARSEST = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnitCircle(Value):
    """Map f = origin + position * step to z = exp(2j pi position / length), and poles back.

    Attributes
    ----------
    origin_hz, step_hz
        Line at angle zero, and the spacing of the grid.
    position
        ``[line]`` in steps from the origin; whole numbers where `gridded`.
    length
        Places around the whole circle.
    gridded
        True when the moments may be summed by FFT.
    """

    origin_hz: float
    step_hz: float
    position: Real
    length: int
    gridded: bool

    def __post_init__(self) -> None:
        self._freeze()

    def moments(self, terms: NDArray[Any], order: int) -> Complex:
        """Sum ``terms`` times z^-m over the lines, for the lags m from -order to order.

        Parameters
        ----------
        terms
            ``[..., line]``.
        order
            Largest lag.

        Returns
        -------
        ``[..., 2 order + 1]``.
        """
        lags = np.arange(-order, order + 1)
        if not self.gridded:
            return np.asarray(terms @ np.exp(-2j * np.pi / self.length * np.outer(self.position, lags)))
        from scipy import fft

        places = np.zeros((*terms.shape[:-1], self.length), dtype=np.complex128)
        places[..., self.position.astype(np.intp)] = terms
        return np.asarray(fft.fft(places, axis=-1, overwrite_x=True)[..., lags % self.length])

    def pole(self, z: Complex) -> Complex:
        """Pole in rad/s of each root z, unwrapped to the turn around the middle of the arc."""
        middle = np.pi * self.position[-1] / self.length
        log = np.log(z * np.exp(-1j * middle)) + 1j * middle
        return np.asarray(log * (self.length * self.step_hz) + 2j * np.pi * self.origin_hz)


def unit_circle(frequency_hz: Real) -> UnitCircle:
    """Lay lines on an arc that takes nine tenths of the unit circle, the first at angle zero.

    Parameters
    ----------
    frequency_hz
        ``[line]``, at least two, strictly rising; gaps in an equidistant grid leave places empty.
    """
    from scipy import fft

    count = frequency_hz.size
    span_hz = float(frequency_hz[-1] - frequency_hz[0])
    # The smallest distance is the grid's step up to rounding; dividing the whole span by its count takes that away.
    places = round(span_hz / float(np.diff(frequency_hz).min()))
    position = (frequency_hz - frequency_hz[0]) * (places / span_hz)
    gridded = places < SPARSEST * count and bool(np.all(np.abs(position - np.round(position)) < ON_GRID))
    if not gridded:
        places = count - 1
        position = (frequency_hz - frequency_hz[0]) * (places / span_hz)
    return UnitCircle(
        origin_hz=float(frequency_hz[0]),
        step_hz=span_hz / places,
        position=np.round(position) if gridded else position,
        length=fft.next_fast_len(round(places / ARC) + 1),
        gridded=gridded,
    )
