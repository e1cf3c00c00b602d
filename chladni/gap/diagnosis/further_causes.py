"""The search for a third cause, and more: beside two that leave what no detail of their laws does."""

import numpy as np

from chladni.gap.diagnosis.completeness import COMPLETE, completeness_of
from chladni.gap.diagnosis.pairs import second_causes, without_one
from chladni.gap.diagnosis.search import ALONE, detailed
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.hypothesis import Contestant
from chladni.models.effects.attached_effect import AttachedEffect


def leaves_a_further(best: Contestant) -> bool:
    """Whether several effects leave what one more may explain."""
    return len(best.hypothesis.effects) > 1 and best.most_left > ALONE


def further_causes(study: Study, several: Contestant) -> list[Contestant]:
    """Enter one more effect beside several, then others in the place of each of those, and all with one pruned.

    Only those that explain what the several leave nearly whole: laws that differ a little from the machine's leave so
    much that another one mends some of it.
    """
    found = _more(study, several, several, tuple(several.fit.effects))
    if not found:
        return []
    best = weighed(found)[0]
    if best.most_left > ALONE:
        # The others were found while this one wasn't known.
        effects = best.fit.effects
        for place in range(len(several.fit.effects)):
            found += _more(study, several, best, (*effects[:place], *effects[place + 1 :]))
        best = weighed(found)[0]
    found.append(detailed(study, best))
    return [*found, *without_one(study, best)]


def _more(
    study: Study, several: Contestant, fitted: Contestant, kept: tuple[AttachedEffect, ...]
) -> list[Contestant]:
    """Enter another effect beside some of a fit; those that explain what the several leave."""
    return [one for one in second_causes(study, fitted, kept) if explains_the_rest(several, one)]


def explains_the_rest(several: Contestant, more: Contestant) -> bool:
    """Whether one more effect leaves next to nothing of what several do."""
    before, named = set(several.hypothesis.named), more.hypothesis.named
    added = [
        one.kind.clues.exact for one, name in zip(more.hypothesis.effects, named, strict=False) if name not in before
    ]
    floor = np.minimum(np.minimum(several.held, more.held), 1.0)
    return (
        completeness_of(several.held, more.held, floor, exact=not before.issuperset(named) and all(added)) > COMPLETE
    )
