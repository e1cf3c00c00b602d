"""Protobuf messages to columns, against the messages that were written."""

import struct
from functools import cache

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, duration_pb2, message_factory, struct_pb2, timestamp_pb2
from google.protobuf.descriptor_pool import DescriptorPool
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.decoding import make_decoder
from chladni.io.decoding import protobuf as module
from chladni.signals.errors import LogError
from tests.io.decoding.encoded import batch_of, decode_all, values_of

Field = descriptor_pb2.FieldDescriptorProto


def descriptor_set() -> descriptor_pb2.FileDescriptorSet:
    """demo.Sample: scalars of every width, packed arrays, nested messages, a map, times."""
    file = descriptor_pb2.FileDescriptorProto(name="demo.proto", package="demo", syntax="proto3")
    file.dependency.extend(["google/protobuf/timestamp.proto", "google/protobuf/duration.proto"])
    vector = file.message_type.add(name="Vector")
    for number, name in enumerate("xyz", 1):
        vector.field.add(name=name, number=number, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL)
    sample = file.message_type.add(name="Sample")
    entry = sample.nested_type.add(name="GainsEntry")
    entry.options.map_entry = True
    entry.field.add(name="key", number=1, type=Field.TYPE_STRING, label=Field.LABEL_OPTIONAL)
    entry.field.add(name="value", number=2, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL)
    one, many = Field.LABEL_OPTIONAL, Field.LABEL_REPEATED
    for name, kind, label, type_name in [
        ("stamp", Field.TYPE_MESSAGE, one, ".google.protobuf.Timestamp"),
        ("age", Field.TYPE_MESSAGE, one, ".google.protobuf.Duration"),
        ("accel", Field.TYPE_MESSAGE, one, ".demo.Vector"),
        ("f", Field.TYPE_FLOAT, one, ""),
        ("i", Field.TYPE_INT32, one, ""),
        ("s", Field.TYPE_SINT64, one, ""),
        ("u", Field.TYPE_UINT64, one, ""),
        ("x", Field.TYPE_FIXED32, one, ""),
        ("b", Field.TYPE_BOOL, one, ""),
        ("name", Field.TYPE_STRING, one, ""),
        ("raw", Field.TYPE_BYTES, one, ""),
        ("samples", Field.TYPE_FLOAT, many, ""),
        ("counts", Field.TYPE_INT64, many, ""),
        ("names", Field.TYPE_STRING, many, ""),
        ("points", Field.TYPE_MESSAGE, many, ".demo.Vector"),
        ("stamps", Field.TYPE_MESSAGE, many, ".google.protobuf.Timestamp"),
        ("gains", Field.TYPE_MESSAGE, many, ".demo.Sample.GainsEntry"),
    ]:
        sample.field.add(name=name, number=len(sample.field) + 1, type=kind, label=label, type_name=type_name or None)
    found = descriptor_pb2.FileDescriptorSet()
    found.file.append(file)  # before what it imports: the order isn't guaranteed
    for known in (timestamp_pb2, duration_pb2):
        known.DESCRIPTOR.CopyToProto(found.file.add())
    return found


@cache
def sample_class():
    files = descriptor_set().file
    pool = DescriptorPool()
    for file in (*files[1:], files[0]):
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.Sample"))


def decoder_of(data: bytes, name: str = "demo.Sample"):
    return make_decoder(message_encoding="protobuf", schema_name=name, schema_encoding="protobuf", schema_data=data)


def filled(index: int):
    sample = sample_class()()
    sample.stamp.seconds, sample.stamp.nanos = 1_700_000_000 + index, 5
    sample.age.seconds, sample.age.nanos = -1, -500_000_000
    sample.accel.x, sample.accel.z = 0.1 + index, -1e-300
    sample.f, sample.i, sample.s, sample.u, sample.x = 0.1, -7 - index, -(2**40), 2**64 - 1, 2**32 - 1
    sample.b, sample.name, sample.raw = True, "wrist é", bytes([0, 255, index])
    sample.samples.extend([0.5, index, 2.5][: 2 + index % 2])
    sample.counts.extend([-1, 2**40])
    sample.names.extend(["a", "b"])
    sample.points.add(x=1.0 + index)
    sample.points.add(y=2.0)
    sample.stamps.add(seconds=index)
    sample.gains["k"] = 2.0
    return sample


