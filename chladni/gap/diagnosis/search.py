"""The search: moves that enter hypotheses, one after another while the believed one leaves something."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from chladni.gap.calibration import (
    BEGUN,
    CAUSES,
    FITS,
    FORMS,
    ITERATIONS,
    LEADS,
    MANY,
    PLACES,
    WORTH,
)
from chladni.gap.diagnosis.belief import Belief
from chladni.gap.diagnosis.following import followed
from chladni.gap.diagnosis.pairs import exchanged, paired_causes, second_causes, shared, without_one, words_of_kinds
from chladni.gap.diagnosis.plausible import is_lost, is_one_force, least_left, plausible_places, sound
from chladni.gap.diagnosis.study import Study, contest_over, over_model
from chladni.gap.diagnosis.told_holds import changed, other_holds, price
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import (
    effect_hypotheses,
    polished,
    siblings,
    sticking_hypotheses,
    twins,
)
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.linear_words import linear_beside, linear_elsewhere, linear_hypotheses
from chladni.gap.explanation.screen import Screened
from chladni.gap.explanation.wrong_values import with_wrong_values, wrong_values
from chladni.gap.location.locate import Located
from chladni.signals.errors import EstimateError

if TYPE_CHECKING:
    from chladni.gap.explanation.known_effect import KnownStates

Step = Callable[[float], None]


class Search:
    """Hypotheses on one log, entered move by move while the believed one leaves something.

    Parameters
    ----------
    study
        Of the log.

    Attributes
    ----------
    found
        Every sound contestant, that without a cause first.
    states
        That the machine went through, where all runs were lost and a law follows from these; else None.
    forces
        Two unknown forces that explain much more than one, when they were looked for; else None.
    """

    def __init__(self, study: Study) -> None:
        self.begin_anew(study, [_without_cause(study)])
        self.states: KnownStates | None = None
        #: Behind which holds were asked last.
        self._held: list[Contestant] = []
        #: Whose causes were left out last, one at a time.
        self._whole: Contestant | None = None
        self.forces: Located | None = None
        self._tried: set[object] = set()

    @cached_property
    def belief(self) -> Belief:
        """What is believed of all that was found."""
        study = self.study
        return Belief(
            study.location, self.found, self.forces,
            kinds=study.kinds, told=study.coarse, windows=study.windows is not None,
        )  # fmt: skip

    @property
    def best(self) -> Contestant:
        """The most probable one."""
        return self.belief.best

    def add(self, entered: Sequence[Contestant]) -> bool:
        """Take sound contestants in; whether the most probable one is another now."""
        before = self.best
        self.found += sound(self.study, entered)
        self.__dict__.pop("belief", None)
        return self.best is not before

    def enter(self, hypotheses: Sequence[Hypothesis], progress: Step | None = None) -> bool:
        """Fit hypotheses and take them in, but for forms that were fitted before."""
        new = [one for one in hypotheses if self._form(one) not in self._tried]
        self._tried.update(self._form(one) for one in new)
        return self.add(self.study.contest.enter_all(new, progress))

    def _form(self, one: Hypothesis) -> object:
        effects = frozenset((each.effect, each.site, each.variant, each.source) for each in one.effects)
        return effects, one.fitted, self.study.contest.run.tunables.wrong(one.start_z)

    @property
    def is_open(self) -> bool:
        """Whether the believed hypothesis leaves what another cause could be worth its price, and a name, for."""
        return self.belief.unexplained(self.best) > WORTH and self.belief.is_much(self.belief.beyond(self.best))

    def over(self, study: Study) -> "Search":
        """Give the search of the same log over another floor, with what was found judged anew."""
        other = copy(self)
        other.begin_anew(study, [study.contest.judged(one.hypothesis, one.fit) for one in self.found])
        return other

    def begin_anew(self, study: Study, found: list[Contestant]) -> None:
        """Take another study of the log, with contestants that were weighed in it, that without a cause first."""
        self.study, self.found, self.nothing = study, found, found[0]
        self.__dict__.pop("belief", None)

    def run(self, progress: Step) -> None:
        """Make moves until nothing is left to be explained, or none helps."""
        self.begin(progress)
        self.go_on(progress)

    def begin(self, progress: Step) -> None:
        """Look for one cause, for two at once where forces at two places tell more, and for forms that hide."""
        progress(0.1)
        if self.is_open:
            self._begin(progress)

    def _begin(self, progress: Step) -> None:
        candidates, hypotheses = self._one_cause(progress)
        self._linear_pairs()
        self._other_holds()
        if self.is_open and self.best.hypothesis.freed:
            # Where an unknown force acts shows only behind the values that are wrong.
            self.add(second_causes(self.study, self.best))
        if self.is_open and self._several_act():
            # Laws at one place only imitate what acts at two.
            self._two_at_once()
        elif self.is_open:
            self._hidden_forms(candidates, hypotheses)
        self._settle()

    def go_on(self, progress: Step) -> None:
        """Look for further causes, until nothing is left to be explained, or none helps."""
        progress(0.8)
        for _ in range(CAUSES):
            # A wrong hold leaves what any further cause would imitate.
            self._other_holds()
            if self._forces_end_it or not (self.is_open and self._one_more(progress)):
                break
        self._other_holds()
        self._settle()
        progress(1.0)

    @property
    def _forces_end_it(self) -> bool:
        """Whether unknown forces at fewer places than there are sensors leave nothing: others only imitate these."""
        if self.study.contest.run.is_black_box:
            # What its linear view doesn't follow another cause may do.
            return False
        sensors = len(self.study.measurement.output_names)
        tried = [one for one in (self.study.location.best, self.forces) if one is not None and one.profile.forces]
        if any(effect.kind.clues.several for lead in self._leads() for effect in lead.hypothesis.effects):
            # One place may have several of them.
            return False
        return sensors > 2 and any(len(one.places) < sensors and self.belief.elsewhere(one) < WORTH for one in tried)

    def _other_holds(self) -> None:
        """Ask what inputs did between samples behind the leading causes, which may have hidden it.

        What acts at an input itself could be any hold as far as an unknown force there tells. Where a hold leaves
        more than noise and details of laws, what else is missing may pass for it. One that was told before its causes
        were known is a guess, however well it fits: what it's worth shows beside the causes that others have.
        """
        study = self.study
        # However little of the gap a wrong hold leaves, it's no cause that must be worth a name.
        doubted = self.belief.unexplained(self.best) > WORTH or study.model is not study.stated
        leads = [one.best for one in self.belief.sets if one.causes][:PLACES] if doubted else []
        leads, self._held = [] if leads == self._held else leads, leads
        model, nats = study.model, max((one.log_evidence for one in leads), default=0.0)
        for others in other_holds(study.stated, study.measurement) if leads else ():
            for other in changed(model, others):
                found = contest_over(study, other).enter_all([_from_fit(one) for one in leads])
                best = max(found, key=lambda one: one.log_evidence, default=leads[0])
                dearer = price(study.stated, other) - price(study.stated, model)
                if best.log_evidence > nats + dearer and self.belief.unexplained(best) < WORTH:
                    model, nats = other, best.log_evidence
        if model is not study.model:
            begun = [_from_fit(one.best) for one in self.belief.sets[:BEGUN] if one.causes]
            study, self._tried = over_model(study, model), set()
            self.begin_anew(study, [_without_cause(study)])
            self.enter(begun)

    def _share(self) -> None:
        """Look whether the words of what leads act at all parts of their kinds: one fit each.

        Like laws at a few of many parts are close, so each of these words is tried. Parts of a kind are made alike:
        two words for them are no lead.
        """
        leads: dict[frozenset[tuple[str, str]], Contestant] = {}
        for one in self.belief.sets:
            words = words_of_kinds(self.study, one.best)
            if words and len(dict(words)) == len(words):
                leads.setdefault(words, one.best)
        for lead in list(leads.values())[:LEADS]:
            if self.is_open:
                self.add(shared(self.study, lead))

    def _several_act(self) -> bool:
        """Whether a force at the best place leaves what only another one explains."""
        best, sensors = self.study.location.best, len(self.study.measurement.output_names)
        return best is not None and sensors > 2 and self.belief.elsewhere(best) > WORTH

    def _two_at_once(self) -> None:
        pairs = paired_causes(self.study, self.best)
        self.states = pairs.states or self.states
        self.forces = pairs.forces or self.forces
        self.add(pairs.ranked)
        self._settle()

    def _one_cause(self, progress: Step) -> tuple[list[Screened], list[Hypothesis]]:
        """Fit what the screen promises most of, and values that may be wrong; give what was screened and fitted."""
        study, location = self.study, self.study.location
        places = plausible_places(location)
        if not is_one_force(location):
            places += self._beside_wrong_values()
        candidates = screened(location, places, study.kinds)
        progress(0.3)
        hypotheses = effect_hypotheses(candidates, count=FITS)
        values = wrong_values(location, study.contest.run.tunables)
        elsewhere = linear_elsewhere(study.model, location, study.kinds, candidates)
        self.enter([*hypotheses, *elsewhere, *values], lambda done: progress(0.3 + 0.4 * done))
        return candidates, hypotheses

    def _linear_pairs(self) -> None:
        """Fit a linear word beside each of the best ones, which a third word's details may have imitated both of.

        A pair that leaves noise alone is worth its price beside any word that leaves more than that.
        """
        study = self.study
        for lead in self._linear_leads():
            if -self.best.left.at(self.belief.level).log_likelihood > WORTH - self.belief.word:
                kept, z = lead.fit.effects, lead.fit.z
                self.enter(linear_beside(study.model, study.location, study.kinds, kept, z, self.best.chi))

    def _linear_leads(self) -> list[Contestant]:
        """The best linear words that explain half of the gap at least, in decades."""
        enough = np.sqrt(max(self.best.chi, 1.0) * self.nothing.chi)
        found = [one.best for one in self.belief.sets if one.best.hypothesis.effects and one.best.chi < enough]
        linear = [one for one in found if all(effect.kind.linear for effect in one.hypothesis.effects)]
        return [] if self.study.contest.run.is_black_box else linear[:LEADS]

    def _hidden_forms(self, candidates: Sequence[Screened], hypotheses: Sequence[Hypothesis]) -> None:
        """Fit forms that the screen ranks low though they're right: linear ones far off, laws whose runs are lost."""
        study, location = self.study, self.study.location
        self.enter(linear_hypotheses(study.model, location, candidates))
        if self.is_open:
            self.enter(_others(effect_hypotheses(candidates, count=MANY), hypotheses))
        if self.is_open and is_lost(location, self._least):
            self.enter(sticking_hypotheses(location, study.kinds))
        if self.is_open and is_lost(location, self._least):
            shots = followed(study, location.best, hypotheses)
            if shots is not None:
                self.states = shots.states
                self.add(shots.ranked)

    def _beside_wrong_values(self) -> list[Located]:
        """The leading places with the values that are wrong beside a force there."""
        study = self.study
        tunables = study.contest.run.tunables
        leading = study.location.ranked[:LEADS] if len(study.measurement.output_names) > 1 else ()
        found = [with_wrong_values(study.location, one, tunables) for one in leading]
        return [one for one in found if one is not None]

    def _one_more(self, progress: Step) -> bool:
        """Look for another cause beside those that are believed, or for several in their place; whether it helped."""
        study, before, nats = self.study, self.best, self.belief.nats(self.best)
        self._share()
        for lead in self._leads():
            if self.is_open:
                self.add(second_causes(study, lead))
        progress(0.86)
        if self.is_open and not self._several_act() and len(before.hypothesis.effects) < CAUSES:
            self._two_at_once()
        progress(0.94)
        if self.best is before:
            return False
        self.add(exchanged(study, self.best))
        self._settle()
        return self.belief.nats(self.best) > nats + WORTH

    def _settle(self) -> None:
        """Fit the relatives of what leads, its details, the sites that can't be told from its own, and fewer causes.

        A cause that was found beside another one may have imitated the details of that one's law, which only now are
        known: each is left out once, and what is believed then is settled likewise.
        """
        study = self.study
        if not self.best.hypothesis.effects:
            return
        self.enter(self._relatives())
        for one in self._forms():
            # What details may bring is what is missing to noise alone.
            if -one.left.at(self.belief.level).log_likelihood > WORTH:
                self.add(_polished(study, one))
        self.enter(twins(self.best, study.location.places))
        whole = self.best
        if len(whole.hypothesis.effects) > 1 and whole is not self._whole:
            self._whole = whole
            if self.add(without_one(study, whole)):
                self._settle()

    def _relatives(self) -> list[Hypothesis]:
        others = siblings(self.best, self.study.contest.run)
        return [one for one in others if all(self.study.takes_part(each.effect) for each in one.effects)]

    def _forms(self) -> list[Contestant]:
        """The first few forms that name as much as the best one."""
        count = len(self.best.hypothesis.named)
        alike = [one for one in self.found if one.hypothesis.effects and len(one.hypothesis.named) == count]
        return best_forms(sorted(alike, key=self.belief.nats, reverse=True))

    def _leads(self) -> list[Contestant]:
        """The best and the next at another site: of two causes either may look like the first."""
        leads: dict[frozenset[str], Contestant] = {}
        for one in self.belief.sets:
            if one.causes:
                leads.setdefault(frozenset(effect.site for effect in one.best.hypothesis.effects), one.best)
        return list(leads.values())[:LEADS]

    @property
    def _least(self) -> float:
        return least_left([one for one in self.found if one.hypothesis.effects])


