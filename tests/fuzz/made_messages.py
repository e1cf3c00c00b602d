"""Random message types, written as ROS 1, ROS 2, IDL, protobuf and JSON, and read by the libraries of others."""

import json
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

# What ROS and numpy call a number, and by which of its types protobuf writes it.
NUMBERS = {
    "float64": "double",
    "float32": "float",
    "int64": "sint64",
    "uint64": "fixed64",
    "int32": "int32",
    "uint32": "uint32",
    "int16": "sfixed32",
    "uint16": "uint32",
    "int8": "sint32",
    "uint8": "uint32",
    "bool": "bool",
}
LONGEST = 5
IDL_NUMBERS = {"float64": "double", "float32": "float", "bool": "boolean"}


# Types of messages


@dataclass(frozen=True, slots=True)
class Number:
    """A number; ``kind`` is ROS's and numpy's name."""

    kind: str


@dataclass(frozen=True, slots=True)
class Text:
    """Text, whose length shifts what is behind it."""


@dataclass(frozen=True, slots=True)
class Array:
    """Elements of one kind: ``length`` of them, or up to `LONGEST` where that is None."""

    element: "Type"
    length: int | None


@dataclass(frozen=True, slots=True)
class Record:
    """A message type of its own."""

    name: str
    fields: dict[str, "Type"]


Type = Number | Text | Array | Record


class TypeMaker:
    """Makes random message types of distinct names; lists in lists are JSON's alone."""

    def __init__(self, rng: random.Random, *, lists_in_lists: bool) -> None:
        self._rng, self._lists_in_lists = rng, lists_in_lists
        self._names = 0

    def record(self, depth: int = 0) -> Record:
        fields = {f"f{place}": self._field(depth) for place in range(self._rng.randint(1, 5 - depth))}
        if depth == 0:
            fields["plain"] = Number("float64")
        self._names += 1
        return Record(f"T{self._names}", fields)

    def _field(self, depth: int) -> Type:
        chance = self._rng.random()
        if chance < 0.35 and depth < 3:
            inner = self.record(depth + 1)
            return Array(inner, self._length()) if self._rng.random() < 0.6 else inner
        if chance < 0.45:
            return Text()
        element: Type = Number(self._rng.choice(list(NUMBERS)))
        if self._lists_in_lists and self._rng.random() < 0.3:
            element = Array(element, self._length())
        return Array(element, self._length()) if self._rng.random() < 0.4 else element

    def _length(self) -> int | None:
        return self._rng.choice((None, 1, 2, 3))


def records(kind: Type) -> Iterator[Record]:
    """Every message type below, those first that others need."""
    if isinstance(kind, Array):
        yield from records(kind.element)
    elif isinstance(kind, Record):
        for inner in kind.fields.values():
            yield from records(inner)
        yield kind


def declared_paths(kind: Type, path: str) -> Iterator[str]:
    """Path of every number that a message of this type may hold."""
    if isinstance(kind, Record):
        for name, inner in kind.fields.items():
            yield from declared_paths(inner, f"{path}.{name}")
    elif isinstance(kind, Array):
        for place in range(kind.length or LONGEST):
            yield from declared_paths(kind.element, f"{path}[{place}]")
    elif isinstance(kind, Number):
        yield path


def draw(kind: Type, rng: random.Random, *, absent: str = "nothing") -> Any:
    """Draw a value: dictionaries, lists, numbers and text; None where ``absent`` (see `Encoding`) lets it be."""

    def gap() -> bool:
        return rng.random() < 0.1

    if isinstance(kind, Record):
        return {
            name: None
            if absent != "nothing" and not isinstance(inner, Array) and gap()
            else draw(inner, rng, absent=absent)
            for name, inner in kind.fields.items()
        }
    if isinstance(kind, Array):
        length = rng.randint(0, LONGEST) if kind.length is None else kind.length
        return [
            None if absent == "elements" and gap() else draw(kind.element, rng, absent=absent) for _ in range(length)
        ]
    if isinstance(kind, Text):
        return "".join(rng.choice("abc é漢") for _ in range(rng.randrange(9)))
    return _draw_number(kind.kind, rng)


