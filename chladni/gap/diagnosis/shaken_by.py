"""When only a floor that shakes explains a gap."""

from dataclasses import dataclass

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.location.locate import Located
from chladni.gap.location.profile import Profile

#: How well the ground must explain, how nearly as well as the best place; and where another can't be told from it.
_CHI, _BEST, _TIED = 1.5, 1.02, 1.1
#: Share of the gap that any law of a site's motion, or a filter of the inputs, must leave there. Of a floor that
#: shook the best law at a joint left 0.2 to 0.5 in made machines, of an effect at that joint at most 0.12; at an
#: input 0.34 against 0.08.
_LEFT = {"joint": 0.15, "input": 0.2, "ground": 0.5}


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


def _has_ground(located: Located) -> bool:
    return any(site.kind == "ground" for site in located.places[0].sites)


def _follows(study: Study, located: Located) -> bool:
    """Whether any law of the motion at one of a place's sites, or of the inputs, would explain most."""
    sites = [site for site in located.places[0].sites if site.kind in _LEFT]
    return any(left_by_any_law(study.location, located, site) < _LEFT[site.kind] for site in sites)
