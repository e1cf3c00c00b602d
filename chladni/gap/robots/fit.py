"""A set of terms with its best numbers, by least squares from normal equations with lower bounds."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtrtrs
from scipy.optimize import nnls

from chladni.gap.robots.joints_left import JointsLeft
from chladni.gap.robots.term import Term
from chladni.signals.arrays import Real


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
        ``[row]``: times that energy which is left there costs as much as the noise's of the machine as described.
    louder
        ``[row]``: power of the noise with this machine, over that.
    """

    terms: tuple[Term, ...]
    numbers: Real
    root: Real
    left: JointsLeft
    nats: float
    within: int
    weight: Real
    louder: Real

    @property
    def energy(self) -> Real:
        """``[row]``: left, whitened by the noise of the machine as described."""
        return self.left.energy * self.louder

    @property
    def over_described(self) -> Real:
        """``[row]``: what is left over the noise, less what this machine's inertia adds to it."""
        return 1.0 + self.louder * (self.left.over_noise - 1.0)

    @property
    def covariance(self) -> Real:
        """``[number, number]``: of the numbers."""
        inverse = solved(self.root, np.eye(len(self.root)))
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


def bounded(information: Real, right: Real, least: Real) -> Real:
    """Solve for numbers of which some have a lower bound, by nonnegative least squares (Lawson & Hanson 1974)."""
    bound = np.isfinite(least)
    # Behind the free ones, whose part is eliminated so.
    order, free = np.argsort(bound, kind="stable"), int(np.sum(~bound))
    root = root_of(information[order[:, None], order])
    toward = solved(root, right[order])
    found = solved(root, toward, turned=True)
    low = least[order[free:]]
    if np.any(found[free:] < low):
        own = root[free:, free:].T
        found[free:] = low + nnls(own, toward[free:] - own @ low)[0]
        found[:free] = solved(root[:free, :free], toward[:free] - found[free:] @ root[free:, :free], turned=True)
    numbers = np.empty_like(found)
    numbers[order] = found
    return numbers


def root_of(information: Real) -> Real:
    """Lower triangular."""
    return np.asarray(np.linalg.cholesky(information), dtype=np.float64)


def solved(root: Real, right: Real, *, turned: bool = False) -> Real:
    """Solve with a lower triangular matrix, or with its transpose.

    By LAPACK itself: what checks its arguments takes longer than matrices of such sizes.
    """
    return np.asarray(dtrtrs(root.T, right, trans=0 if turned else 1)[0])
