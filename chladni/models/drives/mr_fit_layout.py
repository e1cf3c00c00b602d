"""What the fit of a magnetorheological damper varies: one vector, its bounds, and the coefficients it stands for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb, exp, log
from typing import Self

import numpy as np

from chladni.models.drives.mr_coefficients import MrAsymmetry, MrCoefficients, Polynomial
from chladni.models.drives.mr_record import MrRecord
from chladni.signals.arrays import Real

#: (name, low, high, start, scatter of starts) of the four polynomials: natural logarithms of multiples of F, F/V,
#: F/X, the RMS force, force over RMS velocity and over RMS displacement.
_LEVELS = (
    ("alpha", log(1e-2), log(3.0), log(0.8), 0.2),
    ("c0", log(1e-4), log(10.0), log(0.25), 0.5),
    ("c1", log(1e-2), log(1e3), log(5.0), 0.5),
    ("k0", log(1e-4), log(1e2), log(0.1), 1.0),
)
#: k1 of F/X, x0 of X, logarithm of the yield displacement of X, gamma of delta, n.
_SHAPE = (
    ("k1", -5.0, 5.0, 0.01, 0.02),
    ("x0", -4.0, 4.0, 0.0, 0.1),
    ("delta", log(1e-3), log(1.0), log(0.04), 0.5),
    # gamma >= |beta| keeps the loop from giving energy.
    ("gamma", 0.5, 15.0, 3.0, 1.0),
    ("n", 1.0, 6.0, 2.5, 0.5),
)
#: As `MrAsymmetry`: logarithms, k1 of F/X, logarithm of the speed of V.
_ASYMMETRY = (
    ("alpha_sides", -1.0, 1.0, 0.0, 0.05),
    ("c0_sides", -2.0, 2.0, 0.0, 0.1),
    ("c1_sides", -1.0, 1.0, 0.0, 0.05),
    ("k0_sides", -2.0, 2.0, 0.0, 0.1),
    ("k1_sides", -1.0, 1.0, 0.0, 0.02),
    ("alpha_moving", -3.0, 3.0, 0.0, 0.2),
    ("c1_moving", -3.0, 3.0, 0.0, 0.2),
    ("yield_moving", -3.0, 3.0, 0.0, 0.2),
    ("speed", log(0.02), log(2.0), log(0.18), 0.3),
)
_Row = tuple[str, float, float, float, float]
# A number this close to its bound, as a share of its range, ended there.
_AT_BOUND = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MrLayout:
    """Vector of a fit: Bernstein coefficients of alpha, c0, c1, k0 over current, the loop's shape, the asymmetry.

    Attributes
    ----------
    rows
        (name, low, high, start, scatter) of each number.
    order
        Of the polynomials.
    asymmetry
        Whether the last numbers are there.
    highest_current_a
        Where the Bernstein form ends.
    force, velocity, displacement
        RMS levels F, V, X; the force at 1 for each Bernstein coefficient.
    """

    rows: tuple[_Row, ...]
    order: int
    asymmetry: bool
    highest_current_a: float
    force: tuple[float, ...]
    velocity: float
    displacement: float

    @property
    def low(self) -> Real:
        """Lowest value of each number."""
        return np.array([row[1] for row in self.rows])

    @property
    def high(self) -> Real:
        """Highest value of each number."""
        return np.array([row[2] for row in self.rows])

    @property
    def start(self) -> Real:
        """Rule of thumb."""
        return np.array([row[3] for row in self.rows])

    @property
    def scatter(self) -> Real:
        """How far other starts lie from it."""
        return np.array([row[4] for row in self.rows])

    @property
    def scale(self) -> Real:
        """Typical size of a step."""
        return np.maximum(self.scatter, 0.1)

    @property
    def plain(self) -> int:
        """How many numbers the paper's law has."""
        return len(self.rows) - (len(_ASYMMETRY) if self.asymmetry else 0)

    def without_asymmetry(self) -> Self:
        """Give the layout of the paper's law."""
        return replace(self, rows=self.rows[: self.plain], asymmetry=False)

    def inside(self, vector: Real) -> Real:
        """Move numbers just inside of their bounds."""
        # Trust-region reflective steps need a start off the bounds.
        slack = 1e-6 * (self.high - self.low)
        return np.asarray(np.clip(vector, self.low + slack, self.high - slack), dtype=np.float64)

    def at_bounds(self, vector: Real) -> tuple[str, ...]:
        """Names of the numbers that lie at a bound."""
        share = (vector - self.low) / (self.high - self.low)
        return tuple(
            row[0] for row, place in zip(self.rows, share, strict=True) if not _AT_BOUND < place < 1.0 - _AT_BOUND
        )

    def coefficients(self, vector: Real, origin: str) -> MrCoefficients:
        """What the vector stands for."""
        count = self.order + 1
        # Shape and asymmetry are one for all currents, so they are counted from the largest force.
        force, stiffness = max(self.force), max(self.force) / self.displacement
        levels = (1.0, 1.0 / self.velocity, 1.0 / self.velocity, 1.0 / self.displacement)
        polynomials = [
            self._polynomial(np.exp(vector[place * count : (place + 1) * count]), level)
            for place, level in enumerate(levels)
        ]
        k1, x0, yields, gamma, n = (float(number) for number in vector[4 * count : 4 * count + len(_SHAPE)])
        delta = exp(-yields) / self.displacement
        return MrCoefficients(
            alpha=polynomials[0], c0=polynomials[1], c1=polynomials[2], k0=polynomials[3],
            k1=k1 * force / self.displacement, x0=x0 * self.displacement,
            beta=(1.0 - gamma) * delta, gamma=gamma * delta, delta=delta, n=n,
            asymmetry=self._asymmetry(vector[self.plain :], stiffness) if self.asymmetry else None,
            highest_current_a=self.highest_current_a, origin=origin,
        )  # fmt: skip

    def _polynomial(self, multiples: Real, level: float) -> Polynomial:
        """Powers of the current from Bernstein coefficients (Farouki 2012, equation 8)."""
        m, powers = self.order, np.zeros(self.order + 1)
        for j, multiple in enumerate(multiples):
            value = float(multiple) * level * self.force[j]
            for k in range(j, m + 1):
                powers[k] += value * comb(m, k) * comb(k, j) * (-1.0) ** (k - j)
        return tuple(float(power) / self.highest_current_a**k for k, power in enumerate(powers))

    def _asymmetry(self, numbers: Real, stiffness: float) -> MrAsymmetry:
        values = {row[0]: float(number) for row, number in zip(_ASYMMETRY, numbers, strict=True)}
        values["k1_sides"] *= stiffness
        values["speed"] = exp(values["speed"]) * self.velocity
        return MrAsymmetry(**values)


