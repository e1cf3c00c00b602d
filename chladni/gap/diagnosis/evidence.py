"""Force and motion at the sites that a verdict names, and what any law of that motion explains without a name."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.calibration import ALONE
from chladni.gap.diagnosis.study import Study
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.location.locate import Located, explained_share
from chladni.gap.location.profile import profile_at
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.places import Place, Site
from chladni.gap.records.diagnosis import PARAMETER, AnyLaw, Cause
from chladni.signals.arrays import Real


def evidence(study: Study, causes: Causes, said: Sequence[Cause]) -> tuple[Recovered, ...]:
    """Recover force and motion at the named site, else at the best place, with the parameters that are believed.

    Of several forces each is recovered with the others free: alone it would have to do their work, too. Where the
    first cause is an error of a sensor, or the sensors can't tell the forces apart, there is the first one alone;
    none where the model has no such site.
    """
    named = _sites(study, said)
    if not named:
        return ()
    problem, z = study.location.problem, _believed(study, causes, named[0])
    recoveries = []
    for site in named:
        others = [one for one in named if one != site]
        recoveries.append(recovered(problem, profile_at(problem, (site, *others), z), site, others))
    return tuple(recoveries)


def _sites(study: Study, said: Sequence[Cause]) -> list[Site]:
    """The first cause's site, and those of other forces when all of them print patterns of their own."""
    ranked = [one.places[0] for one in study.location.ranked]
    if not said:
        return [place.sites[0] for place in ranked[:1]]
    found = {name: _found(study.location.places, name) for name in map(_port_name, said)}
    forces = [one for one in found.values() if one is not None and one[1].kind != "output"]
    first = found[_port_name(said[0])]
    # An error of a sensor is no force; it's looked at where it explains about as much as the best place.
    if first is None or (first not in forces and first[0] not in ranked):
        return []
    # With as many forces as sensors anything could be explained, and noise would tell how.
    enough = len(forces) < len(study.measurement.output_names)
    apart = len({place.names for place, _ in forces}) == len(forces)
    return [site for _, site in forces] if first in forces and enough and apart else [first[1]]


def _found(places: Sequence[Place], name: str) -> tuple[Place, Site] | None:
    sites = ((place, site) for place in places for site in place.sites)
    return next(((place, site) for place, site in sites if site.name == name), None)


def _port_name(cause: Cause) -> str:
    """Where a cause acts: a wrong ``elbow.stiffness`` at the elbow."""
    return cause.site.rpartition(".")[0] if cause.effect == PARAMETER else cause.site


def _believed(study: Study, causes: Causes, site: Site) -> Real:
    """``[parameter]`` with which a force is recovered; a wrong one is nominal, so that what it makes is lacking."""
    if causes.best is causes.tuned:
        alone = (one.profile for one in study.location.ranked if site in one.places[0].sites)
        return next(alone, study.location.tuned).z
    z = np.array(causes.best.fit.z)
    wrong = [study.contest.run.tunables.names.index(name) for name in causes.best.hypothesis.freed]
    z[wrong] = 0.0
    return z


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
        force=explained_share(study.location.tuned.chi, located.profile.chi),
        law=1.0 - left_by_any_law(study.location, located, site),
        named=explained_share(causes.tuned.chi, causes.best.chi) if said else None,
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
