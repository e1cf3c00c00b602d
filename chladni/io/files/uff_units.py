"""Units of a function in a universal file: what its labels, its data types and dataset 164 say, brought together.

The label goes before the unit that the type implies (note to record 8 of dataset 58), also where the two contradict
each other, which is told: the label is what the writer's own plots show. A type settles what a label may mean.
"""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Literal

from chladni.io.files.uff_header import OUR_LINES
from chladni.io.files.uff_sets import Dataset, contradiction
from chladni.io.log_info import some_of
from chladni.signals.errors import LogError, SetupError
from chladni.signals.unit_labels import (
    length_and_force_powers,
    quantity_of_name,
    read_label,
    same_quantity,
    says_nothing,
)
from chladni.signals.unit_text import in_unit, read, symbol_as_written, write
from chladni.signals.units import quotient, si_factor

# Data type: SI unit along an axis and about one, powers of length and force in each (table of unit exponents).
_QUANTITIES: dict[int, tuple[tuple[str, int, int], tuple[str, int, int]]] = {
    2: (("Pa", -2, 1), ("N/m", -1, 1)),
    3: (("1", 0, 0), ("1", 0, 0)),
    8: (("m", 1, 0), ("rad", 0, 0)),
    9: (("N", 0, 1), ("N m", 1, 1)),
    11: (("m/s", 1, 0), ("rad/s", 0, 0)),
    12: (("m/s^2", 1, 0), ("rad/s^2", 0, 0)),
    13: (("N", 0, 1), ("N m", 1, 1)),
    15: (("Pa", -2, 1), ("N/m", -1, 1)),
    16: (("kg", -1, 1), ("kg m^2", 1, 1)),
}
_TYPE_NAMES = {
    0: "unknown", 1: "general", 2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 8: "displacement",
    9: "reaction force", 11: "velocity", 12: "acceleration", 13: "excitation force", 15: "pressure", 16: "mass",
    17: "time", 18: "frequency", 19: "rpm", 20: "order",
}  # fmt: skip
_GENERAL, _TIME, _FREQUENCY, _RPM = 1, 17, 18, 19
# What a function is over: a label that ends in something else over a length is one unit, as N/m^2.
_REFERENCES = frozenset(
    ["N", "N m", "m", "m/s", "m/s^2", "rad", "rad/s", "rad/s^2", "V", "A", "C", "Pa", "m^3/s", "m^3"]
)
_IN_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]{1,20})\s*[\])]\s*$")
_AXIS_WORDS = frozenset(["time", "zeit", "temps", "frequency", "freq", "frequenz", "fréquence"])
# Writers round the factors of dataset 164.
_SAME_FACTOR = 1e-3
_OVER = {"s": "time", "Hz": "frequency"}


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundUnit:
    """Multiply by `factor` to get values in the SI `unit`; notes say what was taken how, and why there's none.

    `of_ratio`: the label is that of response over reference, and the factor of the response holds for both.
    """

    factor: float = 1.0
    unit: str = "1"
    notes: tuple[str, ...] = ()
    of_ratio: bool = False


def ordinate_unit(header: Dataset) -> FoundUnit:
    """Give the unit of the ordinates of a function of one channel, such as a time record.

    Examples
    --------
    >>> header = {"ordinate_axis_units_lab": "g", "ordinate_axis_lab": "NONE", "ordinate_spec_data_type": 12}
    >>> header |= {"rsp_dir": 1, "ordinate_len_unit_exp": 0, "ordinate_force_unit_exp": 0, "system": None}
    >>> ordinate_unit(header)
    FoundUnit(factor=9.80665, unit='m/s^2', notes=(), of_ratio=False)
    """
    return _axis_unit(header, "ordinate", "rsp_dir")


def function_units(header: Dataset) -> tuple[FoundUnit, FoundUnit]:
    """Give the units of response and reference of a frequency response.

    The label of the ordinate may be that of the ratio, ``(m/s^2)/N``: the types or the label of the denominator tell,
    and where neither is there the label itself.
    """
    ratio = _ratio(header)
    if ratio is not None:
        return ratio
    return _axis_unit(header, "ordinate", "rsp_dir"), _axis_unit(header, "orddenom", "ref_dir")


