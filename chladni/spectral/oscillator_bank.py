"""Oscillators on a shaken base: many natural frequencies at once, of many channels, and their largest responses.

numba compiles what steps them; so this is imported when it's needed.
"""

from math import ceil

import numba as nb
import numpy as np

from chladni.signals.arrays import Index, Real
from chladni.signals.cache_folder import CACHED

# `scipy.signal.resample_poly` looks so many samples ahead and back.
RESAMPLING_REACH = 10


class OscillatorBank:
    """Oscillators whose periods need so many times the samples, of all channels, with what they remember.

    Parameters
    ----------
    channels
        How many channels there are.
    lines_hz
        Natural frequencies, rising.
    sample_rate_hz
        Of the samples that are fed.
    factor
        How many times as many the oscillators see, band-limited.
    numerators, denominators
        ``[line, 3]``, of the filter of each oscillator at its own rate; denominators begin with 1.
    """

    def __init__(
        self,
        channels: int,
        lines_hz: Real,
        sample_rate_hz: float,
        factor: int,
        *,
        numerators: Real,
        denominators: Real,
    ) -> None:
        self._factor = factor
        self._reach = 0 if factor == 1 else RESAMPLING_REACH
        # A row holds neighbouring oscillators, which the processor steps together.
        self._b, self._a = np.ascontiguousarray(numerators.T), np.ascontiguousarray(denominators.T)
        # What is left of the motion after the record has its peaks within a period, which slow ones take longest for.
        periods = np.array([ceil(factor * sample_rate_hz / one) for one in lines_hz.tolist()])
        self._ringing = np.array([np.count_nonzero(periods > step) for step in range(periods.max())])
        self._state = np.zeros((channels, 2, lines_hz.size))
        self._past = np.zeros((channels, 2 * self._reach))
        self._age = np.zeros(channels, dtype=np.intp)
        self.highest, self.lowest = np.zeros((channels, lines_hz.size)), np.zeros((channels, lines_hz.size))

    def feed(self, rows: Index, values: Real) -> None:
        """Take in the next samples ``[row, sample]`` of some channels."""
        for age in np.unique(self._age[rows]).tolist():
            same = self._age[rows] == age
            samples = self._finer(rows[same], values[same], age)
            self._respond(rows[same], samples, np.full(samples.shape[1], self._b.shape[1]))

    def end(self, rows: Index) -> None:
        """Let the oscillators of some channels ring out, and be at rest again."""
        if self._reach:
            self.feed(rows, np.zeros((rows.size, self._reach)))
        # Nothing but zeros: one row of them serves all channels.
        self._respond(rows, np.broadcast_to(np.zeros(1), (rows.size, self._ringing.size)), self._ringing)
        self._state[rows], self._past[rows], self._age[rows] = 0.0, 0.0, 0

    def _finer(self, rows: Index, values: Real, age: int) -> Real:
        """Give the samples with those between them, band-limited, as late as the filter looks ahead."""
        from scipy.signal import resample_poly

        if not self._reach:
            return values
        known = np.concatenate([self._past[rows], values], axis=1)
        self._past[rows] = known[:, -2 * self._reach :]
        self._age[rows] = min(age + values.shape[1], self._reach)
        # Nothing comes out for times before the first sample.
        first = self._reach + max(0, self._reach - age)
        fine = resample_poly(known, self._factor, 1, axis=1)
        return np.asarray(fine[:, first * self._factor : (known.shape[1] - self._reach) * self._factor])

    def _respond(self, rows: Index, samples: Real, moving: Index) -> None:
        _step(rows, samples, moving, self._b, self._a, self._state, self.highest, self.lowest)


@nb.njit(cache=CACHED, nogil=True)
def _step(
    rows: Index, samples: Real, moving: Index, b: Real, a: Real, state: Real, highest: Real, lowest: Real
) -> None:
    """Step the first `moving` oscillators of each row through each sample, and keep their extremes.

    The transposed direct form II, with its operations in the order of `scipy.signal.lfilter`.
    """
    for place in range(rows.size):
        row = rows[place]
        first, second, high, low = state[row, 0], state[row, 1], highest[row], lowest[row]
        for sample in range(samples.shape[1]):
            x = samples[place, sample]
            for line in range(moving[sample]):
                y = first[line] + b[0, line] * x
                first[line] = second[line] + b[1, line] * x - a[1, line] * y
                second[line] = b[2, line] * x - a[2, line] * y
                high[line] = max(high[line], y)
                low[line] = min(low[line], y)
