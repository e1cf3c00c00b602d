"""Values out of decoded JSON messages, one message after another: the rules, and the path for the odd cases."""

from __future__ import annotations

import json
import math
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.found import Row
from chladni.io.decoding.json_schema import NANOSECONDS, SECONDS, is_unicode, number_in
from chladni.io.decoding.schema import Array, FieldType, Primitive, Text

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence

    from chladni.io.decoding.schema import Leaf

Scalar = float | int | bool | str
Value = Scalar | tuple[Scalar, ...]

_INT64: Final = range(-(2**63), 2**63)


def load_message(content: bytes) -> object:
    """Parse one message.

    ``NaN`` and ``Infinity``, which JSON doesn't know but many writers write, are let through. Of a key that is given
    twice the last counts.

    Raises
    ------
    ValueError
        If it isn't JSON in UTF-8, or is nested too deep to be parsed.
    """
    text = content.decode("utf-8")
    try:
        return _parsed(text)
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def _parsed(text: str) -> object:
    try:
        found: object = json.loads(text)
    except json.JSONDecodeError:
        raise
    except ValueError:
        found = json.loads(text, parse_int=_int_or_double)
    return found


def _int_or_double(digits: str) -> float:
    """JSON bounds no number; Python takes an integer of so many digits only."""
    most = sys.get_int_max_str_digits()
    return float(digits) if 0 < most < len(digits) else int(digits)


class Extractor:
    """Takes the values of leaves out of one message after another.

    A number that is absent or null is NaN, whatever its type: fields of JSON objects are optional, and one that a
    message lacks says nothing against those beside it. So is what isn't a number, with a word. True and false are 1
    and 0 where a number belongs, and numbers in quotes are numbers, with a word. What is called an integer and isn't
    one is a float. A text that is absent is empty, and so is what isn't one, with a word. A time that a list lacks is
    NaN; one that the message itself lacks leaves the message without time.

    Parameters
    ----------
    leaves : sequence of Leaf
    told : collections.Counter
        What was odd, and in how many values; written to.
    """

    def __init__(self, leaves: Sequence[Leaf], told: Counter[str]) -> None:
        self._leaves = leaves
        self._told = told

    def __call__(self, message: object) -> list[Row]:
        """Give the values of each leaf: one, or, below a list of objects, any number.

        Parameters
        ----------
        message : object
            As `load_message` gives it.

        Raises
        ------
        ValueError
            Says that the message is no object, or which time is missing.
        """
        if isinstance(message, dict):
            return [self._row(message, leaf) for leaf in self._leaves]
        raise ValueError("the message is no object")

    def _odd(self, leaf: Leaf, what: str) -> None:
        self._told[f"{leaf.info.path}: {what}"] += 1

    def _row(self, message: object, leaf: Leaf) -> Row:
        row = Row(values=[message])
        for name, lists in zip(leaf.names, leaf.lists, strict=True):
            row.values = [self._member(place, name, leaf) for place in row.values]
            for _ in range(lists):
                row.open([self._list(place, leaf) for place in row.values])
        row.values = [self._value(one, leaf.type, leaf) for one in row.values]
        return row

    def _member(self, place: object, name: str, leaf: Leaf) -> object:
        if isinstance(place, dict):
            return place.get(name)
        if place is not None:
            self._odd(leaf, "no object where one belongs; what is in it counts as missing")
        return None

    def _list(self, found: object, leaf: Leaf) -> list[object]:
        if isinstance(found, list):
            return found
        if found is not None:
            self._odd(leaf, "no list where one belongs; it counts as empty")
        return []

    def _value(self, found: object, kind: FieldType, leaf: Leaf) -> Value:
        match kind:
            case Array(element=element):
                return tuple(self._scalar(one, element, leaf) for one in self._list(found, leaf))
            case _:
                return self._scalar(found, kind, leaf)

    def _scalar(self, found: object, kind: FieldType, leaf: Leaf) -> Scalar:
        if isinstance(kind, Primitive):
            return self._number(found, kind, leaf)
        if isinstance(kind, Text):
            return self._text(found, leaf)
        parts = found if isinstance(found, dict) else {}
        if not leaf.info.dims:
            return _nanoseconds(parts, leaf)
        if found is None:
            return math.nan
        with suppress(ValueError):
            return _nanoseconds(parts, leaf)
        self._odd(leaf, f"no {leaf.info.kind} where one belongs; it counts as missing")
        return math.nan

    def _text(self, found: object, leaf: Leaf) -> str:
        # A lone surrogate parses, but is no text: nothing could write it.
        if isinstance(found, str) and is_unicode(found):
            return found
        if found is not None:
            self._odd(leaf, "no text where one belongs; it counts as missing")
        return ""

    def _number(self, found: object, kind: Primitive, leaf: Leaf) -> Scalar:
        if isinstance(found, str) and (quoted := number_in(found)) is not None:
            self._odd(leaf, "numbers in quotes, read as numbers")
            found = quoted
        if kind.dtype == np.bool_ and isinstance(found, bool):
            return found
        # Controllers write switches as true and false under schemas that know numbers only.
        if kind.dtype != np.bool_ and isinstance(found, int | float):
            return _double(found) if kind.dtype == np.float64 else _whole(found)
        if found is not None and not (isinstance(found, float) and math.isnan(found)):
            self._odd(leaf, f"no {leaf.info.kind} where one belongs; it counts as missing")
        return math.nan


def _double(found: float) -> float:
    try:
        return float(found)
    except OverflowError:
        # As a parser makes infinity of 1e999.
        return math.inf if found > 0 else -math.inf


def _whole(found: float) -> float:
    # JSON Schema counts 5.0 as an integer.
    if isinstance(found, int) or found.is_integer():
        return int(found) if int(found) in _INT64 else _double(found)
    return found


def _nanoseconds(found: dict[str, object], leaf: Leaf) -> int:
    parts = [found[name] for name in NANOSECONDS if name in found]
    seconds = found.get(SECONDS)
    if len(parts) != 1 or type(parts[0]) is not int or type(seconds) is not int:
        raise ValueError(f"{leaf.info.path} is no time of sec and nsec")
    whole = seconds * 1_000_000_000 + parts[0]
    if whole not in _INT64:
        raise ValueError(f"{leaf.info.path} exceeds 64 bits")
    return whole
