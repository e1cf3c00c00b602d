"""A joint that mostly sticks: its way is too small for a law to be weighed along it, but its force is told."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from chladni.gap.calibration import CREEP, FAR, LITTLE, PLACES
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.places import Site
from chladni.models.effects.attached_effect import attached_if_possible
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.trial import Numbers


def sticking_hypotheses(location: Location, kinds: Iterable[EffectKind]) -> list[Hypothesis]:
    """Give friction at the joints where the cause may be, as large as most of the force that they pass on.

    Of a joint that sticks sensors tell the whole force, friction with spring and damper: what they miss of the way
    goes to the one as it comes from the other.
    """
    joints = list(_joints(location))[:PLACES]
    resisting = [(kind, kind.clues.resisting) for kind in kinds if kind.clues.resisting is not None]
    found = [_sticking(location, *joint, *friction) for friction in resisting for joint in joints]
    return [one for one in found if one is not None]


def _joints(location: Location) -> Iterator[tuple[Located, Site]]:
    enough = FAR * min((one.profile.chi for one in location.ranked), default=0.0)
    for located in location.ranked:
        if located.profile.forces and located.profile.chi < enough:
            yield from ((located, site) for site in located.places[0].sites if site.kind == "joint")


def _sticking(
    location: Location, located: Located, site: Site, kind: EffectKind, resisting: Callable[[float, float], Numbers]
) -> Hypothesis | None:
    problem = location.problem
    motion = recovered(problem, located.profile, site)
    compiled = problem.view(motion.z).compiled
    port = compiled.ports[compiled.port_index(site.name, "joint")]
    passed = motion.force + port.stiffness * motion.displacement + port.damping * motion.velocity
    # Sliding begins with most of the force.
    force = float(np.quantile(np.abs(passed - np.median(passed)), 1 - LITTLE))
    effect = attached_if_possible(kind, site.name, resisting(force, CREEP * float(np.std(motion.velocity))))
    return None if effect is None else hypothesis_of((effect,), located.profile.z)