def _without_cause(study: Study) -> Contestant:
    """Give the tuned model alone."""
    contest = study.contest
    found = contest.enter(Hypothesis(start_z=study.location.tuned.z), max_iterations=2 * ITERATIONS)
    if found is None:
        # Too sensitive to be fitted in free run: what the linear part said of the parameters has to do.
        found = contest.enter(Hypothesis(start_z=study.location.tuned.z), tune=False)
    if found is None:
        raise EstimateError(
            f"model {study.model.name!r} diverges on log {study.measurement.log!r} within its tolerances; "
            "check the model's stability and the units of its inputs"
        )
    return found


def _from_fit(found: Contestant) -> Hypothesis:
    """Give a hypothesis again from where its fit ended."""
    return replace(found.hypothesis, effects=found.fit.effects, start_z=found.fit.z, initial=found.fit.initial)


def _others(found: Sequence[Hypothesis], tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that name what none of the tried ones does."""
    names = {one.named for one in tried}
    return [one for one in found if one.named not in names]


def best_forms(ranked: Sequence[Contestant]) -> list[Contestant]:
    """The first few that differ in more than where their search began."""
    forms: dict[object, Contestant] = {}
    for one in ranked:
        key = (one.hypothesis.named, tuple(effect.variant for effect in one.hypothesis.effects))
        forms.setdefault(key, one)
    return list(forms.values())[:FORMS]


def _polished(study: Study, found: Contestant) -> list[Contestant]:
    """Let the details of the laws move too: creep, presliding, shape."""
    finer = polished(found.hypothesis, found.fit)
    if finer is None:
        return []
    # Windows of a lost fit begin where no details lead out: then it's the linear part that tells their states.
    starts = [finer, replace(finer, initial=None)] if study.windows is not None else [finer]
    return study.contest.enter_all(starts)
