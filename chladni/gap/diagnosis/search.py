"""The search for one cause: every plausible effect entered, more while all leave something."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.diagnosis.following import Entered, followed, is_lost_beside
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.degenerate import is_degenerate
from chladni.gap.explanation.hypotheses import (
    effect_hypotheses,
    polished,
    siblings,
    twins,
    wrong_parameters,
)
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.linear_words import linear_hypotheses
from chladni.gap.explanation.sticking import sticking_hypotheses
from chladni.gap.location.locate import Located, Location
from chladni.gap.side_by_side import side_by_side
from chladni.signals.errors import EstimateError

Step = Callable[[float], None]
#: Fits of an effect, and so many more while all leave something: along a motion that isn't quite the machine's the
#: screen may rank a law low that fits.
_FITTED, _AGAIN = 7, 16
#: A best fit that leaves more than this has details of laws worth a fit, those of the first few.
_DETAILED, _POLISHED = 1.1, 4
#: A first effect that leaves less than this, over the noise's power, is alone.
ALONE = 1.3
#: An unknown force that leaves less than this explains all; with more than so many sensors that says something. A
#: place at which it leaves so many times more is another one.
_ONE_FORCE, _PATTERN_SENSORS, _SAME_PLACE = 1.15, 2, 1.25
#: What another place leaves of the gap beyond the best one, where the cause may still be: beside floors that shook
#: the next place left 0.02, beside a stop between a body and the ground that joint 0.0001.
_NEAR = 0.003
#: Named effects that leave so many times what the best place does leave far more.
_FAR = 3.0


def is_one_force(location: Location) -> bool:
    """Whether an unknown force at one place leaves nothing, where there are sensors enough for that to say something.

    Then two known ones elsewhere would only imitate it, and so would one.
    """
    best = location.best
    return best is not None and len(location.problem.measured) > _PATTERN_SENSORS and best.profile.chi < _ONE_FORCE


def plausible_places(location: Location) -> list[Located]:
    """Give the places at which the cause may be: all, unless one alone leaves nothing."""
    return near_places(location, _SAME_PLACE) if is_one_force(location) else list(location.ranked)


def same_places(location: Location) -> list[Located]:
    """Give the places that explain as much as the best one: one force to the sensors."""
    enough = _SAME_PLACE * _least_chi(location)
    return [one for one in location.ranked if one.profile.chi < enough]


def near_places(location: Location, same: float) -> list[Located]:
    """Give the places that leave at most `same` times what the best one does, or little more of the gap."""
    first = _least_chi(location)
    enough = max(same * first, first + _NEAR * (location.tuned.chi - first))
    return [one for one in location.ranked if one.profile.chi < enough]


def _least_chi(location: Location) -> float:
    """Give what the best place leaves, over the noise's power; less than noise is no better than noise."""
    return max(location.ranked[0].profile.chi, 1.0)


def without_cause(study: Study) -> Contestant:
    """Give the tuned model alone."""
    contest = study.contest
    found = contest.enter(Hypothesis(start_z=study.location.tuned.z), max_iterations=20)
    if found is None:
        # Too sensitive to be fitted in free run: what the linear part said of the parameters has to do.
        found = contest.enter(Hypothesis(start_z=study.location.tuned.z), tune=False)
    if found is None:
        raise EstimateError(
            f"model {study.model.name!r} diverges on log {study.measurement.log!r} within its tolerances; "
            "check the model's stability and the units of its inputs"
        )
    return found


