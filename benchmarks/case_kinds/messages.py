"""Messages: alignment, schemas that say otherwise, and absent fields."""

import struct
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from case_kinds.checks import check_rate, check_values
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import (
    HEADER,
    NS,
    START_NS,
    Entry,
    Topic,
    as_json,
    json_topic,
    proto_class,
    proto_file,
    proto_topic,
    read_back,
    write_log,
)
from case_kinds.product import Product, expect

PERIOD_NS = 10_000_000
SAMPLES = 200
SINE = np.sin(0.3 * np.arange(SAMPLES))
"""What most of the given logs hold: 200 samples at 100 Hz."""


def one_topic_log(folder: Path, topic: Topic, messages: Iterable[bytes], period_ns: int = PERIOD_NS) -> Path:
    entries = [Entry(topic, START_NS + index * period_ns, data) for index, data in enumerate(messages)]
    path = write_log(folder / "log.mcap", entries)
    assert [data for _, _, data in read_back(path)] == [entry.data for entry in entries]
    return path


# CDR aligned from its header


def _aligned(parts: list[tuple[str, Any]], order: str) -> bytes:
    """Encode with the four bytes of the encapsulation counted in: each number at a multiple of its size."""
    data = bytearray(b"\0\1\0\0" if order == "<" else b"\0\0\0\0")
    for code, value in parts:
        size = struct.calcsize(code)
        data += bytes(-len(data) % size)
        data += struct.pack(order + code, value)
    return bytes(data)


def _cdr(
    topic: Topic, parts_of: Callable[[float], list[tuple[str, Any]]], order: str = "<"
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        return one_topic_log(folder, topic, (_aligned(parts_of(float(value)), order) for value in SINE))

    return write


def _check_fields(**truths: np.ndarray) -> Check:
    def check(product: Product, path: Path) -> None:
        for name, truth in truths.items():
            check_values(product, path, name, truth, within=1e-6)
        check_rate(product, path, next(iter(truths)), 100, samples=SAMPLES)

    return check


def cdr_aligned_from_its_header() -> list[Case]:
    """Alignment is counted from the encapsulation header."""
    kind = "cdr_aligned_from_its_header"
    idl = b"module m {\n struct S {\n  octet b;\n  double x;\n  float y;\n  double z;\n };\n};\n"
    mixed = Topic("/s", "m::S", idl, schema_encoding="omgidl")
    three = Topic("/s", "p/msg/V", b"float64 x\nfloat64 y\nfloat64 z\n")
    counted = Topic("/s", "p/msg/C", b"uint32 n\nfloat64 x\n")
    framed = Topic("/s", "p/msg/F", f"std_msgs/Header header\nfloat64 x\nfloat64 y\n{HEADER}".encode())
    whole = Topic("/s", "m::L", b"module m {\n struct L {\n  long k;\n  sequence<double> d;\n  double x;\n };\n};\n",
                  schema_encoding="omgidl")  # fmt: skip
    stamps = iter(range(START_NS, 2 * START_NS, PERIOD_NS))

    def header(value: float) -> list[tuple[str, Any]]:
        seconds, nanoseconds = divmod(next(stamps), NS)
        return [("i", seconds), ("I", nanoseconds), ("I", 4), ("4s", b"imu\0"), ("d", value), ("d", 2 * value)]

    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("rti", given(kind, "rti.mcap"), _check_fields(x=SINE, y=-SINE)),
            ("octet_double_float_double",
             _cdr(mixed, lambda v: [("B", 7), ("d", v), ("f", -v), ("d", 9.81 + v)]),
             _check_fields(x=SINE, z=9.81 + SINE)),
            ("three_doubles_big_endian",
             _cdr(three, lambda v: [("d", v), ("d", -v), ("d", 3 * v)], ">"),
             _check_fields(x=SINE, y=-SINE, z=3 * SINE)),
            ("counter_and_double",
             _cdr(counted, lambda v: [("I", round(1000 + v)), ("d", v)]), _check_fields(x=SINE)),
            ("header_and_doubles", _cdr(framed, header), _check_fields(x=SINE, y=2 * SINE)),
            ("sequence_of_doubles",
             _cdr(whole, lambda v: [("i", 5), ("I", 2), ("d", v + 1), ("d", v + 2), ("d", v)]),
             _check_fields(x=SINE)),
        )
    ]  # fmt: skip


# A JSON schema that says integer


def _json(properties: dict[str, Any], fields_of: Callable[[int], dict[str, Any]]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        return one_topic_log(
            folder, json_topic("/j", properties), (as_json(**fields_of(index)) for index in range(SAMPLES))
        )

    return write


def _check_json(name: str, truth: np.ndarray, *, word: bool = True) -> Check:
    def check(product: Product, path: Path) -> None:
        check_rate(product, path, name, 100, samples=truth.size)
        check_values(product, path, name, truth)
        if word:
            product.told(r"integer|whole|schema")

    return check


def json_schema_says_integer() -> list[Case]:
    """Floats under a schema that says integer, because the first was written as 0."""
    kind = "json_schema_says_integer"
    integer = {"type": "integer"}
    nested = {"acc": {"type": "object", "properties": {"x": integer, "y": {"type": "number"}}}}
    whole = np.round(100 * SINE)
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("floats", given(kind, "floats.mcap"), _check_json("x", SINE)),
            ("nested", _json(nested, lambda i: {"acc": {"x": SINE[i], "y": 0.5}}), _check_json("x", SINE)),
            ("in_an_array",
             _json({"v": {"type": "array", "items": integer}}, lambda i: {"v": [SINE[i], i]}),
             _check_json("v[0]", SINE)),
            ("late_float",
             _json({"x": integer}, lambda i: {"x": int(whole[i]) if i < 150 else whole[i] + 0.5}),
             _check_json("x", whole + 0.5 * (np.arange(SAMPLES) >= 150))),
            ("integer_or_null",
             _json({"x": {"type": ["integer", "null"]}}, lambda i: {"x": SINE[i]}), _check_json("x", SINE)),
            ("whole_floats_need_no_word",
             _json({"x": integer}, lambda i: {"x": float(whole[i])}), _check_json("x", whole, word=False)),
            ("boolean_beside",
             _json({"ok": {"type": "boolean"}, "x": integer}, lambda i: {"ok": True, "x": 1e3 * SINE[i]}),
             _check_json("x", 1e3 * SINE)),
        )
    ]  # fmt: skip


