"""Damaged messages: marked, never crashing, never read beyond their own bytes."""

import struct
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.decoding import make_decoder
from chladni.io.decoding import walk as walk_module
from chladni.signals.errors import LogError
from tests.io.decoding.definitions import ros2_types
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


def joint_state(rng: np.random.Generator, *, joints: int = 2, frame: bytes = b"base") -> bytes:
    store = ros2_types()
    types = store.types
    message = types["sensor_msgs/msg/JointState"](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id=frame.decode()
        ),
        name=[f"joint{k}" for k in range(joints)],
        position=rng.normal(size=joints), velocity=np.empty(0), effort=rng.normal(size=joints),
    )  # fmt: skip
    return bytes(store.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def reference(message: bytes) -> tuple[Any, ...] | None:
    """One JointState read on its own, with every length checked against the message's; None where malformed."""
    try:
        return _reference(message)
    except (struct.error, ValueError, IndexError):
        return None


def _reference(message: bytes) -> tuple[Any, ...]:
    if message[0] != 0 or message[1] != 1:
        raise ValueError("not little-endian CDR")
    body, place = message[4:], 0

    def number(code: str, width: int) -> Any:
        nonlocal place
        place += -place % width
        place += width
        return struct.unpack_from(f"<{code}", body, place - width)[0]

    def text() -> str:
        nonlocal place
        length = number("I", 4)
        content = body[place : place + length]
        if len(content) < length or (length and content[-1]):
            raise ValueError("string")
        place += length
        return content[:-1].decode()

    seconds, nanoseconds, frame = number("i", 4), number("I", 4), text()
    names = [text() for _ in range(limited(number("I", 4), body, 4))]
    arrays = [[number("d", 8) for _ in range(limited(number("I", 4), body, 8))] for _ in range(3)]
    # Writers fill up to a multiple of 4 bytes; more than that nobody has described.
    if not 0 <= len(body) - place < 4:
        raise ValueError("length")
    return seconds * 10**9 + nanoseconds, frame, tuple(names), *arrays


def limited(count: int, body: bytes, width: int) -> int:
    if count * width > len(body):
        raise ValueError("count")
    return count


PATHS = ["header.stamp", "header.frame_id", "name", "position", "velocity", "effort"]


@given(
    damage=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 200), st.integers(0, 255)), min_size=1, max_size=6),
    cuts=st.lists(st.integers(0, 250), max_size=2),
    gaps=st.sampled_from([(0,), (3, 8)]),
    joints=st.integers(0, 3),
)
def test_damaged_messages_are_marked_or_read_as_they_stand(
    damage: list[tuple[int, int, int]], cuts: list[int], gaps: tuple[int, ...], joints: int
) -> None:
    rng = np.random.default_rng(0)
    messages = [bytearray(joint_state(rng, joints=joints)) for _ in range(6)]
    for index, place, byte in damage:
        messages[index][place % len(messages[index])] = byte
    for index, cut in enumerate(cuts):
        del messages[index][cut:]
    decoded = decoder_of(JOINT_STATE).columns(batch_of([bytes(one) for one in messages], gaps=gaps), PATHS)
    for index, message in enumerate(messages):
        expected = reference(bytes(message))
        assert bool(decoded.bad[index]) == (expected is None), (index, decoded.reasons)
        if expected is not None:
            got = [values_of(decoded, path)[index] for path in PATHS]
            assert np.array_equal(flat_numbers(got), flat_numbers(list(expected)), equal_nan=True)
            assert got[1:3] == list(expected[1:3])
    assert sum(decoded.reasons.values()) == decoded.bad.sum()


def flat_numbers(values: list[Any]) -> np.ndarray:
    return np.concatenate([[values[0]], *values[3:]])


def test_a_length_field_is_believed_only_as_far_as_the_message_goes() -> None:
    huge = cdr(struct.pack("<I", 2**32 - 1), b"\0" * 12)
    good = cdr(struct.pack("<I", 1), b"\0" * 4, struct.pack("<d", 4.0))
    decoded = decoder_of("float64[] x").columns(batch_of([huge, good, huge, good], gaps=(0,)), ["x"])
    assert decoded.bad.tolist() == [True, False, True, False]
    assert decoded.columns["x"].select(~decoded.bad).numbers.tolist() == [[4.0], [4.0]]
    assert decoded.reasons == {"an array runs past the end of the message": 2}


