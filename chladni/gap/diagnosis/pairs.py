"""The search for two causes at once: one beside another, both at once, and each again beside the other."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.calibration import ALIKE, ALONE, BEGUN, CAUSES, FITS, FORMS, LEADS, PAIR_GAIN, PLACES, SAME
from chladni.gap.comparison.whitening import with_law_error
from chladni.gap.diagnosis.following import Entered, followed, is_lost_beside
from chladni.gap.diagnosis.plausible import is_another, least_left, near_places, sound
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import Form, forms_at, promised, screened, searched
from chladni.gap.explanation.hypotheses import effect_hypotheses, hypothesis_of, little_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_effect import KnownEffect
from chladni.gap.explanation.linear_words import linear_hypotheses
from chladni.gap.explanation.screen import Screened
from chladni.gap.explanation.wrong_values import wrong_values
from chladni.gap.location.locate import Located, Location, locate, located_pairs
from chladni.gap.location.profile import with_own
from chladni.models.core.model import Model
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def second_causes(
    study: Study, found: Contestant, effects: Sequence[AttachedEffect] | None = None
) -> list[Contestant]:
    """Enter a second effect beside a first one, looked for in what that leaves.

    Parameters
    ----------
    found
        The first, or a fit of several.
    effects
        Those of the fit that are taken for known, all by default.
    """
    kept = tuple(found.fit.effects if effects is None else effects)
    behind = _behind(study, found, kept)
    if behind is None:
        return []
    model, location, known = behind
    trials = _second_trials(study, location, kept, known)
    singles = [_beside(found, kept, one, found.fit.z) for one in effect_hypotheses(trials, count=FORMS)]
    values = [_beside(found, kept, one, one.start_z) for one in wrong_values(location, study.contest.run.tunables)]
    good = sound(study, study.contest.enter_all([*singles, *values]))
    if least_left(good) > ALONE:
        linear = linear_hypotheses(model, location, trials, count=FORMS)
        good += sound(study, study.contest.enter_all([_beside(found, kept, one, one.start_z) for one in linear]))
    return good


def _second_trials(
    study: Study, location: Location, kept: Sequence[AttachedEffect], known: KnownEffect | None
) -> list[Screened]:
    """Screen the best places for a second effect, beside those that are kept."""
    count = min(max(FORMS, len(near_places(location, ALIKE))), FITS)
    trials = screened(location, location.ranked[:count], study.kinds, known)
    # At the same place a second word would mend the details of the first one's law; but a machine has many tones.
    taken = _same_places(study, {one.site for one in kept})
    several = {(one.kind.name, one.site) for one in kept if one.kind.clues.several}
    return [
        one
        for one in trials
        if one.trial.site.name not in taken or (one.trial.effect, one.trial.site.name) in several
    ]


def _beside(found: Contestant, kept: tuple[AttachedEffect, ...], one: Hypothesis, z: Real) -> Hypothesis:
    """Another effect beside those of a fit that are kept."""
    return hypothesis_of((*kept, *one.effects), z, initial=found.fit.initial)


def paired_causes(study: Study, best: Contestant) -> Entered:
    """Enter two effects at two places at once, which one after the other may miss.

    Parameters
    ----------
    best
        The best one so far: where any two forces explain everything, two laws must promise much more than it does.
    """
    pairs = located_pairs(study.location)
    weighed = _weighed_pairs(study, best, pairs)
    forces = _two_forces(study.location, pairs)
    both = [_of_pair(pair, forms) for pair, forms in weighed]
    found = sound(study, study.contest.enter_all([one for each in both for one in each]))
    if not weighed or not is_lost_beside(weighed[0][0], min(best.chi, least_left(found))):
        return Entered(ranked=found, forces=forces)
    shots = followed(study, weighed[0][0], both[0])
    return Entered(ranked=found, forces=forces) if shots is None else Entered(
        ranked=[*found, *sound(study, shots.ranked)], states=shots.states, forces=forces
    )  # fmt: skip


def _two_forces(location: Location, pairs: Sequence[Located]) -> Located | None:
    """Give the pair that explains much more than one force does; any two explain two sensors."""
    near = _near_pairs(location, pairs) if len(location.problem.measured) > 2 else []
    return replace(near[0], profile=with_own(location.problem, near[0].profile)) if near else None


def _weighed_pairs(study: Study, best: Contestant, pairs: Sequence[Located]) -> list[tuple[Located, list[Form]]]:
    """Give the pairs whose laws promise most while the other's force is free, with what was screened there."""
    location = study.location
    tell = len(location.problem.measured) > 2
    near = _near_pairs(location, pairs) if tell else list(pairs)
    weighed = [(pair, forms_at(location, [pair], study.kinds)) for pair in near]
    if not tell:
        most = PAIR_GAIN * best.chi * location.problem.scale
        weighed = [one for one in weighed if promised(*one) < most]
    return sorted(weighed, key=lambda one: promised(*one))[:PLACES]