PLAIN_DECODER = decoder_of(descriptor_set().SerializeToString())


def test_every_kind_of_field_is_read_with_its_wire_type() -> None:
    decoder = decoder_of(descriptor_set().SerializeToString())
    encoded = batch_of([filled(index).SerializeToString() for index in range(4)])
    decoded = decode_all(decoder, encoded)
    assert not decoded.bad.any()
    expected = {
        "stamp": [(1_700_000_000 + i) * 10**9 + 5 for i in range(4)],
        "age": [-1_500_000_000] * 4,
        "accel.x": [0.1 + i for i in range(4)],
        "accel.y": [0.0] * 4,
        "accel.z": [-1e-300] * 4,
        "f": [float(np.float32(0.1))] * 4,
        "i": [-7 - i for i in range(4)],
        "s": [-(2**40)] * 4,
        "u": [2**64 - 1] * 4,
        "x": [2**32 - 1] * 4,
        "b": [True] * 4,
        "name": ["wrist é"] * 4,
        "raw": [[0, 255, i] for i in range(4)],
        "samples": [[0.5, float(i), 2.5][: 2 + i % 2] for i in range(4)],
        "counts": [[-1, 2**40]] * 4,
        "names": [("a", "b")] * 4,
        "points[].x": [[1.0 + i, 0.0] for i in range(4)],
        "points[].y": [[0.0, 2.0]] * 4,
        "points[].z": [[0.0, 0.0]] * 4,
        "stamps": [[i * 10**9] for i in range(4)],
        "gains[].key": [["k"]] * 4,
        "gains[].value": [[2.0]] * 4,
    }
    assert {info.path for info in decoder.fields} == set(expected)
    for path, values in expected.items():
        assert values_of(decoded, path) == values, path
    assert {info.path: info.dtype for info in decoder.fields}["f"] == np.float32
    assert decoded.columns["samples"].counts is not None
    assert decoded.columns["raw"].counts is None
    assert len(decoded.columns["names"].strings.table) == 1


PLAIN = ["stamp", "age", "accel.x", "accel.z", "f", "i", "s", "u", "x", "b", "raw", "samples"]


@given(
    layouts=st.lists(st.integers(0, 3), min_size=1, max_size=8),
    seed=st.integers(0, 2**32),
    damage=st.lists(st.tuples(st.integers(0, 7), st.integers(0, 150), st.integers(0, 255)), max_size=4),
)
def test_shared_layouts_give_what_the_library_gives(
    layouts: list[int], seed: int, damage: list[tuple[int, int, int]]
) -> None:
    rng = np.random.default_rng(seed)
    messages = [bytearray(varied(rng, layout).SerializeToString()) for layout in layouts]
    for index, place, byte in damage:
        chosen = messages[index % len(messages)]
        if chosen:
            chosen[place % len(chosen)] = byte
    encoded = batch_of([bytes(one) for one in messages], gaps=(3, 4))
    decoder = PLAIN_DECODER
    fast = decoder.columns(encoded, PLAIN)
    slow = decoder.columns(encoded, [*PLAIN, "name"])  # strings are beyond templates
    # The library also refuses damage in fields that weren't asked for.
    assert not (fast.bad & ~slow.bad).any()
    for path in PLAIN:
        pairs = zip(values_of(fast, path), values_of(slow, path), strict=True)
        for one, other in (pair for pair, bad in zip(pairs, slow.bad, strict=True) if not bad):
            assert np.array_equal(one, other, equal_nan=True), path


