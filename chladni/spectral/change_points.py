"""Steps in a series of estimates, beside what covariates explain, each with where it may lie."""

from dataclasses import dataclass
from math import comb
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.trend import ChangePoint

#: Logs on each side of a step, at least: one or two that stand apart are outliers.
LEAST_IN_SEGMENT: Final = 3
MOST_CHANGES: Final = 20
FALSE_ALARM: Final = 0.01
#: Steps beyond those in question, by which the likeness of neighbours is judged.
FURTHER_STEPS: Final = 3
#: Correlation of neighbours beyond which no number of values would count.
MOST_ALIKE: Final = 0.95
#: Of the probability of where a step lies.
CREDIBLE: Final = 0.95
#: Median of a squared standard normal number.
_MEDIAN_SQUARE: Final = 0.4549364


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps:
    """Levels, covariates and changes fitted to a series.

    Attributes
    ----------
    changes
        In order.
    expected
        ``[place]``, the fit.
    explained
        ``[place]``, what covariates explain of it, zero in the mean.
    scatter
        One sigma of what is left.
    slopes, slopes_std
        ``[covariate]``, and one sigma.
    """

    changes: tuple[ChangePoint, ...]
    expected: Real
    explained: Real
    scatter: float
    slopes: Real
    slopes_std: Real