def test_many_bad_messages_beside_a_long_one_take_no_memory() -> None:
    long = cdr(struct.pack("<I", 100_000), b"\0" * 4, bytes(800_000))
    encoded = batch_of([long, *([cdr(b"\xff" * 4)] * 100_000)], gaps=(0,))
    decoded = decoder_of("float64[] x").columns(encoded, ["x"])
    assert decoded.bad.sum() == 100_000
    assert decoded.columns["x"].numbers.size == 100_000
    assert decoded.columns["x"].select(~decoded.bad).numbers.shape == (1, 100_000)


@pytest.mark.parametrize(
    ("text", "body", "reason"),
    [
        ("string<=2 s", text_of(b"abc"), "exceeds its bound"),
        ("float64[<=1] x", struct.pack("<I4x2d", 2, 0, 0), "exceeds its bound"),
        ("string s", text_of(b"\xff"), "isn't UTF-8"),
        ("string[] s", struct.pack("<I", 1) + text_of(b"\xff"), "isn't UTF-8"),
        ("string s", struct.pack("<I", 2) + b"ab", "terminating zero"),
        ("float64 x", b"\0" * 7, "past the end"),
    ],
)
def test_each_kind_of_damage_is_named(text: str, body: bytes, reason: str) -> None:
    decoder = decoder_of(text)
    decoded = decode_all(decoder, batch_of([cdr(body)]))
    assert decoded.bad.tolist() == [True]
    assert reason in next(iter(decoded.reasons))


def test_an_empty_string_may_come_without_its_zero() -> None:
    decoded = decoder_of("string s\nint32 x").columns(batch_of([cdr(struct.pack("<Ii", 0, 7))] * 2), ["s", "x"])
    assert values_of(decoded, "s") == ["", ""]
    assert values_of(decoded, "x") == [7, 7]


def test_messages_outside_the_buffer_are_marked() -> None:
    encoded = batch_of([cdr(struct.pack("<d", 1.5))] * 4)
    encoded.offsets[0], encoded.lengths[1], encoded.lengths[2] = -1, 2**62, -5
    decoded = decoder_of("float64 x").columns(encoded, ["x"])
    assert decoded.bad.tolist() == [True, True, True, False]
    assert decoded.columns["x"].numbers[3] == 1.5
    assert decoded.reasons == {"the message lies outside the data": 3}


def test_a_byte_order_unlike_the_others_is_damage() -> None:
    little, big = cdr(struct.pack("<d", 1.5)), cdr(struct.pack(">d", 1.5), little_endian=False)
    decoded = decoder_of("float64 x").columns(batch_of([big, big, little]), ["x"])
    assert decoded.bad.tolist() == [False, False, True]
    assert decoded.columns["x"].numbers[:2].tolist() == [1.5, 1.5]


def test_one_odd_header_marks_one_message() -> None:
    good = cdr(struct.pack("<d", 1.5))
    decoded = decoder_of("float64 x").columns(batch_of([good, b"\0\x07\0\0" + good[4:], good, b"\0"]), ["x"])
    assert decoded.bad.tolist() == [False, True, False, True]


def test_lists_beyond_the_step_limit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(walk_module, "MAX_ELEMENT_STEPS", 3)
    messages = [cdr(struct.pack("<I", n), (text_of(b"abc")) * n) for n in (3, 4, 2)]
    decoded = decoder_of("string[] names").columns(batch_of(messages), ["names"])
    assert decoded.bad.tolist() == [False, True, False]
    assert values_of(decoded, "names")[0] == ("abc",) * 3


def test_elements_that_lack_only_their_padding_are_noticed() -> None:
    text = f"Part[] parts\n{SEPARATOR}\nMSG: demo/Part\nuint8 a\nfloat64 b\n"
    good = cdr(struct.pack("<IB3xdB7xd", 2, 1, 0.5, 2, 1.5))
    decoder = decoder_of(text)
    decoded = decoder.columns(batch_of([good, good[:-4], good]), ["parts[].b"])
    assert decoded.bad.tolist() == [False, True, False]
    assert decoded.columns["parts[].b"].select(~decoded.bad).numbers.tolist() == [[0.5, 1.5]] * 2


