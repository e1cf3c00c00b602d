"""Fits of sets of terms to the missing torque of all joints at once, and their evidence."""

from collections import Counter
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb, log

import numpy as np
from scipy.linalg.lapack import dtrtrs
from scipy.optimize import nnls

from chladni.gap.calibration import ANOTHER, DETAILS, QUARTER
from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.robots.joints_left import JointsLeft
from chladni.gap.robots.row import Row, columns_of_rows, parts_of
from chladni.gap.robots.term import FOUND, Term
from chladni.gap.robots.tolerances import tolerances
from chladni.gap.robots.torques import RIGHT, Torques
from chladni.gap.robots.words import all_terms
from chladni.signals.arrays import Index, Mask, Real

#: Information over the prior's: what a log tells less of stays where it's believed.
_UNTOLD = 1e-3
_ROUNDS, _NEAR = 8, 3
#: Fits that are kept, those that were asked for last: twice as many as a search looks at around one set.
_KEPT = 512


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A set of terms with its best numbers.

    Attributes
    ----------
    terms
        The set.
    numbers, root
        ``[number]`` of the tolerances first, which `Contest.tolerances` reads, then of the terms, over their scales;
        and the lower triangular root of their information ``[number, number]``.
    left
        What is left at each joint.
    nats
        Evidence and prior.
    within
        How many of the numbers are of tolerances.
    weight
        ``[joint]``: times that energy which is left there costs as much as the noise's.
    """

    terms: tuple[Term, ...]
    numbers: Real
    root: Real
    left: JointsLeft
    nats: float
    within: int
    weight: Real

    @property
    def covariance(self) -> Real:
        """``[number, number]``: of the numbers."""
        inverse = _solved(self.root, np.eye(len(self.root)))
        return np.asarray(inverse.T @ inverse)

    @property
    def strain(self) -> float:
        """Nats by which values stand aside within their tolerances."""
        return 0.5 * float(np.sum(self.numbers[: self.within] ** 2))

    def values(self, place: int) -> tuple[Real, Real]:
        """Numbers of a term and their standard deviations, SI, nominal included."""
        first = self.within + sum(len(one.scale) for one in self.terms[:place])
        term = self.terms[place]
        rows = slice(first, first + len(term.scale))
        deviation = np.sqrt(np.maximum(np.diag(self.covariance)[rows], 0.0))
        return term.nominal + self.numbers[rows] * term.scale, deviation * term.scale


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
        kinds = {(term.key, term.rare): term for term in self.terms}
        self._words, self._every = Counter((term.word, term.rare) for term in kinds.values()), log(max(len(kinds), 1))
        # What tolerances alone leave.
        self._before = self._energy
        self._fits: dict[tuple[tuple[int, ...], bytes | None], Fit] = {}
        self._promises: dict[tuple[tuple[int, ...], bytes, bytes], Real] = {}
        self.nothing = self.fit(())
        self._before = self.nothing.left.energy
        self._fits.clear()

    def _row(self, row: int, numbers: Index, columns: Real) -> Row:
        return Row.of(numbers, columns, self._whiten[row], self.torques.missing[row])

    def _with(self, **parts: object) -> "Contest":
        """Give the same at the same prices, but for these parts."""
        other = copy(self)
        for made in ("_alike", "_acting"):
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
        gram, right = self._moments(chosen)
        laws = self._laws(terms)
        least, mean = self._least[chosen], self._mean[chosen]
        arms = self._arms(terms)
        for _ in range(rounds):
            numbers = _bounded(_information(weight, gram), weight @ right + mean, least)
            for first, last, share in arms:
                least[first] = max(share * float(np.linalg.norm(numbers[first + 1 : last])), 0.0)
                numbers[first] = max(numbers[first], least[first])
            left = self._left(gram, right, numbers, laws, self._passing(terms, numbers), self._units(terms, numbers))
            weight = left.weight
        root = _root(_information(weight, gram))
        size = -0.5 * float(np.sum((numbers - mean) ** 2)) - float(np.sum(np.log(np.diag(root))))
        return Fit(
            terms=tuple(terms), numbers=numbers, root=root, left=left, within=self.within,
            nats=float(np.sum(left.log_likelihood)) + size + self.prior(terms), weight=weight,
        )  # fmt: skip

    def _moments(self, chosen: Index) -> tuple[Real, Real]:
        """Give ``[row, chosen, chosen]`` and ``[row, chosen]``."""
        gram = np.zeros((len(self._rows), chosen.size, chosen.size))
        right = np.zeros(gram.shape[:2])
        for row, one in enumerate(self._rows):
            places, here = one.held(chosen)
            gram[row, places[:, None], places] = one.gram[here[:, None], here]
            right[row, places] = one.right[here]
        return gram, right

    def tolerances(self, fit: Fit) -> dict[str, tuple[float, float]]:
        """Give what a fit says of numbers in their tolerances: value and standard deviation, over the tolerance."""
        values, covariance = self._within(fit)
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return dict(zip(self._tolerated, zip(values.tolist(), deviations.tolist(), strict=True), strict=True))

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

    def prior(self, terms: Sequence[Term]) -> float:
        """Nats of a set: each a cause of its own, or a word at several sites, as far as that is less."""
        nats = 0.0
        every = self._every
        for word, count in Counter((term.word, term.rare) for term in terms).items():
            alone = (log(ANOTHER) - every) * (count - 1)
            # Terms of another contest may be at sites that are left out here.
            sites = max(self._words[word], count)
            shared = log(ANOTHER) - log(comb(sites, count)) if count > 1 else -np.inf
            nats += log(ANOTHER) - every + max(alone, shared)
        # What machines rarely have is one thing more than what most have.
        nats += log(ANOTHER) * sum(term.rare for term in terms)
        # A form that was chosen among several was one of them by chance.
        forms = [term.form for term in terms if term.form is not None]
        nats -= sum(log(one.count) + 0.5 * (one.value / one.usual) ** 2 for one in forms)
        # Tolerances allow for what values are usually wrong by: more is one thing more.
        nats += log(ANOTHER) * sum(term.word == PARAMETER for term in terms)
        # A law that holds a simpler one, with another number, is one thing more.
        return nats + log(ANOTHER) * sum(len(term.scale) - 1 for term in terms if term.rows)

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
            found[list(rows), place : place + len(term.numbers)] = 1.0
            place += len(term.numbers)
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

    def _left(self, gram: Real, right: Real, numbers: Real, laws: Real, passing: Real, units: Real) -> JointsLeft:
        energy = (self._energy - 2.0 * right @ numbers + (gram @ numbers) @ numbers) / passing
        energy += np.maximum(energy - self.count, 0.0) * (1.0 / units - 1.0)
        own = laws * numbers
        # Neither a law that is undone by tolerances nor one that adds nothing has details.
        force = np.minimum(np.sum(own * (gram @ own[..., None])[..., 0], axis=1), self._before - energy)
        return JointsLeft(energy=np.maximum(energy, 0.0), count=self.count, force=np.maximum(force, 0.0))

    def quietest(self, fit: Fit) -> Real:
        """Give ``[row]``: least energy over the noise that a fit leaves, or with the term more that promises most."""
        found = fit.left.over_noise
        taken = {term.key for term in fit.terms}
        for row in range(len(found)):
            alone = np.zeros(len(found))
            alone[row] = 1.0
            _, term = next(one for one in self.promise(replace(fit, weight=alone)) if one[1].key not in taken)
            more = self.fit([*fit.terms, term], fit)
            found = np.minimum(found, more.left.over_noise)
        return found

    def weighed_as(self, fit: Fit, weight: Real) -> Fit:
        """Give the numbers of the same set with its rows weighed so; what it leaves and its evidence stay."""
        chosen = self._chosen(fit.terms)
        gram, right = self._moments(chosen)
        information = _information(weight, gram)
        numbers = _bounded(information, weight @ right + self._mean[chosen], self._least[chosen])
        return replace(fit, numbers=numbers, root=_root(information), weight=weight)

    def promise(self, fit: Fit) -> list[tuple[float, Term]]:
        """Give what each further term would bring at about, nats, with the rows weighed as in a fit; most first."""
        key = tuple(map(id, fit.terms)), fit.weight.tobytes(), fit.numbers.tobytes()
        if key not in self._promises:
            self._promises[key] = self._promised(fit)
        gains = self._promises[key]
        terms = [term for _, alike, _ in self._alike for term in alike]
        return [(float(gains[place]), terms[place]) for place in np.argsort(-gains, kind="stable")]

    def _promised(self, fit: Fit) -> Real:
        """``[term]``: what each brings, in the order of `_alike`."""
        weight, chosen = fit.weight, self._chosen(fit.terms)
        gram, rest = np.zeros((self._size, chosen.size)), np.zeros(self._size)
        for row in np.flatnonzero(weight):
            one = self._rows[row]
            places, here = one.held(chosen)
            gram[one.numbers[:, None], places] += weight[row] * one.gram[:, here]
            rest[one.numbers] += weight[row] * one.right
        rest -= gram @ fit.numbers
        shared = _solved(fit.root, gram.T).T
        found = []
        for at, _, blocks in self._alike:
            own = np.tensordot(weight, blocks, 1) + np.eye(at.shape[1])
            own -= shared[at] @ np.swapaxes(shared[at], 1, 2)
            mean = self._mean[at]
            wanted = rest[at] + mean
            gains = np.einsum("tk,tk->t", wanted, np.linalg.solve(own, wanted[..., None])[..., 0])
            found.append(0.5 * (gains - np.linalg.slogdet(own)[1] - np.sum(mean**2, axis=1)))
        return np.concatenate(found)

    @cached_property
    def _alike(self) -> list[tuple[Index, list[Term], Real]]:
        """Terms with as many numbers, the places of these ``[term, number]``, and their moments."""
        by_count: dict[int, list[Term]] = {}
        for term in self.terms:
            by_count.setdefault(len(term.numbers), []).append(term)
        found = []
        for terms in by_count.values():
            at = np.array([self._places[id(one)] for one in terms])
            found.append((at, terms, np.array([_blocks(one, at) for one in self._rows])))
        return found

    def course(self, fit: Fit) -> tuple[Real, Real]:
        """Give ``[joint, coarse]`` twice: energy that a fit leaves, whitened, and what noise alone would leave.

        Of the stretches that take no part as well.
        """
        joints = slice(len(self.torques.joints))
        there = self.torques.numbers_a_sample * self.torques.without(()).moving[joints]
        rest = (self.torques.missing - self.explained(fit))[joints] / self.torques.noise[joints, None]
        return np.asarray(there * rest**2), np.asarray(there, dtype=np.float64)

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
        added = np.einsum("p,jpq,q->j", numbers, self._moments(at)[0], numbers)
        return np.asarray(added / np.maximum(self._energy, np.maximum(self.count, 1.0)))

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


def _blocks(row: Row, at: Index) -> Real:
    """``[term, number, number]``: moments at a row of terms whose numbers are at these places ``[term, number]``."""
    found = np.zeros((*at.shape, at.shape[1]))
    flat, here = row.held(at.ravel())
    places = np.full(at.shape, -1)
    places.ravel()[flat] = here
    acting = np.flatnonzero(np.any(places >= 0, axis=1))
    own = places[acting]
    both = (own[:, :, None] >= 0) & (own[:, None, :] >= 0)
    found[acting] = np.where(both, row.gram[own[:, :, None], own[:, None, :]], 0.0)
    return found


def _told(whitened: Real) -> Real:
    """``[told, tolerance]``: combinations of tolerances that a log tells of, orthogonal, of one deviation each."""
    flat = whitened.reshape(len(whitened), -1)
    information, combinations = np.linalg.eigh(flat @ flat.T)
    return np.asarray(combinations[:, information > _UNTOLD].T)


def _information(weight: Real, gram: Real) -> Real:
    """``[number, number]``: of numbers whose moments ``[row, number, number]`` are weighed."""
    return np.tensordot(weight, gram, 1) + np.eye(gram.shape[1])


def _root(information: Real) -> Real:
    """Lower triangular."""
    return np.asarray(np.linalg.cholesky(information), dtype=np.float64)


def _bounded(information: Real, right: Real, least: Real) -> Real:
    """Solve for numbers of which some have a lower bound, by nonnegative least squares (Lawson & Hanson 1974)."""
    bound = np.isfinite(least)
    # Behind the free ones, whose part is eliminated so.
    order, free = np.argsort(bound, kind="stable"), int(np.sum(~bound))
    root = _root(information[np.ix_(order, order)])
    toward = _solved(root, right[order])
    found = _solved(root, toward, turned=True)
    low = least[order[free:]]
    if np.any(found[free:] < low):
        own = root[free:, free:].T
        found[free:] = low + nnls(own, toward[free:] - own @ low)[0]
        found[:free] = _solved(root[:free, :free], toward[:free] - found[free:] @ root[free:, :free], turned=True)
    numbers = np.empty_like(found)
    numbers[order] = found
    return numbers


def _solved(root: Real, right: Real, *, turned: bool = False) -> Real:
    """Solve with a lower triangular matrix, or with its transpose.

    By LAPACK itself: what checks its arguments takes longer than matrices of such sizes.
    """
    return np.asarray(dtrtrs(root.T, right, trans=0 if turned else 1)[0])
