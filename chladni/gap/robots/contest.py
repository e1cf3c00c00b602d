"""Fits of sets of terms to the missing torque of all joints at once, and their evidence."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from math import log

import numpy as np
from scipy.sparse.csgraph import connected_components

from chladni.gap.calibration import ANOTHER, DETAILS, QUARTER
from chladni.gap.robots.fit import Fit, bounded, root_of
from chladni.gap.robots.joints_left import JointsLeft
from chladni.gap.robots.promise import Promises
from chladni.gap.robots.row import Moments, Row, columns_of_rows, parts_of
from chladni.gap.robots.set_prior import SetPrior
from chladni.gap.robots.term import FOUND, Term
from chladni.gap.robots.tolerances import LOOP_S, tolerances
from chladni.gap.robots.torques import ALL_COMMANDS, RIGHT, Torques
from chladni.gap.robots.words import all_terms
from chladni.signals.arrays import Index, Mask, Real

#: Information over the prior's: what a log tells less of stays where it's believed.
_UNTOLD = 1e-3
_ROUNDS, _NEAR = 8, 3
#: Fits that are kept, those that were asked for last: twice as many as a search looks at around one set.
_KEPT = 512


class Contest:
    """Terms of one log, whitened, so that sets of them are fitted by small matrices.

    Parameters
    ----------
    left_out
        Words, and words at a site, that don't take part.
    taking_part
        ``[coarse]``: what is fitted to; all that moves when None.
    terms
        What takes part; every word at every site when None.
    """

    def __init__(
        self,
        torques: Torques,
        left_out: frozenset[str] = frozenset(),
        *,
        taking_part: Mask | None = None,
        terms: Sequence[Term] | None = None,
    ) -> None:
        self.torques = torques
        self.terms = list(all_terms(torques, left_out) if terms is None else terms)
        there = torques.moving if taking_part is None else torques.moving & taking_part
        self._whiten = np.sqrt(torques.numbers_a_sample) * there / torques.noise[:, None]
        inside, self._tolerated = tolerances(torques)
        self._told = _told(inside * self._whiten)
        self.within = len(self._told)
        starts = np.cumsum([self.within, *(len(term.scale) for term in self.terms)])
        self._places = {
            id(term): np.arange(a, a + len(term.scale)) for term, a in zip(self.terms, starts, strict=False)
        }
        self._size = int(starts[-1])
        whole = (parts_of(np.tensordot(self._told, inside, 1)), np.ones(self.within))
        columns = columns_of_rows(torques.missing.shape, [whole, *((term.parts, term.scale) for term in self.terms)])
        self._rows = tuple(self._row(row, *each) for row, each in enumerate(columns))
        self.count = torques.numbers_a_sample * np.sum(there, axis=1)
        self._energy = np.sum((torques.missing * self._whiten) ** 2, axis=1)
        self._start = 1.0 / (1.0 + np.maximum(self._energy - self.count, 0.0) / np.maximum(self.count, 1.0))
        bounds = [term.least / term.scale for term in self.terms]
        self._least = np.concatenate([np.full(self.within, -np.inf), *bounds])
        self._mean = np.concatenate([np.zeros(self.within), *(term.about / term.scale for term in self.terms)])
        self.prior = SetPrior.among(self.terms, torques.robot)
        others = frozenset(joint.name for joint in torques.joints).difference(*self.prior.like)
        self.groups = (*self.prior.like, others)
        # What tolerances alone leave.
        self._before = self._energy
        self._fits: dict[tuple[tuple[int, ...], bytes | None], Fit] = {}
        self._promises: dict[tuple[tuple[int, ...], bytes, bytes], Real] = {}
        self.nothing = self.fit(())
        self._before = self.nothing.energy
        self._fits.clear()

    def _row(self, row: int, numbers: Index, columns: Real) -> Row:
        return Row.of(numbers, columns, self._whiten[row], self.torques.missing[row])

    def _with(self, **parts: object) -> "Contest":
        """Give the same at the same prices, but for these parts."""
        other = copy(self)
        for made in ("_promising", "_acting"):
            vars(other).pop(made, None)
        vars(other).update(parts, _fits={}, _promises={})
        return other

    def narrowed(self, terms: Sequence[Term]) -> "Contest":
        """Give the contest of these terms alone, at the same prices."""
        chosen = self._chosen(terms)
        counts = np.cumsum([self.within, *(len(term.scale) for term in terms)])
        return self._with(
            terms=list(terms), _rows=tuple(one.among(chosen) for one in self._rows), _size=chosen.size,
            _least=self._least[chosen], _mean=self._mean[chosen],
            _places={id(term): np.arange(a, a + len(term.scale)) for term, a in zip(terms, counts, strict=False)},
        )  # fmt: skip

    def joined(self, term: Term) -> "Contest":
        """Give the contest with one term more, at the same prices."""
        first, count = self._size, len(term.numbers)
        more = columns_of_rows(self.torques.missing.shape, [(term.parts, term.scale)])
        both = tuple(
            self._row(row, np.concatenate([one.numbers, first + numbers]), np.concatenate([one.columns, columns]))
            if numbers.size
            else one
            for row, (one, (numbers, columns)) in enumerate(zip(self._rows, more, strict=True))
        )
        return self._with(
            terms=[*self.terms, term], _rows=both, _size=first + count,
            _least=np.concatenate([self._least, term.least / term.scale]),
            _mean=np.concatenate([self._mean, term.about / term.scale]),
            _places={**self._places, id(term): np.arange(first, first + count)},
        )  # fmt: skip

    def fit(self, terms: Sequence[Term], near: "Fit | None" = None) -> Fit:
        """Fit a set: most probable numbers, each joint weighed by how far from its noise it is left.

        Parameters
        ----------
        near
            A fit of nearly the same set, whose weights are begun with.
        """
        key = tuple(map(id, terms)), None if near is None else near.weight.tobytes()
        found = self._fits.pop(key, None)
        if found is None:
            begin, rounds = (self._start, _ROUNDS) if near is None else (near.weight, _NEAR)
            found = self._fit(terms, begin, rounds)
        # What was asked for last stands last.
        self._fits[key] = found
        if len(self._fits) > _KEPT:
            del self._fits[next(iter(self._fits))]
        return found

    def _fit(self, terms: Sequence[Term], weight: Real, rounds: int) -> Fit:
        chosen = self._chosen(terms)
        moments = Moments.of(self._rows, chosen)
        laws = moments.at_rows(self._laws(terms))
        least, mean = self._least[chosen], self._mean[chosen]
        arms, (belief, narrow) = self._arms(terms), self.prior.information(terms, self.within)
        for _ in range(rounds):
            numbers = bounded(moments.information(weight) + belief, moments.toward(weight) + belief @ mean, least)
            for first, last, share in arms:
                least[first] = max(share * float(np.linalg.norm(numbers[first + 1 : last])), 0.0)
                numbers[first] = max(numbers[first], least[first])
            louder = self._louder(terms, numbers)
            shares = self._passing(terms, numbers), self._units(terms, numbers), louder
            left = self._left(moments, numbers, laws, *shares)
            weight = left.weight / louder
        root = root_of(moments.information(weight) + belief)
        size = -0.5 * float((numbers - mean) @ belief @ (numbers - mean)) - float(np.sum(np.log(np.diag(root))))
        size += 0.5 * narrow
        return Fit(
            terms=tuple(terms), numbers=numbers, root=root, left=left, within=self.within,
            nats=float(np.sum(left.log_likelihood)) + size + self.prior.nats(terms), weight=weight,
            louder=louder,
        )  # fmt: skip

    def tolerances(self, fit: Fit) -> dict[str, tuple[float, float]]:
        """Give what a fit says of numbers in their tolerances: value and standard deviation, over the tolerance."""
        values, covariance = self._within(fit)
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return dict(zip(self._tolerated, zip(values.tolist(), deviations.tolist(), strict=True), strict=True))

    def delay_of_all(self, fit: Fit) -> tuple[float, float]:
        """Give how late the commands of all joints come, and its standard deviation, s.

        They wait for the loop's turn. Where efforts would be the same for other delays, the motion tells which it is.
        """
        within, torques = self.tolerances(fit), self.torques
        (turn, _), (later, doubt) = (within.get(name, (0.0, 1.0)) for name in ("turn", "later"))
        place = next((at for at, term in enumerate(fit.terms) if term.key == ("delay", ALL_COMMANDS)), None)
        if place is None:
            return torques.robot.delay_s + LOOP_S * turn, 0.0
        values, deviations = fit.values(place)
        middle, width = torques.guesses.late_s.get(ALL_COMMANDS), torques.doubt_s
        if middle is None or width == 0.0:
            return float(values[0]) + LOOP_S * turn, float(deviations[0])
        return torques.robot.delay_s + middle + width * later, float(np.hypot(deviations[0], width * doubt))

    def together(self, fit: Fit, weights: Sequence[Mapping[str, float]]) -> tuple[Real, Real]:
        """Give what a fit says of weighted sums of numbers in their tolerances: values, and covariance."""
        weight = np.array([[each.get(name, 0.0) for name in self._tolerated] for each in weights])
        values, covariance = self._within(fit)
        return weight @ values, weight @ covariance @ weight.T

    def _within(self, fit: Fit) -> tuple[Real, Real]:
        """``[tolerance]`` and ``[tolerance, tolerance]``: values and covariance, over the tolerances."""
        told, own = self._told, slice(self.within)
        narrowed = np.eye(self.within) - fit.covariance[own, own]
        return fit.numbers[own] @ told, np.eye(told.shape[1]) - told.T @ narrowed @ told

    def again(self, fit: Fit) -> Fit:
        """Fit a set of another contest, of the same words at the same sites."""
        return self.fit(self.same(fit.terms))

    def nats_of(self, terms: Sequence[Term]) -> float:
        """Give the evidence of another contest's terms, at this one's noise."""
        small = self.narrowed([])
        for term in terms:
            small = small.joined(term)
        return small.fit(terms).nats

    def same(self, terms: Sequence[Term]) -> list[Term]:
        """Give this contest's terms of the words, sites and forms of another's."""
        forms = {(term.site, *term.kind): term for term in self.terms}
        found = []
        for term in terms:
            # A form that was found, else that of the grid; a secant became the slope where it led to.
            kinds = (term.word, term.variant, FOUND), term.kind, (term.word, None, 0)
            found.append(next(forms[term.site, *kind] for kind in kinds if (term.site, *kind) in forms))
        return found

    def _arms(self, terms: Sequence[Term]) -> list[tuple[int, int, float]]:
        """Places of a mass and behind its moments, and the least mass a unit of moment; over their scales."""
        found, place = [], self.within
        for term in terms:
            count = len(term.numbers)
            if term.reach is not None:
                found.append((place, place + 4, float(term.scale[1] / term.scale[0] / term.reach)))
            place += count
        return found

    def _laws(self, terms: Sequence[Term]) -> Real:
        """Give ``[row, number]``: one where a number idealises: of a joint's laws, of what its drive doesn't give."""
        found = np.zeros((len(self._rows), self.within + sum(len(term.numbers) for term in terms)))
        place = self.within
        for term in terms:
            rows = self.rows(term) if term.takes else term.rows
            count = len(term.numbers)
            found[list(rows), place : place + count] = [not one.is_exact for one in term.numbers]
            place += count
        return found

    def _passing(self, terms: Sequence[Term], numbers: Real) -> Real:
        """Give ``[row]``: share that the energy left is of what it'd be in units of the torque that was asked for.

        What takes nearly all of it would explain anything, as a gain near zero would.
        """
        taken: dict[int, Real] = {}
        place = self.within
        for term in terms:
            if term.takes:
                first = self._places[id(term)][0]
                for row in self._acting[first]:
                    taken[row] = taken.get(row, 0.0) + numbers[place] * self._rows[row].column(first)
            place += len(term.numbers)
        found = np.ones(len(self._energy))
        for row, part in taken.items():
            asked = self.torques.asked_of[row]
            passing = float(np.var(asked - part)) / (float(np.var(asked)) + 1e-300)
            found[row] = min(passing / QUARTER, 1.0) + 1e-6
        return found

    def _units(self, terms: Sequence[Term], numbers: Real) -> Real:
        """Give ``[row]``: how many units of what was asked for one of the machine's torque is, squared, one at most.

        What a law leaves beyond noise is the machine's: a gain doesn't make it small.
        """
        found, place = np.ones(len(self._energy)), self.within
        for term in terms:
            if term.over_gain:
                over = float(term.nominal[0] + numbers[place] * term.scale[0])
                found[self._acting[self._places[id(term)][0]]] *= min(over, 1.0) ** 2
            place += len(term.numbers)
        return found

    def _louder(self, terms: Sequence[Term], numbers: Real) -> Real:
        """Give ``[row]``: power of the noise over that of the machine as described.

        What readings shake by asks for more torque the more inertia it moves. The likelihood is that of the readings:
        what makes more torque of their noise makes as much more of all that they say, so that no determinant is left.
        """
        torques, found, place = self.torques, np.ones(len(self._energy)), self.within
        inertia = torques.inertia
        for term in terms:
            count = len(term.numbers)
            if term.added_inertia is not None:
                added = numbers[place : place + count] * term.scale
                inertia = inertia + np.tensordot(added, term.added_inertia, 1)
            place += count
        if inertia is not torques.inertia:
            joints = slice(len(torques.joints))
            more = torques.reading_noise_at(inertia) - torques.described_reading_noise
            found[joints] += more / torques.noise[joints] ** 2
        return found

    def _left(
        self, moments: Moments, numbers: Real, laws: Real, passing: Real, units: Real, louder: Real
    ) -> JointsLeft:
        at_rows = moments.at_rows(numbers)
        energy = (self._energy - 2.0 * np.sum(moments.right * at_rows, axis=1) + moments.power(at_rows)) / passing
        energy += np.maximum(energy - self.count * louder, 0.0) * (1.0 / units - 1.0)
        # Neither a law that is undone by tolerances nor one that adds nothing has details.
        force = np.minimum(moments.power(laws * at_rows), self._before - energy)
        return JointsLeft(
            energy=np.maximum(energy, 0.0) / louder, count=self.count, force=np.maximum(force, 0.0) / louder
        )

    def quietest(self, fit: Fit) -> Real:
        """Give ``[row]``: least energy over the noise that a fit leaves, or with the term more that promises most.

        As the machine that is described would leave it.
        """
        found = fit.over_described
        taken = {term.key for term in fit.terms}
        for row in range(len(found)):
            alone = np.zeros(len(found))
            alone[row] = 1.0
            _, term = next(one for one in self.promise(replace(fit, weight=alone)) if one[1].key not in taken)
            more = self.fit([*fit.terms, term], fit)
            found = np.minimum(found, more.over_described)
        return found

    def weighed_as(self, fit: Fit, weight: Real) -> Fit:
        """Give the numbers of the same set with its rows weighed so; what it leaves and its evidence stay."""
        chosen = self._chosen(fit.terms)
        moments, (belief, _) = Moments.of(self._rows, chosen), self.prior.information(fit.terms, self.within)
        information = moments.information(weight) + belief
        numbers = bounded(information, moments.toward(weight) + belief @ self._mean[chosen], self._least[chosen])
        return replace(fit, numbers=numbers, root=root_of(information), weight=weight)

    def promise(self, fit: Fit) -> list[tuple[float, Term]]:
        """Give what each further term would bring at about, nats, with the rows weighed as in a fit; most first."""
        key = tuple(map(id, fit.terms)), fit.weight.tobytes(), fit.numbers.tobytes()
        if key not in self._promises:
            self._promises[key] = self._promising.of(self._chosen(fit.terms), fit.numbers, fit.weight, fit.root)
        gains, terms = self._promises[key], self._promising.in_order
        return [(float(gains[place]), terms[place]) for place in np.argsort(-gains, kind="stable")]

    @cached_property
    def _promising(self) -> Promises:
        return Promises(rows=self._rows, terms=self.terms, places=self._places, mean=self._mean)

    def course(self, fit: Fit) -> tuple[Real, Real]:
        """Give ``[joint, coarse]`` twice: energy that a fit leaves, whitened, and what noise alone would leave.

        Of the stretches that take no part as well.
        """
        joints = slice(len(self.torques.joints))
        there = self.torques.numbers_a_sample * self.torques.without(()).moving[joints]
        rest = (self.torques.missing - self.explained(fit))[joints] / self.noise(fit)[joints, None]
        return np.asarray(there * rest**2), np.asarray(there, dtype=np.float64)

    def noise(self, fit: Fit) -> Real:
        """``[row]``: standard deviation of the missing torque that the noise of a fit's machine gives."""
        return self.torques.noise * np.sqrt(fit.louder)

    def of_terms(self, fit: Fit) -> Real:
        """Give ``[row, coarse]``: what the terms explain, without tolerances."""
        alone = np.where(np.arange(fit.numbers.size) < self.within, 0.0, fit.numbers)
        return self.explained(replace(fit, numbers=alone))

    def explained(self, fit: Fit) -> Real:
        """Give ``[joint, coarse]``: missing torque that the numbers of a fit explain."""
        numbers = np.zeros(self._size)
        numbers[self._chosen(fit.terms)] = fit.numbers
        return np.array([numbers[one.numbers] @ one.columns for one in self._rows])

    def shares(self, fit: Fit, place: int) -> Real:
        """Give ``[row]``: power of what a term adds, over that of all that is missing there."""
        first = self.within + sum(len(one.scale) for one in fit.terms[:place])
        at = self._places[id(fit.terms[place])]
        numbers = fit.numbers[first : first + at.size]
        moments = Moments.of(self._rows, at)
        added = moments.power(moments.at_rows(numbers))
        return np.asarray(added / np.maximum(self._energy, np.maximum(self.count, 1.0)))

    def power(self, term: Term, values: Real) -> float:
        """Give the whitened energy of a term with values ``[number]``."""
        at = self._places[id(term)]
        moments = Moments.of(self._rows, at)
        return float(np.sum(moments.power(moments.at_rows(values / term.scale))))

    def over_rounding(self, energy: Real) -> Real:
        """Give ``[row]``: RMS torque of a whitened energy, over what a description of its changes rounds."""
        power = energy / np.maximum(self.count, 1.0) * self.torques.noise**2
        changes = np.resize(np.std(self.torques.drive, axis=1), power.size)
        return np.asarray(np.sqrt(power) / np.maximum(RIGHT * changes, 1e-300))

    def rows(self, term: Term) -> frozenset[int]:
        """Give the rows at which a term acts."""
        return frozenset(row for number in self._places[id(term)] for row in self._acting[number])

    @cached_property
    def _acting(self) -> list[list[int]]:
        """Rows at which each number acts."""
        found: list[list[int]] = [[] for _ in range(self._size)]
        for row, one in enumerate(self._rows):
            for number in one.numbers:
                found[number].append(row)
        return found

    def _chosen(self, terms: Sequence[Term]) -> Index:
        return np.concatenate([np.arange(self.within), *(self._places[id(term)] for term in terms)])

    def unknowns(self, fit: Fit) -> Real:
        """Give ``[joint]``: nats that a torque of any shape there would bring beside a fit."""
        alone = log(ANOTHER) - log(len(self._rows)) - DETAILS
        return np.asarray(fit.left.of_any_shape().log_likelihood - fit.left.log_likelihood + alone)


def _told(whitened: Real) -> Real:
    """``[told, tolerance]``: combinations of tolerances that a log tells of, orthogonal, of one deviation each.

    Of the branches of a robot each has its own, so that few act at a row.
    """
    acts = np.any(whitened, axis=2)
    everywhere = np.all(acts | ~np.any(acts, axis=0), axis=1)
    beside = acts[~everywhere].astype(np.intp)
    _, branch = connected_components(beside @ beside.T, directed=False)
    groups = [np.flatnonzero(everywhere), *(np.flatnonzero(~everywhere)[branch == one] for one in np.unique(branch))]
    found = [np.zeros((0, len(whitened)))]
    for group in groups:
        flat = whitened[group].reshape(group.size, whitened.shape[1] * whitened.shape[2])
        information, combinations = np.linalg.eigh(flat @ flat.T)
        told = np.zeros((group.size, len(whitened)))
        told[:, group] = combinations.T
        found.append(told[information > _UNTOLD])
    return np.concatenate(found)
