"""Values out of decoded JSON messages, one message after another: the rules, and the path for the odd cases."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.json_schema import NANOSECONDS, SECONDS
from chladni.io.decoding.schema import Array, FieldType, Primitive, Stamp, Text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.io.decoding.schema import Leaf

Scalar = float | int | bool | str
Value = Scalar | tuple[Scalar, ...]

_INT64: Final = range(-(2**63), 2**63)


def load_message(content: bytes) -> object:
    """Parse one message.

    ``NaN`` and ``Infinity``, which JSON doesn't know but many writers write, are let through here: only where an
    infinite value is asked for is the message bad. Of a key that is given twice the last counts.

    Raises
    ------
    ValueError
        If it isn't JSON in UTF-8, or is nested too deep to be parsed.
    """
    try:
        parsed: object = json.loads(content.decode("utf-8"))
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    return parsed


def extract(message: object, leaves: Sequence[Leaf]) -> list[list[Value]]:
    """Values of each leaf in one message: one, or, below a list of objects, any number.

    A number that is absent or null is NaN, whatever its type: fields of JSON objects are optional, and one that a
    message lacks says nothing against those beside it. True and false are 1 and 0 where a number belongs.

    Parameters
    ----------
    message : object
        As `load_message` gives it.
    leaves : sequence of Leaf

    Raises
    ------
    ValueError
        Says which field is of another type or infinite, or which time, text or list is missing.
    """
    return [[_value(found, leaf.type, leaf) for found in _reached(message, leaf)] for leaf in leaves]


def _reached(message: object, leaf: Leaf) -> list[object]:
    places: list[object] = [_object(message, leaf)]
    for name, lists in zip(leaf.names, leaf.lists, strict=True):
        places = [_member(place, name, leaf) for place in places]
        for _ in range(lists):
            places = [element for place in places for element in _list(place, leaf)]
    return places


def _member(place: object, name: str, leaf: Leaf) -> object:
    return None if place is None else _object(place, leaf).get(name)


def _object(found: object, leaf: Leaf) -> dict[str, object]:
    if isinstance(found, dict):
        return found
    raise ValueError(f"{leaf.info.path}: no object where one belongs")


def _list(found: object, leaf: Leaf) -> list[object]:
    if isinstance(found, list):
        return found
    raise ValueError(f"{leaf.info.path}: no list where one belongs")


def _value(found: object, kind: FieldType, leaf: Leaf) -> Value:
    if isinstance(kind, Array):
        return tuple(_scalar(element, kind.element, leaf) for element in _list(found, leaf))
    if isinstance(kind, Primitive) and (found is None or (isinstance(found, float) and math.isnan(found))):
        return math.nan
    return _scalar(found, kind, leaf)


def _scalar(found: object, kind: FieldType, leaf: Leaf) -> Scalar:
    if isinstance(kind, Text) and isinstance(found, str):
        found.encode("utf-8")  # a lone surrogate parses, but is no text: nothing could write it
        return found
    if isinstance(kind, Stamp) and isinstance(found, dict):
        return _nanoseconds(found, leaf)
    if isinstance(kind, Primitive) and isinstance(found, int | float):
        return _number(found, kind, leaf)
    if found is None:
        raise ValueError(f"no value for {leaf.info.path}")
    raise ValueError(f"{leaf.info.path} is no {leaf.info.kind}")


def _number(found: float, kind: Primitive, leaf: Leaf) -> Scalar:
    if kind.dtype == np.bool_:
        if isinstance(found, bool):
            return found
        raise ValueError(f"{leaf.info.path} is no bool")
    # Controllers write switches as true and false under schemas that know numbers only.
    return _double(found, leaf) if kind.dtype == np.float64 else _whole(found, leaf)


def _double(found: float, leaf: Leaf) -> float:
    try:
        value = float(found)
    except OverflowError as error:
        raise ValueError(f"{leaf.info.path} exceeds the range of a double") from error
    if math.isinf(value):
        raise ValueError(f"{leaf.info.path} isn't finite")
    return value


def _whole(found: float, leaf: Leaf) -> int:
    # JSON Schema counts 5.0 as an integer.
    if found % 1 != 0:
        raise ValueError(f"{leaf.info.path} isn't whole")
    whole = int(found)
    if whole not in _INT64:
        raise ValueError(f"{leaf.info.path} exceeds 64 bits")
    return whole


def _nanoseconds(found: dict[str, object], leaf: Leaf) -> int:
    parts = [found[name] for name in NANOSECONDS if name in found]
    seconds = found.get(SECONDS)
    if len(parts) != 1 or type(parts[0]) is not int or type(seconds) is not int:
        raise ValueError(f"{leaf.info.path} is no time of sec and nsec")
    return _whole(seconds * 1_000_000_000 + parts[0], leaf)
