"""Window functions and what they do to noise."""

import difflib
from typing import Any

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import SetupError

Window = str | tuple[Any, ...]

# General cosine windows, w(n) = a0 - a1 cos(2 pi n/N) + a2 cos(4 pi n/N) - ... Importing scipy.signal costs most of a
# second; these cover daily work without it (coefficients: Harris 1978, table 1; flattop: D'Antona & Ferrero 2006).
_COSINES: dict[str, tuple[float, ...]] = {
    "boxcar": (1.0,),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 0.46),
    "blackman": (0.42, 0.5, 0.08),
    "blackmanharris": (0.35875, 0.48829, 0.14128, 0.01168),
    "nuttall": (0.3635819, 0.4891775, 0.1365995, 0.0106411),
    "flattop": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
}
_ALIASES = {"rectangular": "boxcar", "rect": "boxcar", "box": "boxcar", "ones": "boxcar", "hanning": "hann"}


# Windows that need parameters, with common ones.
_PARAMETERS = {"kaiser": "8.6", "tukey": "0.25", "gaussian": "100", "chebwin": "100", "dpss": "2.5"}


def window_samples(window: Window, samples: int) -> Real:
    """Sample a window, periodic (one sample short of symmetric), as averaging of spectra wants it.

    Parameters
    ----------
    window
        Name, or tuple of name and parameters, as in `scipy.signal.get_window`: ``"hann"``, ``("kaiser", 8.6)``; or
        both in one text as `window_name` writes it: ``"kaiser 8.6"``.
    samples
        Length, at least 1.

    Returns
    -------
    ndarray
        ``[samples]``, dimensionless.

    Raises
    ------
    SetupError
        When there is no such window, or its parameters are missing or wrong.

    Examples
    --------
    >>> window_samples("hann", 4)
    array([0. , 0.5, 1. , 0.5])
    """
    window = _parted(window)
    coefficients = _COSINES.get(_ALIASES.get(window, window)) if isinstance(window, str) else None
    if coefficients is None:
        return _scipy_window(window, samples)
    # Over N, not N - 1: the period of the window is the segment, as the transform sees it.
    angle = 2 * np.pi * np.arange(samples) / samples
    terms = [(-1) ** order * weight * np.cos(order * angle) for order, weight in enumerate(coefficients)]
    return np.asarray(np.sum(terms, axis=0), dtype=np.float64)


def window_name(window: Window) -> str:
    """Write a window the way a person would: ``hann``, ``kaiser 8.6``.

    Examples
    --------
    >>> window_name(("kaiser", 8.6))
    'kaiser 8.6'
    """
    if isinstance(window, str):
        return _ALIASES.get(window, window)
    return " ".join(str(part) for part in window)


def _parted(window: Window) -> Window:
    """Part a name from the numbers behind it; anything else stays, and is refused by name later."""
    if not isinstance(window, str) or len(window.split()) < 2:
        return window
    name, *parameters = window.split()
    try:
        return (name, *map(float, parameters))
    except ValueError:
        return window


def noise_bandwidth_bins(samples: Real) -> float:
    """Effective noise bandwidth of a window in lines, N sum(w^2)/sum(w)^2 (Harris 1978, eq. 11); 1.5 for Hann."""
    return float(samples.size * np.sum(samples**2) / np.sum(samples) ** 2)


def _scipy_window(window: Window, samples: int) -> Real:
    # Imported here, where a window is asked for that isn't among the cheap ones.
    from scipy.signal import get_window

    try:
        sampled = np.asarray(get_window(window, samples, fftbins=True), dtype=np.float64)
    except (ValueError, TypeError, IndexError) as error:
        raise SetupError(f"window {window!r} can't be used: {error}{_hint(window)}") from error
    # Parameters such as NaN pass SciPy unnoticed.
    if not np.all(np.isfinite(sampled)) or np.sum(sampled) == 0:
        raise SetupError(f"window {window!r} over {samples} samples has no finite, non-zero sum; choose another")
    return sampled


def _hint(window: Window) -> str:
    name = window if isinstance(window, str) else str(window[0] if window else "")
    if name in _PARAMETERS:
        return f"; it needs its parameters, such as '{name} {_PARAMETERS[name]}'"
    near = difflib.get_close_matches(name, [*_COSINES, *_ALIASES, "kaiser", "tukey", "gaussian", "bartlett"])
    return f"; did you mean {', '.join(near)}?" if near and name not in near else ""
