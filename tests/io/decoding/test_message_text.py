"""ROS definitions as text: what is understood, and what is refused before it can do harm."""

import numpy as np
import pytest

from chladni.io.decoding import SUPPORTED, definition_text, make_decoder
from chladni.io.decoding.decoder import MAX_SCHEMA_BYTES
from chladni.io.decoding.message_text import parse_ros1_text, parse_ros2_text
from chladni.io.decoding.schema import Array, Primitive, Record, Stamp, Text, leaves
from chladni.signals.errors import LogError

SEPARATOR = "=" * 80


def paths(record: Record) -> list[str]:
    return [leaf.info.path for leaf in leaves(record)]


def test_every_form_of_a_line_is_understood() -> None:
    text = """
    # a comment = with a sign
    int32 LIMIT=5
    string NAME = "a # b"   # a constant
    float64[9]\tcovariance  # fixed
    float32[<=3] bounded
    string<=10 short "a default"
    string<=4[<=2] several
    int8 count 5
    byte b
    char c
    bool[] flags
    wstring wide
    builtin_interfaces/Time t
    builtin_interfaces/msg/Duration d
    """
    types = {member.name: member.type for member in parse_ros2_text("demo/msg/Demo", text).members}
    assert types["covariance"] == Array(element=Primitive(dtype=np.dtype(np.float64)), length=9)
    assert types["bounded"] == Array(element=Primitive(dtype=np.dtype(np.float32)), bound=3)
    assert types["short"] == Text(bound=10)
    assert types["several"] == Array(element=Text(bound=4), bound=2)
    assert types["b"] == types["c"] == Primitive(dtype=np.dtype(np.uint8))
    assert types["wide"] == Text(wide=True)
    assert [types[name].kind for name in "td" if isinstance(types[name], Stamp)] == ["time", "duration"]
    assert len(types) == 11


def test_types_are_found_in_full_in_their_package_and_by_their_last_name() -> None:
    text = f"""Header header
Inner a
other/Inner b
Third[] c
{SEPARATOR}
MSG: std_msgs/msg/Header
uint8 x
{SEPARATOR}
MSG: demo/Inner
uint8 y
{SEPARATOR}
MSG: other/msg/Inner
uint8 z
{SEPARATOR}
MSG: else/Third
Fourth w
{SEPARATOR}
MSG: else/Fourth
uint8 v
"""
    assert paths(parse_ros2_text("demo/msg/Demo", text)) == ["header.x", "a.y", "b.z", "c[].w.v"]


def test_a_definition_may_begin_with_its_own_heading() -> None:
    text = f"{SEPARATOR}\nMSG: demo/msg/Demo\nuint8 x\n"
    assert paths(parse_ros2_text("demo/msg/Demo", text.partition("\n")[2])) == ["x"]


def test_ros_1_has_its_own_words() -> None:
    record = parse_ros1_text("demo/Demo", "Header header\ntime t\nduration d\nbyte b\n")
    types = {member.name: member.type for member in record.members}
    assert paths(record)[:3] == ["header.seq", "header.stamp", "header.frame_id"]
    assert types["b"] == Primitive(dtype=np.dtype(np.int8))
    assert isinstance(types["d"], Stamp)
    assert types["d"].seconds == np.int32
    assert parse_ros1_text("demo/Empty", "").members == ()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("float64", "expected 'type name'"),
        ("float64 9x", "expected 'type name'"),
        ("float64[x] y", "expected 'type name'"),
        ("Missing x", "uses 'Missing', which the schema doesn't define"),
        ("float64<=4 x", "only strings have a bound"),
        ("float64[0] x", "array of length 0"),
        (f"A a\n{SEPARATOR}\nMSG: demo/A\nA again", "contains itself"),
        (f"A a\n{SEPARATOR}\nMSG: demo/A\nB b\n{SEPARATOR}\nMSG: demo/B\nA a", "contains itself"),
        ("float64[4294967295] x", "more than the"),
        ("uint8[4294967295] x", None),
    ],
)
def test_mistakes_are_named(text: str, told: str | None) -> None:
    if told is None:
        assert len(leaves(parse_ros2_text("demo/msg/Demo", text))) == 1
        return
    with pytest.raises(LogError, match=told):
        leaves(parse_ros2_text("demo/msg/Demo", text))


def test_types_nested_too_deep_are_refused() -> None:
    parts = [f"{SEPARATOR}\nMSG: demo/T{n}\nT{n + 1} x" for n in range(80)]
    with pytest.raises(LogError, match="nested deeper"):
        parse_ros2_text("demo/msg/Demo", "\n".join(["T0 x", *parts, f"{SEPARATOR}\nMSG: demo/T80\nuint8 x"]))


@pytest.mark.parametrize("levels", [20, 50])
def test_definitions_that_double_at_each_level_are_refused_in_time(levels: int) -> None:
    parts = [f"{SEPARATOR}\nMSG: demo/T{n}\nT{n + 1} x\nT{n + 1} y" for n in range(levels)]
    text = "\n".join(["T0 x", *parts, f"{SEPARATOR}\nMSG: demo/T{levels}\nuint8 x"])
    with pytest.raises(LogError, match="more than"):
        make_decoder(
            message_encoding="cdr", schema_name="demo/Demo", schema_encoding="ros2msg", schema_data=text.encode()
        )


def test_encodings_that_are_not_supported_are_named_beside_those_that_are() -> None:
    with pytest.raises(LogError, match="'cbor' with schema encoding '' can't be decoded; supported: cdr/ros2msg"):
        make_decoder(message_encoding="cbor", schema_name="x", schema_encoding="", schema_data=b"")
    assert ("json", "") in SUPPORTED


def test_schemas_that_are_no_text_or_too_long_are_refused() -> None:
    with pytest.raises(LogError, match="expected 'type name'"):
        make_decoder(message_encoding="cdr", schema_name="x", schema_encoding="ros2msg", schema_data=b"\xff")
    with pytest.raises(LogError, match="a definition may have"):
        make_decoder(
            message_encoding="cdr",
            schema_name="x",
            schema_encoding="ros2msg",
            schema_data=bytes(MAX_SCHEMA_BYTES + 1),
        )


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_comments_in_an_old_encoding_cost_nothing(encoding: str) -> None:
    text = "float64 x  # [m/s²]\r\nfloat64 y\r\n"
    decoder = make_decoder(
        message_encoding="cdr", schema_name="x", schema_encoding="ros2msg", schema_data=text.encode(encoding)
    )
    assert [info.path for info in decoder.fields] == ["x", "y"]
    assert definition_text(text.encode(encoding)) == text


@pytest.mark.parametrize("size", ["²", "1_0", "٣", "+3", "-1", " 3", "9" * 11, "0x3"])
@pytest.mark.parametrize("line", ["float64[%s] x", "float64[<=%s] x", "string<=%s x"])
def test_what_isn_t_a_size_is_refused(size: str, line: str) -> None:
    with pytest.raises(LogError, match="expected 'type name'"):
        parse_ros2_text("demo/Demo", line % size)


@pytest.mark.parametrize("sign", ["\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\u2029"])
def test_only_a_newline_ends_a_line(sign: str) -> None:
    record = parse_ros2_text("demo/Demo", f"float64 x # left{sign}float64 hidden\nfloat64 y{sign}\n")
    assert [member.name for member in record.members] == ["x", "y"]