def _draw_number(kind: str, rng: random.Random) -> float | int | bool:
    if kind == "bool":
        return rng.random() < 0.5
    if kind.startswith("float"):
        usual = rng.gauss(0, 1)
        with np.errstate(over="ignore"):
            return float(np.dtype(kind).type(rng.choice((usual, usual * 10.0 ** rng.randint(-50, 50), 0.0, 1.0))))
    limits = np.iinfo(kind)
    return int(rng.choice((rng.randint(limits.min, limits.max), limits.min, limits.max, 0, 1)))


# Encodings: how a type is declared, a value written, and what others read


@dataclass(frozen=True, slots=True)
class Encoding:
    """One way to write messages of a type, and how others read them.

    ``absent`` is what a message needn't hold: nothing, fields, or elements of arrays as well.
    """

    message_encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes
    write: Callable[[Any], bytes]
    read: Sequence[Callable[[bytes], Any]]
    absent: str = "nothing"


def _ros_body(record: Record) -> str:
    def declared(inner: Type) -> str:
        if isinstance(inner, Array):
            return f"{declared(inner.element)}[{inner.length or ''}]"
        if isinstance(inner, Record):
            return f"made/{inner.name}"
        return "string" if isinstance(inner, Text) else inner.kind

    return "".join(f"{declared(inner)} {name}\n" for name, inner in record.fields.items())


def _ros_text(kind: Record) -> str:
    others = {record.name: record for record in records(kind) if record.name != kind.name}.values()
    return _ros_body(kind) + "".join(f"{'=' * 80}\nMSG: made/{each.name}\n{_ros_body(each)}" for each in others)


def _rosbags_store(kind: Record) -> Typestore:
    store = get_typestore(Stores.EMPTY)
    for record in records(kind):
        if f"made/msg/{record.name}" not in store.types:
            store.register(get_types_from_msg(_ros_body(record), f"made/msg/{record.name}"))
    return store


def _rosbags_value(kind: Type, value: Any, store: Typestore) -> Any:
    if isinstance(kind, Record):
        made = {name: _rosbags_value(inner, value[name], store) for name, inner in kind.fields.items()}
        return store.types[f"made/msg/{kind.name}"](**made)
    if isinstance(kind, Array):
        element = kind.element
        if isinstance(element, Number):
            return np.array(value, element.kind)
        return [_rosbags_value(element, each, store) for each in value]
    return value


def ros2(kind: Record) -> Encoding:
    """ROS 2 message text, written by `mcap-ros2-support`, read by it and by `rosbags`."""
    text, name, store = _ros_text(kind), f"made/msg/{kind.name}", _rosbags_store(kind)
    return Encoding(
        "cdr",
        name,
        "ros2msg",
        text.encode(),
        serialize_dynamic(f"made/{kind.name}", text)[f"made/{kind.name}"],
        (
            generate_dynamic(f"made/{kind.name}", text)[f"made/{kind.name}"],
            lambda data: store.deserialize_cdr(data, name),
        ),
    )


def ros1(kind: Record) -> Encoding:
    """ROS 1, written and read by `rosbags`."""
    name, store = f"made/msg/{kind.name}", _rosbags_store(kind)
    return Encoding(
        "ros1",
        f"made/{kind.name}",
        "ros1msg",
        _ros_text(kind).encode(),
        lambda value: bytes(store.serialize_ros1(_rosbags_value(kind, value, store), name)),
        (lambda data: store.deserialize_ros1(data, name),),
    )


