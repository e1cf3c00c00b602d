"""Transfer functions as quotients of polynomials with dead time, kept exactly as they are written."""

from dataclasses import dataclass
from math import isfinite, pi
from typing import Self

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError

#: Highest power of s that is taken; roots of longer polynomials are ill-conditioned beyond use.
MAX_ORDER = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferFunction:
    """``H(s) = num(s)/den(s) e^(-s delay)``; num may be of higher order than den (an improper function).

    Attributes
    ----------
    num, den
        Coefficients of descending powers of s: ``(2, 1)`` is 2 s + 1. Leading zeros are dropped.
    delay_s
        Dead time in seconds, not negative.

    Raises
    ------
    ModelError
        When a number is not finite, den is zero, an order is above 40, or the dead time is negative.

    Examples
    --------
    >>> pt1 = TransferFunction(num=(3,), den=(0.5, 1))
    >>> pt1.poles()
    array([-2.+0.j])
    >>> (pt1 * TransferFunction(num=(0.5, 1), den=(1,))).num
    (1.5, 3.0)
    """

    num: tuple[float, ...]
    den: tuple[float, ...] = (1.0,)
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "num", _coefficients("num", self.num))
        object.__setattr__(self, "den", _coefficients("den", self.den))
        if self.den == (0.0,):
            raise ModelError("transfer function: den is zero; give at least one coefficient that isn't")
        if not (isfinite(self.delay_s) and self.delay_s >= 0):
            raise ModelError(f"transfer function: delay_s = {self.delay_s:g}; a dead time is finite and not negative")

    @property
    def order(self) -> int:
        """Number of poles: the highest power of s in den."""
        return len(self.den) - 1

    @property
    def relative_degree(self) -> int:
        """How many powers of s den is above num; negative for an improper function. 0 is given for H = 0 too."""
        return 0 if self.num == (0.0,) else len(self.den) - len(self.num)

    @property
    def proper(self) -> bool:
        """Whether the response stays bounded at high frequency, so that equations in time exist."""
        return self.relative_degree >= 0

    def frequency_response(self, frequency_hz: Real) -> Complex:
        """``H(j omega)``, ``[frequency]``, exact with dead time and improper; infinite at a pole on the axis."""
        s = 2j * pi * np.asarray(frequency_hz, dtype=np.float64)
        above, below = np.polyval(self.num, s) * np.exp(-s * self.delay_s), np.polyval(self.den, s)
        # Divided by one in its place, so that a pole gives infinity without a warning.
        pole = below == 0
        return np.asarray(np.where(pole, complex(np.inf), above / np.where(pole, 1.0, below)), dtype=np.complex128)

    def poles(self) -> Complex:
        """Roots of den in rad/s."""
        return np.asarray(np.roots(self.den), dtype=np.complex128)

    def zeros(self) -> Complex:
        """Roots of num in rad/s. A dead time has neither poles nor zeros."""
        return np.asarray(np.roots(self.num), dtype=np.complex128)

    def static_gain(self) -> float:
        """``H(0)``; infinite when the function integrates, by the sign of the gain."""
        # Powers of s that both have cancel at rest only; the function itself keeps them.
        shared = min(_trailing_zeros(self.num), _trailing_zeros(self.den))
        above, below = self.num[len(self.num) - 1 - shared], self.den[len(self.den) - 1 - shared]
        if below == 0:
            leading = self.den[len(self.den) - 1 - _trailing_zeros(self.den)]
            return float(np.copysign(np.inf, above * leading))
        return above / below

    def polynomial_and_rest(self) -> tuple[Real, Real]:
        """Split num/den into a polynomial, descending, and what is left over den, as num = q den + r."""
        # NumPy's polydiv takes small leading coefficients of the rest for zero, which those of fast poles aren't.
        den, rest = np.asarray(self.den), np.asarray(self.num)
        quotient = np.zeros(max(1, rest.size - den.size + 1))
        for place in range(rest.size - den.size + 1):
            quotient[place] = rest[0] / den[0]
            rest = rest[1:] - quotient[place] * np.pad(den, (0, rest.size - den.size))[1:]
        return quotient, rest

    def filtered(self, time_constant_s: float) -> Self:
        """Give the proper function with as many lags of `time_constant_s` as the order of num is above that of den.

        A proper function comes back unchanged.
        """
        lags = max(0, -self.relative_degree)
        den = np.asarray(self.den)
        for _ in range(lags):
            den = np.polymul(den, [_positive_time(time_constant_s), 1.0])
        return type(self)(num=self.num, den=tuple(den), delay_s=self.delay_s)

    def __mul__(self, other: "TransferFunction") -> "TransferFunction":
        """Both in series; nothing is cancelled."""
        return TransferFunction(
            num=tuple(np.polymul(self.num, other.num)),
            den=tuple(np.polymul(self.den, other.den)),
            delay_s=self.delay_s + other.delay_s,
        )


def _coefficients(name: str, given: tuple[float, ...]) -> tuple[float, ...]:
    values = tuple(float(value) for value in given)
    if not values or not all(isfinite(value) for value in values):
        raise ModelError(f"transfer function: {name} = {list(given)!r:.80}; give finite numbers, at least one")
    # The order is that of the first coefficient that isn't zero: a knob at zero takes a power away.
    first = next((place for place, value in enumerate(values) if value), len(values) - 1)
    if len(values) - first > MAX_ORDER + 1:
        raise ModelError(
            f"transfer function: {name} is of order {len(values) - first - 1}; at most {MAX_ORDER} is taken"
        )
    return values[first:]


def _trailing_zeros(coefficients: tuple[float, ...]) -> int:
    return next((place for place, value in enumerate(reversed(coefficients)) if value), 0)


def _positive_time(time_s: float) -> float:
    if not (isfinite(time_s) and time_s > 0):
        raise ModelError(f"filter time constant {time_s:g} s: it must be finite and above zero")
    return time_s