def abscissa_unit(header: Dataset, wanted: Literal["s", "Hz"]) -> FoundUnit:
    """Give the factor from the abscissa of a function to seconds, or to hertz.

    Raises
    ------
    LogError
        When the function is over something else, or over a unit that isn't known: a wrong axis is worse than none.
    """
    word, kind, label = _OVER[wanted], header["abscissa_spec_data_type"], _label(header, "abscissa")
    of_word = {"s": (_TIME,), "Hz": (_FREQUENCY, _RPM)}[wanted]
    if label.casefold() in _AXIS_WORDS:
        label = ""
    if not label:
        if kind in (0, _GENERAL, *of_word):
            return FoundUnit(factor=1 / 60 if kind == _RPM else 1.0, unit=wanted)
        raise LogError(f"is over {_type_name(kind)}, not over {word}")
    try:
        factor, unit = read_label(label, quantity=wanted)
    except SetupError as error:
        raise LogError(f"is over {label!r}, which is no known unit of {word} ({error})") from error
    if wanted == "Hz" and same_quantity(unit, "rad/s"):
        factor, unit = factor / (2 * pi), wanted
    if not same_quantity(unit, wanted):
        raise LogError(f"is over {label!r}, not over {word}")
    agree = kind in (0, _GENERAL, *of_word)
    note = f"the type of the abscissa is {_type_name(kind)}, its label {label!r}; the label was taken"
    return FoundUnit(factor=factor, unit=wanted, notes=() if agree else (note,))


def unit_sentences(path: Path, found: Mapping[str, Sequence[str]], remedy: str) -> list[str]:
    """Say what was found of units, once for all channels that it was found of.

    Parameters
    ----------
    found
        Names of channels by note.
    remedy
        How another unit is stated.
    """
    return [f"{path}: {some_of(tuple(dict.fromkeys(names)))}: {note}; {remedy}." for note, names in found.items()]


# --- one axis ----------------------------------------------------------------------------------------------------


def _axis_unit(header: Dataset, axis: str, direction: str) -> FoundUnit:
    label, types = _label(header, axis), _types(header, axis, direction)
    if not label:
        return _by_type(header, axis, types)
    if _ours(header):
        with suppress(SetupError):
            factor, unit = si_factor(label)
            return FoundUnit(factor=factor, unit=unit)
    for unit, *_ in types:
        found = _read(label, unit)
        if found is not None:
            kind = _type_name(header[f"{axis}_spec_data_type"])
            notes = tuple(f"of type {kind} but labelled {note}" for note in found.notes)
            return replace(found, notes=notes + _beside_system(header, label, found, types))
    try:
        factor, unit = read_label(label, quantity=quantity_of_name(str(header[f"{axis}_axis_lab"])))
    except SetupError as error:
        return FoundUnit(notes=(f"{error}; the values have no unit",))
    if not types:
        return FoundUnit(factor=factor, unit=unit, notes=_other_exponents(header, axis, label, unit))
    kind = _type_name(header[f"{axis}_spec_data_type"])
    told = f"of type {kind} but labelled {label!r}, which is {in_unit(unit)}; the label was taken"
    return FoundUnit(factor=factor, unit=unit, notes=(told,))


def _read(label: str, quantity: str) -> FoundUnit | None:
    """Read a label as a unit of a quantity; None when it isn't one."""
    try:
        factor, unit = read_label(label, quantity=quantity)
    except SetupError:
        return None
    if not same_quantity(unit, quantity):
        return None
    try:
        alone = read_label(label)[1]
    except SetupError:
        alone = quantity
    told = () if same_quantity(alone, quantity) else (f"{label!r}, which was taken as {factor:g} {quantity}",)
    return FoundUnit(factor=factor, unit=quantity, notes=told)


def _by_type(header: Dataset, axis: str, types: list[tuple[str, int, int]]) -> FoundUnit:
    """The unit that the type implies, in the file's own units."""
    if not types:
        lengths, forces = header[f"{axis}_len_unit_exp"], header[f"{axis}_force_unit_exp"]
        general = header[f"{axis}_spec_data_type"] == _GENERAL and (lengths or forces)
        told = f"of general type, length^{lengths} force^{forces}, which is no unit without a label"
        return FoundUnit(notes=(told,) if general else ())
    unit, lengths, forces = types[0]
    system = header["system"]
    doubt = system.get("mistake") or contradiction(system) if system else None
    if doubt and (lengths or forces):
        return FoundUnit(notes=(f"without label, and {doubt}; the values have no unit",))
    return FoundUnit(factor=_factor(system, lengths, forces), unit=unit)


