"""Random noise of a level in a band, as a function of time."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

# Enough lines for a sum that is normally distributed and, over minutes, free of visible lines.
_LINES = 1024
_BLOCK = 512
_BLOCKS = 2048
# Times of a uniform grid agree with it to within rounding.
_UNIFORM = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class BandNoise:
    """A sum of tones with random phases whose frequencies share out a band evenly, one at random in each share.

    The same time always gives the same value: it doesn't matter how long the log is or how it's cut. Because the
    frequencies are no multiples of each other, nothing repeats.

    Attributes
    ----------
    level
        Root mean square.
    low_hz, high_hz
        The band.
    seed
        Another seed gives another noise of the same kind.
    """

    level: float
    low_hz: float
    high_hz: float
    seed: int

    def __call__(self, times_s: Real) -> Real:
        """Give the noise at some times; ``[sample]``.

        Raises
        ------
        ModelError
            When samples at a steady rate are too far apart for the band.
        """
        times_s = np.asarray(times_s, dtype=np.float64)
        frequency_hz, phase = self.lines()
        amplitude = self.level * sqrt(2 / _LINES)
        interval = _uniform_interval(times_s)
        # Any times at all are allowed: cosine by cosine, in blocks that keep memory small.
        if interval is None:
            blocks = np.array_split(times_s, max(1, times_s.size // _BLOCK))
            return np.concatenate([_at(one, frequency_hz, phase) for one in blocks]) * amplitude
        # An aliased line would be a tone at a frequency that nobody asked for.
        if self.high_hz * interval > 0.5:
            raise ModelError(
                f"a floor that shakes up to {self.high_hz:g} Hz would alias at {1 / interval:g} Hz: "
                f"simulate at {2 * self.high_hz:g} Hz or more, or lower the band"
            )
        return _on_grid(times_s, interval, frequency_hz, phase) * amplitude

    def lines(self) -> tuple[Real, Real]:
        """Frequencies in Hz and phases in rad of the tones."""
        rng = np.random.default_rng(self.seed)
        share = (np.arange(_LINES) + rng.random(_LINES)) / _LINES
        return self.low_hz + share * (self.high_hz - self.low_hz), rng.uniform(0, 2 * pi, _LINES)


def _uniform_interval(times_s: Real) -> float | None:
    if times_s.size < 2:
        return None
    interval = float(times_s[-1] - times_s[0]) / (times_s.size - 1)
    steps = np.diff(times_s)
    slack = _UNIFORM * interval + 4 * np.spacing(np.max(np.abs(times_s)))
    return interval if interval > 0 and np.all(np.abs(steps - interval) <= slack) else None


def _at(times_s: Real, frequency_hz: Real, phase: Real) -> Real:
    return np.asarray(np.cos(np.outer(times_s, 2 * pi * frequency_hz) + phase).sum(axis=1), dtype=np.float64)


def _on_grid(times_s: Real, interval: float, frequency_hz: Real, phase: Real) -> Real:
    """Sum on a uniform grid as one product of matrices: cos(a + b) = cos a cos b - sin a sin b.

    a is the phase at the start of a block, b the phase inside it, which is the same in every block: a sample costs
    a multiplication and an addition a line in place of a cosine.
    """
    b = np.outer(2 * pi * frequency_hz, interval * np.arange(_BLOCK))
    cosine, sine = np.cos(b), np.sin(b)
    total = np.empty(-(-times_s.size // _BLOCK) * _BLOCK)
    # A million samples at a time: hours of a log take no more memory than minutes.
    for first in range(0, times_s.size, _BLOCKS * _BLOCK):
        starts = times_s[first : first + _BLOCKS * _BLOCK : _BLOCK]
        a = np.outer(starts, 2 * pi * frequency_hz) + phase
        total[first : first + starts.size * _BLOCK] = (np.cos(a) @ cosine - np.sin(a) @ sine).ravel()
    return total[: times_s.size]
