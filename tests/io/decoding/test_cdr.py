"""CDR and ROS 1 messages to columns, against rosbags, mcap's ROS 2 decoder and a reader of one message."""

import struct
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from chladni.io.decoding import make_decoder
from tests.io.decoding.definitions import Oracle, leaf_of, messages, ros2_types
from tests.io.decoding.encoded import (
    JOINT_STATE,
    SEPARATOR,
    batch_of,
    cdr,
    decode_all,
    decoder_of,
    text_of,
    values_of,
)


def flattened(value: Any) -> Any:
    """Lists of strings are tuples in a column; rosbags gives lists."""
    if isinstance(value, tuple):
        return list(value)
    if isinstance(value, list):
        return [one for element in value for one in (element if isinstance(element, tuple) else (element,))]
    return value


def assert_agrees(
    oracle: Oracle, *, seed: int, count: int, gaps: tuple[int, ...], little_endian: bool = True
) -> None:
    rng = np.random.default_rng(seed)
    values = [oracle.value(rng, oracle.root) for _ in range(count)]
    encoded = batch_of([oracle.encode(value, little_endian=little_endian) for value in values], gaps=gaps)
    decoder = make_decoder(
        message_encoding="cdr" if oracle.ros == 2 else "ros1",
        schema_name=f"demo/msg/{oracle.root.name}",
        schema_encoding="ros2msg" if oracle.ros == 2 else "ros1msg",
        schema_data=oracle.schema_text(),
    )
    whole = decode_all(decoder, encoded)
    assert not whole.bad.any(), whole.reasons
    for info in decoder.fields:
        expected = [leaf_of(value, info.path) for value in values]
        assert [flattened(value) for value in values_of(whole, info.path)] == expected
        alone = decoder.columns(encoded, [info.path])
        assert values_of(alone, info.path) == values_of(whole, info.path)


@given(
    root=messages(ros=2),
    seed=st.integers(0, 2**32),
    count=st.integers(1, 5),
    gaps=st.sampled_from([(5,), (5, 5, 9), (0,)]),
    little_endian=st.booleans(),
)
def test_any_ros2_definition_reads_back_what_rosbags_wrote(
    root: Any, seed: int, count: int, gaps: tuple[int, ...], little_endian: bool
) -> None:
    assert_agrees(Oracle(root, ros=2), seed=seed, count=count, gaps=gaps, little_endian=little_endian)


@given(root=messages(ros=1), seed=st.integers(0, 2**32), count=st.integers(1, 5))
def test_any_ros1_definition_reads_back_what_rosbags_wrote(root: Any, seed: int, count: int) -> None:
    assert_agrees(Oracle(root, ros=1), seed=seed, count=count, gaps=(5, 5, 9))


# --- known schemas --------------------------------------------------------------------------------

KNOWN = [
    "sensor_msgs/msg/Imu", "geometry_msgs/msg/Accel", "geometry_msgs/msg/AccelStamped",
    "geometry_msgs/msg/Vector3Stamped", "geometry_msgs/msg/Wrench", "geometry_msgs/msg/WrenchStamped",
    "sensor_msgs/msg/JointState", "std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray", "std_msgs/msg/Empty",
]  # fmt: skip


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("little_endian", [True, False])
def test_known_messages_read_back_what_rosbags_wrote(name: str, little_endian: bool) -> None:
    store = ros2_types()
    rng = np.random.default_rng(1)
    values = [random_value(store, rng, name) for _ in range(7)]
    encoded = batch_of([bytes(store.serialize_cdr(one, name, little_endian=little_endian)) for one in values])
    text, _ = store.generate_msgdef(name, ros_version=2)
    decoder = decoder_of(text, name)
    decoded = decode_all(decoder, encoded)
    assert not decoded.bad.any()
    for info in decoder.fields:
        assert [flattened(one) for one in values_of(decoded, info.path)] == [
            leaf_of(one, info.path) for one in values
        ]


def random_value(store: Any, rng: np.random.Generator, name: str) -> Any:
    kind = store.types[name]
    return kind(**{field: random_field(store, rng, what) for field, what in store.fielddefs[name][1]})


def random_field(store: Any, rng: np.random.Generator, what: Any) -> Any:
    node, detail = int(what[0]), what[1]
    if node == 1 and detail[0] == "string":
        return str(rng.choice(["", "base_link", "imu"]))
    if node == 1:
        return float(rng.normal()) if detail[0].startswith("float") else int(rng.integers(0, 100))
    if node == 2:
        return random_value(store, rng, detail)
    element, count = detail
    length = count if node == 3 else int(rng.integers(0, 4))
    found = [random_field(store, rng, element) for _ in range(length)]
    numeric = int(element[0]) == 1 and element[1][0] != "string"
    return np.array(found, element[1][0]) if numeric else found


