"""Whether a hypothesis leaves details of its laws, or another cause."""

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from chladni.gap.explanation.hypothesis import Contestant
from chladni.signals.arrays import Real

#: Share of the gap's RMS beyond the noise that a cause may leave at even odds, of laws with details and of those
#: without; what it may leave over the noise's power without that being counted.
_LEFT, _UNCOUNTED = (0.38, 0.16), 0.05
#: Completeness with which a hypothesis is named.
COMPLETE = 0.5
#: How sharply more speaks against it.
_SHARPNESS = 0.2
#: Probability that the cause of a large gap is one of those that took part, and how much smaller a faint gap's is.
_KNOWN, _FAINT = 0.95, 0.2


def completeness(tuned: Contestant, found: Contestant, floor: Real) -> float:
    """Probability that what a hypothesis leaves is noise and details of its laws, not another cause.

    Logistic in the share of the gap's RMS that is left on held-out samples, noise taken from both as power, root sum
    square of all outputs. Its middle and width were set on campaigns, see docs/methods/gap-explanation.md.

    Parameters
    ----------
    tuned
        Without any cause: its residual is the gap.
    floor
        ``[output]`` mean square of the noise, over that of its estimate.
    """
    effects, wide = found.hypothesis.effects, found.hypothesis.wide
    exact = bool(effects or wide) and all(one.kind.clues.exact for one in effects)
    return completeness_of(tuned.held, found.held, floor, exact=exact)


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


def completeness_among(tuned: Contestant, found: Contestant, others: Sequence[Contestant], floor: Real) -> float:
    """Give the completeness of a hypothesis, or of one among others that adds oscillators to its own.

    A cable or a bracket has more modes than the catalogue's oscillator: what its second mode does is a detail.
    """
    whole = [found, *(one for one in others if _has_more_modes(one, found))]
    return max(completeness(tuned, one, floor) for one in whole)


def _has_more_modes(other: Contestant, found: Contestant) -> bool:
    """Whether both are one word alone that often comes in several, once where the only one of the other is."""
    effects, more = found.hypothesis.effects, other.hypothesis.effects
    if len(effects) != 1 or len(more) < 2 or not effects[0].kind.clues.several:
        return False
    return {one.effect for one in more} == {effects[0].effect} and effects[0].site in {one.site for one in more}


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
