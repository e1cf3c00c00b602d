"""Random errors: how many independent averages there are, and what scatter that leaves."""

from math import comb
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError

# Orders of differences from line to line: a curve of few lines adds least to low ones, one of many to high ones.
DIFFERENCES = (2, 3, 4, 5)
# Neighbours that know a median to a tenth.
SCATTER_LINES = 64


class EffectiveAverages:
    """Count of segments under overlap, window and weighting.

    The variance of an average of K overlapping segments with weights w_k is that of ``n`` independent ones,

        n = (sum w_k)^2 / sum_k sum_l w_k w_l rho(k - l),
        rho(m) = (sum_n w(n) w(n + m D))^2 / (sum_n w(n)^2)^2,

    with hop D (Welch 1967, p. 72; equal weights and no gaps give his formula). Segments of separate stretches count
    as independent.

    Parameters
    ----------
    window
        ``[sample]``, the window.
    hop
        Samples between segment starts.
    decay
        Ratio of the weights of consecutive segments, newest first; 1 for equal weights.

    Examples
    --------
    >>> count = EffectiveAverages(np.ones(8), hop=8)
    >>> count.add(0, 10)
    >>> count.value
    10.0
    """

    def __init__(self, window: Real, hop: int, decay: float = 1.0) -> None:
        self.decay = decay
        self.segments = 0
        self.weight = 0.0
        self.correlation = window_correlation(window, hop)
        self.pairs = np.zeros(self.correlation.size)
        # The weights of two segments m hops apart differ by decay^m.
        self._gains = decay ** np.arange(self.correlation.size)

    def add(self, first: int, count: int) -> None:
        """Count `count` segments, the first of which is number `first` (from 0) of its unbroken stretch."""
        for position in range(first, first + count):
            self._fade(1)
            self.weight += 1
            # A segment overlaps with earlier ones of its stretch only, as far as the window reaches.
            self.pairs[: position + 1] += self._gains[: position + 1]

    def merge(self, later: Self) -> None:
        """Count the segments of another stretch, later in time."""
        self._fade(later.segments)
        self.weight += later.weight
        self.pairs += later.pairs

    def copy(self) -> Self:
        """Give an independent copy."""
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__, pairs=self.pairs.copy())
        return twin

    @property
    def value(self) -> float:
        """Independent segments that would scatter as much."""
        if self.segments == 0:
            return 0.0
        return float(self.weight**2 / (self.pairs[0] + 2 * self.pairs[1:] @ self.correlation[1:]))

    def _fade(self, segments: int) -> None:
        self.segments += segments
        if self.decay != 1:
            self.weight *= self.decay**segments
            # Products of two weights fade twice as fast.
            self.pairs *= self.decay ** (2 * segments)


def window_correlation(window: Real, hop: int) -> Real:
    """Squared correlation of segment spectra at multiples of the hop, for white noise (Welch 1967); 1 at lag 0."""
    # Segments farther apart than a window share no sample.
    lags = range(0, window.size, hop)
    overlaps = np.array([window[lag:] @ window[: window.size - lag] for lag in lags])
    return np.asarray((overlaps / overlaps[0]) ** 2, dtype=np.float64)


def response_std(residual_power: Real, inverse_reference_power: Real, *, averages: float, references: int) -> Real:
    """Give one sigma of the magnitude of least-squares frequency responses.

    With q references and n effective averages,

        var |H_yi| = (1 - coherence) G_yy [G_xx^-1]_ii / (2 (n - q)),

    which for one reference is Bendat & Piersol (2010), eq. 9.90, with n - 1 in place of n: the coherence is
    estimated from the same n averages, and one of them is spent on H.

    Parameters
    ----------
    residual_power
        (1 - multiple coherence) G_yy, unit_y^2/Hz, at least 0.
    inverse_reference_power
        Diagonal elements of the inverse reference matrix, Hz/unit_x^2; broadcasts against `residual_power`.
    averages
        Effective averages.
    references
        Number q of references.

    Returns
    -------
    ndarray
        Infinite when there are too few averages to tell, n <= q.
    """
    # One number of each pair of real and imaginary error lies along H, hence the 2.
    variance = residual_power * inverse_reference_power
    if averages <= references:
        return np.full(variance.shape, np.inf)
    return np.asarray(np.sqrt(variance / (2 * (averages - references))), dtype=np.float64)