def test_px4_messages_keep_their_wire_types() -> None:
    text = "uint64 timestamp\nuint64 timestamp_sample\nuint32 device_id\nfloat32 dt\nfloat32 scale\nuint8 samples\n"
    text += "int16[32] x\nint16[32] y\nint16[32] z\nuint8 ORB_QUEUE_LENGTH = 4\n"
    decoder = decoder_of(text, "px4_msgs/msg/SensorAccelFifo")
    x = np.arange(32, dtype="<i2") - 7
    body = struct.pack("<QQIffB", 2**63, 5, 6, 0.25, 0.5, 32) + b"\0" + x.tobytes() + (2 * x).tobytes() + x.tobytes()
    decoded = decode_all(decoder, batch_of([cdr(body)] * 3))
    assert decoded.columns["timestamp"].numbers.tolist() == [2**63] * 3
    assert decoded.columns["dt"].numbers.dtype == np.float32
    assert decoded.columns["y"].numbers.dtype == np.int16
    assert values_of(decoded, "y") == [(2 * x).tolist()] * 3
    assert {info.path: info.array for info in decoder.fields}["y"] == 32


def test_names_that_all_messages_share_are_decoded_once() -> None:
    names = struct.pack("<I", 2) + text_of(b"elbow") + b"\0" * 2 + text_of(b"arm")
    messages = [cdr(struct.pack("<iI", k, 0), text_of(b""), b"\0" * 3, names) for k in range(50)]
    decoded = decoder_of(JOINT_STATE).columns(batch_of(messages), ["header.stamp", "name"])
    strings = decoded.columns["name"].strings
    assert strings.table == (("elbow", "arm"),)
    assert strings[49] == ("elbow", "arm")
    assert len(strings) == 50
    assert decoded.columns["header.stamp"].numbers.tolist() == [k * 10**9 for k in range(50)]


# --- measured logs --------------------------------------------------------------------------------


@pytest.mark.parametrize("file", ["real_ros2_bag.mcap", "emps.mcap"])
def test_measured_logs_read_as_the_ros_2_decoder_reads_them(shared_data: Path, file: str) -> None:
    topics: dict[str, tuple[Any, list[bytes]]] = {}
    with (shared_data / file).open("rb") as stream:
        for schema, channel, record in islice(make_reader(stream).iter_messages(), 5000):
            found = topics.setdefault(channel.topic, (schema, []))[1]
            if len(found) < 40:
                found.append(record.data)
    for schema, records in topics.values():
        one = DecoderFactory().decoder_for("cdr", schema)
        values = [one(message) for message in records]
        decoder = decoder_of(schema.data.decode(), schema.name)
        decoded = decode_all(decoder, batch_of(records))
        assert not decoded.bad.any()
        for info in decoder.fields:
            got = [flattened(value) for value in values_of(decoded, info.path)]
            assert repr(got) == repr([plain(leaf_of(value, info.path), info.kind) for value in values]), info.path


def plain(value: Any, kind: str) -> Any:
    # mcap's decoder gives uint8 arrays as bytes.
    return list(value) if isinstance(value, bytes | tuple) and kind != "string" else value


def test_arrays_in_arrays_are_given_in_the_order_of_the_wire() -> None:
    text = f"Group[] groups\n{SEPARATOR}\nMSG: demo/Group\nfloat32[2] pair\nuint8 id\nfloat64[] more\n"
    groups = [[], [((1, 2), 3, [0.5])], [((4, 5), 6, []), ((7, 8), 9, [1.5, 2.5])]]
    decoded = decode_all(decoder_of(text), batch_of([cdr(encoded_groups(one)) for one in groups]))
    assert values_of(decoded, "groups[].pair") == [[], [1.0, 2.0], [4.0, 5.0, 7.0, 8.0]]
    assert values_of(decoded, "groups[].id") == [[], [3], [6, 9]]
    assert values_of(decoded, "groups[].more") == [[], [0.5], [1.5, 2.5]]


def encoded_groups(groups: list[tuple[tuple[int, int], int, list[float]]]) -> bytes:
    content = struct.pack("<I", len(groups))
    for pair, number, more in groups:
        content += b"\0" * (-len(content) % 4) + struct.pack("<2fB", *pair, number)
        content += b"\0" * (-len(content) % 4) + struct.pack("<I", len(more))
        content += (b"\0" * (-len(content) % 8) if more else b"") + struct.pack(f"<{len(more)}d", *more)
    return content


def test_elements_without_constant_spacing_are_found() -> None:
    # A small member before the widest one: element 0 starts aligned, the others don't.
    text = f"string s\nPart[] parts\nuint8 end\n{SEPARATOR}\nMSG: demo/Part\nuint8 a\nfloat64 b\nuint8 c\n"
    messages = []
    for size in (1, 4, 6):
        body = text_of(b"s" * size)
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", 3)
        for k in range(3):
            body += bytes([k])
            body += b"\0" * (-len(body) % 8) + struct.pack("<dB", k + 0.5, 10 + k)
        messages.append(cdr(body, b"\x77"))
    for chosen in (messages[:1] * 3, messages):
        decoded = decode_all(decoder_of(text), batch_of(chosen))
        assert values_of(decoded, "parts[].a") == [[0, 1, 2]] * 3
        assert values_of(decoded, "parts[].b") == [[0.5, 1.5, 2.5]] * 3
        assert values_of(decoded, "parts[].c") == [[10, 11, 12]] * 3
        assert values_of(decoded, "end") == [0x77] * 3
