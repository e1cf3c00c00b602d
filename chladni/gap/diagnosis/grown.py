"""Second effects that grow from little beside a first one, where what that leaves has lost its run.

Taken from the log, a law that is only half of the cause leaves a rest that no place and no law explains: another one
beside it would have led it elsewhere. Then every word at every site begins beside it, and all numbers move together.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

from chladni.gap.diagnosis.search import sound
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import effect_of, hypothesis_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.screen import Screened
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.profile import profiled
from chladni.models.effects.attached_effect import kind_of

#: Words at sites that begin beside a first effect, steps that they are given, and those that go on to the end.
_TRIED, _STEPS, _ENTERED = 48, 2, 4
#: What an effect begins with of the numbers that make it larger: screened alone it stood for both.
_LITTLE = 0.1


class Grown:
    """Words that begin beside a first effect.

    Parameters
    ----------
    study
        Of the log.
    """

    def __init__(self, study: Study) -> None:
        self.study = study

    @cached_property
    def _candidates(self) -> list[Screened]:
        study = self.study
        found = screened(study.location, _everywhere(study.location), study.kinds)
        return [each for one in found for each in (one, *_turned(one)) if study.takes_part(each.trial.effect)]

    def beside(self, lead: Contestant) -> list[Contestant]:
        """Enter the words that, beside a fit of one effect, explain most in their first steps."""
        study = self.study
        begun = study.contest.enter_all([*self._begun(lead)], max_iterations=_STEPS, only_coarse=True)
        begun = sound(study, begun)
        begun.sort(key=lambda one: one.chi)
        return sound(study, study.contest.enter_all([_on_from(one) for one in begun[:_ENTERED]]))

    def _begun(self, lead: Contestant) -> Iterator[Hypothesis]:
        fit = lead.fit
        tried: set[tuple[str, str]] = set()
        # At the same site a second word would mend the details of the first one's law.
        taken = {one.site for one in fit.effects}
        for one in self._candidates:
            key = (one.trial.effect, one.trial.site.name)
            effect = None if key in tried or key[1] in taken else effect_of(_little(one))
            if effect is None:
                continue
            tried.add(key)
            yield hypothesis_of((*fit.effects, effect), fit.z, screened=one.chi, initial=fit.initial)
            if len(tried) == _TRIED:
                return


def _turned(one: Screened) -> list[Screened]:
    """Give a softening spring as a hardening one and back: alone it stood for what is left of both effects."""
    opposite = one.trial.kind.clues.opposite if one.trial.kind is not None else None
    other = opposite(one.values) if opposite is not None else None
    if other is None:
        return []
    return [replace(one, trial=replace(one.trial, kind=kind_of(other.effect)), values=other.values)]


def _little(one: Screened) -> Screened:
    sizes = one.trial.kind.clues.sizes if one.trial.kind is not None else ()
    values = {name: (_LITTLE if name in sizes else 1.0) * value for name, value in one.values.items()}
    return replace(one, values=values)


def _on_from(begun: Contestant) -> Hypothesis:
    fit = begun.fit
    return hypothesis_of(fit.effects, fit.z, screened=begun.hypothesis.screened, initial=fit.initial)


def _everywhere(location: Location) -> list[Located]:
    """Every place: beside a first effect the second may be where it alone explains nothing."""
    ranked = {one.places[0] for one in location.ranked}
    others = [place for place in location.places if place not in ranked]
    start = location.tuned.z
    return [
        *location.ranked,
        *(
            Located(places=(place,), profile=profiled(location.problem, (place.sites[0],), start, iterations=2))
            for place in others
        ),
    ]