def varied(rng: np.random.Generator, layout: int):
    sample = sample_class()()
    if layout == 0:
        return sample
    sample.stamp.seconds, sample.stamp.nanos = int(rng.integers(2**30, 2**31)), int(rng.integers(0, 10**9))
    sample.age.nanos = -int(rng.integers(1, 100))
    sample.accel.x, sample.f, sample.name = rng.normal(), rng.normal(), "é" * layout
    sample.i, sample.s, sample.u = (
        int(rng.integers(-(2**31), 2**31)),
        -int(rng.integers(9)),
        int(rng.integers(2**62)),
    )
    sample.x, sample.b, sample.raw = int(rng.integers(2**32)), True, rng.bytes(layout)
    sample.samples.extend(rng.normal(size=layout))
    sample.points.add(x=1.0)
    return sample


def test_a_shared_layout_is_not_read_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    original = module._Batch._read
    monkeypatch.setattr(module._Batch, "_read", lambda self, rows: (read.extend(rows), original(self, rows))[1])
    messages = [filled(2 * index).SerializeToString() for index in range(50)]
    decoded = PLAIN_DECODER.columns(batch_of(messages), ["accel.x", "stamp", "samples"])
    assert values_of(decoded, "accel.x") == [0.1 + 2 * index for index in range(50)]
    assert values_of(decoded, "samples") == [[0.5, float(2 * index)] for index in range(50)]
    assert not read


def test_repeated_and_odd_forms_of_a_field_are_left_to_the_library() -> None:
    good = filled(0).SerializeToString()
    twice = sample_class()()
    twice.accel.x = 7.0
    group = b"\xa3\x06\xa4\x06"  # an unknown group, which nothing but the library knows to pass over
    messages = [good + twice.SerializeToString(), good + b"\x28\x05", group + good, good]
    decoded = PLAIN_DECODER.columns(batch_of(messages), ["accel.x", "accel.z", "i"])
    assert not decoded.bad.any(), decoded.reasons
    assert values_of(decoded, "accel.x") == [7.0, 0.1, 0.1, 0.1]
    assert values_of(decoded, "accel.z") == [-1e-300] * 4
    assert values_of(decoded, "i") == [-7, 5, -7, -7]


def test_a_field_of_another_wire_type_counts_as_unknown() -> None:
    decoded = PLAIN_DECODER.columns(batch_of([b"\x22\x04abcd"] * 3), ["f"])
    assert values_of(decoded, "f") == [0.0] * 3
    assert PLAIN_DECODER.informed_by([]) is PLAIN_DECODER


# --- what a message leaves out -----------------------------------------------------------------------------------


def test_what_a_message_leaves_out_is_zero_where_it_has_no_presence_and_missing_where_it_has() -> None:
    decoder = decoder_of(descriptor_set().SerializeToString())
    encoded = batch_of([b"", b""])
    # By templates, and one by one: strings are beyond templates.
    for paths in (PLAIN, [info.path for info in decoder.fields]):
        decoded = decoder.columns(encoded, paths)
        assert not decoded.bad.any()
        for path in ("f", "i", "s", "u", "x", "b"):
            assert values_of(decoded, path) == [0, 0], path
        for path in ("accel.x", "accel.z", "age"):
            assert np.isnan(decoded.columns[path].numbers).all(), path
        # A time that isn't there is told by whoever looks for stamps: it is no number.
        assert values_of(decoded, "stamp") == [0, 0]
        assert values_of(decoded, "samples") == [[], []]
    assert values_of(decoded, "name") == ["", ""]
    assert values_of(decoded, "gains[].value") == [[], []]


def test_an_empty_message_inside_is_there_and_its_fields_are_zero() -> None:
    sample = sample_class()()
    sample.accel.SetInParent()
    sample.age.SetInParent()
    encoded = batch_of([sample.SerializeToString(), b""])
    for paths in (["accel.x", "age"], ["accel.x", "age", "name"]):
        decoded = PLAIN_DECODER.columns(encoded, paths)
        for path in ("accel.x", "age"):
            assert np.array_equal(decoded.columns[path].numbers, [0.0, np.nan], equal_nan=True), path


NAMES = {Field.TYPE_DOUBLE: "d", Field.TYPE_FLOAT: "f", Field.TYPE_INT32: "i", Field.TYPE_BOOL: "b"}


