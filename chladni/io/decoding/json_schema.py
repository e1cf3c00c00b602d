"""The fields of JSON messages: from a JSON Schema, or from the messages themselves."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.schema import MAX_NESTING, Array, FieldType, Member, Primitive, Record, Stamp, Text
from chladni.signals.errors import LogError

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


def discovered_record(name: str, values: Iterable[object]) -> Record:
    """Derive the fields from decoded messages.

    Every number counts as a float, since a later message may hold a fraction where the first held 0.

    Parameters
    ----------
    name : str
    values : iterable
        Decoded messages; those that aren't objects are passed over.

    Returns
    -------
    Record
        All keys found, in the order they first appear; a key whose type differs keeps the first.

    Examples
    --------
    >>> record = discovered_record("demo", [{"value": 1, "note": None}, {"value": 0.5, "note": "b"}])
    >>> [member.name for member in record.members]
    ['value', 'note']
    """
    messages = [value for value in values if isinstance(value, dict)]
    return _merged(name, messages, 0)


def _merged(name: str, objects: list[dict[str, object]], depth: int) -> Record:
    keys = dict.fromkeys(key for value in objects for key in value)
    members = {key: _type_of_all(name, [value[key] for value in objects if key in value], depth) for key in keys}
    return _record(name, members)


def _type_of_all(name: str, values: list[object], depth: int) -> FieldType | None:
    if depth > MAX_NESTING:
        return None
    first = next((value for value in values if value is not None), None)
    if isinstance(first, bool):
        return BOOLEAN
    if isinstance(first, int | float):
        return FLOAT
    if isinstance(first, str):
        return Text()
    if isinstance(first, list):
        elements = [element for value in values if isinstance(value, list) for element in value]
        element = _type_of_all(name, elements, depth + 1)
        return None if element is None else Array(element=element)
    if isinstance(first, dict):
        if is_stamp(first):
            return TIME
        return _merged(name, [value for value in values if isinstance(value, dict)], depth + 1)
    return None