def _near_pairs(location: Location, pairs: Sequence[Located]) -> list[Located]:
    """Pairs of forces that explain much more than one, about as much as the best pair."""
    if not pairs or pairs[0].profile.chi > PAIR_GAIN * location.ranked[0].profile.chi:
        return []
    return [one for one in pairs if one.profile.chi < SAME * pairs[0].profile.chi][:BEGUN]


def exchanged(study: Study, both: Contestant) -> list[Contestant]:
    """Enter other effects beside each of two: the first was found while the second was not known."""
    effects = both.fit.effects
    return [one for kept in effects if len(effects) == CAUSES for one in second_causes(study, both, (kept,))]


def without_one(study: Study, both: Contestant) -> list[Contestant]:
    """Enter each effect of several without one of the others, started from their common fit."""
    effects = both.fit.effects
    fewer = [
        hypothesis_of((*effects[:place], *effects[place + 1 :]), both.fit.z, initial=both.fit.initial)
        for place in range(len(effects))
        if len(effects) > 1
    ]
    return sound(study, study.contest.enter_all(fewer))


def words_of_kinds(study: Study, found: Contestant) -> frozenset[tuple[str, str]]:
    """Give the kind of part that each effect of a fit acts at, with its word."""
    kinds = _kinds(study)
    return frozenset((kinds.get(one.site, one.site), one.effect) for one in found.fit.effects)


def shared(study: Study, found: Contestant) -> list[Contestant]:
    """Enter the words of a fit at all sites of their kinds at once: parts of a kind are made alike.

    Where one does nothing it's left out, and the others are fitted again.
    """
    words = {one.kind.name: one for one in found.fit.effects}
    everywhere = [*found.fit.effects, *(each for one in words.values() for each in _elsewhere(study, found, one))]
    if len(everywhere) == len(found.fit.effects):
        return []
    entered = study.contest.enter_all([hypothesis_of((*everywhere,), found.fit.z, initial=found.fit.initial)])
    run = study.contest.run
    left = [[effect for effect in one.fit.effects if not is_another(run, one, effect)] for one in entered]
    fewer = [
        hypothesis_of((*some,), one.fit.z, initial=found.fit.initial)
        for one, some in zip(entered, left, strict=True)
        if len(found.fit.effects) < len(some) < len(one.fit.effects)
    ]
    return sound(study, [*entered, *study.contest.enter_all(fewer)])


def _elsewhere(study: Study, found: Contestant, effect: AttachedEffect) -> list[AttachedEffect]:
    """Give a little of an effect at the other sites of its kind; nothing of pairs, which a machine has many of."""
    kinds = _kinds(study)
    kind, taken = kinds.get(effect.site), {one.site for one in found.fit.effects}
    if kind not in ("joint", "body", "input", "output") or effect.source is not None:
        return []
    return [little_of(effect, site=name) for name, other in kinds.items() if other == kind and name not in taken]


def _kinds(study: Study) -> dict[str, str]:
    """Kind of part of each site, by its name."""
    return {site.name: site.kind for place in study.location.places for site in place.sites}


def _behind(
    study: Study, found: Contestant, kept: tuple[AttachedEffect, ...]
) -> tuple[Model, Location, KnownEffect | None] | None:
    """Where the rest of the gap lies when some effects of a fit are known; None when the model diverges without.

    Linear effects, and all of a black box's, are in the model that comes with it; others are taken from the log.
    """
    contest, model, known = study.contest, study.model, None
    # They leave details of their laws, which a quiet band of coloured noise would make more of than of any effect.
    floor = with_law_error(contest.noise.lowered(found.held), np.std(study.measurement.outputs, axis=1))
    if contest.run.is_black_box or all(one.kind.linear for one in kept):
        model = model.with_effects((*model.effects, *kept))
    else:
        try:
            known = KnownEffect.of(contest.run, found.fit, kept)
        except ModelError:
            return None
    rest = study.measurement if known is None else known.without(study.measurement)
    return model, locate(model, rest, floor, contest.run.tunables, found.fit.z), known


def _of_pair(pair: Located, weighed: Sequence[Form]) -> list[Hypothesis]:
    found = searched([pair], weighed)
    forms = []
    for place in pair.places:
        there = [one for one in found if one.trial.site.name in place.names]
        forms.append(effect_hypotheses(there, count=LEADS))
    return [
        hypothesis_of((*first.effects, *second.effects), pair.profile.z) for first in forms[0] for second in forms[1]
    ]


def _same_places(study: Study, sites: Collection[str]) -> set[str]:
    """Names of sites, and of those that these sensors can't tell from them."""
    places = [located.places[0].names for located in study.location.ranked]
    return {*sites, *(name for names in places if not set(sites).isdisjoint(names) for name in names)}
