"""Whether a hypothesis leaves details of its laws, or another cause."""

import numpy as np
from scipy.special import expit

from chladni.signals.arrays import Real

#: Share of the gap's RMS beyond the noise that a cause may leave at even odds, of laws with details and of those
#: without; what it may leave over the noise's power without that being counted.
_LEFT, _UNCOUNTED = (0.38, 0.16), 0.05
#: How sharply more speaks against it.
_SHARPNESS = 0.2
#: Probability that the cause of a large gap is one of those that took part, and how much smaller a faint gap's is.
_KNOWN, _FAINT = 0.95, 0.2


def completeness_of(tuned: Real, found: Real, floor: Real, *, exact: bool) -> float:
    """Give the completeness of some words from ``[output]`` mean squares over noise, without and with them.

    Parameters
    ----------
    exact
        Whether none of their laws has details, see `Clues`. A wrong value has none.
    """
    gap = _beyond(tuned / floor)
    left = _beyond(found / floor - _UNCOUNTED)
    share = left / gap if gap > 0 else float(left > 0)
    return float(expit((1.0 - share / _LEFT[int(exact)]) / _SHARPNESS))


def known_share(tuned: Real, floor: Real) -> float:
    """Probability that a cause is one of those that took part, not one that they imitate.

    Of the names that were given with confidence to made machines, a tenth of which hid something else, about nineteen
    in twenty were right; where the gap is no larger than the noise, three in four.

    Parameters
    ----------
    tuned, floor
        ``[output]`` as of `completeness_of`.
    """
    above = np.maximum(np.sqrt(tuned / floor) - 1.0, 0.0)
    return _KNOWN * (1.0 - _FAINT * float(np.exp(-np.linalg.norm(above))))


def _beyond(held: Real) -> float:
    """RMS beyond the noise, root sum square of all outputs, from ``[output]`` mean squares over noise."""
    return float(np.sqrt(np.sum(np.maximum(held - 1.0, 0.0))))
