"""What a window does between spectral lines and to the correlation of neighbouring lines."""

from functools import lru_cache

import numpy as np
import scipy.fft

from chladni.signals.arrays import Real
from chladni.signals.errors import SetupError
from chladni.spectral.windows import window_samples

# The shape of a window's spectrum in lines doesn't depend on its length once that is long against a sample.
SAMPLES = 512
STEPS = 64


def named_window(name: str) -> Real:
    """Sample the window that a provenance names, such as ``hann`` or ``kaiser 8.6``; boxcar when it names none.

    Examples
    --------
    >>> float(named_window("hann")[0])
    0.0
    >>> float(named_window("force + exponential 5/s")[0])
    1.0
    """
    kind, *parameters = name.split() or ["boxcar"]
    try:
        return window_samples((kind, *map(float, parameters)) if parameters else kind, SAMPLES)
    except (SetupError, ValueError):
        # Windows of single channels (force, exponential) shape a transient; its lines are those of the bare record.
        return np.ones(SAMPLES)


def leakage(window: Real, offset: Real) -> Real:
    """Power that a line shows of a tone `offset` lines away, 1 for a tone on the line.

    Offsets are rounded to a 64th of a line. Further away than half the window's samples the power stays at what it is
    there, an upper bound.

    Examples
    --------
    >>> leakage(named_window("hann"), np.array([0.0, 1.0, 0.5])).round(3)
    array([1.   , 0.25 , 0.721])
    """
    fine = _fine_spectrum(window.tobytes())
    at = np.rint(np.abs(offset) * STEPS).astype(np.int64)
    return np.asarray(fine[np.minimum(at, STEPS * (window.size - 1) // 2)], dtype=np.float64)


def line_correlation(window: Real) -> float:
    """Sum of the squared correlations of a line with all lines, for noise: 1 for boxcar, 35/18 for Hann.

    Notes
    -----
    rho(m) = sum_n w(n)^2 exp(-2 pi j m n / N) / sum_n w(n)^2; by Parseval the sum of squares over all m is
    N sum(w^4) / sum(w^2)^2.

    Examples
    --------
    >>> round(line_correlation(named_window("hann")) * 18, 9)
    35.0
    """
    return float(window.size * np.sum(window**4) / np.sum(window**2) ** 2)


@lru_cache(maxsize=8)
def _fine_spectrum(window: bytes) -> Real:
    """Power of a window's spectrum at every 64th of a line; kept, since one is asked for again for every peak."""
    samples = np.frombuffer(window)
    fine = np.abs(scipy.fft.rfft(samples, STEPS * samples.size)) ** 2 / samples.sum() ** 2
    fine.flags.writeable = False
    return np.asarray(fine, dtype=np.float64)