def idl(kind: Record) -> Encoding:
    """OMG IDL, written and read by `rosbags`."""

    def member(name: str, inner: Type) -> str:
        if isinstance(inner, Array):
            if inner.length is None:
                return f"sequence<{word(inner.element)}> {name};"
            return f"{word(inner.element)} {name}[{inner.length}];"
        return f"{word(inner)} {name};"

    def word(inner: Type) -> str:
        if isinstance(inner, Record):
            return f"made::msg::{inner.name}"
        return "string" if isinstance(inner, Text) else IDL_NUMBERS.get(inner.kind, inner.kind)

    structs = "".join(
        f"struct {record.name} {{ {' '.join(member(*one) for one in record.fields.items())} }};\n"
        for record in {record.name: record for record in records(kind)}.values()
    )
    text = f"module made {{ module msg {{\n{structs}}}; }};\n"
    name = f"made/msg/{kind.name}"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_idl(text))
    return Encoding(
        "cdr",
        name,
        "ros2idl",
        text.encode(),
        lambda value: bytes(store.serialize_cdr(_rosbags_value(kind, value, store), name)),
        (lambda data: store.deserialize_cdr(data, name),),
    )


def _declare(message: Any, name: str, kind: Type) -> None:
    declared = descriptor_pb2.FieldDescriptorProto
    label = declared.LABEL_REPEATED if isinstance(kind, Array) else declared.LABEL_OPTIONAL
    number = len(message.field) + 1
    made = message.field.add(name=name, number=number, label=label)
    if isinstance(kind, Number) and number % 2:
        # proto3's `optional`: a field of presence, in a oneof of its own.
        made.proto3_optional, made.oneof_index = True, len(message.oneof_decl)
        message.oneof_decl.add(name=f"_{name}")
    element = kind.element if isinstance(kind, Array) else kind
    if isinstance(element, Record):
        made.type, made.type_name = declared.TYPE_MESSAGE, f".made.{element.name}"
    elif isinstance(element, Text):
        made.type = declared.TYPE_STRING
    else:
        made.type = getattr(declared, f"TYPE_{NUMBERS[element.kind].upper()}")


def protobuf(kind: Record) -> Encoding:
    """proto3, written and read by protobuf's own library."""
    file = descriptor_pb2.FileDescriptorProto(name="made.proto", package="made", syntax="proto3")
    for record in {record.name: record for record in records(kind)}.values():
        message = file.message_type.add(name=record.name)
        for name, inner in record.fields.items():
            _declare(message, name, inner)
    files = descriptor_pb2.FileDescriptorSet(file=[file])
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made_class = message_factory.GetMessageClass(pool.FindMessageTypeByName(f"made.{kind.name}"))

    return Encoding(
        "protobuf",
        f"made.{kind.name}",
        "protobuf",
        files.SerializeToString(),
        lambda value: made_class(**value).SerializeToString(),
        (made_class.FromString,),
        absent="fields",
    )


def json_text(kind: Record) -> Encoding:
    """JSON without a schema, read by Python's own decoder."""
    return Encoding("json", "", "", b"", lambda value: json.dumps(value).encode(), (json.loads,), absent="elements")


ENCODINGS = (ros2, ros1, idl, protobuf, json_text)


def numbers(kind: Type, value: Any, path: str) -> Iterator[tuple[str, float]]:
    """Every number of a value that some library has read, with its message path; none for what is absent."""
    if value is None:
        return
    if isinstance(kind, Record):
        for name, inner in kind.fields.items():
            yield from numbers(inner, _member(value, name), f"{path}.{name}")
    elif isinstance(kind, Array):
        for place, each in enumerate(value):
            yield from numbers(kind.element, each, f"{path}[{place}]")
    elif isinstance(kind, Number):
        yield path, float(value)


def _member(value: Any, name: str) -> Any:
    if isinstance(value, dict):
        return value.get(name)
    if isinstance(value, Message):
        declared = value.DESCRIPTOR.fields_by_name[name]
        return getattr(value, name) if not declared.has_presence or value.HasField(name) else None
    return getattr(value, name)
