"""Numbers of a model file: plain SI numbers, or text with a unit of the right dimension."""

from collections.abc import Mapping
from functools import lru_cache
from math import isfinite

from chladni.signals.errors import ModelError, SetupError
from chladni.signals.unit_text import in_unit, read, symbol_as_written
from chladni.signals.units import parse_quantity

# What derived SI units are made of. Hz stays by itself: 2 rad/s is no 2 Hz.
_MADE_OF: Mapping[str, Mapping[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "C": {"A": 1, "s": 1},
    "F": {"A": 2, "s": 4, "kg": -1, "m": -2},
    "T": {"kg": 1, "s": -2, "A": -1},
    "rad": {},
}


def number(value: float | str, unit: str | None) -> float:
    """Give a number of a model file in SI.

    Parameters
    ----------
    value
        A number, taken to be in `unit`; or text such as ``"1.2 kN/mm"``.
    unit
        SI unit expected; None when any will do, because another mistake hides which.

    Raises
    ------
    ModelError
        When the text is no quantity, its unit has another dimension, or the number is not finite.

    Examples
    --------
    >>> number("1.2 kN/mm", "N/m"), number(3.0, "N/m"), number("0.5 N m", "N m/rad")
    (1200000.0, 3.0, 0.5)
    """
    if not isinstance(value, str):
        if not is_finite(value):
            raise ModelError(f"found {value}; must be finite, not inf or nan")
        return float(value)
    try:
        found, found_unit = parse_quantity(value)
    except SetupError as error:
        raise ModelError(str(error)) from None
    if unit is not None and dimension(found_unit) != dimension(unit):
        raise ModelError(f"found {value[:60]!r}, which is {in_unit(found_unit)}; must be {_wanted(unit)}")
    return found


def is_finite(value: float) -> bool:
    """Whether a number is finite in double precision; TOML's whole numbers may have a thousand digits."""
    try:
        return isfinite(value)
    except OverflowError:
        return False


@lru_cache(maxsize=1024)
def dimension(unit: str) -> tuple[tuple[str, int], ...]:
    """Powers of the base units in the text of an SI unit; angles have none.

    Examples
    --------
    >>> dimension("N/m") == dimension("kg/s^2"), dimension("N m/rad") == dimension("N m")
    (True, True)
    """
    # m/s^2 comes as one factor, so its seconds are added to the rest.
    powers: dict[str, int] = {}
    for (symbol, per_second), exponent in read(unit, symbol_as_written)[1].items():
        for base, power in _MADE_OF.get(symbol, {symbol: 1}).items():
            powers[base] = powers.get(base, 0) + power * exponent
        powers["s"] = powers.get("s", 0) - per_second * exponent
    return tuple(sorted((base, power) for base, power in powers.items() if power))


def _wanted(unit: str) -> str:
    if unit == "1":
        return "a plain number, or a share such as '5 %'"
    return f"a number in {unit}, or text with a unit such as '2.5 {unit}'"