def std_or_scatter(values: NDArray[np.complexfloating], std: Real) -> Real:
    """``[..., line]`` std of functions; one that has none has the scatter from line to line instead.

    A file holds functions without std, coherence or averages, a single average knows none, and a model's functions
    have no error at all. What their lines jump by bounds their noise from above.
    """
    blind = ~np.isfinite(std).any(axis=-1, keepdims=True)
    return np.where(blind, line_scatter(values), std) if blind.any() else std


def line_scatter(values: NDArray[np.complexfloating]) -> Real:
    """``[..., line]`` std of the real and of the imaginary part of complex noise on smooth functions.

    The n-th difference of noise has binom(2n, n) times its variance, and the median of squares of complex noise is
    ln 2 of their mean and doesn't see the few lines in a sharp peak. What curves adds to it, so that the least of
    several orders is the nearest. Medians are those of `SCATTER_LINES` neighbours, since noise grows where a hammer
    drives less. Infinite where there are too few lines.

    Examples
    --------
    >>> line = np.arange(50)
    >>> noise = np.random.default_rng(1).standard_normal((2, 50)) * 0.01
    >>> float(line_scatter(1 / (line - 20.3 - 0.01j) + noise[0] + 1j * noise[1])[0].round(2))
    0.01
    """
    lines = values.shape[-1]
    found = [
        _course(np.abs(np.diff(values, n=order, axis=-1)) ** 2, lines) / (2 * comb(2 * order, order) * np.log(2))
        for order in DIFFERENCES
        if lines > order
    ]
    return np.sqrt(np.min(found, axis=0)) if found else np.full(values.shape, np.inf)


def _course(squares: Real, lines: int) -> Real:
    """``[..., line]`` medians of neighbours, block by block and straight lines between their middles."""
    blocks = np.array_split(squares, max(squares.shape[-1] // SCATTER_LINES, 1), axis=-1)
    medians = np.stack([np.median(block, axis=-1) for block in blocks], axis=-1)
    middles = (np.arange(len(blocks)) + 0.5) * lines / len(blocks)
    return np.apply_along_axis(lambda levels: np.interp(np.arange(lines), middles, levels), -1, medians)


def coherence_std(coherence: Real, averages: float) -> Real:
    """One sigma of a coherence, sqrt(2) (1 - c) sqrt(c) / sqrt(n) (Bendat & Piersol 2010, table 9.6).

    Infinite when one average or less went in: such a coherence is 1 whatever the data.
    """
    if averages <= 1:
        return np.full(coherence.shape, np.inf)
    return np.asarray((1 - coherence) * np.sqrt(2 * coherence / averages), dtype=np.float64)


def periodic_response_std(spectra: CrossSpectra, values: Complex, reference: int, responses: list[int]) -> Real:
    """Give one sigma of the magnitude of mean response over mean reference, from the scatter between periods.

        var H = |H|^2 / M (s_yy/|Y|^2 + s_xx/|X|^2 - 2 Re(s_xy/(conj(X) Y)))

    with the covariances s of one period and M periods (Pintelon & Schoukens 2012, chapter 2); half of it is in the
    magnitude, half in the phase.

    Parameters
    ----------
    spectra
        Averages over periods, with their scatter.
    values
        ``[response, frequency]`` mean response over mean reference.
    reference, responses
        Rows of the channels.

    Returns
    -------
    ndarray
        ``[response, frequency]``; infinite where the mean reference has no power.
    """
    if spectra.noise_density is None:
        raise EstimateError("the scatter between periods is known for periodic averages only")
    periods = spectra.provenance.averages
    scatter = np.asarray(spectra.noise_density)
    mean = np.asarray(spectra.density) - scatter * ((periods - 1) / periods)
    power = mean[reference, reference].real
    # Written with H instead of Y, so that a response that is zero still has an error.
    own = scatter[responses, responses].real
    common = 2 * (np.conj(values) * scatter[reference, responses]).real
    spread = own + np.abs(values) ** 2 * scatter[reference, reference].real - common
    variance = np.divide(np.maximum(spread, 0.0), power * periods, out=np.full(own.shape, np.inf), where=power > 0)
    return np.asarray(np.sqrt(variance / 2), dtype=np.float64)
