"""What further terms would bring beside a fit, at about: one step of Newton's, all of them at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chladni.gap.robots.fit import solved
from chladni.gap.robots.row import Row
from chladni.gap.robots.term import Term
from chladni.signals.arrays import Index, Real


@dataclass(frozen=True, kw_only=True, eq=False)
class Promises:
    """Terms that a contest has, with their moments.

    Attributes
    ----------
    rows
        Moments of all numbers.
    terms
        All of them.
    places
        Of the numbers of each, by its identity.
    mean
        ``[number]``: what they're about before the log is seen.
    """

    rows: tuple[Row, ...]
    terms: Sequence[Term]
    places: Mapping[int, Index]
    mean: Real

    def of(self, chosen: Index, numbers: Real, weight: Real, root: Real) -> Real:
        """Give what each term would bring beside a fit, nats, with the rows weighed so, in the order of `in_order`.

        Parameters
        ----------
        chosen, numbers, root
            ``[number]``: those of the fit, and the root of their information.
        """
        wanted, at_one, spread, at_many = self._beside(chosen, numbers, weight, root)
        found = []
        for (count, one_row), (_, at) in self._alike.items():
            own = np.tensordot(weight, self._blocks[count, one_row], 1) + np.eye(count)
            explained = (at_one[at], spread[at]) if one_row else (at_many[self._many[at]],) * 2
            own -= explained[0] @ np.swapaxes(explained[1], 1, 2)
            mean = self.mean[at]
            toward = wanted[at] + mean
            gains = np.einsum("tk,tk->t", toward, np.linalg.solve(own, toward[..., None])[..., 0])
            found.append(0.5 * (gains - np.linalg.slogdet(own)[1] - np.sum(mean**2, axis=1)))
        return np.concatenate(found)

    @cached_property
    def in_order(self) -> list[Term]:
        """Terms with as many numbers together."""
        return [term for terms, _ in self._alike.values() for term in terms]

    def _beside(self, chosen: Index, numbers: Real, weight: Real, root: Real) -> tuple[Real, Real, Real, Real]:
        """Give what a fit leaves of each number's moment, and how the fit's own numbers take part in it.

        ``[number]``; of terms at one row moments with the few that act there, and the same times their covariance,
        ``[number, acting]``; of the others, ``[many, chosen]``, moments over the root.
        """
        held = [one.held(chosen) for one in self.rows]
        most = max((places.size for places, _ in held), default=0)
        inverse = solved(root, np.eye(len(root)))
        wanted, at_one = np.zeros(self.mean.size), np.zeros((self.mean.size, most))
        spread, at_many = np.zeros_like(at_one), np.zeros((int(np.max(self._many, initial=-1)) + 1, chosen.size))
        for row, (one, (places, here)) in enumerate(zip(self.rows, held, strict=True)):
            moments = weight[row] * one.gram[:, here]
            wanted[one.numbers] += weight[row] * one.right - moments @ numbers[places]
            several = self._many[one.numbers] >= 0
            alone, own, part = one.numbers[~several], moments[~several], inverse[:, places]
            at_one[alone, : places.size], spread[alone, : places.size] = own, own @ (part.T @ part)
            at_many[self._many[one.numbers[several], None], places] += moments[several]
        return wanted, at_one, spread, solved(root, at_many.T).T

    @cached_property
    def _many(self) -> Index:
        """``[number]``: growing places of those whose term acts at several rows; -1 of the others."""
        acts = np.zeros((len(self.rows), self.mean.size), dtype=bool)
        for row, one in enumerate(self.rows):
            acts[row, one.numbers] = True
        found, count = np.full(self.mean.size, -1), 0
        for at in self.places.values():
            if np.sum(np.any(acts[:, at], axis=1)) > 1:
                found[at] = np.arange(count, count + at.size)
                count += at.size
        return found

    @cached_property
    def _alike(self) -> dict[tuple[int, bool], tuple[list[Term], Index]]:
        """Terms with as many numbers that act at one row, and at several; and the places of these."""
        alike: dict[tuple[int, bool], list[Term]] = {}
        for term in self.terms:
            at = self.places[id(term)]
            alike.setdefault((at.size, bool(self._many[at[0]] < 0)), []).append(term)
        return {key: (terms, np.array([self.places[id(one)] for one in terms])) for key, terms in alike.items()}

    @cached_property
    def _blocks(self) -> dict[tuple[int, bool], Real]:
        """``[row, term, number, number]``: moments of each term's own numbers."""
        return {key: np.array([_blocks(one, at) for one in self.rows]) for key, (_, at) in self._alike.items()}


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
