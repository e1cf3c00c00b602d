"""IDL definitions, against rosbags' own parser and serialiser."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_idl, get_typestore

from chladni.io.decoding import make_decoder
from chladni.io.decoding.idl import parse_idl
from chladni.signals.errors import LogError
from tests.io.decoding.encoded import batch_of, decode_all, values_of

INNER = """
// generated from rosidl_adapter/resource/msg.idl.em
module demo {
  module msg {
    typedef double double__3[3];
    module Inner_Constants {
      @verbatim (language="comment", text="see http://example.org/{x}; 'so'" "\\n" "and more")
      const int32 LIMIT = 5;
    };
    @verbatim (language="comment", text="one [m/s^2]")
    struct Inner {
      @unit (value="m/s^2")
      double__3 axes;
      @default (value=-7)
      int8 small;
    };
  };
};
"""
OUTER = """
#include "builtin_interfaces/msg/Time.idl"
module demo {
  module msg {
    struct Outer {
      builtin_interfaces::msg::Time stamp;
      string frame;  /* which
      one */
      boolean on;
      octet flags;
      long long count, more;
      unsigned short code;
      float level;
      demo::msg::Inner one;
      sequence<Inner> several;
      sequence<float, 10> samples;
      sequence<string> names;
      Inner pair[2];
    };
  };
};
"""
TIME = """
module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };
"""
SET = f"{OUTER}\n{'=' * 80}\nIDL: demo/msg/Inner\n{INNER}\n{'=' * 80}\nIDL: builtin_interfaces/msg/Time\n{TIME}"


def test_messages_that_rosbags_wrote_from_the_same_idl_read_back() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    # rosbags wants its own words for the same types, and no list of declarators.
    text = (
        OUTER.replace("#include", "// ").replace("sequence<Inner>", "sequence<demo::msg::Inner>")
        .replace("Inner pair[2]", "demo::msg::Inner pair[2]")
        .replace("long long count, more;", "int64 count; int64 more;").replace("unsigned short", "uint16")
    )  # fmt: skip
    store.register(get_types_from_idl(INNER))
    store.register(get_types_from_idl(text))
    inner, outer = store.types["demo/msg/Inner"], store.types["demo/msg/Outer"]
    time = store.types["builtin_interfaces/msg/Time"]
    inners = [inner(axes=np.arange(3.0) + k, small=-k) for k in range(4)]
    values = [
        outer(
            stamp=time(sec=3 + k, nanosec=4), frame="f" * k, on=True, flags=7, count=-1, more=2**40, code=65535,
            level=0.5, one=inners[0], several=inners[1 : 1 + k], samples=np.ones(k, np.float32),
            names=["a", "bc"][:k], pair=inners[2:4],
        )
        for k in range(3)
    ]  # fmt: skip
    encoded = batch_of([bytes(store.serialize_cdr(value, "demo/msg/Outer")) for value in values])
    decoder = make_decoder(
        message_encoding="cdr", schema_name="demo/msg/Outer", schema_encoding="ros2idl", schema_data=SET.encode()
    )
    decoded = decode_all(decoder, encoded)
    assert not decoded.bad.any()
    assert values_of(decoded, "stamp") == [3_000_000_004, 4_000_000_004, 5_000_000_004]
    assert values_of(decoded, "frame") == ["", "f", "ff"]
    assert values_of(decoded, "more") == [2**40] * 3
    assert values_of(decoded, "code") == [65535] * 3
    assert values_of(decoded, "one.axes") == [[0.0, 1.0, 2.0]] * 3
    assert values_of(decoded, "several[].axes") == [[], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 2.0, 3.0, 4.0]]
    assert values_of(decoded, "several[].small") == [[], [-1], [-1, -2]]
    assert values_of(decoded, "samples") == [[], [1.0], [1.0, 1.0]]
    assert values_of(decoded, "names") == [(), ("a",), ("a", "bc")]
    assert values_of(decoded, "pair[].small") == [[-2, -3]] * 3


def names_of(text: str, name: str = "S") -> list[str]:
    return [member.name for member in parse_idl(name, text).members]


def test_plain_idl_has_inheritance_enums_constants_and_dimensions() -> None:
    text = """
    const long N = 2; enum Mode { OFF, ON }; typedef float row[3];
    module m { const unsigned long K = 4; };
    struct Base { @key long id; };
    struct S : Base { Mode mode; double grid[N][3]; row rows[N]; sequence<octet, m::K> raw; string<N> tag;; };
    """.replace(";;", ";")
    record = parse_idl("S", text)
    assert [member.name for member in record.members] == ["id", "mode", "grid", "rows", "raw", "tag"]
    grid, rows, raw, tag = (member.type for member in record.members[2:])
    assert grid.length == 6
    assert rows.length == 6
    assert raw.bound == 4
    assert tag.bound == 2


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("union U switch (long) { case 1: long a; };", "unions"),
        ("struct S { @optional long a; };", "@optional"),
        ("struct S { S again; };", "contains itself"),
        ("typedef B A; typedef A B; struct S { A a; };", "contains itself"),
        ("struct S { nowhere a; };", "isn't defined"),
        ("struct S { long double a; };", "isn't defined"),
        ("struct S { double a[K]; };", "constant declared before"),
        ("struct S { double a[0]; };", "at least 1"),
        ("struct S { double a[²]; };", "constant declared before"),
        ("const long K = ²; struct S { double a[K]; };", "constant declared before"),
        ("struct S { double a" + "[999999999999]" * 20_000 + "; };", "a has 999999999999 elements or more"),
        ("@bit_bound(64) enum E { A }; struct S { E a; };", "at most 32 bits"),
        ("struct S { double a", "expected"),
        ("struct S { double 1a; };", "a name"),
        ("struct Other { double a; };", "doesn't define a struct"),
        ("enum S { A };", "doesn't define a struct"),
        ("module a {" * 70, "nested modules"),
        ("struct S { " + "sequence<" * 70, "nested sequences"),
        ("struct S { long a; }; @verbatim(text=", "expected"),
    ],
)
def test_what_is_not_understood_is_refused_by_name(text: str, told: str) -> None:
    with pytest.raises(LogError, match=told):
        parse_idl("S", text)


def test_unclosed_comments_take_linear_time() -> None:
    with pytest.raises(LogError):
        names_of("/*" * 500_000)


def test_a_forward_declaration_changes_nothing() -> None:
    assert names_of("struct S; struct S { long a; };") == ["a"]


@pytest.mark.parametrize(
    ("annotation", "expected"),
    [
        ("", None), ("@final", "final"), ("@appendable", "appendable"), ("@mutable", "mutable"),
        ("@extensibility(FINAL)", "final"), ("@extensibility(MUTABLE_EXTENSIBILITY)", "mutable"),
        ("@nested @Appendable @verbatim(text=\"@final\")", "appendable"),
    ],
)  # fmt: skip
def test_the_extensibility_of_a_struct_is_what_its_annotation_says(annotation: str, expected: str | None) -> None:
    text = f"{annotation} struct S {{ @key double a; @optional(false) long b; }}; @final struct T {{ S s; }};"
    assert parse_idl("S", text).extensibility == expected
    assert parse_idl("T", text).extensibility == "final"


@pytest.mark.parametrize(("bits", "width"), [("8", 1), ("16", 2), ("17", 4), ("32", 4)])
def test_an_enum_has_as_many_bytes_as_its_bound_needs(bits: str, width: int) -> None:
    record = parse_idl("S", f"@bit_bound({bits}) enum E {{ A, B }}; enum F {{ C }}; struct S {{ E e; F f; }};")
    assert [member.type.dtype.itemsize for member in record.members] == [width, 4]


def test_sizes_are_the_numbers_of_idl() -> None:
    text = "const long K = 0x10; struct S { double a[012]; double b[K]; sequence<long, 0XA> c; };"
    a, b, c = (member.type for member in parse_idl("S", text).members)
    assert (a.length, b.length, c.bound) == (10, 16, 10)


@pytest.mark.parametrize("size", ["²", "1_0", "٣", "+3", "08", "0x", "1.5", "3L", "9" * 13, "9" * 5000, "-1"])
@pytest.mark.parametrize(
    "text",
    [
        "struct S { double a[%s]; };",
        "struct S { sequence<long, %s> a; };",
        "const long K = %s; struct S { double a[K]; };",
        "struct S { string<%s> a; };",
    ],
)
def test_what_isn_t_a_size_in_idl_is_refused(size: str, text: str) -> None:
    with pytest.raises(LogError, match="schema S: "):
        parse_idl("S", text % size)
