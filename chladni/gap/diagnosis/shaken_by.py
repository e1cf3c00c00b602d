"""When only a floor that shakes explains a gap."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.shaken_ground import follows_inputs
from chladni.gap.location.locate import Located
from chladni.gap.location.profile import Profile
from chladni.gap.location.recovered import Recovered, recovered

Matrix = NDArray[np.float64]
#: How well the ground must explain, how nearly as well as the best place; and where another can't be told from it.
_CHI, _BEST, _TIED = 1.5, 1.02, 1.1
#: How little of the force there may follow the inputs, or the motion that it acts along.
_COHERENCE, _OWN_MOTION = 0.5, 0.25
#: Intervals of displacement and of velocity with equally many samples.
_INTERVALS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class ShakenGround:
    """The ground's profile, and the names of sites that can't be told from it, itself first."""

    profile: Profile
    group: tuple[str, ...]


def shaken_by(study: Study) -> ShakenGround | None:
    """Give the ground when no law is left but a motion of its own; None when something else may act.

    With a machine that stands on one joint, a force there is nearly the ground's motion. What tells them apart is
    that a law of the joint follows its motion, and an actuator's the inputs; the floor follows neither.
    """
    if "base_vibration" in study.leave_out or len(study.measurement.output_names) < 2:
        return None
    first = study.location.ranked[0].profile.chi
    tied = [one for one in study.location.ranked if one.profile.chi < _TIED * first]
    ground = next((one for one in tied if _has_ground(one)), None)
    if ground is None or ground.profile.chi > min(_CHI, _BEST * first):
        return None
    if any(_follows(study, one) for one in tied):
        return None
    names = ["ground", *(name for one in (ground, *tied) for name in one.places[0].names)]
    return ShakenGround(profile=ground.profile, group=tuple(dict.fromkeys(names)))


def own_motion_share(motion: Recovered) -> float:
    """Share of a force's power that is the same each time displacement and velocity are, 0 to 1."""
    place = np.zeros(motion.force.size, dtype=np.int64)
    for signal in (motion.displacement, motion.velocity):
        edges = np.quantile(signal, np.linspace(0.0, 1.0, _INTERVALS + 1)[1:-1])
        place = place * _INTERVALS + np.digitize(signal, edges)
    count = np.maximum(np.bincount(place), 1)
    mean = np.bincount(place, motion.force) / count
    power = float(np.var(motion.force))
    return 1.0 - float(np.var(motion.force - mean[place])) / power if power > 0 else 0.0


def _has_ground(located: Located) -> bool:
    return any(site.kind == "ground" for site in located.places[0].sites)


def _follows(study: Study, located: Located) -> bool:
    """Whether a force at one of a place's sites follows an input, or the motion of its joint or its command."""
    problem = study.location.problem
    for site in located.places[0].sites:
        motion = recovered(problem, located.profile, site)
        if follows_inputs(problem, motion.force) > _COHERENCE:
            return True
        if site.kind in ("joint", "input") and own_motion_share(motion) > _OWN_MOTION:
            return True
    return False
