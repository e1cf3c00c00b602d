"""Units: from what people write to SI, and a small closed algebra on the text of SI units.

The symbols and their scales are in ``units.txt``, read by pint on first need; SI units never load it.
"""

import re
from collections.abc import Callable
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any

from chladni.signals.errors import SetupError
from chladni.signals.unit_text import (
    MOTION,
    Exponents,
    Scaled,
    combined,
    read,
    symbol_as_written,
    write,
)
from chladni.signals.wording import near_words

#: Symbols that results are written in; they are their own SI form.
SI_SYMBOLS = frozenset(
    ["m", "s", "kg", "A", "K", "degC", "rad", "Hz", "N", "Pa", "V", "ohm", "C", "F", "W", "J", "T"]
)

_QUANTITY = re.compile(
    r"\s*(?P<number>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)(?P<unit>(?![0-9.]).*)"
)
_REFUSED = {
    "degF": "it has an offset; give the temperature in K or degC",
    "dB": "decibels are logarithmic; give the linear value",
    "gram": "chladni reads g as gravity and has no gram; give masses in kg",
}
# Symbols; what is longer is a word, which may have a plural.
_SHORT = 4
# Those that capitals may hide: nobody means picojoules by PJ.
_PREFIXES = ("", *"numckM", "nano", "micro", "milli", "centi", "kilo", "mega")
# Prefixes in use where not all are. No sensor counts in gigaseconds, hectogravities or centivolts, and nobody divides
# days: such a reading is one by the letter.
_PREFIXES_OF = {
    "meter": ("nano", "micro", "milli", "centi", "deci", "kilo", "pico"),
    "second": ("pico", "nano", "micro", "milli"),
    "standard_gravity": ("nano", "micro", "milli"),
    "litre": ("micro", "milli", "centi", "deci", "hecto"),
    "tonne": ("kilo",),
} | dict.fromkeys(["minute", "hour", "day", "foot", "mil", "mile", "count", "order", "percent"], ())
_RARE_PREFIXES = {"centi": ("newton",), "deci": ("bar",), "hecto": ("pascal",)}
# Farther than any derivative in use: snap is m/s^4.
_HIGHEST_DERIVATIVE = 6


@lru_cache(maxsize=1024)
def si_factor(unit: str) -> tuple[float, str]:
    """Give the factor that turns values in `unit` into SI, and the text of the SI unit.

    Parameters
    ----------
    unit
        Such as ``"g"`` (gravity, never gram), ``"mm/s^2"``, ``"m/s2"``, ``"kN/mm"``, ``"%"``; empty means ``1``.

    Returns
    -------
    factor, si_unit
        Multiply by `factor` to get SI. ``degC`` stays ``degC``: its offset is no factor.

    Raises
    ------
    SetupError
        When the text is no unit, a symbol is unknown (near matches are named) or the unit is no plain multiple of SI.

    Examples
    --------
    >>> si_factor("g")
    (9.80665, 'm/s^2')
    >>> si_factor("m/s²")
    (1.0, 'm/s^2')
    >>> si_factor("kN/mm")
    (1000000.0, 'N/m')
    """
    factor, exponents = read(unit, symbol_in_si)
    return factor, write(exponents)


def parse_quantity(text: str) -> tuple[float, str]:
    """Read a number with its unit and give both in SI.

    Raises
    ------
    SetupError
        When there is no finite number in front or what follows is no unit.

    Examples
    --------
    >>> parse_quantity("50 g")
    (490.3325, 'm/s^2')
    >>> parse_quantity("100 mV/m")
    (0.1, 'V/m')
    """
    return quantity_by(text, si_factor)


def quantity_by(text: str, unit_in_si: Callable[[str], tuple[float, str]]) -> tuple[float, str]:
    """Read a number with its unit, the unit by `unit_in_si`, as `parse_quantity` does."""
    # Cut, because text from a file may be of any length and the message below repeats it.
    match = _QUANTITY.fullmatch(text[:200])
    if match is None or not isfinite(float(match["number"])):
        raise SetupError(f"quantity {text[:60]!r}: begins with no finite number; quantities look like '1.2 kN/mm'")
    factor, unit = unit_in_si(match["unit"].strip())
    value = float(match["number"]) * factor
    if not isfinite(value):
        raise SetupError(f"quantity {text[:60]!r}: too large for a floating point number in {unit}")
    return value, unit


@lru_cache(maxsize=1024)
def product(left: str, right: str) -> str:
    """Unit of ``left * right``.

    Examples
    --------
    >>> product("m", "N")
    'N m'
    """
    return write(combined(_text(left), _text(right))[1])


@lru_cache(maxsize=1024)
def quotient(numerator: str, denominator: str) -> str:
    """Unit of ``numerator / denominator``; ``1`` when both are equal.

    Examples
    --------
    >>> quotient("m/s^2", "N")
    '(m/s^2)/N'
    >>> quotient("V", "V")
    '1'
    """
    return write(combined(_text(numerator), _text(denominator), power=-1)[1])


@lru_cache(maxsize=1024)
def power(unit: str, exponent: int) -> str:
    """Unit of ``unit`` raised to a whole `exponent`.

    Examples
    --------
    >>> power("m/s", 2)
    '(m/s)^2'
    """
    return write(combined((1.0, {}), _text(unit), power=exponent)[1])


def power_density_unit(unit: str) -> str:
    """Unit of a power spectral density of a channel in `unit`.

    Examples
    --------
    >>> power_density_unit("m/s^2"), power_density_unit("N")
    ('(m/s^2)^2/Hz', 'N^2/Hz')
    """
    return quotient(power(unit, 2), "Hz")


