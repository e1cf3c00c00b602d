"""The fields of JSON messages: from a JSON Schema, or from the messages themselves."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.schema import MAX_NESTING, Array, FieldType, Member, Primitive, Record, Stamp, Text
from chladni.io.message_path import quoted
from chladni.signals.errors import LogError
from chladni.signals.text_reading import real_number

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

SECONDS: Final = "sec"
NANOSECONDS: Final = ("nsec", "nanosec")
"""Names that Foxglove and ROS 2 give to the parts of a time."""

FLOAT: Final = Primitive(dtype=np.dtype(np.float64))
INTEGER: Final = Primitive(dtype=np.dtype(np.int64))
BOOLEAN: Final = Primitive(dtype=np.dtype(np.bool_))
TIME: Final = Stamp(kind="time", seconds=np.dtype(np.int64), nanoseconds=np.dtype(np.int64))
DURATION: Final = Stamp(kind="duration", seconds=np.dtype(np.int64), nanoseconds=np.dtype(np.int64))

LARGEST_EXACT: Final = 2**53
"""Largest number up to which a double holds every integer."""

_SURROGATES: Final = re.compile("[\ud800-\udfff]")
_CONTAINERS: Final[dict[type, str]] = {list: "list", dict: "object"}
_SCALARS: Final[dict[str, FieldType]] = {"number": FLOAT, "integer": INTEGER, "boolean": BOOLEAN, "string": Text()}


def parse_json_schema(name: str, data: bytes) -> Record | None:
    """Read the fields out of a JSON Schema.

    Parameters
    ----------
    name : str
    data : bytes
        The schema; may be empty.

    Returns
    -------
    Record or None
        None where the schema names no field whose type it tells: the messages must then tell it.

    Raises
    ------
    LogError
        If the schema isn't JSON, refers to itself or is nested deeper than `MAX_NESTING`.
    """
    if not data.strip():
        return None
    try:
        schema = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise LogError(f"schema {name!r}: the JSON Schema isn't readable JSON ({error})") from error
    kind = _SchemaReader(name, schema).type_of(schema, 0)
    return kind if isinstance(kind, Record) and kind.members else None


class _SchemaReader:
    def __init__(self, name: str, root: object) -> None:
        self.name = name
        self.root = root
        self.done: dict[str, FieldType | None] = {}

    def type_of(self, schema: object, depth: int) -> FieldType | None:
        """Type that a part of the schema describes; None where it doesn't say."""
        if depth > MAX_NESTING:
            raise LogError(f"schema {self.name!r}: nested deeper than {MAX_NESTING} or in a circle; it is refused")
        if not isinstance(schema, dict):
            return None
        if isinstance(schema.get("$ref"), str):
            return self._referred_type(schema["$ref"], depth)
        kind = _first_type(schema)
        if kind == "array":
            element = self.type_of(schema.get("items"), depth + 1)
            return None if element is None else Array(element=element)
        if kind == "object":
            return self._object(schema, depth)
        return _SCALARS.get(kind)

    def _object(self, schema: Mapping[str, object], depth: int) -> FieldType | None:
        properties = schema.get("properties")
        if not isinstance(properties, dict):
            return None
        members = {key: self.type_of(value, depth + 1) for key, value in properties.items()}
        if is_stamp(members) and members[SECONDS] in (INTEGER, FLOAT):
            return DURATION if schema.get("title") == "duration" else TIME
        return _record(self.name, members)

    def _referred_type(self, reference: str, depth: int) -> FieldType | None:
        # Each part is read once: one that refers to the next one twice, and so on, would otherwise take 2**n steps.
        if reference not in self.done:
            self.done[reference] = self.type_of(self._referred(reference), depth + 1)
        return self.done[reference]

    def _referred(self, reference: str) -> object:
        if not reference.startswith("#"):
            return None  # other documents aren't in the log
        place = self.root
        for name in filter(None, reference.lstrip("#").split("/")):
            key = name.replace("~1", "/").replace("~0", "~")
            place = place.get(key) if isinstance(place, dict) else None
        return place


def _first_type(schema: Mapping[str, object]) -> str:
    declared = schema.get("type")
    if isinstance(declared, list):
        # ["number", "null"]: a null is then a missing value, reported message by message.
        declared = next((kind for kind in declared if kind != "null"), None)
    if isinstance(declared, str):
        return declared
    return "object" if "properties" in schema else "array" if "items" in schema else ""


def is_stamp(members: Iterable[str]) -> bool:
    """Whether an object with these keys is a time: seconds and nanoseconds, nothing else."""
    return set(members) in [{SECONDS, nanoseconds} for nanoseconds in NANOSECONDS]


def _record(name: str, members: Mapping[str, FieldType | None]) -> Record:
    known = [Member(name=key, type=kind) for key, kind in members.items() if kind is not None]
    return Record(name=name, members=tuple(known))


