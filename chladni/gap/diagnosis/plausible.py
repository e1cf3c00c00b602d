"""Which places may hold a cause, and which fits are worth a name at all."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.calibration import NEAR, ONE_FORCE, SAME
from chladni.gap.diagnosis.following import is_lost_beside
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.hypotheses import fitted_form
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.location.locate import Located, Location
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.side_by_side import side_by_side
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def is_one_force(location: Location) -> bool:
    """Whether an unknown force at one place leaves nothing, where there are sensors enough for that to say something.

    Then two known ones elsewhere would only imitate it, and so would one.
    """
    best = location.best
    return best is not None and len(location.problem.measured) > 2 and best.profile.chi < ONE_FORCE


def plausible_places(location: Location) -> list[Located]:
    """Give the places at which the cause may be: all, unless one alone leaves nothing."""
    return near_places(location, SAME) if is_one_force(location) else list(location.ranked)


def near_places(location: Location, same: float) -> list[Located]:
    """Give the places that leave at most `same` times what the best one does, or little more of the gap."""
    # Less than noise is no better than noise.
    first = max(location.ranked[0].profile.chi, 1.0)
    enough = max(same * first, first + NEAR * (location.tuned.chi - first))
    return [one for one in location.ranked if one.profile.chi < enough]


def is_lost(location: Location, left: float) -> bool:
    """Whether what the best runs leave, over the noise's power, is far more than an unknown force does."""
    return is_lost_beside(location.best, left)


def least_left(found: Sequence[Contestant]) -> float:
    """Give what the best of contestants leaves, over the noise's power; infinite without any."""
    return min((one.chi for one in found), default=np.inf)


def sound(study: Study, entered: Sequence[Contestant]) -> list[Contestant]:
    """Leave out what is its law in name only, and what steps larger than a sensor's signal make of it."""

    def is_sound(one: Contestant) -> bool:
        return not is_degenerate(study.contest.run, one) and not _is_rounding(study, one) and _is_possible(study, one)

    return [one for one, kept in zip(entered, side_by_side(is_sound, entered), strict=True) if kept]


def _is_rounding(study: Study, one: Contestant) -> bool:
    """Whether an effect is at a sensor of which only steps are left: what these take looks like tones and gains."""
    return not study.coarse.isdisjoint(effect.site for effect in one.hypothesis.effects)


def _is_possible(study: Study, one: Contestant) -> bool:
    """Whether outputs may have recorded what they did with the errors that a fit gives them."""
    recorded = dict(zip(study.measurement.output_names, study.measurement.outputs, strict=True))
    return all(
        effect.kind.clues.possible(recorded[effect.site], effect.values)
        for effect in one.fit.effects
        if effect.kind.clues.possible is not None and effect.site in recorded
    )


def is_degenerate(run: FreeRun, found: Contestant) -> bool:
    """Whether an effect of a fitted hypothesis does what a parameter or another effect does."""
    return any(is_another(run, found, effect) for effect in found.fit.effects)


def is_another(run: FreeRun, found: Contestant, effect: AttachedEffect) -> bool:
    """Whether one effect of a fit does what a parameter or another effect does."""
    judge = effect.kind.clues.is_degenerate
    if judge is None:
        return False

    def motion() -> tuple[Real, Real]:
        return run.law_motion(found.fit.z, found.fit.effects, found.fit.initial, site=effect.site)

    try:
        return judge(fitted_form(run, effect, motion))
    except ModelError:
        # A run that diverges shows no law at work.
        return True