def _beside_system(
    header: Dataset, label: str, found: FoundUnit, types: list[tuple[str, int, int]]
) -> tuple[str, ...]:
    """Say that the label goes before dataset 164 where that means another unit."""
    system = header["system"]
    if not system or "mistake" in system or contradiction(system):
        return ()
    factor = next(_factor(system, lengths, forces) for unit, lengths, forces in types if unit == found.unit)
    if abs(factor / found.factor - 1) <= _SAME_FACTOR:
        return ()
    return (f"labelled {label!r}, where dataset 164 means {factor:g} {found.unit}; the label was taken",)


def _other_exponents(header: Dataset, axis: str, label: str, unit: str) -> tuple[str, ...]:
    """Say that the label of a general quantity has other powers of length and force than its header."""
    stated = (header[f"{axis}_len_unit_exp"], header[f"{axis}_force_unit_exp"])
    found = length_and_force_powers(unit)
    if header[f"{axis}_spec_data_type"] != _GENERAL or stated == (0, 0) or found in (None, stated):
        return ()
    return (f"labelled {label!r}, but with the exponents length^{stated[0]} force^{stated[1]}; the label was taken",)


def _factor(system: Dataset | None, lengths: int, forces: int) -> float:
    if not system or not (lengths or forces):
        return 1.0
    return float(system["length"] ** -lengths * system["force"] ** -forces)


def _types(header: Dataset, axis: str, direction: str) -> list[tuple[str, int, int]]:
    """What the type of an axis may be, that of its direction first; empty when the type implies no unit.

    Exporters give translations as the direction of what turns, so that a label may have either.
    """
    along, about = _QUANTITIES.get(header[f"{axis}_spec_data_type"], (None, None))
    if along is None or about is None:
        return []
    return [about, along] if abs(header[direction]) in (4, 5, 6) else [along, about]


def _label(header: Dataset, axis: str) -> str:
    """The label of the unit, or the one in brackets behind the name of the axis."""
    label = str(header[f"{axis}_axis_units_lab"]).strip("\0 ")
    if not says_nothing(label):
        return label
    named = _IN_BRACKETS.search(str(header[f"{axis}_axis_lab"]))
    return named[1] if named else ""


def _ours(header: Dataset) -> bool:
    """Whether chladni wrote a function: then its labels are SI, and C is coulomb."""
    return str(header.get("id5", "")).strip().startswith(OUR_LINES)


def _type_name(kind: int) -> str:
    return _TYPE_NAMES.get(kind, f"type {kind}")


# --- ratios ------------------------------------------------------------------------------------------------------


def _ratio(header: Dataset) -> tuple[FoundUnit, FoundUnit] | None:
    """Response and reference where the label of the ordinate is that of their ratio; None where it isn't."""
    label, below = _label(header, "ordinate"), _label(header, "orddenom")
    responses = [unit for unit, *_ in _types(header, "ordinate", "rsp_dir")]
    references = [unit for unit, *_ in _types(header, "orddenom", "ref_dir")]
    if not label or _ours(header) or any(_read(label, unit) for unit in responses):
        return None
    above, under = _split(label)
    if not references:
        stated = _axis_unit(header, "orddenom", "ref_dir").unit if below else under
        references = [stated] if stated != "1" else []
    if not responses:
        # Without its own type the label has to say both, and agree with what is said of the denominator.
        responses = [above] if above != "1" and any(same_quantity(under, unit) for unit in references) else []
    for response in responses:
        for reference in references:
            found = _read(label, quotient(response, reference))
            if found is not None:
                return replace(found, unit=response, of_ratio=True), FoundUnit(unit=reference, of_ratio=True)
    return None


def _split(label: str) -> tuple[str, str]:
    """What stands above and below in a label such as ``(m/s^2)/N``; ``1`` where nothing does."""
    try:
        exponents = read(read_label(label)[1], symbol_as_written)[1]
    except SetupError:
        return "1", "1"
    above = write({factor: power for factor, power in exponents.items() if power > 0})
    below = write({factor: -power for factor, power in exponents.items() if power < 0})
    return (above, below) if below in _REFERENCES else ("1", "1")
