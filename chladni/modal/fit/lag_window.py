"""What averaging over windowed segments does to the response of a mode: its decay is seen through the window."""

from dataclasses import dataclass
from functools import lru_cache
from math import factorial, pi

import numpy as np

from chladni.signals.arrays import Complex
from chladni.signals.provenance import Provenance
from chladni.spectral.leakage import SAMPLES, named_window

# Cosines that the lag window of any cosine window up to flattop is made of.
HARMONICS = 4
# Coefficients below this are rounding of the fit to 512 samples.
NEGLIGIBLE = 1e-6
# Below this the closed forms lose more digits to cancellation than the series leaves out.
SERIES_BELOW = 0.5
SERIES_TERMS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class LagWindow:
    """Correlation of a window with itself, by which H1 of a random excitation sees every impulse response shortened.

    The expected cross-spectrum of a windowed segment is that of h(tau) r(tau), with r(tau) the window's correlation
    over that at lag 0: what came in before the segment is missing (Schoukens, Rolain & Pintelon 2006; Bendat &
    Piersol 2010, section 11.6). A resonance looks wider than it is, the more so the fewer decay times a segment
    holds. For u = tau/segment in 0..1 and a cosine window

        r(u) = sum_m a_m (1 - u) cos(2 pi m u) + b_m sin(2 pi m u).

    Attributes
    ----------
    segment_s
        Length of a segment.
    tapered, sines
        a_0 ... a_4 and b_1 ... b_4.
    """

    segment_s: float
    tapered: tuple[float, ...]
    sines: tuple[float, ...]

    @property
    def slope_per_s(self) -> float:
        """Derivative of r at lag 0; zero for windows that begin at zero."""
        waves = sum(2 * pi * (m + 1) * b for m, b in enumerate(self.sines))
        return (waves - sum(self.tapered)) / self.segment_s

    def decay_transform(self, s: Complex, poles: Complex) -> tuple[Complex, Complex]:
        """Transform of exp(lambda tau) r(tau), and its derivative to lambda; 1/(s - lambda) for endless segments.

        Parameters
        ----------
        s
            ``[line]`` j omega in rad/s.
        poles
            ``[mode]`` in rad/s.

        Returns
        -------
        ``[mode, line]`` in s, and in s^2.
        """
        z = (poles[:, np.newaxis] - s) * self.segment_s
        value, slope = np.zeros_like(z), np.zeros_like(z)
        for weight, shift, kind in self._terms():
            part, part_slope = _moments(z + shift, kind)
            value += weight * part
            slope += weight * part_slope
        return value * self.segment_s, slope * self.segment_s**2

    def _terms(self) -> list[tuple[complex, complex, int]]:
        """Weight, shift of z and kind of integral of each exponential that r is made of."""
        angles = 2j * pi * np.arange(HARMONICS + 1)
        tapers = [(weight / 2, sign * angles[m], 2) for m, weight in enumerate(self.tapered) for sign in (1, -1)]
        waves = [(sign * b / 2j, sign * angles[m], 1) for m, b in enumerate(self.sines, 1) for sign in (1, -1)]
        return [term for term in tapers + waves if term[0] != 0]


def lag_window(provenance: Provenance) -> LagWindow | None:
    """Give the lag window of an averaged estimate, or None where every segment holds its whole response.

    Periods of a repeating excitation and records of an impact begin and end at rest or repeat: nothing is missing.

    Examples
    --------
    >>> hann = lag_window(Provenance(estimator="H1", window="hann", segment_s=1.0, averages=8))
    >>> [round(weight, 6) for weight in hann.tapered[:3]], round(hann.sines[0] * 2 * pi, 6)
    ([0.666667, 0.333333, 0.0], 1.0)
    >>> lag_window(Provenance(averaging="impact", segment_s=1.0)) is None
    True
    """
    if provenance.averaging not in ("linear", "exponential") or provenance.segment_s <= 0 or provenance.averages < 1:
        return None
    tapered, sines = _coefficients(provenance.window)
    return LagWindow(segment_s=provenance.segment_s, tapered=tapered, sines=sines)


@lru_cache(maxsize=8)
def _coefficients(window: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    samples = named_window(window)
    padded = np.fft.rfft(samples, 2 * SAMPLES)
    lags = np.fft.irfft(np.abs(padded) ** 2)[:SAMPLES]
    u = np.arange(SAMPLES) / SAMPLES
    orders = np.arange(HARMONICS + 1)
    tapers = (1 - u)[:, np.newaxis] * np.cos(2 * pi * u[:, np.newaxis] * orders)
    waves = np.sin(2 * pi * u[:, np.newaxis] * orders[1:])
    # Exact for cosine windows; for others the nearest, which is close because lag windows are smooth.
    answer = np.linalg.lstsq(np.hstack([tapers, waves]), lags / lags[0], rcond=None)[0]
    # What is nothing but rounding of the fit needn't be evaluated at every line.
    answer = np.where(np.abs(answer) > NEGLIGIBLE, answer, 0.0)
    return tuple(map(float, answer[: HARMONICS + 1])), tuple(map(float, answer[HARMONICS + 1 :]))


def _moments(z: Complex, kind: int) -> tuple[Complex, Complex]:
    """Integral over u in 0..1 of exp(z u), or of (1 - u) exp(z u) for kind 2, and the derivative to z."""
    small = np.abs(z) < SERIES_BELOW
    safe = np.where(small, 1.0, z)
    grown = np.exp(safe)
    if kind == 1:
        value, slope = (grown - 1) / safe, (grown * (safe - 1) + 1) / safe**2
    else:
        value, slope = (grown - 1 - safe) / safe**2, (grown * (safe - 2) + safe + 2) / safe**3
    if small.any():
        near = z[small]
        series = np.polynomial.Polynomial([1 / factorial(k + kind) for k in range(SERIES_TERMS)])
        value[small], slope[small] = series(near), series.deriv()(near)
    return np.asarray(value, dtype=np.complex128), np.asarray(slope, dtype=np.complex128)
