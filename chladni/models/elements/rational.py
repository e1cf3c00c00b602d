"""Elements given by their coefficients, each of which becomes a parameter."""

from collections.abc import Sequence
from math import inf

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.elements.element import Element, ElementKind, Values
from chladni.models.elements.transfer_function import TransferFunction

#: Word for elements that no file names by kind, but by num and den.
RATIONAL = "rational"


def rational(num: Sequence[float], den: Sequence[float] = (1.0,), *, delay_s: float = 0.0) -> Element:
    """Give the element ``num(s)/den(s) e^(-s delay)``.

    Its parameters are ``num_s1`` for the coefficient of s in num, and so on, for those that aren't zero, and
    ``delay`` when there's a dead time.

    Parameters
    ----------
    num, den
        Coefficients of descending powers of s; num may be the longer one.
    delay_s
        Dead time in seconds.

    Raises
    ------
    ModelError
        When they make no transfer function.

    Examples
    --------
    >>> list(rational((2, 1), (3, 0)).parameters)
    ['num_s1', 'num_s0', 'den_s1']
    """
    checked = TransferFunction(num=tuple(num), den=tuple(den), delay_s=delay_s)
    declared = [*_declared("num", checked.num), *_declared("den", checked.den)]
    if delay_s:
        declared.append(_parameter("delay", delay_s, "s", 0.0, "dead time"))
    parameters = Parameters(tuple(declared))
    kind = ElementKind(
        name=RATIONAL,
        title="Transfer function by its coefficients",
        formula="num(s)/den(s)",
        group="basic",
        parameters=parameters,
        transfer=_transfer,
    )
    return Element(kind=kind, parameters=parameters)


def _declared(name: str, coefficients: tuple[float, ...]) -> list[Parameter]:
    last = len(coefficients) - 1
    return [
        _parameter(f"{name}_s{last - place}", value, "1", -inf, f"{name}, power {last - place} of s")
        for place, value in enumerate(coefficients)
        # The lone zero of H = 0 stays, so that num has a parameter at all.
        if value or last == 0
    ]


def _parameter(name: str, value: float, unit: str, minimum: float, meaning: str) -> Parameter:
    """A number whose meaning isn't known has a usual range of a decade to both sides."""
    low, high = sorted((value / 10, value * 10)) if value else (-1.0, 1.0)
    return Parameter(name=name, value=value, unit=unit, low=low, high=high, minimum=minimum, meaning=meaning)


def _transfer(values: Values) -> TransferFunction:
    return TransferFunction(
        num=_polynomial("num_s", values), den=_polynomial("den_s", values), delay_s=values.get("delay", 0.0)
    )


def _polynomial(prefix: str, values: Values) -> tuple[float, ...]:
    by_power = {int(name.removeprefix(prefix)): value for name, value in values.items() if name.startswith(prefix)}
    # Powers without a parameter were zero, and stay so.
    return tuple(by_power.get(power, 0.0) for power in range(max(by_power), -1, -1))
