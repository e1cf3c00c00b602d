"""Units as instruments, exporters and people label measured values: conventions, and what a label can't tell alone.

A label is no definition. ``lb`` on a load cell is a force, ``G`` on an accelerometer is gravity and on a magnetometer
gauss, ``EU`` is whatever the sensor was set up in. What the file says of the quantity settles it; where nothing does,
the label is refused with what to write instead.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import islice
from itertools import product as every

from chladni.signals.errors import SetupError
from chladni.signals.unit_text import MAX_LENGTH, Exponents, Scaled, read, spelled, symbol_as_written, write
from chladni.signals.units import in_other_case, symbol_in_si

# What the file writes where there is nothing to say.
_NOTHING = frozenset(
    ["", "-", "--", "none", "null", "n/a", "n.a.", "unitless", "dimensionless", "no unit", "no units", "ratio", "1"]
)
_LEFT_OPEN = frozenset(["eu", "user", "unit", "units", "eng. units", "engineering units", "a.u.", "au", "arb", "?"])
# A level is no value of its own: the label says how a number was formed from samples, not in which unit.
_LEVEL = re.compile(
    r"(?:[\s_-]*\(?(?:rms|pk[-\s]?pk|pk|peak[-\s]to[-\s]peak|peak|p-p|pp|0-pk|0-p)\)?|(?<=[VA])\s?(?:DC|AC))$",
    re.IGNORECASE,
)
_ENCLOSED = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)|\"([^\"]*)\"")
_SPELLINGS = (
    (re.compile(r"['’`](?=s\b)", re.IGNORECASE), ""),
    (re.compile(r"(?<=[a-z])s?[-\s]force\b"), "_force"),
    (re.compile(r"\bg[-\s]?force\b", re.IGNORECASE), "g"),
    (re.compile(r"\bg_?[0₀ₙ]"), "gn"),
    # Random vibration is in gravity, whatever its capital.
    (re.compile(r"^G(?=[\s_-]?(?:rms|pk|peak|p-p)|(?:\^2|\*\*2|2|²)/Hz)", re.IGNORECASE), "g"),
    # German and French revolutions.
    (re.compile(r"^[UuTt]/(?=(?:min|s)\b)"), "rev/"),
    (re.compile(r"^r/(?=(?:min|s)\b)"), "rev/"),
    (re.compile(r"ε"), "strain"),
    (re.compile(r"^[µμ]$"), "micron"),
)
# Meanings of a symbol, and whether the first is the usual one where nothing else is known.
_MEANINGS: dict[str, tuple[tuple[str, ...], bool]] = {
    "G": (("g", "gauss"), False),
    "Gs": (("g", "gauss"), True),
    "lb": (("lbf", "lbm"), False),
    "lbs": (("lbf", "lbm"), False),
    "pound": (("lbf", "lbm"), False),
    "pounds": (("lbf", "lbm"), False),
    "oz": (("ozf", "oz"), False),
    "kg": (("kg", "kgf"), True),
    "t": (("t", "tf"), True),
    "C": (("degC", "C"), False),
    "gal": (("Gal", "gallon"), False),
    "nm": (("nm", "Nm"), True),
}
_PREFIXED = {f"{prefix}{symbol}": (prefix, symbol) for prefix in ("m", "u", "n", "k") for symbol in ("G", "Gs")}
# No sensor measures a mass times a length, or over an area: that is the torque or the pressure of its weight.
_OF_WEIGHT = {"kg m": "N m", "kg/m^2": "Pa"}
# SI units in kg, m, s and A (SI brochure, table 4).
_BASE: dict[str, dict[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "C": {"A": 1, "s": 1},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "T": {"kg": 1, "s": -2, "A": -1},
    "Hz": {"s": -1},
}
_GRAVITY = frozenset(["g", "mg", "ug", "ng"])
_NAMES = (
    (frozenset(["a", "ax", "ay", "az", "acc", "accel", "acceleration", "beschleunigung", "vibration"]), "m/s^2"),
    (frozenset(["b", "bx", "by", "bz", "mag", "magnetic", "magnetometer", "field", "flux"]), "T"),
    (frozenset(["f", "fx", "fy", "fz", "force", "load", "thrust", "hammer", "shaker", "kraft"]), "N"),
    (frozenset(["torque", "moment", "drehmoment"]), "N m"),
    (frozenset(["pressure", "druck"]), "Pa"),
    (frozenset(["mass", "masse"]), "kg"),
    (frozenset(["charge", "ladung"]), "C"),
    (frozenset(["temp", "temperature"]), "degC"),
)
_TWICE = re.compile(r"/\s*([A-Za-z_]+)\s*\*\s*\1\b")
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_SYMBOL = re.compile(r"[A-Za-z_]+")
# Few symbols have a second meaning; a label that is full of them is no unit.
_MOST_READINGS = 64


@lru_cache(maxsize=1024)
def read_label(label: str, *, quantity: str | None = None) -> tuple[float, str]:
    """Read the unit that a file or an instrument writes beside its values.

    Parameters
    ----------
    label
        As it stands there: ``"ms^-2"``, ``"Gs"``, ``"g rms"``, ``"lb"``, ``"RPM"``, ``"M/S**2"``. Nothing, and words
        for nothing, mean ``1``.
    quantity
        SI unit of what the values are known to be, such as ``"N"`` of a force; it chooses among the meanings of a
        label. A label that means something else all the same is read as it stands: compare with `same_quantity`.

    Returns
    -------
    factor, si_unit
        Multiply by `factor` to get SI; written as `quantity` where the two agree.

    Raises
    ------
    SetupError
        When the label is no unit, leaves the unit open, or has several meanings and nothing tells which; it says what
        to write instead.

    Examples
    --------
    >>> read_label("ms^-2"), read_label("Gs")
    ((1.0, 'm/s^2'), (9.80665, 'm/s^2'))
    >>> read_label("lb", quantity="N")
    (4.4482216152605, 'N')
    """
    if says_nothing(label):
        return 1.0, "1"
    bare = _bare(label)
    try:
        _require_linear(label, bare)
        chosen = _chosen(label, _readings(label, bare), quantity)
    except SetupError:
        mended = _mended(bare)
        if quantity is None or mended == bare:
            raise
        chosen = _chosen(label, _readings(label, mended), quantity)
        if chosen.unit != quantity:
            raise
    return chosen.factor, chosen.unit


def require_label(label: str) -> None:
    """Raise `SetupError` for a label that is no unit whatever the values are; one of several meanings passes."""
    _require_linear(label, bare := _bare(label))
    _readings(label, bare)


def says_nothing(label: str) -> bool:
    """Whether a label is empty, or a word for nothing, as ``NONE`` and ``n/a``.

    Examples
    --------
    >>> says_nothing("NONE"), says_nothing("nA")
    (True, False)
    """
    bare = _bare(label)
    # In capitals or without it's no answer; nA is a current.
    return bare.casefold() in _NOTHING or bare in ("NA", "na")


def same_quantity(unit: str, other: str) -> bool:
    """Whether two SI units are of one dimension; radians and degC count as dimensions.

    Examples
    --------
    >>> same_quantity("N", "kg (m/s^2)"), same_quantity("Hz", "1/s"), same_quantity("rad/s", "Hz")
    (True, True, False)
    """
    return _dimension(unit) == _dimension(other)


def length_and_force_powers(unit: str) -> tuple[int, int] | None:
    """Give the powers of length and force in an SI unit; None when it has others than these and time.

    Examples
    --------
    >>> length_and_force_powers("Pa"), length_and_force_powers("m/s^2"), length_and_force_powers("V")
    ((-2, 1), (1, 0), None)
    """
    powers = dict(_dimension(unit))
    force = powers.pop("kg", 0)
    length = powers.pop("m", 0) - force
    return (length, force) if not powers.keys() - {"s"} else None


def quantity_of_name(name: str) -> str | None:
    """Tell the SI unit of what a channel's name says that it measures; None when it says nothing or several things.

    It serves to choose among the meanings of a label, never to overrule one.

    Examples
    --------
    >>> quantity_of_name("accel_x"), quantity_of_name("magX"), quantity_of_name("channel 1")
    ('m/s^2', 'T', None)
    """
    words = {word.casefold() for word in _WORD.findall(name[:MAX_LENGTH])}
    found = [quantity for names, quantity in _NAMES if names & words]
    return found[0] if len(found) == 1 else None


def _bare(label: str) -> str:
    """The label without brackets, level and marks, in the spelling that is read."""
    text = label.strip("\0 \t\r\n")
    enclosed = _ENCLOSED.fullmatch(text)
    if enclosed is not None:
        text = next(part for part in enclosed.groups() if part is not None).strip()
    for pattern, replacement in _SPELLINGS:
        text = pattern.sub(replacement, text)
    without = _LEVEL.sub("", text)
    return without or text


def _require_linear(label: str, bare: str) -> None:
    if bare.casefold() in _LEFT_OPEN or "EU" in _SYMBOL.findall(bare):
        raise SetupError(f"unit {label[:40]!r}: it stands for whatever unit the sensor was set up in")
    if re.match(r"dB", bare, re.IGNORECASE):
        raise SetupError(f"unit {label[:40]!r}: decibels are logarithmic; give the linear value")
    if _TWICE.search(spelled(bare)):
        raise SetupError(f"unit {label[:40]!r}: it may be divided once or twice; write m/s^2 or m/s/s")
    if bare == "F":
        raise SetupError(f"unit {label[:40]!r}: degrees Fahrenheit have an offset; give K or degC, or write farad")


def _mended(bare: str) -> str:
    """Mend slips that the quantity can confirm: ms2, m/s*s and m/s^-2 on an acceleration."""
    text = re.sub(r"/\s*(s|sec)\s*\^?\s*-([0-9])", r"/\1^\2", spelled(bare))
    text = _TWICE.sub(r"/\1^2", text)
    return re.sub(r"\b([a-z]?m|in|ft|rad|deg)s\^?([0-9])", r"\1/s^\2", text)


@dataclass(frozen=True, slots=True)
class _Reading:
    """One meaning of a label; `usual` when each of its symbols has its usual one."""

    factor: float
    exponents: Exponents
    usual: bool
    text: str

    @property
    def unit(self) -> str:
        return write(self.exponents)


def _readings(label: str, bare: str) -> list[_Reading]:
    """What a label may mean, the usual meaning of each symbol first; `SetupError` when it's nothing at all."""
    symbols = dict.fromkeys(_SYMBOL.findall(spelled(bare)))
    meanings = [_meanings(symbol, bare) for symbol in symbols]
    found: list[_Reading] = []
    for chosen in islice(every(*(words for words, _ in meanings)), _MOST_READINGS):
        words = dict(zip(symbols, chosen, strict=True))
        try:
            factor, exponents = read(bare, partial(_resolved, words))
        except SetupError as error:
            raise SetupError(str(error).replace(repr(bare), repr(label[:MAX_LENGTH]), 1)) from None
        usual = all(has and word == first for word, ((first, *_), has) in zip(chosen, meanings, strict=True))
        found.append(_Reading(factor, exponents, usual, _with_words(spelled(bare), words)))
    return found