def find_steps(
    values: ArrayLike, *, std: ArrayLike | None = None, covariates: ArrayLike | None = None,
    false_alarm: float = FALSE_ALARM,
) -> Steps:  # fmt: skip
    """Find where a series steps to another level.

    Parameters
    ----------
    values
        ``[place]``, in order of time, finite.
    std
        ``[place]``, one sigma of each; None, or infinite ones, count as equal.
    covariates
        ``[covariate, place]``, what explains part of the values linearly; None for none.
    false_alarm
        Chance that any step is found in a series without one.

    Returns
    -------
    Steps
        Of a series shorter than twice `LEAST_IN_SEGMENT` there are no changes.

    Raises
    ------
    EstimateError
        When shapes don't fit or a value isn't finite.

    Notes
    -----
    Steps are added one by one, the one first that explains most beside all others and the covariates (a regression on
    steps; Frisch & Waugh 1933), or two together, as long as their F-test allows no chance. It has Bonferroni's
    correction for all places, and an effective number of values where neighbours are alike (Bartlett 1946). Each is
    then placed anew beside the others. Where it lies is told by the likelihood of each place, levels integrated out
    (Smith 1975, Biometrika 62, 407): the shortest run of places around the best with 95 % of it.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(60)
    >>> found = find_steps(noise + 5.0 * (np.arange(60) >= 40))
    >>> [change.place for change in found.changes], [(one.first, one.last) for one in found.changes]
    ([40], [(40, 40)])
    """
    problem = _Problem.of(values, std, covariates)
    places: list[int] = []
    while len(places) < MOST_CHANGES:
        more = problem.sure_steps(places, false_alarm)
        if not more:
            break
        places = problem.settled(sorted([*places, *more]))
    return problem.told(places)


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Whitened values and the columns that are always fitted: a level, and covariates about their mean."""

    values: Real
    roots: Real
    always: Real

    @classmethod
    def of(cls, values: ArrayLike, std: ArrayLike | None, covariates: ArrayLike | None) -> "_Problem":
        y = np.asarray(values, dtype=np.float64)
        if y.ndim != 1 or not y.size or not np.isfinite(y).all():
            raise EstimateError(f"a series of shape {y.shape} must be one-dimensional, not empty and finite")
        columns = np.zeros((0, y.size)) if covariates is None else np.atleast_2d(np.asarray(covariates, dtype=float))
        if columns.shape[1] != y.size or not np.isfinite(columns).all():
            raise EstimateError(
                f"covariates of shape {columns.shape} must be finite, one for each of {y.size} values"
            )
        roots = np.sqrt(_weights(y, None if std is None else np.asarray(std, dtype=np.float64)))
        always = np.vstack([np.ones(y.size), columns - columns.mean(axis=1, keepdims=True)])
        return cls(y, roots, always)

    def design(self, places: list[int]) -> Real:
        """``[column, place]`` whitened: always, then a step at each place."""
        steps = [np.arange(self.values.size) >= place for place in places]
        return np.asarray(np.vstack([self.always, *steps]) * self.roots, dtype=np.float64)

    def gains(self, places: list[int]) -> tuple[Real, Real]:
        """``[place]`` by how much a step there lowers the sum of squares, and its own square left by the others."""
        basis = _basis(self.design(places))
        y = self.values * self.roots
        left = (y - basis.T @ (basis @ y)) * self.roots
        # A step at k is the roots from k on: sums from the end.
        products = np.cumsum(left[::-1])[::-1]
        shared = np.cumsum((basis * self.roots)[:, ::-1], axis=1)[:, ::-1]
        own = np.cumsum(self.roots[::-1] ** 2)[::-1] - (shared**2).sum(axis=0)
        least = 1e-9 * float((self.roots**2).sum())
        return np.where(own > least, products**2 / np.maximum(own, least), 0.0), own

    def allowed(self, places: list[int]) -> Real:
        """``[place]`` whether segments stay long enough."""
        edges = np.array([0, *places, self.values.size])
        number = np.arange(self.values.size)
        return np.asarray(np.abs(number[:, np.newaxis] - edges).min(axis=1) >= LEAST_IN_SEGMENT)

    def best_place(self, places: list[int]) -> int | None:
        """Place of one more step."""
        allowed = self.allowed(places)
        if not allowed.any():
            return None
        return int(np.argmax(np.where(allowed, self.gains(places)[0], -1.0)))

    def sure_steps(self, places: list[int], false_alarm: float) -> list[int]:
        """Give one more step that is more than chance, or two: a level that comes back hides either of its steps."""
        more: list[int] = []
        for _ in range(2):
            place = self.best_place(sorted([*places, *more]))
            if place is None:
                break
            more.append(place)
            if self._is_sure(places, more, false_alarm):
                return more
        return []

    def _is_sure(self, places: list[int], more: list[int], false_alarm: float) -> bool:
        design = self.design(sorted([*places, *more]))
        before, left = self._left(self.design(places)), self._left(design)
        freedom = self.values.size - np.linalg.matrix_rank(design)
        if freedom < 1:
            return False
        power = float(left @ left)
        gain = float(before @ before) - power
        nothing = 1e-24 * float(((self.values * self.roots) ** 2).sum())
        if gain <= nothing or power <= nothing:
            return gain > nothing
        share = self._independent_share(sorted([*places, *more]))
        statistic = gain / len(more) * share / (power / freedom)
        tried = comb(int(self.allowed(places).sum()), len(more))
        return bool(fdtrc(len(more), max(freedom * share, 1.0), statistic) * tried < false_alarm / 2)

    def _independent_share(self, places: list[int]) -> float:
        """Share of the values that count, by what further steps would leave, sure or not.

        A step that isn't found yet makes neighbours alike as slow noise does, and would hide itself.
        """
        for _ in range(FURTHER_STEPS):
            place = self.best_place(places)
            if place is None:
                break
            places = sorted([*places, place])
        design = self.design(places)
        return _independent_share(self._left(design), fitted=len(design))

    def settled(self, places: list[int]) -> list[int]:
        """Place each step anew beside the others."""
        for number in range(len(places)):
            others = [*places[:number], *places[number + 1 :]]
            found = self.best_place(others)
            if found is not None:
                places = sorted([*others, found])
        return places

    def told(self, places: list[int]) -> Steps:
        """Give the fit, with one sigma of each step and where it may lie."""
        design = self.design(places)
        left = self._left(design)
        freedom = max(self.values.size - np.linalg.matrix_rank(design), 1)
        variance = float(left @ left) / freedom / _independent_share(left, fitted=len(design))
        inverse = np.linalg.pinv(design @ design.T)
        fitted = inverse @ (design @ (self.values * self.roots))
        std = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance)
        first = len(self.always)
        expected = fitted @ (design / self.roots)
        scatter = float(np.sqrt(np.mean((self.values - expected) ** 2) * self.values.size / freedom))
        changes = tuple(
            ChangePoint(
                place=place, step=float(fitted[first + n]), step_std=float(std[first + n]),
                **self._where(places, n, variance),
            )
            for n, place in enumerate(places)
        )  # fmt: skip
        return Steps(
            changes=changes,
            expected=expected,
            explained=fitted[1:first] @ self.always[1:],
            scatter=scatter,
            slopes=fitted[1:first],
            slopes_std=std[1:first],
        )

    def _where(self, places: list[int], number: int, variance: float) -> dict[str, int]:
        others = [*places[:number], *places[number + 1 :]]
        gains, own = self.gains(others)
        edges = [0, *others, self.values.size]
        inside = np.arange(self.values.size)
        low = max(edge for edge in edges if edge <= places[number])
        high = min(edge for edge in edges if edge > places[number])
        inside = inside[(inside > low) & (inside < high) & (own > 0)]
        # The level's integral leaves one over the root of the step's own square.
        told = gains[inside] / (2 * max(variance, np.finfo(float).tiny)) - 0.5 * np.log(own[inside])
        probability = np.exp(told - told.max())
        probability /= probability.sum()
        best = first = last = int(np.flatnonzero(inside == places[number])[0])
        while probability[first : last + 1].sum() < CREDIBLE:
            before = probability[first - 1] if first > 0 else -1.0
            after = probability[last + 1] if last + 1 < inside.size else -1.0
            first, last = (first - 1, last) if before >= after else (first, last + 1)
        return {"first": int(inside[min(first, best)]), "last": int(inside[last])}

    def _left(self, design: Real) -> Real:
        basis = _basis(design)
        y = self.values * self.roots
        return np.asarray(y - basis.T @ (basis @ y), dtype=np.float64)


def _basis(design: Real) -> Real:
    """Orthonormal rows that span those of a design; those that say nothing new are left out."""
    _, sizes, rows = np.linalg.svd(design, full_matrices=False)
    return np.asarray(rows[sizes > 1e-9 * sizes.max(initial=0.0)], dtype=np.float64)


def _weights(values: Real, std: Real | None) -> Real:
    """One over the variance of each value: its own, and what values scatter beyond that."""
    if std is None or not np.isfinite(std).all() or not (std > 0).all():
        return np.ones(values.size)
    jumps = np.diff(values)
    scatter = float(np.median(jumps**2)) / (2 * _MEDIAN_SQUARE) if jumps.size else 0.0
    beyond = max(scatter - float(np.median(std**2)), 0.0)
    weights = 1.0 / (std**2 + beyond)
    return np.asarray(weights / weights.mean(), dtype=np.float64)


def _independent_share(left: Real, *, fitted: int) -> float:
    """Share of the values that count, where neighbours of what is left are alike: (1 - r) / (1 + r), at most 1.

    What was fitted makes what is left look less alike: of n values and p fitted columns, r comes out lower by
    (p (1 + r) + 2 r) / n in the mean (Kendall 1954, Biometrika 41, 403, has p = 1). That is taken back.
    """
    power, size = float(left @ left), left.size
    found = float(left[1:] @ left[:-1]) / power if power > 0 else 0.0
    alike = (found + fitted / size) / max(1 - (fitted + 2) / size, 1 / size)
    alike = min(max(alike, 0.0), MOST_ALIKE)
    return (1 - alike) / (1 + alike)