def optional_set(syntax: str) -> descriptor_pb2.FileDescriptorSet:
    """opt.M: a number beside optional ones of several types, one of them in an optional message, two in a oneof."""
    files = descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name="opt.proto", package="opt", syntax=syntax)
    if syntax == "editions":
        file.edition = descriptor_pb2.EDITION_2023
    inner = file.message_type.add(name="Inner")
    outer = file.message_type.add(name="M")
    outer.oneof_decl.add(name="kind")
    for name in ("volt", "ampere"):
        outer.field.add(
            name=name, number=20 + len(name), type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL, oneof_index=0
        )
    for message in (inner, outer):
        for kind, name in NAMES.items():
            field = message.field.add(name=name, number=len(message.field) + 1, type=kind, label=Field.LABEL_OPTIONAL)
            if syntax == "proto3":
                field.proto3_optional = True
                field.oneof_index = len(message.oneof_decl)
                message.oneof_decl.add(name=f"_{name}")
    outer.field.add(
        name="inner", number=10, type=Field.TYPE_MESSAGE, label=Field.LABEL_OPTIONAL, type_name=".opt.Inner"
    )
    return files


def optional_class(syntax: str):
    pool = DescriptorPool()
    pool.Add(optional_set(syntax).file[0])
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("opt.M"))


@pytest.mark.parametrize("syntax", ["proto3", "proto2", "editions"])
@pytest.mark.parametrize("count", [1, 40])
def test_an_optional_number_that_is_absent_is_missing(syntax: str, count: int) -> None:
    made = optional_class(syntax)
    x = 5 + np.sin(0.3 * np.arange(count))
    messages = []
    for index in range(count):
        one = made()
        if index % 4:
            one.d, one.f, one.i, one.b, one.inner.i = x[index], 0.5, index, True, 0
        if index % 3:
            setattr(one, "volt" if index % 3 == 1 else "ampere", x[index])
        messages.append(one.SerializeToString())
    decoder = decoder_of(optional_set(syntax).SerializeToString(), "opt.M")
    encoded = batch_of(messages)
    absent = np.arange(count) % 4 == 0
    for paths in (
        ["d", "f", "i", "b", "inner.d", "inner.i"],
        ["volt", "ampere", "d", "f", "i", "b", "inner.d", "inner.i"],
    ):
        decoded = decoder.columns(encoded, paths)
        assert not decoded.bad.any(), decoded.reasons
        columns = {path: np.asarray(decoded.columns[path].numbers, np.float64) for path in paths}
        expected = {"d": x, "f": 0.5, "i": np.arange(count), "b": 1.0, "inner.i": 0.0, "inner.d": np.nan}
        for path, values in expected.items():
            assert np.array_equal(columns[path], np.where(absent, np.nan, values), equal_nan=True), path
    assert np.array_equal(columns["volt"], np.where(np.arange(count) % 3 == 1, x, np.nan), equal_nan=True)
    assert np.array_equal(columns["ampere"], np.where(np.arange(count) % 3 == 2, x, np.nan), equal_nan=True)


def test_a_type_that_has_room_for_what_is_missing_keeps_its_width() -> None:
    decoder = decoder_of(optional_set("proto3").SerializeToString(), "opt.M")
    decoded = decoder.columns(batch_of([b"", optional_class("proto3")(f=0.5).SerializeToString()]), ["f"])
    assert decoded.columns["f"].numbers.dtype == np.float32


def test_an_optional_number_of_proto2_with_a_default_has_that() -> None:
    files = descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name="old.proto", package="old", syntax="proto2")
    inner, outer = file.message_type.add(name="Inner"), file.message_type.add(name="M")
    for message in (inner, outer):
        message.field.add(name="v", number=1, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL, default_value="2.5")
    outer.field.add(
        name="inner", number=2, type=Field.TYPE_MESSAGE, label=Field.LABEL_OPTIONAL, type_name=".old.Inner"
    )
    decoder = decoder_of(files.SerializeToString(), "old.M")
    decoded = decoder.columns(batch_of([b"", b"\x12\x00"]), ["v", "inner.v"])
    assert not decoded.bad.any()
    assert values_of(decoded, "v") == [2.5, 2.5]
    # Without the message inside, its default stands for nothing.
    assert np.array_equal(decoded.columns["inner.v"].numbers, [np.nan, 2.5], equal_nan=True)