def _resolved(words: Mapping[str, str], symbol: str) -> Scaled:
    return symbol_in_si(words.get(symbol, symbol))


def _with_words(text: str, words: Mapping[str, str]) -> str:
    return _SYMBOL.sub(lambda symbol: words.get(symbol.group(), symbol.group()), text)


def _meanings(symbol: str, label: str) -> tuple[tuple[str, ...], bool]:
    """The words a symbol may stand for, and whether the first is the usual one."""
    # Within a product C is coulomb: nothing is measured in degrees Celsius over something.
    if symbol in _MEANINGS and (symbol != "C" or label == symbol):
        return _MEANINGS[symbol]
    if symbol in _PREFIXED:
        prefix, base = _PREFIXED[symbol]
        return tuple(prefix + one for one in _MEANINGS[base][0]), False
    try:
        symbol_in_si(symbol)
    except SetupError:
        found = _in_other_case(symbol, label)
        if len(found) == 1:
            return _MEANINGS.get(found[0], (found, True))
        return found or (symbol,), not found
    return (symbol,), True


def _in_other_case(symbol: str, label: str) -> tuple[str, ...]:
    """Units that a symbol is in capitals or without: RPM, KHz, and all of M/S**2."""
    capitals = label.upper() == label
    if capitals:
        # A lone letter is a symbol of its own: S is siemens.
        return () if len(symbol) == len(label) == 1 else in_other_case(symbol)
    # Among other letters two capitals are no unit, as in gallon (US); pS is picosiemens, and Mg a megagram.
    short = len(symbol) <= 2
    if short and (symbol[0] == "M" or not (symbol.islower() or symbol.istitle())):
        return ()
    return () if len(symbol) == 1 else in_other_case(symbol)


