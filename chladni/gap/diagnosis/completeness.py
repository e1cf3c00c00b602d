"""Whether a hypothesis leaves details of its laws, or another cause."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from chladni.gap.explanation.hypothesis import Contestant

Matrix = NDArray[np.float64]
#: Words whose law has no details that a machine's could differ in: a factor, a shift of time, a line, a mass, an
#: oscillator, a value.
_EXACT = frozenset(
    {"gain_error", "cross_axis", "time_offset", "delay", "tonal_disturbance", "added_mass", "extra_mode", "parameter"}
)
#: Share of the gap's RMS above the noise that a cause may leave at even odds, and what it may leave over the noise's
#: RMS without that being counted; of laws with details, and of those without.
_LEFT, _DETAIL = (0.35, 0.1), (0.25, 0.1)
#: How sharply more speaks against it.
_SHARPNESS = 0.2
#: Probability that the cause of a large gap is one of those that took part, and how much smaller a faint gap's is.
_KNOWN, _FAINT = 0.92, 0.2


def completeness(tuned: Contestant, found: Contestant, floor: Matrix) -> float:
    """Probability that what a hypothesis leaves is noise and details of its laws, not another cause.

    Logistic in the share of the gap's RMS above the noise that is left on held-out samples, root sum square of all
    outputs. Its middle and width were set on campaigns, see docs/methods/gap-explanation.md.

    Parameters
    ----------
    tuned
        Without any cause: its residual is the gap.
    floor
        ``[output]`` mean square of the noise, over that of its estimate.
    """
    named = found.hypothesis.named
    exact = int(bool(named) and all(one.effect in _EXACT for one in named))
    gap = _above(tuned.held / floor, 0.0)
    left = _above(found.held / floor, _DETAIL[exact])
    share = left / gap if gap > 0 else float(left > 0)
    return float(expit((1.0 - share / _LEFT[exact]) / _SHARPNESS))


def known_share(tuned: Contestant, floor: Matrix) -> float:
    """Probability that a cause is one of those that took part, not one that they imitate.

    Of the names that were given with confidence to made machines, a tenth of which hid something else, about nine in
    ten were right; where the gap is no larger than the noise, three in four.

    Parameters
    ----------
    tuned, floor
        As of `completeness`.
    """
    return _KNOWN * (1.0 - _FAINT * float(np.exp(-_above(tuned.held / floor, 0.0))))


def _above(held: Matrix, slack: float) -> float:
    """RMS above the noise's, root sum square of all outputs ``[output]`` mean squares over noise."""
    return float(np.sqrt(np.sum(np.maximum(np.sqrt(held) - 1.0 - slack, 0.0) ** 2)))