def test_a_list_whose_messages_are_all_bad_is_not_walked(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = []
    walked = walk_module.Walk._element
    monkeypatch.setattr(walk_module.Walk, "_element", lambda *given: (steps.append(1), walked(*given)))
    huge = cdr(struct.pack("<I", 2**32 - 1), b"\0" * 12)
    decoded = decoder_of("string[] names\nint32 x").columns(batch_of([huge]), ["names", "x"])
    assert decoded.bad.tolist() == [True]
    assert not steps


def test_no_messages_give_empty_columns() -> None:
    decoded = decode_all(decoder_of(JOINT_STATE), batch_of([]))
    assert {path: len(values_of(decoded, path)) for path in decoded.columns} == dict.fromkeys(PATHS, 0)
    assert decoded.bad.shape == (0,)


def test_wide_strings_are_refused_only_where_they_are_in_the_way() -> None:
    decoder = decoder_of("int32 before\nwstring text\nint32 after")
    encoded = batch_of([cdr(struct.pack("<iI", 5, 0), b"\0" * 4)] * 2)
    assert values_of(decoder.columns(encoded, ["before"]), "before") == [5, 5]
    with pytest.raises(LogError, match="after can't be decoded: numbers behind a wstring"):
        decoder.columns(encoded, ["after"])


def test_an_unknown_path_is_refused_with_its_neighbours() -> None:
    with pytest.raises(LogError, match="no field 'positions'; near: position"):
        decoder_of(JOINT_STATE).columns(batch_of([]), ["positions"])


@pytest.mark.parametrize("order", [0, 1])
def test_a_message_of_the_other_byte_order_is_damaged_though_it_stands_alone(order: int) -> None:
    """Its numbers would read, and be wrong: the first messages tell the order of all batches."""
    sound = bytes([0, order, 0, 0]) + struct.pack("<d" if order else ">d", 4.5)
    decoder = decoder_of("float64 x").informed_by([batch_of([sound] * 5)])
    odd = bytes([0, 1 - order, 0, 0]) + sound[4:]
    for messages in ([odd], [odd, odd, sound]):
        decoded = decoder.columns(batch_of(messages), ["x"])
        assert decoded.bad.tolist() == [one is odd for one in messages]
        assert "byte order" in next(iter(decoded.reasons))


@pytest.mark.parametrize("bit", range(32))
def test_a_flipped_header_costs_one_message(bit: int) -> None:
    sound = cdr(struct.pack("<d", 4.5))
    odd = bytearray(sound)
    odd[bit // 8] ^= 1 << bit % 8
    for heads in ([sound] * 9, [sound, bytes(odd), sound]):
        decoder = decoder_of("float64 x").informed_by([batch_of(heads)])
        decoded = decoder.columns(batch_of([bytes(odd)]), ["x"])
        # Two bytes of the header are options, which say nothing of the numbers.
        assert decoded.bad[0] == (bit < 16)
        assert decoded.bad[0] or values_of(decoded, "x") == [4.5]


def nested_definitions(depth: int) -> Iterator[tuple[str, str, bytes]]:
    """Definitions as deep as this, made of types that each are read before: no one of them is deep by itself."""
    many = range(1, depth)
    parts = "".join(f"{SEPARATOR}\nMSG: demo/T{k}\nT{k - 1} a\n" for k in many)
    yield (
        "cdr",
        "ros2msg",
        f"{''.join(f'T{k} a{k}{chr(10)}' for k in many)}{parts}{SEPARATOR}\nMSG: demo/T0\nint8 a\n".encode(),
    )
    structs = "".join(f"struct T{k} {{ T{k - 1} a; }};" for k in many)
    fields = "".join(f"T{k} a{k}; " for k in many)
    yield "cdr", "omgidl", f"struct T0 {{ long a; }}; {structs} struct Demo {{ {fields} }};".encode()
    lists = "".join(f"typedef sequence<T{k - 1}> T{k};" for k in many)
    yield "cdr", "omgidl", f"typedef long T0; {lists} struct Demo {{ {fields} }};".encode()


@pytest.mark.parametrize("depth", [20, 200, 3000])
def test_types_nested_too_deep_are_refused(depth: int) -> None:
    for encoding, schema_encoding, data in nested_definitions(depth):
        make = partial(
            make_decoder, message_encoding=encoding, schema_name="demo/Demo", schema_encoding=schema_encoding,
            schema_data=data,
        )  # fmt: skip
        if depth < 64:
            assert make().fields
        else:
            with pytest.raises(LogError):
                make()


def test_two_fields_of_one_name_are_refused() -> None:
    with pytest.raises(LogError, match="two fields are called 'x'"):
        decoder_of("float64 x\nfloat64 y\nint32 x\n")
