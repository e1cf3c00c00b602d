"""Fits of sets of terms to the missing torque of all joints at once, and their evidence."""

from collections import Counter
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb, log, log1p

import numpy as np
from scipy.optimize import nnls

from chladni.gap.calibration import ANOTHER, DETAILS, ELSEWHERE, QUARTER, USUAL
from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.robots.row import Row, columns_of_rows
from chladni.gap.robots.term import FOUND, Term
from chladni.gap.robots.tolerances import tolerances
from chladni.gap.robots.torques import RIGHT, Torques
from chladni.gap.robots.words import all_terms
from chladni.signals.arrays import Index, Mask, Real

#: Share by which the noise of a torque is known.
_DOUBT = 0.3
#: Information over the prior's: what a log tells less of stays where it's believed.
_UNTOLD = 1e-3
_ROUNDS, _NEAR = 8, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLeft:
    """What a fit leaves at a joint, as whitened energy; noise alone leaves `count`.

    Attributes
    ----------
    energy, count
        Left, and expected of noise alone.
    force
        Energy that the joint's own laws and limits of its drive explain: these idealise a part of it. None without
        any, infinite for a torque of any shape.
    """

    energy: float
    count: float
    force: float | None

    @property
    def over_noise(self) -> float:
        """Energy over the noise's."""
        return self.energy / max(self.count, 1.0)

    @property
    def beyond(self) -> float:
        """Energy beyond the noise's."""
        return max(self.energy - self.count, 0.0)

    @property
    def log_likelihood(self) -> float:
        """Nats, by the evidence of every diagnosis (`Left`).

        What is left beyond the noise is worth few numbers as far as it's the usual detail of the joint's own laws,
        and many beyond. Where one ends the other begins as flat, so that there's one best fit.
        """
        # The square of a real number costs half of a complex line's; of the noise's own level little is told.
        beyond, doubted = self.beyond / 2.0, _DOUBT * self.count / 2.0
        told = beyond**2 / (beyond + doubted) if beyond > 0 else 0.0
        inside = min(told, self._usual)
        nats = DETAILS * log1p(inside / DETAILS)
        if told > inside:
            nats += ELSEWHERE * log1p((told - inside) / (ELSEWHERE * (1.0 + inside / DETAILS)))
        return -nats

    @property
    def _usual(self) -> float:
        return 0.0 if self.force is None else USUAL**2 * self.force / 2.0

    @property
    def weight(self) -> float:
        """Times that a unit of energy costs as much as of noise alone."""
        beyond = self.beyond / 2.0
        inside = min(beyond, self._usual)
        flat = 1.0 + inside / DETAILS
        return 1.0 / (flat + (beyond - inside) / ELSEWHERE)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A set of terms with its best numbers.

    Attributes
    ----------
    terms
        The set.
    numbers, covariance
        ``[number]`` of the tolerances first, which `Contest.tolerances` reads, then of the terms, over their scales;
        and their covariance.
    left
        ``[joint]``: what is left at each.
    nats
        Evidence and prior.
    within
        How many of the numbers are of tolerances.
    weight
        ``[joint]``: times that energy which is left there costs as much as the noise's.
    """

    terms: tuple[Term, ...]
    numbers: Real
    covariance: Real
    left: tuple[JointLeft, ...]
    nats: float
    within: int
    weight: Real

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
    """Terms of one log, whitened, so that sets of them are fitted by small matrices."""

    def __init__(
        self, torques: Torques, left_out: frozenset[str] = frozenset(), taking_part: Mask | None = None
    ) -> None:
        self.torques = torques
        self.terms = all_terms(torques, left_out)
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
        whole = (np.tensordot(self._told, inside, 1), np.ones(self.within))
        columns = columns_of_rows(len(torques.missing), [whole, *((term.columns, term.scale) for term in self.terms)])
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
        self.nothing = self.fit(())
        self._before = np.array([one.energy for one in self.nothing.left])

    def _row(self, row: int, numbers: Index, columns: Real) -> Row:
        return Row.of(numbers, columns, self._whiten[row], self.torques.missing[row])

    def _with(self, **parts: object) -> "Contest":
        """Give the same at the same prices, but for these parts."""
        other = copy(self)
        for made in ("_alike", "_acting"):
            vars(other).pop(made, None)
        vars(other).update(parts)
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
        more = columns_of_rows(len(self._rows), [(term.columns, term.scale)])
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
        chosen = self._chosen(terms)
        gram, right = self._moments(chosen)
        laws = self._laws(terms)
        least, mean = self._least[chosen].copy(), self._mean[chosen]
        weight = self._start if near is None else near.weight
        arms = self._arms(terms)
        for _ in range(_ROUNDS if near is None else _NEAR):
            curvature = np.tensordot(weight, gram, 1) + np.eye(chosen.size)
            numbers = _bounded(curvature, weight @ right + mean, least)
            for first, last, share in arms:
                least[first] = max(share * float(np.linalg.norm(numbers[first + 1 : last])), 0.0)
                numbers[first] = max(numbers[first], least[first])
            left = self._left(gram, right, numbers, laws, self._passing(terms, numbers), self._units(terms, numbers))
            weight = np.array([one.weight for one in left])
        curvature = np.tensordot(weight, gram, 1) + np.eye(chosen.size)
        covariance = np.asarray(np.linalg.inv(curvature), dtype=np.float64)
        known = sum(one.log_likelihood for one in left)
        size = -0.5 * float(np.sum((numbers - mean) ** 2)) - 0.5 * float(np.linalg.slogdet(curvature)[1])
        return Fit(
            terms=tuple(terms), numbers=numbers, covariance=covariance, left=left, within=self.within,
            nats=known + size + self.prior(terms), weight=weight,
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
        values = fit.numbers[: self.within] @ self._told
        narrowed = np.eye(self.within) - fit.covariance[: self.within, : self.within]
        deviations = np.sqrt(np.maximum(1.0 - np.einsum("pn,pq,qn->n", self._told, narrowed, self._told), 0.0))
        return dict(zip(self._tolerated, zip(values.tolist(), deviations.tolist(), strict=True), strict=True))

    def again(self, fit: Fit) -> Fit:
        """Fit a set of another contest, of the same words at the same sites."""
        return self.fit(self.same(fit.terms))

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
            shared = log(ANOTHER) - log(comb(self._words[word], count)) if count > 1 else -np.inf
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

    def _laws(self, terms: Sequence[Term]) -> list[Index]:
        """Places among the fitted numbers of what idealises: a joint's laws, and what its drive doesn't give."""
        found: list[list[int]] = [[] for _ in self.torques.missing]
        place = self.within
        for term in terms:
            for row in self.rows(term) if term.takes else term.rows:
                found[row] += range(place, place + len(term.numbers))
            place += len(term.numbers)
        return [np.array(one, dtype=np.intp) for one in found]

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

    def _left(
        self, gram: Real, right: Real, numbers: Real, laws: Sequence[Index], passing: Real, units: Real
    ) -> tuple[JointLeft, ...]:
        energy = (self._energy - 2.0 * right @ numbers + (gram @ numbers) @ numbers) / passing
        energy += np.maximum(energy - self.count, 0.0) * (1.0 / units - 1.0)
        found = []
        for row, places in enumerate(laws):
            own = numbers[places] @ gram[row][np.ix_(places, places)] @ numbers[places]
            # Neither a law that is undone by tolerances nor one that adds nothing has details.
            force = max(min(float(own), float(self._before[row] - energy[row])), 0.0) if places.size else None
            found.append(JointLeft(energy=float(max(energy[row], 0.0)), count=float(self.count[row]), force=force))
        return tuple(found)

    def quietest(self, fit: Fit) -> Real:
        """Give ``[row]``: least energy over the noise that a fit leaves, or with the term more that promises most."""
        found = [one.over_noise for one in fit.left]
        taken = {term.key for term in fit.terms}
        for row in range(len(found)):
            alone = np.zeros(len(found))
            alone[row] = 1.0
            _, term = next(one for one in self.promise(replace(fit, weight=alone)) if one[1].key not in taken)
            more = self.fit([*fit.terms, term], fit)
            found = [min(least, one.over_noise) for least, one in zip(found, more.left, strict=True)]
        return np.array(found)

    def weighed_as(self, fit: Fit, weight: Real) -> Fit:
        """Give the numbers of the same set with its rows weighed so; what it leaves and its evidence stay."""
        chosen = self._chosen(fit.terms)
        gram, right = self._moments(chosen)
        curvature = np.tensordot(weight, gram, 1) + np.eye(chosen.size)
        numbers = _bounded(curvature, weight @ right + self._mean[chosen], self._least[chosen])
        covariance = np.asarray(np.linalg.inv(curvature), dtype=np.float64)
        return replace(fit, numbers=numbers, covariance=covariance, weight=weight)

    def promise(self, fit: Fit) -> list[tuple[float, Term]]:
        """Give what each further term would bring at about, nats, with the rows weighed as in a fit."""
        weight, chosen = fit.weight, self._chosen(fit.terms)
        gram, rest = np.zeros((self._size, chosen.size)), np.zeros(self._size)
        for row in np.flatnonzero(weight):
            one = self._rows[row]
            places, here = one.held(chosen)
            gram[one.numbers[:, None], places] += weight[row] * one.gram[:, here]
            rest[one.numbers] += weight[row] * one.right
        rest -= gram @ fit.numbers
        found: list[tuple[float, Term]] = []
        for at, terms, blocks in self._alike:
            own = np.tensordot(weight, blocks, 1) + np.eye(at.shape[1])
            own -= gram[at] @ fit.covariance @ np.swapaxes(gram[at], 1, 2)
            mean = self._mean[at]
            wanted = rest[at] + mean
            gains = np.einsum("tk,tk->t", wanted, np.linalg.solve(own, wanted[..., None])[..., 0])
            gains -= np.linalg.slogdet(own)[1] + np.sum(mean**2, axis=1)
            found += zip((0.5 * gains).tolist(), terms, strict=True)
        return sorted(found, key=lambda one: one[0], reverse=True)

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
        alone = log(ANOTHER) - log(len(fit.left)) - DETAILS
        return np.array([replace(one, force=np.inf).log_likelihood - one.log_likelihood + alone for one in fit.left])


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


def _bounded(curvature: Real, right: Real, least: Real) -> Real:
    """Solve for numbers of which some have a lower bound, by nonnegative least squares (Lawson & Hanson 1974)."""
    numbers = np.linalg.solve(curvature, right)
    if np.all(numbers >= least):
        return np.asarray(numbers)
    bound = np.isfinite(least)
    free = ~bound
    # What the others make of the bounded ones is eliminated.
    across = np.linalg.solve(
        curvature[np.ix_(free, free)], np.column_stack([curvature[np.ix_(free, bound)], right[free]])
    )
    own = curvature[np.ix_(bound, bound)] - curvature[np.ix_(bound, free)] @ across[:, :-1]
    wanted = right[bound] - curvature[np.ix_(bound, free)] @ across[:, -1] - own @ least[bound]
    lower = np.linalg.cholesky(own)
    above, _ = nnls(lower.T, np.linalg.solve(lower, wanted))
    numbers[bound] = least[bound] + above
    numbers[free] = across[:, -1] - across[:, :-1] @ numbers[bound]
    return np.asarray(numbers)
