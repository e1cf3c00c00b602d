"""The search for causes: hypotheses entered, a second effect looked for while the first leaves something."""

from collections.abc import Callable, Collection, Sequence

import numpy as np

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.degenerate import is_degenerate
from chladni.gap.explanation.hypotheses import (
    effect_hypotheses,
    hypothesis_of,
    polished,
    sibling,
    wrong_parameters,
)
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_effect import KnownEffect
from chladni.gap.location.locate import Located, Location, locate, located_pairs
from chladni.gap.tuning.law_error import with_law_error
from chladni.signals.errors import EstimateError, ModelError

Step = Callable[[float], None]
#: Fits of a first effect, so many more while all leave something (along a motion that isn't quite the machine's the
#: screen may rank a law low that fits), of a second beside it, and of each of two at once.
_FITTED, _AGAIN, _SECOND, _EACH = 7, 16, 4, 2
#: A best fit that leaves more than this has details of laws worth a fit, those of the first few.
_DETAILED, _POLISHED = 1.1, 4
#: A first effect that leaves less than this, over the noise's power, is alone.
ALONE = 1.3
#: An unknown force that leaves less than this explains all; with more than so many sensors that says something. A
#: place at which it leaves so many times more is another one.
_ONE_FORCE, _PATTERN_SENSORS, _SAME_PLACE = 1.15, 2, 1.25
#: Two forces must leave less than this of what one leaves; pairs that are as good as the best are tried too.
_PAIR_GAIN, _PAIR_TIE, _PAIRS = 0.6, 1.3, 3


def is_one_force(location: Location) -> bool:
    """Whether an unknown force at one place leaves nothing, where there are sensors enough for that to say something.

    Then two known ones elsewhere would only imitate it, and so would one.
    """
    best = location.best
    return best is not None and len(location.problem.measured) > _PATTERN_SENSORS and best.profile.chi < _ONE_FORCE


def plausible_places(location: Location) -> list[Located]:
    """Give the places at which the cause may be: all, unless one alone leaves nothing that another can match."""
    if not is_one_force(location):
        return list(location.ranked)
    enough = _SAME_PLACE * location.ranked[0].profile.chi
    return [one for one in location.ranked if one.profile.chi < enough]


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


def single_causes(study: Study, progress: Step) -> list[Contestant]:
    """Enter every effect that the screen holds plausible, and parameters beyond their tolerance; by evidence."""
    location, contest = study.location, study.contest
    places = plausible_places(location)
    candidates = screened(location, places, study.leave_out, study.own)
    progress(0.3)
    hypotheses = effect_hypotheses(candidates, study.own, count=_FITTED)
    wrong = wrong_parameters(location)
    entered = contest.enter_all([*hypotheses, *([wrong] if wrong else [])], lambda done: progress(0.3 + 0.5 * done))
    sound = _sound(study, entered)
    if min((one.chi for one in sound), default=np.inf) > ALONE:
        others = _others(effect_hypotheses(candidates, study.own, count=_AGAIN), hypotheses)
        sound += _sound(study, contest.enter_all(others))
    ranked = weighed([*sound, *_siblings(study, sound)])
    if ranked and ranked[0].chi > _DETAILED:
        # A detail of its law that was set by the screen's grid must not cost a word its place.
        forms = _best_forms(ranked)
        ranked = [*(_polished(study, one) for one in forms), *(one for one in ranked if one not in forms)]
    return weighed(ranked)


def second_causes(study: Study, first: Contestant) -> list[Contestant]:
    """Enter a second effect beside a first one, looked for in what that leaves."""
    contest = study.contest
    # It leaves details of its law, which a quiet band of coloured noise would make more of than of any effect.
    floor = with_law_error(contest.noise.lowered(first.held), np.std(study.measurement.outputs, axis=1))
    model, known = study.model, None
    if all(one.kind.linear for one in first.fit.effects):
        model = model.with_effects((*model.effects, *first.fit.effects))
    else:
        try:
            known = KnownEffect.of(contest.run, first)
        except ModelError:
            return []
    rest = study.measurement if known is None else known.without(study.measurement)
    location = locate(model, rest, floor, contest.run.tunables, first.fit.z)
    found = screened(location, location.ranked[:4], study.leave_out, study.own, known)
    # At the same place a second word would mend the details of the first one's law.
    taken = _same_places(study, {one.site for one in first.fit.effects})
    singles = effect_hypotheses([one for one in found if one.trial.site.name not in taken], study.own, count=_SECOND)
    both = [hypothesis_of((*first.fit.effects, *one.effects), first.fit.z, screened=one.screened) for one in singles]
    return _sound(study, contest.enter_all(both))


