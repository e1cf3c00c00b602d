"""The search for a third cause, beside two that leave what no detail of their laws does."""

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.completeness import completeness_of
from chladni.gap.diagnosis.pairs import second_causes, without_one
from chladni.gap.diagnosis.search import ALONE, detailed
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.hypothesis import Contestant

Matrix = NDArray[np.float64]
#: Probability that a third explains all of what two leave, from which on it's named.
_ALL = 0.5


def leaves_a_third(best: Contestant) -> bool:
    """Whether two effects leave what a third may explain."""
    return len(best.hypothesis.effects) == 2 and best.most_left > ALONE


def third_causes(study: Study, both: Contestant) -> list[Contestant]:
    """Enter a third effect beside two, then others in the place of either, and the three with one pruned.

    Only those that explain what two leave nearly whole: laws that differ a little from the machine's leave so much
    that another one mends some of it.
    """
    found = _beside(study, both, both)
    if not found:
        return []
    best = weighed(found)[0]
    if best.most_left > ALONE:
        # The two were found while the third wasn't known.
        effects = best.fit.effects
        for place in range(len(effects) - 1):
            kept = (*effects[:place], *effects[place + 1 :])
            found += [one for one in second_causes(study, best, kept) if explains_the_rest(both, one)]
        best = weighed(found)[0]
    found.append(detailed(study, best))
    return [*found, *without_one(study, best)]


def _beside(study: Study, both: Contestant, known: Contestant) -> list[Contestant]:
    """Third effects beside all of a fit, that explain what two leave."""
    return [one for one in second_causes(study, known, known.fit.effects) if explains_the_rest(both, one)]


def explains_the_rest(both: Contestant, three: Contestant) -> bool:
    """Whether three effects leave next to nothing of what two do."""
    before = set(both.hypothesis.named)
    added = [one.effect for one in three.hypothesis.named if one not in before]
    floor = np.minimum(np.minimum(both.held, three.held), 1.0)
    return completeness_of(both.held, three.held, added, floor) > _ALL
