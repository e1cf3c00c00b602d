"""How many independent averages there are: overlapping segments count as less than one each."""

from typing import Self

import numpy as np

from chladni.signals.arrays import Real


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