def integrated(unit: str) -> str:
    """Unit of the time integral of a motion, such as ``m/s`` of ``m/s^2``, also over a force: ``(m/s)/N``.

    Raises
    ------
    SetupError
        When `unit` is no motion with a rate left to integrate.
    """
    return _derived(unit, -1)


def differentiated(unit: str) -> str:
    """Unit of the time derivative of a motion, such as ``m/s`` of ``m``, also over a force.

    Raises
    ------
    SetupError
        When `unit` is no motion.
    """
    return _derived(unit, 1)


def _derived(unit: str, step: int) -> str:
    exponents = _text(unit)[1]
    # A motion over a force is a transfer function; integrating it integrates the motion.
    motions = [factor for factor, exponent in exponents.items() if factor[0] in MOTION and exponent == 1]
    verb = "differentiated" if step > 0 else "integrated"
    chain = "m, m/s, m/s^2 or rad, rad/s, rad/s^2, alone or over another unit"
    if len(motions) != 1 or not 0 <= motions[0][1] + step <= _HIGHEST_DERIVATIVE:
        raise SetupError(f"unit {unit!r} can't be {verb}: that needs one motion out of {chain}")
    symbol, per_second = motions[0]
    result: Exponents = {factor: exponent for factor, exponent in exponents.items() if factor != motions[0]}
    result[symbol, per_second + step] = 1
    return write(result)


def _text(unit: str) -> Scaled:
    return read(unit, symbol_as_written)


def symbol_in_si(symbol: str) -> Scaled:
    """Give the scale and the SI factors of one symbol, the `resolve` of what people write; `SetupError` else."""
    if symbol in SI_SYMBOLS:
        return symbol_as_written(symbol)
    return _known_symbol(symbol)


@lru_cache(maxsize=256)
def _known_symbol(symbol: str) -> Scaled:
    registry = _registry()
    readings = _readings(symbol)
    if symbol in _REFUSED or not readings:
        raise SetupError(f"unit {symbol!r}: {_REFUSED.get(symbol) or _advice(symbol, registry)}")
    # A name without prefix comes first: "min" is a minute before it's a thousandth of an inch.
    return _scaled(*min(readings, key=lambda reading: len(reading[0])))


def _readings(symbol: str, *, case_sensitive: bool = True) -> list[tuple[str, str]]:
    """Prefix and name of each unit that a symbol may stand for."""
    found = _registry().parse_unit_name(symbol, case_sensitive=case_sensitive)
    # pint would take the s of "Ns" for a plural; only whole words may have one.
    return [
        (prefix, name)
        for prefix, name, plural in found
        if (not plural or len(symbol) > _SHORT) and (not prefix or _has_prefix(name, prefix))
    ]


def _has_prefix(name: str, prefix: str) -> bool:
    if name in _PREFIXES_OF:
        return prefix in _PREFIXES_OF[name]
    return prefix not in _RARE_PREFIXES or name in _RARE_PREFIXES[prefix]


@lru_cache(maxsize=256)
def in_other_case(symbol: str) -> tuple[str, ...]:
    """Give the symbols of different units that `symbol` is in capitals, or without: ``kHz`` for ``KHZ``."""
    folded, names = symbol.casefold(), _names_by_folded()
    # Where capitals and small letters stand side by side, a prefix is meant as it stands: mBar is no megabar.
    mixed = not (symbol.islower() or symbol.isupper() or symbol.istitle())
    singular = folded[:-1] if len(folded) > _SHORT and folded.endswith("s") else folded
    words = [
        prefix + name
        for spelled in dict.fromkeys([folded, singular])
        for prefix in _PREFIXES
        if spelled.startswith(prefix.casefold()) and (not mixed or symbol.startswith((prefix, "K")))
        for name in names.get(spelled[len(prefix) :], ())
    ]
    found: dict[tuple[float, str], str] = {}
    for word in words:
        try:
            factor, exponents = symbol_in_si(word)
        except SetupError:
            continue
        found.setdefault((factor, write(exponents)), word)
    return tuple(found.values())


@lru_cache(maxsize=1)
def _names_by_folded() -> dict[str, list[str]]:
    names: dict[str, list[str]] = {}
    for name in map(str, _registry()):
        names.setdefault(name.casefold(), []).append(name)
    return names


def _scaled(prefix: str, name: str) -> Scaled:
    root = _registry().Quantity(1.0, prefix + name).to_root_units()
    result: Scaled = (float(root.magnitude), {})
    for dimension, exponent in root.dimensionality.items():
        result = combined(result, symbol_as_written(str(dimension).strip("[]")), power=round(float(exponent)))
    return result


def _advice(symbol: str, registry: Any) -> str:
    known = sorted(name for name in map(str, registry) if len(name) <= len(symbol) + 2)
    other_case = {registry.get_symbol(prefix + name) for prefix, name in _readings(symbol, case_sensitive=False)}
    near = sorted(other_case) or near_words(symbol, known, count=3)
    joined = [f"{symbol[0]} {symbol[1:]}"] if len(symbol) == 2 and set(symbol) <= SI_SYMBOLS else []
    hint = f"; near: {', '.join(joined + near)}" if joined + near else ""
    return f"not known{hint}; units look like g, mm/s^2, N, kN/mm, deg/s"


@lru_cache(maxsize=1)
def _registry() -> Any:
    # Any, because pint's types are looser than what it gives. Imported here because it loads longer than a log.
    import pint

    return pint.UnitRegistry(str(Path(__file__).with_name("units.txt")))