def layout_of(records: Sequence[MrRecord], *, order: int, asymmetry: bool, lowest_k1: float | None) -> MrLayout:
    """Lay out the fit of these records; all levels are multiples of what was measured."""
    currents = [record.current_a for record in records]
    highest = max(currents) if order else (max(currents) or 1.0)
    # Two logs at one current: either level will do as the unit of a Bernstein coefficient.
    by_current = sorted((record.current_a, record.rms_force) for record in records)
    at = [highest * place / max(order, 1) for place in range(order + 1)]
    levels_at = [level for _, level in by_current]
    force = np.interp(at, sorted(currents), levels_at) if order else np.array([max(levels_at)])
    velocity = max(float(np.sqrt(np.mean(record.velocity**2))) for record in records)
    displacement = max(float(np.std(record.displacement)) for record in records)
    levels = tuple(row for row in _LEVELS for _ in range(order + 1))
    unit = float(force.max()) / displacement
    low = -5.0 if lowest_k1 is None else lowest_k1 / unit
    shape = ((_SHAPE[0][0], low, *_SHAPE[0][2:]), *_SHAPE[1:])
    return MrLayout(
        rows=(*levels, *shape, *(_ASYMMETRY if asymmetry else ())),
        order=order,
        asymmetry=asymmetry,
        highest_current_a=float(highest),
        force=tuple(float(each) for each in force),
        velocity=velocity,
        displacement=displacement,
    )