def paired_causes(study: Study) -> list[Contestant]:
    """Enter two effects at two places at once, which one after the other may miss."""
    pairs = located_pairs(study.location)
    single = study.location.ranked[0].profile.chi if study.location.ranked else 0.0
    if not pairs or pairs[0].profile.chi > _PAIR_GAIN * single:
        return []
    near = [one for one in pairs if one.profile.chi < _PAIR_TIE * pairs[0].profile.chi]
    both = [one for pair in near[:_PAIRS] for one in _of_pair(study, pair)]
    return _sound(study, study.contest.enter_all(both))


def without_one(study: Study, both: Contestant) -> list[Contestant]:
    """Enter each effect of several without one of the others, started from their common fit."""
    effects = both.fit.effects
    fewer = [
        hypothesis_of((*effects[:place], *effects[place + 1 :]), both.fit.z, screened=both.hypothesis.screened)
        for place in range(len(effects))
        if len(effects) > 1
    ]
    return _sound(study, study.contest.enter_all(fewer))


def detailed(study: Study, found: Contestant) -> Contestant:
    """Give a contestant with the details of its laws fitted too, when it leaves enough for them to matter."""
    return _polished(study, found) if found.chi > _DETAILED else found


def _others(found: Sequence[Hypothesis], tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that name what none of the tried ones does."""
    names = {one.named for one in tried}
    return [one for one in found if one.named not in names]


def _siblings(study: Study, sound: Sequence[Contestant]) -> list[Contestant]:
    """Enter the law that Coulomb friction is a special case of, when that leads."""
    leads = weighed(sound)[:1]
    if "stribeck_friction" in study.leave_out:
        return []
    if [one.effect for lead in leads for one in lead.hypothesis.effects] != ["coulomb_friction"]:
        return []
    found = sibling(leads[0], study.contest.run)
    return _sound(study, study.contest.enter_all([found] if found is not None else []))


def _of_pair(study: Study, pair: Located) -> list[Hypothesis]:
    found = screened(study.location, [pair], study.leave_out, study.own)
    forms = []
    for place in pair.places:
        there = [one for one in found if one.trial.site.name in place.names]
        forms.append(effect_hypotheses(there, study.own, count=_EACH))
    return [
        hypothesis_of((*first.effects, *second.effects), pair.profile.z) for first in forms[0] for second in forms[1]
    ]


def _same_places(study: Study, sites: Collection[str]) -> set[str]:
    """Names of sites, and of those that these sensors can't tell from them."""
    places = [located.places[0].names for located in study.location.ranked]
    return {*sites, *(name for names in places if not set(sites).isdisjoint(names) for name in names)}


def _best_forms(ranked: Sequence[Contestant]) -> list[Contestant]:
    """The first few that differ in more than where their search began."""
    forms: dict[object, Contestant] = {}
    for one in ranked:
        key = (one.hypothesis.named, tuple(effect.variant for effect in one.hypothesis.effects))
        forms.setdefault(key, one)
    return list(forms.values())[:_POLISHED]


def _polished(study: Study, found: Contestant) -> Contestant:
    """Let the details of the laws move too: creep, presliding, shape; kept when that pays."""
    finer = polished(found.hypothesis, found.fit.effects, found.fit.z)
    entered = study.contest.enter(finer) if finer is not None else None
    if entered is None or is_degenerate(study.contest.run, entered):
        return found
    return weighed([found, entered])[0]


def _sound(study: Study, entered: Sequence[Contestant]) -> list[Contestant]:
    return [one for one in entered if not is_degenerate(study.contest.run, one)]
