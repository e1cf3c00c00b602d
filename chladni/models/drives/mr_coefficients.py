"""Coefficients of a magnetorheological damper over current, and the law that they make at one current."""

from dataclasses import dataclass, replace
from math import isfinite
from typing import Self

from chladni.models.core.port_law import PortLaw
from chladni.models.drives.mr_damper_law import asymmetric_bouc_wen, modified_bouc_wen
from chladni.signals.errors import ModelError

#: Coefficients of a polynomial in current, the constant first; up to the paper's third order.
Polynomial = tuple[float, ...]
_HIGHEST_ORDER = 3
_POLYNOMIALS = ("alpha", "c0", "c1", "k0")
# Beyond this many times its own bound, |z| can only be a trial that is thrown away.
_Z_MARGIN = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MrAsymmetry:
    """How coefficients differ between compression, rest and extension; zeros give the paper's law.

    ``u = tanh(velocity/speed)`` is -1 in compression, 0 at rest, 1 in extension. See
    `chladni.models.drives.mr_damper_law.asymmetric_bouc_wen`.

    Attributes
    ----------
    alpha_sides, c0_sides, c1_sides, k0_sides
        Half the logarithm of extension over compression.
    k1_sides
        Half of extension minus compression, N/m.
    alpha_moving, c1_moving
        Logarithm of moving over resting.
    yield_moving
        Logarithm of the yield displacement 1/delta, moving over resting.
    speed
        Velocity over which the sides change, m/s.
    """

    alpha_sides: float = 0.0
    c0_sides: float = 0.0
    c1_sides: float = 0.0
    k0_sides: float = 0.0
    k1_sides: float = 0.0
    alpha_moving: float = 0.0
    c1_moving: float = 0.0
    yield_moving: float = 0.0
    speed: float

    def __post_init__(self) -> None:
        _require_finite(self.numbers(), "asymmetry")
        if not self.speed > 0:
            raise ModelError(f"speed: {self.speed:g} m/s is not possible; give a positive velocity")

    def numbers(self) -> tuple[float, ...]:
        """In the order of the law."""
        return (
            self.alpha_sides, self.c0_sides, self.c1_sides, self.k0_sides, self.k1_sides,
            self.alpha_moving, self.c1_moving, self.yield_moving, self.speed,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class MrCoefficients:
    """One damper: ``alpha(i) = alpha[0] + alpha[1] i + alpha[2] i^2 + alpha[3] i^3``, c0, c1, k0 alike (equation 5).

    Attributes
    ----------
    alpha
        N (for a z without unit), N/A, ...
    c0, c1
        N s/m: damping beyond yield, and of the slow motion before it.
    k0, k1
        N/m: beside c0, and of the accumulator. The first over current, the second constant.
    x0
        m: where the accumulator gives no force.
    beta, gamma, delta, n
        Shape of the loop. abs(z) stays below ``(delta/(beta + gamma))^(1/n)``.
    asymmetry
        None for the paper's law.
    lowest_current_a, highest_current_a
        Range that the polynomials were fitted in.
    origin
        Data set and what was fitted.

    Raises
    ------
    ModelError
        When a number is not finite or the law would have no bounded loop.
    """

    alpha: Polynomial
    c0: Polynomial
    c1: Polynomial
    k0: Polynomial
    k1: float = 0.0
    x0: float = 0.0
    beta: float
    gamma: float
    delta: float
    n: float
    asymmetry: MrAsymmetry | None = None
    lowest_current_a: float = 0.0
    highest_current_a: float = 1.0
    origin: str = ""

    def __post_init__(self) -> None:
        for name in _POLYNOMIALS:
            polynomial = getattr(self, name)
            if not 1 <= len(polynomial) <= _HIGHEST_ORDER + 1:
                raise ModelError(f"{name}: {len(polynomial)} coefficients; a polynomial in current has 1 to 4")
            _require_finite(polynomial, name)
        _require_finite((self.k1, self.x0, self.beta, self.gamma, self.delta, self.n), "coefficients")
        # With delta <= 0 z would be pushed against the motion, and without beta + gamma nothing would end its growth.
        if not (self.delta > 0 and self.beta + self.gamma > 0 and self.n >= 1):
            raise ModelError(
                f"delta {self.delta:g}, beta + gamma {self.beta + self.gamma:g}, n {self.n:g}: "
                "the loop is bounded only with delta > 0, beta + gamma > 0 and n >= 1"
            )

    @property
    def z_bound(self) -> float:
        """Largest abs(z)."""
        return float((self.delta / (self.beta + self.gamma)) ** (1.0 / self.n))

    def value(self, name: str, current_a: float) -> float:
        """One of alpha, c0, c1, k0 at a current."""
        # Horner: no power of a current is taken.
        total = 0.0
        for coefficient in reversed(getattr(self, name)):
            total = total * current_a + coefficient
        return total

    def law(self, current_a: float, *, port: int = 0) -> PortLaw:
        """Law of the damper at a current, at rest at the start.

        Raises
        ------
        ModelError
            When a polynomial gives a negative coefficient at this current.
        """
        values = [self.value(name, current_a) for name in _POLYNOMIALS]
        for name, value in zip(_POLYNOMIALS, values, strict=True):
            # Without c1 nothing would hold the inner element; the others may vanish.
            if value < 0.0 or (name == "c1" and value == 0.0):
                raise ModelError(
                    f"current: {name}({current_a:g} A) = {value:.4g} is not possible; the coefficients hold "
                    f"from {self.lowest_current_a:g} to {self.highest_current_a:g} A"
                )
        # Beside these the law needs to know where a trial has left the loop for good.
        shape = (self.k1, self.x0, self.beta, self.gamma, self.delta, self.n, _Z_MARGIN * self.z_bound)
        if self.asymmetry is None:
            return PortLaw(port=port, function=modified_bouc_wen, parameters=(*values, *shape), state=(0.0, 0.0))
        parameters = (*values, *shape, *self.asymmetry.numbers())
        return PortLaw(port=port, function=asymmetric_bouc_wen, parameters=parameters, state=(0.0, 0.0))

    def scaled(self, *, force: float = 1.0, alpha: float = 1.0, c0: float = 1.0, c1: float = 1.0) -> Self:
        """Give a damper of the same build whose force is larger: alpha, c0, c1, k0, k1 times `force`.

        `alpha`, `c0` and `c1` change one property beside that.
        """
        # Sides and moving are ratios; of the asymmetry only the stiffness is a force over a displacement.
        asymmetry = self.asymmetry
        if asymmetry is not None:
            asymmetry = replace(asymmetry, k1_sides=force * asymmetry.k1_sides)
        return replace(
            self,
            alpha=_times(self.alpha, force * alpha),
            c0=_times(self.c0, force * c0),
            c1=_times(self.c1, force * c1),
            k0=_times(self.k0, force),
            k1=force * self.k1,
            asymmetry=asymmetry,
        )


def _times(polynomial: Polynomial, factor: float) -> Polynomial:
    return tuple(factor * coefficient for coefficient in polynomial)


def _require_finite(numbers: tuple[float, ...], what: str) -> None:
    for number in numbers:
        if not isfinite(number):
            raise ModelError(f"{what}: {number} is not finite; every coefficient is a number")