def single_causes(study: Study, progress: Step) -> Entered:
    """Enter every effect that the screen holds plausible, and parameters beyond their tolerance."""
    location, contest = study.location, study.contest
    places = plausible_places(location)
    candidates = screened(location, places, study.kinds)
    progress(0.3)
    hypotheses = effect_hypotheses(candidates, count=_FITTED)
    wrong = wrong_parameters(location)
    entered = contest.enter_all([*hypotheses, *([wrong] if wrong else [])], lambda done: progress(0.3 + 0.5 * done))
    found = sound(study, entered)
    if least_left(found) > ALONE:
        linear = linear_hypotheses(study.model, location, candidates)
        found += sound(study, contest.enter_all(linear))
    if least_left(found) > ALONE:
        others = _others(effect_hypotheses(candidates, count=_AGAIN), hypotheses)
        found += sound(study, contest.enter_all(others))
    if is_lost(location, least_left(found)):
        found += sound(study, contest.enter_all(sticking_hypotheses(location, study.kinds)))
    lost = is_lost(location, least_left(found))
    shots = followed(study, location.best, hypotheses) if lost else None
    found += [] if shots is None else sound(study, shots.ranked)
    ranked = weighed([*found, *sibling_causes(study, weighed(found))])
    if ranked and ranked[0].chi > _DETAILED:
        # A detail of its law that was set by the screen's grid must not cost a word its place.
        forms = best_forms(ranked)
        ranked = [*(_polished(study, one) for one in forms), *(one for one in ranked if one not in forms)]
    return Entered(ranked=weighed(ranked), states=None if shots is None else shots.states)


def is_lost(location: Location, left: float) -> bool:
    """Whether what the best runs leave, over the noise's power, is far more than an unknown force does."""
    return is_lost_beside(location.best, left)


def is_far(location: Location, left: float) -> bool:
    """Whether runs leave far more than the best place does, a sensor's or an input's own as well as a force's."""
    best = location.best
    return best is None or left > _FAR * max(best.profile.chi, 1.0)


def least_left(found: Sequence[Contestant]) -> float:
    """Give what the best of contestants leaves, over the noise's power; infinite without any."""
    return min((one.chi for one in found), default=np.inf)


def _others(found: Sequence[Hypothesis], tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that name what none of the tried ones does."""
    names = {one.named for one in tried}
    return [one for one in found if one.named not in names]


def sibling_causes(study: Study, ranked: Sequence[Contestant]) -> list[Contestant]:
    """Enter what contains an effect or is contained in it, where that one leads, alone or beside another effect."""
    others = siblings(ranked[0], study.contest.run) if ranked else []
    allowed = [one for one in others if all(study.takes_part(effect.effect) for effect in one.effects)]
    return sound(study, study.contest.enter_all(allowed))


def twin_causes(study: Study, found: Contestant) -> list[Contestant]:
    """Enter the effects of a fit at the other sites that print the same pattern."""
    # All: where a second effect acts may explain too little alone to be followed.
    return sound(study, study.contest.enter_all(twins(found, study.location.places)))


def best_forms(ranked: Sequence[Contestant]) -> list[Contestant]:
    """The first few that differ in more than where their search began."""
    forms: dict[object, Contestant] = {}
    for one in ranked:
        key = (one.hypothesis.named, tuple(effect.variant for effect in one.hypothesis.effects))
        forms.setdefault(key, one)
    return list(forms.values())[:_POLISHED]


def _polished(study: Study, found: Contestant) -> Contestant:
    """Let the details of the laws move too: creep, presliding, shape; kept when that pays."""
    finer = polished(found.hypothesis, found.fit)
    if finer is None:
        return found
    # Windows of a lost fit begin where no details lead out: then it's the linear part that tells their states.
    starts = [finer, replace(finer, initial=None)] if study.windows is not None else [finer]
    return weighed([found, *sound(study, study.contest.enter_all(starts))])[0]


def detailed(study: Study, found: Contestant) -> Contestant:
    """Give a contestant with the details of its laws fitted too, when it leaves enough for them to matter."""
    return _polished(study, found) if found.chi > _DETAILED else found


def sound(study: Study, entered: Sequence[Contestant]) -> list[Contestant]:
    """Leave out what is its law in name only, and what steps larger than a sensor's signal make of it."""

    def is_sound(one: Contestant) -> bool:
        return not is_degenerate(study.contest.run, one) and not _is_rounding(study, one)

    return [one for one, kept in zip(entered, side_by_side(is_sound, entered), strict=True) if kept]


def _is_rounding(study: Study, one: Contestant) -> bool:
    """Whether an effect is at a sensor of which only steps are left: what these take looks like tones and gains."""
    return not study.coarse.isdisjoint(effect.site for effect in one.hypothesis.effects)