class Settled:
    """Fields of JSON messages: those that the schema states, and what messages show beyond it or against it.

    A schema may have been derived from one message: where its values are of another kind, they are what counts, and
    what it doesn't mention is read as well. Every number without stated type counts as a float, since a later message
    may hold a fraction where the first held 0; only what a double can't hold stays whole.

    Parameters
    ----------
    name : str
        Of the schema.
    stated : Record or None
        What it says.
    values : iterable
        Decoded messages; those that aren't objects are passed over.

    Attributes
    ----------
    record : Record
        All fields. A key has lists, objects or single values, as most messages do; of those numbers count before
        others, and else the first.
    too_deep : list of str
        Paths of what is nested too deep to be read.
    contradicted : dict
        What the schema calls a field, by its path, where messages show otherwise.

    Examples
    --------
    >>> settled = Settled("demo", None, [{"value": 1, "note": None}, {"value": 0.5, "note": "b"}])
    >>> [member.name for member in settled.record.members]
    ['value', 'note']
    """

    def __init__(self, name: str, stated: Record | None, values: Iterable[object]) -> None:
        self._name = name
        self.contradicted: dict[str, str] = {}
        self.too_deep: list[str] = []
        self.record = self._merged(stated, [value for value in values if isinstance(value, dict)], "", 0)

    def _merged(self, stated: Record | None, objects: list[dict[str, object]], path: str, depth: int) -> Record:
        known = {member.name: member.type for member in stated.members} if stated is not None else {}
        members: dict[str, FieldType | None] = {}
        for key in dict.fromkeys([*known, *(key for value in objects for key in value)]):
            below = f"{path}.{quoted(key)}" if path else quoted(key)
            values = [value[key] for value in objects if key in value]
            members[key] = self._type_of(known.get(key), values, below, depth)
        return _record(self._name, members)

    def _type_of(self, stated: FieldType | None, values: list[object], path: str, depth: int) -> FieldType | None:
        given = [value for value in values if value is not None]
        if depth > MAX_NESTING and given:
            self.too_deep.append(path)
        if depth > MAX_NESTING or not given:
            return stated
        shown = self._shown(stated, given, path, depth)
        if stated is not None and shown is not None and _word(shown) != _word(stated):
            self.contradicted[path] = _word(stated)
        return shown or stated

    def _shown(self, stated: FieldType | None, given: list[object], path: str, depth: int) -> FieldType | None:
        # One message of another kind may be damaged.
        ((usual, _),) = Counter(_CONTAINERS.get(type(value)) for value in given).most_common(1)
        if usual == "list":
            elements = [element for value in given if isinstance(value, list) for element in value]
            inner = stated.element if isinstance(stated, Array) else None
            element = self._type_of(inner, elements, path, depth + 1)
            return None if element is None else Array(element=element)
        if usual == "object":
            objects = [value for value in given if isinstance(value, dict)]
            stamps = sum(map(is_stamp, objects))
            if isinstance(stated, Stamp) or (stated is None and 2 * stamps > len(objects)):
                return stated or TIME
            inner_record = stated if isinstance(stated, Record) else None
            return self._merged(inner_record, objects, path, depth + 1)
        return _scalar_of(stated, [value for value in given if type(value) not in _CONTAINERS])


def _scalar_of(stated: FieldType | None, given: list[object]) -> FieldType:
    """Type of values that are no lists and no objects."""
    numbers = [value for value in given if isinstance(value, int | float) and not isinstance(value, bool)]
    if numbers and stated == INTEGER:
        return INTEGER if all(isinstance(value, int) or value.is_integer() for value in numbers) else FLOAT
    if numbers:
        exact = stated is None and all(isinstance(value, int) for value in numbers)
        return INTEGER if exact and max(map(abs, numbers)) > LARGEST_EXACT else FLOAT
    if stated in (FLOAT, INTEGER) and stated is not None:
        return stated  # switches are written as true and false, and numbers in quotes
    if isinstance(given[0], bool):
        return BOOLEAN
    texts = [value for value in given if isinstance(value, str)]
    # Whole numbers in quotes are as often names: only a point or an exponent shows a measured value.
    numeric = stated is None and all(number_in(text) is not None for text in texts)
    return FLOAT if numeric and any(sign in text for text in texts for sign in ".eE") else Text()


def is_unicode(text: str) -> bool:
    """Whether a text can be written at all: escapes of JSON may name half a character.

    Examples
    --------
    >>> is_unicode("é"), is_unicode(chr(0xD800))
    (True, False)
    """
    return text.isascii() or not _SURROGATES.search(text)


def number_in(text: str) -> float | None:
    """Number that a text is, as JSON or C write it; None where it is anything else.

    Examples
    --------
    >>> number_in("-0.5e3"), number_in("nan"), number_in("1_000"), number_in("0x1F"), number_in("n/a")
    (-500.0, nan, None, None, None)
    """
    try:
        return real_number(text)
    except ValueError:
        return None


def _word(kind: FieldType) -> str:
    match kind:
        case Array():
            return "a list"
        case Record():
            return "an object"
        case Stamp():
            return "a time"
        case Text():
            return "text"
        case _ if kind == BOOLEAN:
            return "a truth value"
        case _:
            return "an integer" if kind == INTEGER else "a number"
