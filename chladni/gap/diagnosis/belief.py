"""What is believed: sets of causes, each by its best fit, beside "unknown at a place"; all by one evidence."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

import numpy as np

from chladni.gap.calibration import ANOTHER, CLOSE, DETAILS, LAPSE, LEAST_SHARE, NAMED, TEMPER
from chladni.gap.explanation.evidence import Left, doubt_of, highest_level, left_by_force
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.profile import Profile
from chladni.gap.plant.places import sites_of
from chladni.gap.records.diagnosis import PARAMETER, Candidate
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real

Causes = frozenset[Candidate]


@dataclass(frozen=True, slots=True)
class Believed:
    """A set of causes (none: the model is right) with its best fit and its probability."""

    causes: Causes
    best: Contestant
    nats: float
    probability: float


class Belief:
    """Posterior over the sets of causes that were fitted, and over an unknown one at each place.

    Parameters
    ----------
    contestants
        All that were fitted, the one without causes first.
    pair
        Unknown forces at two places that explain much more than one, None without.
    told
        Names of sensors whose error needs no fit to be told: nothing unknown acts there.
    windows
        Whether contestants run over windows: what they leave is of another horizon than the location's record.
    """

    def __init__(
        self,
        location: Location,
        contestants: Sequence[Contestant],
        pair: Located | None = None,
        *,
        kinds: Collection[EffectKind] = tuple(CATALOGUE.values()),
        told: Collection[str] = (),
        windows: bool = False,
    ) -> None:
        self._location = location
        problem = location.problem
        sites = [site.kind for site in sites_of(problem.model.compile(), problem.measurement.output_names)]
        self._kinds = Counter(sites)
        self._family = {kind.name: kind.family for kind in kinds}
        #: Nats of one more cause: that there is one, and that it's this word at this site.
        self.word = float(np.log(ANOTHER) - np.log(max(sum(kind in one.sites for one in kinds for kind in sites), 1)))
        self.value = float(np.log(ANOTHER) - np.log(max(len(problem.tunables.names), 1)))
        self.site = float(np.log(ANOTHER) - np.log(max(len(sites), 1)))
        self._contestants, self._sensors = tuple(contestants), len(problem.measured)
        alone = [one.left.along + one.left.across for one in contestants if not one.hypothesis.effects]
        self._horizon = min(alone) / location.tuned.misfit if windows and location.tuned.misfit else 1.0
        self._told = np.isin(problem.measurement.output_names, list(told))
        places = [*location.ranked, *([] if pair is None else [pair])]
        self._places = [one for one in places if all(set(told).isdisjoint(each.names) for each in one.places)]

    def nats(self, one: Contestant) -> float:
        """Evidence and prior of one fit."""
        prior = self.value * len(one.hypothesis.freed) + self._words(one.hypothesis.effects)
        return self.evidence(one) + prior

    def evidence(self, one: Contestant) -> float:
        """Evidence of one fit where the noise has the level that is believed, not that of the floor."""
        return one.log_evidence - one.left.log_likelihood + one.left.at(self.level).log_likelihood

    @cached_property
    def level(self) -> Real:
        """``[output]`` share of the floor that the noise has: what the closest fit leaves, as far as that allows.

        One share for all would put what one floor is too high by to the account of what others leave, but for
        hypotheses of causes at as many places as there are sensors.
        """
        closest = min((one.left for one in self._contestants), key=lambda left: left.over_noise)
        found = np.array(closest.outputs) if closest.outputs else closest.over_noise
        # What a coarse sensor rounds off follows its signal: there the noise is whatever is left.
        highest = np.where(self._told, np.inf, highest_level(self._location.problem.noise))
        return np.minimum(found, highest)

    def unexplained(self, one: Contestant) -> float:
        """Nats of what a fit leaves that neither noise nor usual details of its laws account for."""
        return one.left.at(self.level).unexplained

    def elsewhere(self, located: Located) -> float:
        """Nats of what a force at a place (or two) leaves."""
        return self._left_by_force(located).at(self.level).elsewhere

    def beyond(self, one: Contestant) -> Real:
        """``[output]`` energy that a fit leaves beyond the noise, over what noise leaves; one number of windows."""
        left = one.left
        if not left.outputs:
            return np.array([left.at(self.level).beyond / (left.along_expected + left.across_expected)])
        return np.maximum(np.array(left.outputs) - self.level, 0.0)

    def is_much(self, energy: Real) -> bool:
        """Whether that is enough for a cause to be named: a share of an output's gap, and more than noise may be."""
        return bool(np.any(energy > self.least))

    def _words(self, effects: Sequence[AttachedEffect]) -> float:
        """Nats of effects: each at a site of its own, or one word at several sites of a kind, as far as that is less.

        Parts of a kind are made alike: what one joint lacks the others may lack too. Then there's one more cause,
        that they share it, and which of the sites do.
        """
        # Which other output one listens to is chosen, too.
        nats = -np.log(max(self._kinds["output"] - 1, 1)) * sum(one.source is not None for one in effects)
        kinds = {one.kind.name: one.kind for one in effects}
        for name, kind in kinds.items():
            alike = [one.site for one in effects if one.kind.name == name]
            sites, count = set(alike), len(alike)
            where = sum(self._kinds[each] for each in kind.sites)
            shared = np.log(ANOTHER) - np.log(comb(max(where, len(sites)), len(sites)))
            nats += self.word + max(self.word * (count - 1), shared if len(sites) == count > 1 else -np.inf)
        return float(nats)

    def unknown_at(self, located: Located) -> float:
        """Nats of a force of any shape at a place (or two): its size is free, and no law is in it.

        Each of its numbers costs a nat: one that the log tells nothing of is none.
        """
        if not located.profile.forces:
            return -np.inf
        left = self._left_by_force(located)
        places = len(located.places)
        return left.at(self.level).log_likelihood - 0.5 * located.profile.prior + (self.site - DETAILS) * places

    def _left_by_force(self, located: Located) -> Left:
        tuned, found = self._of_horizon(self._location.tuned), self._of_horizon(located.profile)
        return left_by_force(self._location.problem, tuned, found)

    def _of_horizon(self, profile: Profile) -> Profile:
        return replace(profile, misfit=self._horizon * profile.misfit) if self._horizon != 1.0 else profile

    @cached_property
    def sets(self) -> tuple[Believed, ...]:
        """Sets of causes by falling probability."""
        best: dict[Causes, Contestant] = {}
        for one in sorted(self._contestants, key=self.nats, reverse=True):
            best.setdefault(frozenset(one.hypothesis.named), one)
        credit = {causes: self.nats(one) for causes, one in best.items()}
        for causes in sorted(best, key=len, reverse=True):
            # A cause that does hardly anything has no name, but what it makes of the others is theirs.
            fewer = self._without_idle(causes, best)
            own = credit.pop(causes) if fewer else -np.inf
            credit.update({one: max(credit[one], own) for one in fewer})
        best = {causes: best[causes] for causes in credit}
        nats = np.array([*credit.values()])
        unknown = self._unknown()
        top = max(float(nats.max()), unknown)
        weight = np.exp((nats - top) / TEMPER)
        share = (1.0 - LAPSE) * weight / (weight.sum() + np.exp((unknown - top) / TEMPER))
        found = [
            Believed(causes, one, float(each), float(part))
            for (causes, one), each, part in zip(best.items(), nats, share, strict=True)
        ]
        return tuple(sorted(found, key=lambda one: -one.nats))

    @cached_property
    def least(self) -> Real:
        """``[output]`` as `beyond`: what a cause must explain, a share of what values alone, right or wrong, leave.

        Of any output is enough: where one has a hundredth of another one's noise, its gap alone would be the gap.
        """
        valued = [one for one in self._contestants if not one.hypothesis.effects]
        gap = np.min([self.beyond(one) for one in valued], axis=0)
        return np.asarray(LEAST_SHARE * gap + min(one.left.doubt for one in valued), dtype=np.float64)

    def _without_idle(self, causes: Causes, best: Mapping[Causes, Contestant]) -> list[Causes]:
        """Sets that lack one of the causes and leave hardly more than all of them do.

        A word at several sites is one cause: each of them could do a part of what the others do.
        """
        words = Counter(one.effect for one in causes)
        alone = [one for one in causes if words[one.effect] == 1 or one.effect == PARAMETER]
        fewer = [causes - {one} for one in alone if causes - {one} in best]
        return [one for one in fewer if not self.is_much(self.beyond(best[one]) - self.beyond(best[causes]))]

    def _unknown(self) -> float:
        return float(np.logaddexp.reduce([self.anywhere, *(self.unknown_at(one) for one in self._places)]))

    @cached_property
    def anywhere(self) -> float:
        """Nats of forces of any shape at as many places as there are sensors: any of these explain all."""
        tuned = self._of_horizon(self._location.tuned)
        left = Left(
            along=tuned.misfit, along_expected=tuned.expected, across=0.0, across_expected=0.0,
            force=np.inf, doubt=doubt_of(self._location.problem.noise), sites=self._sensors,
        )  # fmt: skip
        return left.at(self.level).log_likelihood - 0.5 * tuned.prior + (self.site - DETAILS) * self._sensors

    @property
    def best(self) -> Contestant:
        """The most probable fit."""
        return self.sets[0].best

    @property
    def unknown(self) -> float:
        """Probability that the cause is none of those that were fitted."""
        return max(1.0 - sum(one.probability for one in self.sets), 0.0)

    def probability(self, *candidates: Candidate) -> float:
        """Probability of any of some causes, whatever stands beside it."""
        wanted = set(candidates)
        return float(sum(one.probability for one in self.sets if not wanted.isdisjoint(one.causes)))

    def in_its_place(self, cause: Candidate) -> tuple[Candidate, ...]:
        """Give a cause of the first set, then what could stand in its place as far as the log can tell."""
        first = self.sets[0]
        near = [one for one in self.sets if one.nats > first.nats - CLOSE and len(one.causes) == len(first.causes)]
        rest = first.causes - {cause}
        others = [each for one in near if rest < one.causes for each in one.causes - rest]
        return tuple(dict.fromkeys([cause, *others]))

    def alike(self, cause: Candidate) -> tuple[Candidate, ...]:
        """Give the narrowest group that is more probable than not and that the log can't tell from a cause.

        That is its word at all sites that could be its own, or, where none of the words there has half of it, those
        of the same family with it.
        """
        others = self.in_its_place(cause)
        word = tuple(one for one in others if one.effect == cause.effect)
        if self.probability(*word) >= NAMED:
            return word
        sites, family = {one.site for one in word}, self._family.get(cause.effect)
        like = (one for one in others if one.site in sites and self._family.get(one.effect) == family is not None)
        return tuple(dict.fromkeys([*word, *like]))

    def answer_set(self, coverage: float) -> tuple[Candidate, ...]:
        """Give effects and sites that together hold the truth with some probability, the most probable first."""
        places = max(self._places, key=self.unknown_at).places if self._places else ()
        unknown = [Candidate(effect="unknown", site=one.names[0]) for one in places]
        rows = [(one.probability, [*one.causes] or [Candidate(effect="none", site="")]) for one in self.sets]
        rows.append((self.unknown, unknown or [Candidate(effect="unknown", site="")]))
        found: dict[Candidate, None] = {}
        held = 0.0
        for probability, named in sorted(rows, key=lambda row: -row[0]):
            found.update(dict.fromkeys(sorted(named, key=lambda one: (one.site, one.effect))))
            held += probability
            if held >= coverage:
                break
        return tuple(found)
