"""JSON messages to columns: the same rules on the fast path and message by message, against `json.loads`."""

import json
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from chladni.io.decoding import json as module
from chladni.io.decoding import make_decoder
from chladni.signals.errors import LogError
from tests.io.decoding.encoded import batch_of, decode_all, values_of

SCHEMA = {
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "value": {"type": "number"},
        "count": {"type": ["null", "integer"]},
        "on": {"type": "boolean"},
        "name": {"type": "string"},
        "pose": {"$ref": "#/$defs/vector"},
        "samples": {"type": "array", "items": {"type": "number"}},
        "points": {"type": "array", "items": {"$ref": "#/$defs/vector"}},
    },
    "$defs": {"vector": {"type": "object", "properties": {"x": {"type": "number"}, "y.z": {"type": "number"}}}},
}


def decoder_of(schema: object = SCHEMA):
    data = b"" if schema is None else json.dumps(schema).encode()
    encoding = "" if schema is None else "jsonschema"
    return make_decoder(message_encoding="json", schema_name="demo", schema_encoding=encoding, schema_data=data)


def message(index: int) -> dict[str, object]:
    return {
        "timestamp": {"sec": 1_700_000_000 + index, "nsec": 5},
        "value": 0.1 * index,
        "count": index,
        "on": index % 2 == 0,
        "name": f"sensor é {index % 3}",
        "pose": {"x": 1e-300 * index, "y.z": -0.5},
        "samples": [0.5] * (index % 3),
        "points": [{"x": 1.0, "y.z": float(index)}] * 2,
    }


