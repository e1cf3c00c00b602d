"""CDR as different middlewares write it: the form is found by the bytes, or the messages are refused."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from chladni.io.decoding import Decoder, cdr, make_decoder
from chladni.io.decoding import walk as walk_module
from chladni.signals.errors import LogError
from tests.io.decoding.encoded import CdrWriter, batch_of, decode_all, decoder_of, values_of

PLAIN, XCDR2, DELIMITED = 0x00, 0x06, 0x08
COUNT = 20
X = np.sin(0.3 * np.arange(COUNT))


def idl_decoder(text: str, name: str = "S") -> Decoder:
    return make_decoder(message_encoding="cdr", schema_name=name, schema_encoding="omgidl", schema_data=text.encode())


def written(write: Callable[[CdrWriter, int], object], **options: object) -> list[bytes]:
    """`COUNT` messages."""
    messages = []
    for index in range(COUNT):
        writer = CdrWriter(**options)  # type: ignore[arg-type]
        write(writer, index)
        messages.append(writer.message(filled=index % 2 == 0))
    return messages


def read(decoder: Decoder, messages: Sequence[bytes], path: str) -> list[object]:
    encoded = batch_of(messages, gaps=(5, 6))
    decoded = decoder.informed_by([encoded]).columns(encoded, [path])
    assert not decoded.bad.any(), decoded.reasons
    return values_of(decoded, path)


# --- alignment ---------------------------------------------------------------------------------------------------

STAMPED = (
    "struct Head { long sec; string frame; }; struct S { Head head; boolean on; sequence<double> raw; double x; };"
)


def write_doubles(writer: CdrWriter, index: int) -> None:
    writer.number("d", X[index], -X[index])


def write_mixed(writer: CdrWriter, index: int) -> None:
    writer.number("i", index).text("frame" * (index % 3)).number("?", True)
    writer.number("I", index % 4).number("d", *[0.5] * (index % 4)).number("d", X[index])


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("origin", [0, 4])
@pytest.mark.parametrize(
    ("text", "write"),
    [("struct S { double x, y; };", write_doubles), (STAMPED, write_mixed)],
    ids=["doubles", "mixed"],
)
def test_alignment_from_the_body_or_from_the_header(
    order: str, origin: int, text: str, write: Callable[[CdrWriter, int], None]
) -> None:
    messages = written(write, order=order, origin=origin)
    assert read(idl_decoder(text), messages, "x") == X.tolist()


def test_another_alignment_is_told_and_the_usual_one_is_not() -> None:
    for origin, told in ((0, []), (4, ["numbers are aligned from the encapsulation header on"])):
        encoded = batch_of(written(write_doubles, origin=origin))
        decoder = idl_decoder("struct S { double x, y; };").informed_by([encoded])
        found = decode_all(decoder, encoded).told
        assert [what.partition(",")[0] for what in found] == told
        assert list(found.values()) == [COUNT] * len(told)


def test_few_messages_of_another_alignment_are_marked_among_many() -> None:
    messages = written(write_doubles)
    other = written(write_doubles, origin=4)
    encoded = batch_of([*messages[:5], *other[:2], *messages[5:]])
    decoded = decode_all(idl_decoder("struct S { double x, y; };").informed_by([encoded]), encoded)
    assert np.flatnonzero(decoded.bad).tolist() == [5, 6]
    assert decoded.columns["x"].numbers[~decoded.bad].tolist() == X.tolist()
    assert decoded.reasons == {"its length isn't that of its definition": 2}


def test_without_eight_byte_numbers_nothing_tells_alignments_apart_and_nothing_needs_to() -> None:
    messages = written(lambda writer, index: writer.number("f", index, 0.5), origin=4)
    encoded = batch_of(messages)
    decoded = decode_all(idl_decoder("struct S { float x, y; };").informed_by([encoded]), encoded)
    assert values_of(decoded, "x") == list(range(COUNT))
    assert not decoded.told


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
@pytest.mark.parametrize("text", ["float32 x", "float64 x\nfloat32 y", "uint8 a\nfloat64 x", "string x"])
def test_a_definition_that_is_not_that_of_the_messages_is_refused(encoding: str, text: str) -> None:
    messages = [one[4 if encoding == "ros1" else 0 :] for one in written(lambda writer, i: writer.number("d", X[i]))]
    decoder = decoder_of(text, encoding=encoding)
    with pytest.raises(LogError, match=r"20 of the first 20 messages don't have the bytes .* from the same build"):
        decoder.informed_by([batch_of(messages[:11]), batch_of(messages[11:])])


def test_lengths_are_looked_at_in_every_batch_where_that_is_cheap() -> None:
    decoder = decoder_of("float64 x\nfloat64 y").informed_by([batch_of(written(write_doubles))])
    good = written(write_doubles)[1]
    decoded = decoder.columns(batch_of([good, good + bytes(4), good[:-4], good + bytes(3)]), ["x"])
    assert decoded.bad.tolist() == [False, True, True, False]
    # What follows the last field asked for is a string: nobody walks through it for that.
    decoder = decoder_of("float64 x\nstring name")
    decoded = decoder.columns(batch_of([CdrWriter().number("d", 1.5).message()]), ["x"])
    assert values_of(decoded, "x") == [1.5]


def test_what_takes_too_long_to_measure_is_taken_as_its_header_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(walk_module, "MAX_MEASURED_STEPS", 3)
    texts = [CdrWriter().number("d", x).number("I", 5) for x in X]
    for writer in texts:
        for _ in range(5):
            writer.text("abc")
    encoded = batch_of([writer.message() + bytes(8) for writer in texts])
    decoder = decoder_of("float64 x\nstring[] names")
    assert values_of(decoder.informed_by([encoded]).columns(encoded, ["x"]), "x") == X.tolist()
    monkeypatch.undo()
    with pytest.raises(LogError, match="don't have the bytes"):
        decoder.informed_by([encoded])


def test_a_definition_that_lacks_its_last_member_is_not_taken_for_another_alignment() -> None:
    # {double; long} under {double}: as many bytes as 4 of padding and a double.
    for write in (
        lambda writer, index: writer.number("d", X[index]).number("i", 7),
        lambda writer, index: writer.number("d", index).number("f", 25.3),
        lambda writer, index: writer.number("d", X[index]).number("i", 0),
        lambda writer, index: writer.number("d", 0.0).number("i", index),
    ):
        with pytest.raises(LogError, match=r"either it lacks a member, or numbers are aligned .* don't show which"):
            idl_decoder("struct S { double x; };").informed_by([batch_of(written(write))])


@pytest.mark.parametrize(("order", "code"), [("<", "d"), (">", "d"), ("<", "q")])
def test_whole_numbers_show_their_alignment_too(order: str, code: str) -> None:
    text = f"struct S {{ {'double' if code == 'd' else 'long long'} x, y; }};"
    messages = written(lambda writer, i: writer.number(code, i, 2**40 + i), order=order, origin=4)
    assert read(idl_decoder(text), messages, "y") == [2**40 + index for index in range(COUNT)]


def test_zeros_show_no_alignment() -> None:
    messages = written(lambda writer, _: writer.number("d", 0.0, 0.0), origin=4)
    with pytest.raises(LogError, match="don't show which"):
        idl_decoder("struct S { double x, y; };").informed_by([batch_of(messages)])


# --- XCDR2 -------------------------------------------------------------------------------------------------------

TYPES = """
enum Mode {{ OFF, ON }};
{inner} struct Point {{ boolean valid; double x; }};
{outer} struct S {{
    boolean on; double x; sequence<double> raw; sequence<Point> points; Point pair[2]; sequence<string> names;
    sequence<Mode> modes; string tag; Point last;
}};
"""


def write_all(writer: CdrWriter, index: int, *, outer: bool, inner: bool, enumerated: bool) -> None:
    def point(x: float) -> None:
        with writer.delimited(inner):
            writer.number("?", True).number("d", x)

    with writer.delimited(outer):
        writer.number("?", True).number("d", X[index]).number("I", index % 3).number("d", *[0.25] * (index % 3))
        with writer.delimited():
            writer.number("I", index % 3)
            for place in range(index % 3):
                point(place + 0.5)
        with writer.delimited():
            point(1.25)
            point(X[index])
        with writer.delimited():
            writer.number("I", 2).text("a" * (index % 4)).text("b")
        with writer.delimited(enumerated):
            writer.number("I", 2, 0, 1)
        writer.text("tag" * (index % 2))
        point(-X[index])


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("enumerated", [False, True])
@pytest.mark.parametrize("number", [0x06, 0x08, 0x10, 0x14])
@pytest.mark.parametrize(
    ("annotation", "inner"),
    [("", False), ("", True), ("@final", False), ("@appendable", True), ("@extensibility(APPENDABLE)", True)],
)
def test_xcdr2_is_read_whatever_has_a_delimiter(
    order: str, enumerated: bool, number: int, annotation: str, inner: bool
) -> None:
    outer = number in (0x08, 0x14)
    messages = written(
        lambda writer, index: write_all(writer, index, outer=outer, inner=inner, enumerated=enumerated),
        number=number,
        order=order,
    )
    decoder = idl_decoder(TYPES.format(inner=annotation, outer=""))
    encoded = batch_of(messages, gaps=(5, 6))
    decoded = decode_all(decoder.informed_by([encoded]), encoded)
    assert not decoded.bad.any(), decoded.reasons
    assert values_of(decoded, "x") == X.tolist()
    assert values_of(decoded, "raw") == [[0.25] * (index % 3) for index in range(COUNT)]
    assert values_of(decoded, "points[].x") == [[0.5, 1.5][: index % 3] for index in range(COUNT)]
    assert values_of(decoded, "pair[].x") == [[1.25, x] for x in X]
    assert values_of(decoded, "names") == [("a" * (index % 4), "b") for index in range(COUNT)]
    assert values_of(decoded, "modes") == [[0, 1]] * COUNT
    assert values_of(decoded, "last.x") == (-X).tolist()
    alone = decoder.informed_by([encoded]).columns(encoded, ["pair[].x"])
    assert values_of(alone, "pair[].x") == [[1.25, x] for x in X]


def test_stamps_of_ros_are_structs_with_a_delimiter_where_others_have_one() -> None:
    def write(writer: CdrWriter, index: int) -> None:
        with writer.delimited():
            with writer.delimited():
                writer.number("i", 5).number("I", index)
            writer.number("d", X[index])

    decoder = decoder_of("builtin_interfaces/Time stamp\nfloat64 x")
    messages = written(write, number=DELIMITED)
    assert read(decoder, messages, "stamp") == [5 * 10**9 + index for index in range(COUNT)]
    assert read(decoder, messages, "x") == X.tolist()


def test_a_delimiter_that_counts_other_bytes_shows_another_definition() -> None:
    def write(writer: CdrWriter, index: int) -> None:
        with writer.delimited():
            writer.number("d", X[index])
        writer.body[0] += 1

    with pytest.raises(LogError, match="don't have the bytes"):
        idl_decoder("struct S { double x; };").informed_by([batch_of(written(write, number=DELIMITED))])


def test_an_enum_has_the_bytes_that_it_is_bound_to() -> None:
    text = "@bit_bound(8) enum Mode { OFF, ON }; struct S { Mode a; Mode b; double x; };"
    messages = written(lambda writer, index: writer.number("B", 1, 0).number("d", X[index]))
    assert read(idl_decoder(text), messages, "x") == X.tolist()
    with pytest.raises(LogError, match="at most 32 bits"):
        idl_decoder("@bit_bound(64) enum Mode { OFF, ON }; struct S { Mode a; };")


# --- what isn't decoded ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [0x02, 0x0A, 0x12])
def test_parameter_lists_are_refused(number: int) -> None:
    with pytest.raises(LogError, match=r"parameter lists .*; record the type as @final or @appendable"):
        decoder_of("float64 x").informed_by([batch_of(written(write_doubles, number=number))])


def test_mutable_types_inside_are_refused() -> None:
    text = "@mutable struct P { double x; }; struct Q { sequence<P> p; }; struct S { Q q; double x; };"
    with pytest.raises(LogError, match="@mutable"):
        idl_decoder(text).informed_by([batch_of(written(write_doubles, number=XCDR2))])


def test_messages_without_header_are_refused() -> None:
    messages = [b'{"x": 1.5}'] * 5
    with pytest.raises(LogError, match="begin with 7b 22, which no header of CDR does"):
        decoder_of("float64 x").informed_by([batch_of(messages)])


def test_messages_of_another_encapsulation_are_marked_among_many() -> None:
    plain, other = written(write_doubles), written(write_doubles, number=XCDR2)
    decoder = decoder_of("float64 x\nfloat64 y").informed_by([batch_of([*plain, *other[:3]])])
    decoded = decoder.columns(batch_of([*other[:3], *plain]), ["x"])
    assert decoded.bad.tolist() == [True] * 3 + [False] * COUNT
    assert decoded.reasons == {"the header doesn't name plain CDR": 3}
    # A batch of nothing else is no reason to give up all that is beside it.
    assert decoder.columns(batch_of(other), ["x"]).bad.all()


def test_a_silent_channel_is_taken_as_plain() -> None:
    decoder = decoder_of("float64 x\nfloat64 y").informed_by([])
    assert values_of(decoder.columns(batch_of(written(write_doubles)), ["x"]), "x") == X.tolist()


WIDE = """float64 x
Part[] parts
float64 y
================================================================================
MSG: demo/Part
float64 z
wstring name
"""


def test_of_what_stands_beside_wide_strings_the_fields_before_them_are_read() -> None:
    decoder = decoder_of(WIDE)
    assert [info.path for info in decoder.fields] == ["x"]
    assert list(decoder.unread) == ["parts[].z", "y"]
    encoded = batch_of([CdrWriter().number("d", x).number("I", 0).number("d", 1.0).message() for x in X])
    informed = decoder.informed_by([encoded])
    assert values_of(informed.columns(encoded, ["x"]), "x") == X.tolist()
    with pytest.raises(LogError, match="y can't be decoded: numbers behind a wstring"):
        informed.columns(encoded, ["y"])


def test_a_list_of_wide_strings_hides_what_follows_too() -> None:
    decoder = decoder_of("float64 x\nwstring[] names\nfloat64 y")
    assert [info.path for info in decoder.fields] == ["x"]


def test_forms_are_measured_once_where_the_usual_one_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []
    fitting = cdr._fitting
    monkeypatch.setattr(cdr, "_fitting", lambda form, head: (tried.append(form), fitting(form, head))[1])
    decoder_of("float64 x\nfloat64 y").informed_by([batch_of(written(write_doubles))])
    assert len(tried) == 1
