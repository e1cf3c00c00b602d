"""Force and motion at the sites that a verdict names, recovered without assuming a law."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.diagnosis.study import Study
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.location.profile import profile_at
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.places import Place, Site
from chladni.gap.records.diagnosis import PARAMETER, Cause
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