def _chosen(label: str, found: list[_Reading], quantity: str | None) -> _Reading:
    """The reading of this quantity; without one that of a weight, or the usual one."""
    of_weight = [weight for mass, weight in _OF_WEIGHT.items() if any(same_quantity(one.unit, mass) for one in found)]
    for wanted in [quantity] if quantity is not None else of_weight:
        fitting = [one for one in found if same_quantity(one.unit, wanted)]
        if len({one.factor for one in fitting}) == 1:
            return replace(fitting[0], exponents=read(wanted, symbol_as_written)[1])
    usual = [one for one in found if one.usual]
    if usual:
        _require_gravity(label, usual[0])
        return usual[0]
    several = " or ".join(dict.fromkeys(one.text for one in found))
    raise SetupError(f"unit {label[:MAX_LENGTH]!r}: it may be {several}; write which")


def _require_gravity(label: str, reading: _Reading) -> None:
    """Refuse g/cm^3, g mm and g/s: there it's a gram, which the definition of g here would belie."""
    of_mass = ("m", 0) in reading.exponents or reading.exponents == {("m", 3): 1}
    if _GRAVITY & set(_SYMBOL.findall(reading.text)) and of_mass:
        raise SetupError(
            f"unit {label[:MAX_LENGTH]!r}: g is gravity here and never gram, which is what it seems to be; give "
            "masses in kg"
        )


@lru_cache(maxsize=256)
def _dimension(unit: str) -> tuple[tuple[str, int], ...]:
    """Exponents of kg, m, s, A, K, degC and rad."""
    total: dict[str, int] = {}
    for (symbol, per_second), power in read(unit, symbol_as_written)[1].items():
        base = _BASE.get(symbol, {symbol: 1})
        for one, exponent in (*base.items(), ("s", -per_second)):
            total[one] = total.get(one, 0) + power * exponent
    return tuple(sorted((one, exponent) for one, exponent in total.items() if exponent))