# An optional that is absent


def _optional(
    fields: list[tuple[str, int, str, str]],
    absent: Callable[[int], bool],
    fill: Callable[[Any, float], None],
    *,
    inner: bool = False,
    syntax: str = "proto3",
    rate_hz: float = 100.0,
    offset: float = 5.0,
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        text: list[tuple[str, list[tuple[str, int, str, str]]]] = [("A", fields)]
        if inner:
            text.insert(0, ("Vector", [("x", 1, "double", "implicit"), ("y", 2, "double", "implicit")]))
        descriptors = proto_file("a.proto", text, syntax)
        message_type = proto_class(descriptors, "A")
        messages = []
        for index in range(SAMPLES):
            message = message_type()
            if not absent(index):
                fill(message, offset + float(SINE[index]))
            messages.append(message.SerializeToString())
        assert sum(not data for data in messages) == sum(map(absent, range(SAMPLES)))
        return one_topic_log(folder, proto_topic("/p", "A", descriptors), messages, round(NS / rate_hz))

    return write


def _check_absent(absent: Callable[[int], bool], scale: float = 1.0) -> Check:
    present = np.array([not absent(index) for index in range(SAMPLES)])

    def check(product: Product, path: Path) -> None:
        found = product.values(path, "x")
        truth = scale * (5.0 + SINE)[present]
        if scale != 1.0:
            truth = np.round(truth)
        made_up = int(np.sum(found == 0.0))
        expect(made_up == 0, f"{made_up} zeros where nothing was sent; RMS {np.std(found):.3g}")
        expect(found.size == truth.size, f"{found.size} samples instead of {truth.size}")
        expect(bool(np.allclose(found, truth, rtol=1e-5)), f"RMS {np.std(found):.3g} instead of {np.std(truth):.3g}")
        document = product.info(path)
        rates = [entry["rate_hz"] for entry in document["channels"] if entry["name"].endswith("x")]
        expect(len(rates) == 1, f"{len(rates)} channels x")

    return check


def _implicit_zero(folder: Path) -> Path:
    """Write a plain proto3 double: a zero is not encoded, and is a zero all the same."""
    descriptors = proto_file("z.proto", [("Z", [("x", 1, "double", "implicit")])], "proto3")
    message_type = proto_class(descriptors, "Z")
    values = np.where(np.arange(SAMPLES) % 4 == 0, 0.0, SINE)
    messages = [message_type(x=float(value)).SerializeToString() for value in values]
    assert sum(not data for data in messages) == SAMPLES // 4
    return one_topic_log(folder, proto_topic("/p", "Z", descriptors), messages)


def _check_implicit(product: Product, path: Path) -> None:
    check_values(product, path, "x", np.where(np.arange(SAMPLES) % 4 == 0, 0.0, SINE))


def protobuf_optional_absent() -> list[Case]:
    """A field that may be absent is, in some messages."""
    kind = "protobuf_optional_absent"

    def fourth(index: int) -> bool:
        return index % 4 == 0

    def some(index: int) -> bool:
        return index < 20 or index % 7 == 3

    def set_x(message: Any, value: float) -> None:
        message.x = value

    def set_whole(message: Any, value: float) -> None:
        message.x = round(1000 * value)

    def set_inner(message: Any, value: float) -> None:
        message.acc.x, message.acc.y = value, 1.0

    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("every_fourth_absent", given(kind, "every_fourth_absent.mcap"), _check_absent(fourth)),
            ("at_the_start_and_between",
             _optional([("x", 1, "float", "optional")], some, set_x, rate_hz=500), _check_absent(some)),
            ("submessage_absent",
             _optional([("acc", 3, "Vector", "implicit")], fourth, set_inner, inner=True), _check_absent(fourth)),
            ("proto2_optional",
             _optional([("x", 1, "double", "optional")], fourth, set_x, syntax="proto2"), _check_absent(fourth)),
            ("whole_number_optional",
             _optional([("x", 2, "sint32", "optional")], some, set_whole), _check_absent(some, 1000)),
            ("in_a_oneof",
             _optional([("x", 1, "double", "oneof"), ("text", 2, "string", "implicit")], fourth, set_x),
             _check_absent(fourth)),
            ("zero_of_a_plain_field", _implicit_zero, _check_implicit),
        )
    ]  # fmt: skip


def cases() -> list[Case]:
    """Every case about alignment, schemas and absent fields."""
    return [*cdr_aligned_from_its_header(), *json_schema_says_integer(), *protobuf_optional_absent()]
