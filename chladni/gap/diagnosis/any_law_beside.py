"""What a force at one place explains that follows the motion there by any smooth law: no name is asked for."""

from collections.abc import Sequence

from chladni.gap.calibration import ALONE
from chladni.gap.diagnosis.study import Study
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.location.locate import Located, explained_share
from chladni.gap.plant.places import Site
from chladni.gap.records.diagnosis import AnyLaw, Cause


def any_law(study: Study, causes: Causes, said: Sequence[Cause]) -> AnyLaw | None:
    """Hold any law of what moves at one place beside the answer: at the named joint or input, else at the best place.

    None where that says nothing: the answer leaves noise alone or says already what explains it, several causes act,
    or no force acts at a place. Over windows what an answer leaves is of another horizon: there it's asked only where
    nothing is named.
    """
    if causes.verdict == "unknown":
        found = _at_best(study)
    elif _leaves_something(study, causes, said):
        found = _at(study, said[0].site)
    else:
        return None
    if found is None or study.location.tuned.chi <= 1.0:
        return None
    located, site = found
    return AnyLaw(
        site=site.name,
        group=tuple(name for name in located.places[0].names if name != site.name),
        force=explained_share(study.location.tuned, located.profile),
        law=1.0 - left_by_any_law(study.location, located, site),
        named=explained_share(causes.tuned, causes.best) if said else None,
    )


def _leaves_something(study: Study, causes: Causes, said: Sequence[Cause]) -> bool:
    """Whether one effect is named by its fit in free run, and leaves more than noise."""
    alone = causes.verdict == "effect" and len(said) == 1 and len(causes.best.hypothesis.effects) == 1
    return alone and causes.shaken is None and study.windows is None and causes.best.chi > ALONE


def _at_best(study: Study) -> tuple[Located, Site] | None:
    """Give the best place with its joint, else its input; None where it's a sensor's, the ground's or a body's."""
    best = study.location.best
    if best is None:
        return None
    sites = [site for kind in ("joint", "input") for site in best.places[0].sites if site.kind == kind]
    return (best, sites[0]) if sites else None


def _at(study: Study, name: str) -> tuple[Located, Site] | None:
    """Give a joint or an input by its name, where its force was followed."""
    there = ((located, site) for located in study.location.ranked for site in located.places[0].sites)
    return next((pair for pair in there if pair[1].name == name and pair[1].kind in ("joint", "input")), None)
