"""How large an oscillation is, as it goes through a record."""

import numpy as np

from chladni.signals.arrays import Real


def amplitude(signal: Real, length: int) -> Real:
    """``[sample]`` amplitude of an oscillation ``[sample]``: of a sine that is as large over `length` samples.

    The mean over the same samples is left out, since a load or a travel is no oscillation. At the ends of the record
    the first and the last whole stretch stand in.
    """
    length = min(max(length, 2), signal.size)
    # Squares of a small oscillation about a large mean would lose it to rounding.
    centred = signal - signal.mean()
    mean, square = (_running_mean(one, length) for one in (centred, centred**2))
    found = np.sqrt(2 * np.maximum(square - mean**2, 0.0))
    before = length // 2
    return np.pad(found, (before, signal.size - found.size - before), mode="edge")


def _running_mean(signal: Real, length: int) -> Real:
    """``[sample]`` means over each whole stretch of a length."""
    sums = np.concatenate([[0.0], np.cumsum(signal)])
    return np.asarray((sums[length:] - sums[:-length]) / length, dtype=np.float64)