def test_malformed_messages_are_marked_and_the_others_read() -> None:
    good = filled(0).SerializeToString()
    too_late = sample_class()()
    too_late.stamp.seconds = 2**62
    decoder = decoder_of(descriptor_set().SerializeToString())
    encoded = batch_of([good, good[:-1], b"\x0a\xff\xff\xff\xff\x0f", too_late.SerializeToString(), good])
    decoded = decoder.columns(encoded, ["stamp", "f", "samples"])
    assert decoded.bad.tolist() == [False, True, True, True, False]
    assert sum(decoded.reasons.values()) == 3
    assert decoded.columns["f"].numbers[~decoded.bad].tolist() == [float(np.float32(0.1))] * 2
    assert decoded.columns["samples"].select(~decoded.bad).numbers.tolist() == [[0.5, 0.0]] * 2


def test_messages_outside_the_buffer_are_marked() -> None:
    encoded = batch_of([filled(0).SerializeToString()] * 2)
    encoded.lengths[1] = 10**9
    decoded = decoder_of(descriptor_set().SerializeToString()).columns(encoded, ["f"])
    assert decoded.bad.tolist() == [False, True]


def test_a_type_that_holds_itself_keeps_its_finite_fields() -> None:
    files = descriptor_pb2.FileDescriptorSet()
    struct_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    decoder = decoder_of(files.SerializeToString(), "google.protobuf.Value")
    assert "number_value" in {info.path for info in decoder.fields}
    value = struct_pb2.Value(number_value=2.5)
    assert values_of(decoder.columns(batch_of([value.SerializeToString()]), ["number_value"]), "number_value") == [
        2.5
    ]


@pytest.mark.parametrize(
    ("data", "name", "told"),
    [
        (b"\xff\xff", "demo.Sample", "not a protobuf FileDescriptorSet"),
        (b"", "demo.Sample", "can't be used"),
        (descriptor_set().SerializeToString(), "demo.Other", "can't be used"),
        (struct.pack("<BB", 0x0A, 0x7F), "demo.Sample", "not a protobuf FileDescriptorSet"),
    ],
)
def test_malformed_descriptor_sets_are_refused(data: bytes, name: str, told: str) -> None:
    with pytest.raises(LogError, match=told):
        decoder_of(data, name)


def test_files_that_import_each_other_are_refused() -> None:
    files = descriptor_pb2.FileDescriptorSet()
    files.file.add(name="a.proto", dependency=["b.proto"])
    files.file.add(name="b.proto", dependency=["a.proto"])
    with pytest.raises(LogError, match="imports itself"):
        decoder_of(files.SerializeToString())


def test_too_many_files_are_refused() -> None:
    files = descriptor_pb2.FileDescriptorSet()
    for index in range(2001):
        files.file.add(name=f"{index}.proto")
    with pytest.raises(LogError, match="more than 2000"):
        decoder_of(files.SerializeToString())


@pytest.mark.parametrize("syntax", ["proto2", "proto3"])
@pytest.mark.parametrize("label", [Field.LABEL_OPTIONAL, Field.LABEL_REPEATED])
def test_a_string_that_is_no_unicode_costs_one_message(syntax: str, label: int) -> None:
    file = descriptor_pb2.FileDescriptorProto(name="t.proto", package="demo", syntax=syntax)
    message = file.message_type.add(name="T")
    message.field.add(name="s", number=1, type=Field.TYPE_STRING, label=label)
    message.field.add(name="x", number=2, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL)
    decoder = decoder_of(descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(), "demo.T")
    sound, odd = (b"\x0a\x02" + text + b"\x11" + struct.pack("<d", 2.5) for text in (b"ab", b"\xff\xfe"))
    decoded = decode_all(decoder, batch_of([sound, odd, sound]))
    assert decoded.bad.tolist() == [False, True, False]
    assert values_of(decoded, "x")[::2] == [2.5, 2.5]
    assert all(isinstance(one, str) for entry in decoded.columns["s"].strings.table for one in entry)