@pytest.fixture(params=["arrow", "one by one"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways through the decoder; the results must not tell which was taken."""
    limit = 2 if request.param == "arrow" else 10**9
    monkeypatch.setattr(module, "FEW_MESSAGES", limit)
    monkeypatch.setattr(module, "SMALLEST_SPLIT", limit)
    return request.param


def test_the_schema_tells_the_fields() -> None:
    fields = {info.path: info for info in decoder_of().fields}
    assert list(fields) == [
        "timestamp", "value", "count", "on", "name", "pose.x", 'pose."y.z"', "samples", "points[].x",
        'points[]."y.z"',
    ]  # fmt: skip
    assert fields["timestamp"].kind == "time"
    assert fields["value"].dtype == np.float64
    assert fields["count"].dtype == np.int64
    assert fields["on"].kind == "bool"
    assert fields["samples"].array == "dynamic"


def test_without_a_schema_the_first_messages_tell_the_fields() -> None:
    first = [json.dumps({**message(index), "value": index, "empty": [], "none": None}).encode() for index in range(3)]
    decoder = decoder_of(None)
    assert decoder.fields == ()
    informed = decoder.informed_by([batch_of([b"broken"]), batch_of(first)])
    kinds = {info.path: (info.kind, info.dtype) for info in informed.fields}
    assert kinds["timestamp"] == ("time", np.int64)
    assert kinds["value"] == ("number", np.float64), "a later message may hold a fraction"
    assert kinds["points[].x"] == ("number", np.float64)
    assert "empty" not in kinds
    with pytest.raises(LogError, match="no field 'value'"):
        decoder.columns(batch_of(first), ["value"])


@pytest.mark.parametrize("gaps", [(31,), (31, 7), (0,)])
def test_every_kind_of_field_is_read(way: str, gaps: tuple[int, ...]) -> None:
    messages = [message(index) for index in range(20)]
    encoded = batch_of([json.dumps(one, ensure_ascii=False).encode() for one in messages], gaps=gaps)
    decoder = decoder_of()
    for chosen in (decoder.fields, [info for info in decoder.fields if "[]" not in info.path]):
        decoded = decoder.columns(encoded, [info.path for info in chosen])
        assert not decoded.bad.any()
        assert values_of(decoded, "timestamp") == [(1_700_000_000 + i) * 10**9 + 5 for i in range(20)]
        assert values_of(decoded, "value") == [0.1 * i for i in range(20)]
        assert values_of(decoded, "count") == list(range(20))
        assert values_of(decoded, "on") == [i % 2 == 0 for i in range(20)]
        assert values_of(decoded, "name") == [f"sensor é {i % 3}" for i in range(20)]
        assert len(decoded.columns["name"].strings.table) == 3
        assert values_of(decoded, 'pose."y.z"') == [-0.5] * 20
        assert values_of(decoded, "samples") == [[0.5] * (i % 3) for i in range(20)]
    assert values_of(decode_all(decoder, encoded), 'points[]."y.z"') == [[float(i)] * 2 for i in range(20)]


BAD_VALUES = [
    b"null", b'{"value": 1', b"", b"7", b"[1]",
    b'{"value": 01}', b'{"value": 1.}', b'{"value": 1,}', b'{"value": 1} x',
    b'{"value": 1}{"value": 2}', b'{"value": 1}\n{"value": 2}', b'{"value": 1}\x00}', b'{"value": 1, "w": "\xff"}',
    b'{"value": 1, "w": "a\nb"}', b"\xff\xfe{\x00}\x00", b'\xef\xbb\xbf{"value": 1}',
    b'{"value": 1, "w": ' + b"[" * 200_000 + b"]" * 200_001 + b"}",
]  # fmt: skip


@pytest.mark.parametrize("bad", BAD_VALUES, ids=range(len(BAD_VALUES)))
def test_a_bad_message_is_marked_and_its_neighbours_are_read(way: str, bad: bytes) -> None:
    good = [json.dumps({"value": index}).encode() for index in range(6)]
    decoded = decoder_of().columns(batch_of([*good[:3], bad, *good[3:]], gaps=(31,)), ["value"])
    assert decoded.bad.tolist() == [False] * 3 + [True] + [False] * 3
    assert decoded.columns["value"].numbers[~decoded.bad].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert sum(decoded.reasons.values()) == 1


@pytest.mark.parametrize("without", ["null", "NaN", None])
@pytest.mark.parametrize("field", ["value", "count", "on", "pose.x"])
def test_a_number_that_a_message_lacks_is_missing_and_those_beside_it_are_read(
    way: str, field: str, without: str | None
) -> None:
    # Fields of JSON objects are optional unless a schema says otherwise, and null is how many writers write NaN.
    parent, _, name = field.rpartition(".")
    lacking = {**message(4), "pose": dict(message(4)["pose"])}
    place = lacking[parent] if parent else lacking
    place[name] = "HERE"
    if without is None:
        del place[name]
    messages = [json.dumps(one).replace('"HERE"', str(without)).encode() for one in (message(4), lacking, message(4))]
    beside = "timestamp"
    decoded = decoder_of().columns(batch_of(messages), [field, beside])
    assert not decoded.bad.any(), decoded.reasons
    assert np.isnan(decoded.columns[field].numbers.astype(np.float64)).tolist() == [False, True, False]
    assert values_of(decoded, beside) == [1_700_000_004 * 10**9 + 5] * 3


def test_an_object_that_a_message_lacks_has_no_numbers(way: str) -> None:
    good = message(4)
    lacking = {name: value for name, value in good.items() if name != "pose"}
    messages = [json.dumps(one).encode() for one in (good, lacking, {**good, "pose": None}, good)]
    decoded = decoder_of().columns(batch_of(messages), ["pose.x", "value"])
    assert not decoded.bad.any(), decoded.reasons
    assert np.isnan(decoded.columns["pose.x"].numbers).tolist() == [False, True, True, False]


def test_true_and_false_are_one_and_zero_where_the_schema_says_number(way: str) -> None:
    messages = [b'{"value": true, "count": false}', b'{"value": 7, "count": true}', b'{"value": false, "count": 3}']
    decoded = decoder_of().columns(batch_of(messages), ["value", "count"])
    assert not decoded.bad.any(), decoded.reasons
    assert values_of(decoded, "value") == [1.0, 7.0, 0.0]
    assert values_of(decoded, "count") == [0, 1, 3]


def test_names_that_a_path_would_read_otherwise_are_quoted() -> None:
    messages = batch_of([json.dumps({"we ird": 1.5, "a.b": 2.5, "a": {"b": 3.5}, "y": 4.5}).encode()] * 3)
    decoder = decoder_of(None).informed_by([messages])
    assert [info.path for info in decoder.fields] == ['"we ird"', '"a.b"', "a.b", "y"]
    decoded = decode_all(decoder, messages)
    assert [values_of(decoded, info.path)[0] for info in decoder.fields] == [1.5, 2.5, 3.5, 4.5]


def test_messages_that_together_look_like_others_are_not_mistaken(way: str) -> None:
    # One message with two objects and one with none would keep the count of objects right.
    messages = [b'{"value": 1}{"value": 2}', b" ", b'{"value": 3}']
    decoded = decoder_of().columns(batch_of(messages), ["value"])
    assert decoded.bad.tolist() == [True, True, False]
    assert decoded.columns["value"].numbers[2] == 3.0


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("timestamp", '{"sec": 1, "nsec": 2, "nanosec": 3}'), ("timestamp", '{"sec": 1.5, "nsec": 2}'),
        ("timestamp", '{"sec": 1}'), ("timestamp", '{"nsec": 1}'), ("timestamp", '{"sec": 10000000000, "nsec": 1}'),
        ("timestamp", "7"), ("timestamp", "null"),
    ],
)  # fmt: skip
def test_a_message_without_its_time_is_bad(way: str, field: str, text: str) -> None:
    good = json.dumps(message(4)).encode()
    bad = json.dumps({**message(4), field: "HERE"}).replace('"HERE"', text).encode()
    decoded = decoder_of().columns(batch_of([good, bad, good]), [field])
    assert decoded.bad.tolist() == [False, True, False], decoded.reasons


MISSING, FRACTION = "no number where one belongs", "the schema calls count an integer, which its values aren't"
QUOTED, NO_LIST, NO_OBJECT = "numbers in quotes", "no list where one belongs", "no object where one belongs"


@pytest.mark.parametrize(
    ("field", "text", "read", "told"),
    [
        ("value", "Infinity", [np.inf], None), ("value", "-1e400", [-np.inf], None),
        ("value", "1" * 400, [np.inf], None), ("value", "[1]", [np.nan], MISSING),
        ("value", '{"x": 1}', [np.nan], MISSING), ("value", '"n/a"', [np.nan], MISSING),
        ("value", '"0.5"', [0.5], QUOTED), ("value", '" -1e3 "', [-1000.0], QUOTED),
        ("value", '"nan"', [np.nan], QUOTED), ("value", '"1_000"', [np.nan], MISSING),
        ("value", '"0,5"', [np.nan], MISSING),
        ("count", "1.5", [1.5], FRACTION), ("count", "9223372036854775808", [2.0**63], None),
        ("count", "-1e400", [-np.inf], None), ("count", '"7"', [7], QUOTED),
        ("on", "1", [np.nan], "no bool where one belongs"), ("pose.x", "5", [np.nan], NO_OBJECT),
        ("samples", "[1, null]", [1.0, np.nan], None), ("samples", '["a", 2]', [np.nan, 2.0], MISSING),
        ("samples", "[[1]]", [np.nan], MISSING), ("samples", "[1, Infinity]", [1.0, np.inf], None),
        ("samples", "null", [], None), ("samples", "5", [], NO_LIST), ("points[].x", "{}", [], NO_LIST),
    ],
)  # fmt: skip
def test_a_number_of_another_type_costs_only_itself(
    way: str, field: str, text: str, read: list[float], told: str | None
) -> None:
    name = field.partition(".")[0].removesuffix("[]")
    good = json.dumps(message(4)).encode()
    odd = json.dumps({**message(4), name: "HERE"}).replace('"HERE"', text).encode()
    decoded = decoder_of().columns(batch_of([good, odd, good]), [field, "timestamp"])
    assert not decoded.bad.any(), decoded.reasons
    found = values_of(decoded, field)[1]
    assert np.array_equal(found if isinstance(found, list) else [found], read, equal_nan=True)
    assert values_of(decoded, field)[::2] == values_of(decoder_of().columns(batch_of([good] * 2), [field]), field)
    assert len(decoded.told) == (told is not None)
    assert all(told in what for what in decoded.told if told is not None)


def test_unusual_but_sound_messages_are_read(way: str) -> None:
    messages = [
        b'{"value": 1, "w": NaN}', b'{"value": 9, "value": 2}', b'\r\n {"value":\n3}\n\t', b'{"\\u0076alue": 4e0}',
        b'{"value": 9007199254740993}', b'{"w": {"value": 7}, "value": -0}',
    ]  # fmt: skip
    decoded = decoder_of().columns(batch_of(messages), ["value"])
    assert not decoded.bad.any(), decoded.reasons
    assert decoded.columns["value"].numbers.tolist() == [1.0, 2.0, 3.0, 4.0, 9007199254740992.0, 0.0]


def test_both_names_of_nanoseconds_are_known(way: str) -> None:
    one = b'{"timestamp": {"sec": 2, "nanosec": 7}}'
    assert values_of(decoder_of().columns(batch_of([one] * 3), ["timestamp"]), "timestamp") == [2_000_000_007] * 3
    mixed = [one, b'{"timestamp": {"sec": 2, "nsec": 8}}', one]
    decoded = decoder_of().columns(batch_of(mixed), ["timestamp"])
    assert values_of(decoded, "timestamp") == [2_000_000_007, 2_000_000_008, 2_000_000_007]


def test_a_whole_float_is_an_integer(way: str) -> None:
    decoded = decoder_of().columns(batch_of([b'{"count": 5.0}', b'{"count": 7}']), ["count"])
    assert values_of(decoded, "count") == [5, 7]


def test_messages_outside_the_buffer_are_marked(way: str) -> None:
    encoded = batch_of([b'{"value": 1}'] * 3)
    encoded.offsets[1] = 10**15
    decoded = decoder_of().columns(encoded, ["value"])
    assert decoded.bad.tolist() == [False, True, False]


def test_no_messages_give_no_values(way: str) -> None:
    decoded = decode_all(decoder_of(), batch_of([]))
    assert values_of(decoded, "value") == []
    assert values_of(decoded, "name") == []


@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=30))
def test_floats_are_rounded_as_json_rounds_them(values: list[float]) -> None:
    texts = [text for value in values for text in (repr(value), f"{value:.25e}", f"{value:.17g}")]
    messages = [b'{"value": ' + text.encode() + b"}" for text in texts]
    expected = np.array([json.loads(one)["value"] for one in messages], np.float64)
    span = module._span(batch_of(messages), np.arange(len(messages)))
    (found,) = module.read_by_arrow(span, [decoder_of()._leaves["value"]]) or [None]
    if not np.isfinite(expected).all():
        return  # of a number beyond the largest double the parser may think as it likes
    assert found.values.tobytes() == expected.tobytes() or (found.values == expected).all()


@given(
    content=st.lists(st.binary(max_size=12), min_size=3, max_size=8),
    at=st.integers(0, 200),
    cut=st.integers(0, 12),
)
def test_damaged_bytes_give_what_the_rules_give(content: list[bytes], at: int, cut: int) -> None:
    messages = [json.dumps({"value": index, "samples": [index] * 2}).encode() for index in range(len(content))]
    damaged = []
    for one, junk in zip(messages, content, strict=True):
        place = at % len(one)
        damaged.append(one[:place] + junk + one[place + cut :])
    block = module._Block([decoder_of()._leaves[path] for path in ("value", "samples")])
    block._one_by_one(damaged)
    span = module._span(batch_of(damaged), np.arange(len(damaged)))
    found = module.read_by_arrow(span, block.leaves)
    if found is None:
        return
    assert not block.bad[0].any(), "the fast path may refuse more than the rules, never less"
    for fast, slow in zip(found, (column[0] for column in block.found), strict=True):
        # A key that was damaged is a number that is missing.
        assert np.array_equal(fast.values, slow.values, equal_nan=True)


@pytest.mark.parametrize(
    ("schema", "told"),
    [
        (b"{", "isn't readable JSON"),
        (b"\xff", "isn't readable JSON"),
        (b"[" * 100_000, "isn't readable JSON"),
        (json.dumps({"type": "object", "properties": {"a": {"$ref": "#"}}}).encode(), "in a circle"),
    ],
)
def test_a_malformed_schema_leaves_the_fields_to_the_messages_with_a_word(schema: bytes, told: str) -> None:
    decoder = make_decoder(message_encoding="json", schema_name="d", schema_encoding="jsonschema", schema_data=schema)
    messages = batch_of([b'{"x": 0.5}'] * 3)
    decoded = decode_all(decoder.informed_by([messages]), messages)
    assert values_of(decoded, "x") == [0.5] * 3
    ((what, count),) = decoded.told.items()
    assert told in what
    assert "the fields are those of the first messages" in what
    assert count == 3


def test_parts_that_refer_to_the_next_one_twice_are_given_up_in_time() -> None:
    parts = {f"p{n}": {"properties": {k: {"$ref": f"#/$defs/p{n + 1}"} for k in "ab"}} for n in range(25)}
    schema = {"$defs": {**parts, "p25": {"type": "number"}}, "$ref": "#/$defs/p0"}
    messages = batch_of([b'{"x": 0.5}'])
    (what,) = decode_all(decoder_of(schema).informed_by([messages]), messages).told
    assert "more than" in what


def test_a_schema_in_another_language_is_not_needed() -> None:
    decoder = make_decoder(
        message_encoding="json", schema_name="d", schema_encoding="ros2msg", schema_data=b"float64 x"
    )
    assert [info.path for info in decoder.informed_by([batch_of([b'{"x": 0.5}'])]).fields] == ["x"]


@pytest.mark.parametrize("schema", [{}, {"type": "object"}, {"properties": {"a": {}}}, True, {"$ref": "other.json"}])
def test_schemas_that_tell_nothing_leave_it_to_the_messages(schema: object) -> None:
    decoder = decoder_of(schema)
    assert decoder.fields == ()
    informed = decoder.informed_by([batch_of([b'{"a": [1]}'])])
    assert [(info.path, info.array) for info in informed.fields] == [("a", "dynamic")]


def test_a_list_of_unknown_things_is_no_field() -> None:
    parts = {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}
    schema = {"properties": {"a": {"type": "array"}, "b": {"title": "duration", "properties": parts}}}
    assert [(info.path, info.kind) for info in decoder_of(schema).fields] == [("b", "duration")]


@pytest.mark.parametrize(("file", "topic"), [("silverbox.mcap", "/input"), ("json_plc.mcap", "/eip/level")])
def test_measured_logs_read_as_json_reads_them(shared_data: Path, file: str, topic: str) -> None:
    with (shared_data / file).open("rb") as stream:
        first = islice(make_reader(stream).iter_messages(topics=[topic]), 4000)
        schemas, messages = zip(*((schema, record.data) for schema, _, record in first), strict=True)
    schema = schemas[0]
    decoder = make_decoder(
        message_encoding="json", schema_name=schema.name, schema_encoding=schema.encoding, schema_data=schema.data
    )
    decoded = decoder.columns(batch_of(messages), ["value"])
    assert not decoded.bad.any()
    assert decoded.columns["value"].numbers.tolist() == [json.loads(one)["value"] for one in messages]


# --- what messages show beyond their schema, or against it --------------------------------------------------------


def informed(properties: dict[str, object] | None, messages: list[dict[str, object]]):
    schema = None if properties is None else {"type": "object", "properties": properties}
    encoded = batch_of([json.dumps(one).encode() for one in messages])
    return decoder_of(schema).informed_by([encoded]), encoded


def kind_of(stated: object, *values: object) -> tuple[str, object] | None:
    """Kind and type of a field with such values under such a schema; None where there is no field."""
    properties = None if stated is None else {"x": stated}
    decoder, _ = informed(properties, [{"x": value} for value in values])
    return next(((info.kind, info.dtype) for info in decoder.fields), None)


INTEGER, NUMBER, BOOLEAN, STRING = ({"type": name} for name in ("integer", "number", "boolean", "string"))
FLOAT64, INT64 = ("number", np.dtype(np.float64)), ("number", np.dtype(np.int64))


@pytest.mark.parametrize(
    ("stated", "values", "expected"),
    [
        (INTEGER, [0, 0.5], FLOAT64), (INTEGER, [0, 5.0], INT64), (INTEGER, [None, True], INT64),
        (NUMBER, [0, 1], FLOAT64), (NUMBER, ["n/a", "0.5"], FLOAT64), (NUMBER, [True, False], FLOAT64),
        (BOOLEAN, [False, 0.5], FLOAT64), (STRING, ["", "a"], ("string", None)), (STRING, [1.5], FLOAT64),
        (STRING, ["0.5", "1.5"], ("string", None)), ({"type": "null"}, [None, 0.5], FLOAT64),
        ({"type": "null"}, [None], None), ({"type": "array", "items": INTEGER}, [[1], [0.5]], FLOAT64),
        (None, [0, 1], FLOAT64), (None, [2**53 + 1, 5], INT64), (None, [1e300, 0], FLOAT64),
        (None, ["n/a", 0.5], FLOAT64), (None, ["0.5", "-1e3", None], FLOAT64),
        (None, ["007", "12"], ("string", None)),
        (None, ["0.5", "off"], ("string", None)), (None, [True, None], ("bool", np.dtype(np.bool_))),
        (None, [True, 0.5], FLOAT64), (None, [[], [1]], FLOAT64),
    ],
)  # fmt: skip
def test_values_tell_the_kind_where_the_schema_is_silent_or_wrong(
    stated: object, values: list[object], expected: object
) -> None:
    assert kind_of(stated, *values) == expected


def test_an_object_where_the_schema_says_number_is_read_with_a_word() -> None:
    decoder, messages = informed({"x": NUMBER, "y": NUMBER}, [{"x": {"v": 0.5}, "y": 1.5}] * 3)
    decoded = decode_all(decoder, messages)
    assert values_of(decoded, "x.v") == [0.5] * 3
    assert values_of(decoded, "y") == [1.5] * 3
    assert decoded.told == {
        "the schema calls x a number, which its values aren't; they are read as they are": 3,
    }
    assert decoder.columns(messages, ["y"]).told == {}


def test_fields_that_the_schema_does_not_mention_are_read_too() -> None:
    decoder, messages = informed(
        {"x": NUMBER, "pose": {"properties": {"a": NUMBER}}}, [{"pose": {"b": 1.5}, "z": 2.5}]
    )
    assert [info.path for info in decoder.fields] == ["x", "pose.a", "pose.b", "z"]
    assert values_of(decode_all(decoder, messages), "pose.b") == [1.5]


def test_integers_that_turn_into_fractions_later_are_read_with_a_word(way: str) -> None:
    first, later = ([{"x": value, "n": 5} for value in values] for values in ([0, 1], [2, 0.25, 3]))
    decoder, _ = informed({"x": INTEGER, "n": INTEGER}, first)
    decoded = decode_all(decoder, batch_of([json.dumps(one).encode() for one in later]))
    assert values_of(decoded, "x") == [2.0, 0.25, 3.0]
    assert values_of(decoded, "n") == [5, 5, 5]
    assert decoded.told == {
        "the schema calls x an integer, which its values aren't; they are read as they are": 3,
    }


def test_nanoseconds_since_1970_keep_their_last_digit_without_a_schema(way: str) -> None:
    stamps = [1_700_000_000_123_456_789 + index for index in range(5)]
    decoder, messages = informed(None, [{"t": stamp} for stamp in stamps])
    assert values_of(decode_all(decoder, messages), "t") == stamps


@pytest.mark.parametrize("content", [b"0.5", b"[0.5]", b"null", b'"text"'])
def test_messages_that_name_no_value_are_refused(content: bytes) -> None:
    with pytest.raises(LogError, match="none of the first 3 messages is JSON that names its values"):
        decoder_of(None).informed_by([batch_of([content] * 3)])


def test_messages_that_are_no_json_are_refused() -> None:
    with pytest.raises(LogError, match="none of the first 2 messages is JSON, so"):
        decoder_of().informed_by([batch_of([b"\x00\x01"] * 2)])


# --- one odd value, or message, among many -----------------------------------------------------------------------


@pytest.mark.parametrize("text", ["null", "5", '"\\ud800"', "[]", "{}"])
def test_what_is_no_text_is_empty_and_costs_no_number(way: str, text: str) -> None:
    odd = json.dumps({**message(4), "name": "HERE"}).replace('"HERE"', text).encode()
    decoded = decoder_of().columns(batch_of([json.dumps(message(4)).encode(), odd]), ["name", "value"])
    assert not decoded.bad.any(), decoded.reasons
    assert values_of(decoded, "name") == ["sensor é 1", ""]
    assert values_of(decoded, "value") == [0.4, 0.4]
    assert list(decoded.told) == ([] if text == "null" else ["name: no text where one belongs; it counts as missing"])


ELEMENTS = {
    "numbers": ([1.5, 2.5], [np.nan]), "integers": ([2**60, 3], [np.nan]), "switches": ([True, False], [np.nan]),
    "texts": (["a", "b"], [""]), "times": ([{"sec": 1, "nsec": 2}, {"sec": 3, "nsec": 4}], [np.nan]),
    "lists": ([[1.0, 2.0], [3.0]], []), "objects": ([{"x": 1.0}, {"x": 2.0}], [np.nan]),
}  # fmt: skip


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_null_in_a_list_leaves_the_other_elements(way: str, kind: str, place: int) -> None:
    """Null is no value: NaN, an empty text, an empty list."""
    elements, missing = ELEMENTS[kind]
    whole, odd = list(elements), list(elements)
    odd.insert(place, None)
    messages = batch_of([json.dumps({"a": one}).encode() for one in (whole, odd, whole)])
    decoder = decoder_of(None).informed_by([messages])
    (path,) = (info.path for info in decoder.fields)
    decoded = decoder.columns(messages, [path])
    assert not decoded.bad.any(), decoded.reasons
    first, second, third = ([*one[0]] if isinstance(one, list) and one and isinstance(one[0], tuple) else list(one)
                            for one in values_of(decoded, path))  # fmt: skip
    assert first == third
    lengths = [len(one) if isinstance(one, list) else 1 for one in elements]
    before = sum(lengths[:place])
    np.testing.assert_array_equal(second, [*first[:before], *missing, *first[before:]])
    assert [lengths_of[1].tolist() for lengths_of in [decoded.columns[path].lengths] if kind == "lists"] == (
        [[2, 1, *[*lengths[:place], 0, *lengths[place:]], 2, 1]] if kind == "lists" else []
    )


@pytest.mark.parametrize("odd", [0, 1, 5])
@pytest.mark.parametrize("what", [1.5, "text", [1], {"y": 1}, None, True])
def test_one_message_of_another_kind_hides_no_field(way: str, odd: int, what: object) -> None:
    """The kind that most of the first messages show counts."""
    for usual, path in (({"x": 2.5}, "a.x"), ([2.5], "a"), (2.5, "a")):
        contents = [{"a": what if index == odd else usual, "b": index} for index in range(6)]
        messages = batch_of([json.dumps(one).encode() for one in contents])
        decoder = decoder_of(None).informed_by([messages])
        assert {"b", path} <= {info.path for info in decoder.fields}
        decoded = decoder.columns(messages, [path, "b"])
        assert not decoded.bad.any()
        assert values_of(decoded, "b") == list(range(6))
        values = [one if isinstance(one, list) else [one] for one in values_of(decoded, path)]
        assert all(one == [2.5] for index, one in enumerate(values) if index != odd)


def test_names_that_are_no_unicode_are_told_and_cost_nothing_else(way: str) -> None:
    contents = [b'{"a\\ud800": 1, "a\\udc00": {"x": 2}, "a\\\\ud800": 3, "b": 4, "\\ud83d\\ude00": 5}'] * 3
    decoder = decoder_of(None).informed_by([batch_of(contents)])
    assert [info.path for info in decoder.fields] == ['"a\\\\ud800"', "b", "\U0001f600"]
    assert list(decoder.unread) == ["a\\ud800", "a\\udc00.x"]
    assert all("half a character" in why for why in decoder.unread.values())
    decoded = decode_all(decoder, batch_of(contents))
    assert [values_of(decoded, info.path)[0] for info in decoder.fields] == [3.0, 4.0, 5.0]


@pytest.mark.parametrize("digits", [400, 4300, 5000])
def test_numbers_of_any_length_are_read(way: str, digits: int) -> None:
    contents = [b'{"a": %s, "b": 1}' % (b"1" * digits), b'{"a": -%s, "b": 2}' % (b"9" * digits), b'{"a": 3, "b": 3}']
    decoder = decoder_of(None).informed_by([batch_of(contents[2:])])
    decoded = decode_all(decoder, batch_of(contents))
    assert values_of(decoded, "a") == [np.inf, -np.inf, 3.0]
    assert values_of(decoded, "b") == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(("opened", "closed"), [('{"a": ', "}"), ("[", "]")])
def test_what_is_nested_too_deep_costs_only_itself(way: str, opened: str, closed: str) -> None:
    for depth in (80, 20_000):
        odd = b'{"b": 1, "deep": %s1%s}' % (opened.encode() * depth, closed.encode() * depth)
        messages = batch_of([odd, b'{"b": 2, "deep": null}', b'{"b": 3}'])
        decoder = decoder_of(None).informed_by([messages])
        decoded = decoder.columns(messages, ["b"])
        sound = np.flatnonzero(~decoded.bad).tolist()
        assert sound[-2:] == [1, 2]
        assert [values_of(decoded, "b")[index] for index in sound] == [index + 1.0 for index in sound]
        # What Python can parse is told to be too deep; what it can't tells nothing of itself.
        assert bool(decoder.unread) == (depth == 80)


def test_a_long_number_before_what_is_nested_too_deep_costs_only_its_message(way: str) -> None:
    odd = b'{"b": 1, "n": %s, "deep": %s%s}' % (b"1" * 5000, b"[" * 20_000, b"]" * 20_000)
    messages = batch_of([odd, b'{"b": 2}', b'{"b": 3}'])
    decoded = decoder_of(None).informed_by([messages]).columns(messages, ["b"])
    assert values_of(decoded, "b")[1:] == [2.0, 3.0]
    assert decoded.bad.tolist() == [way == "one by one", False, False]
