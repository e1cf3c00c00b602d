"""Arrays in arrays: every element by its indices, in every encoding, against what was written."""

import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, message_factory
from google.protobuf.descriptor_pool import DescriptorPool
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from chladni.io.decoding import Decoder, make_decoder
from chladni.io.field_selector import resolve_fields
from chladni.io.message_path import parse_message_path
from chladni.io.selected_numbers import select
from chladni.signals.errors import LogError
from tests.io.decoding.definitions import Oracle, messages
from tests.io.decoding.encoded import SEPARATOR, CdrWriter, Encoded, batch_of, decoder_of

Reach = Callable[[Any, str], Any]
"""From a written message and a name to the value of that field."""


def nested(value: Any, names: Sequence[str], reach: Reach) -> Any:
    """What a message holds of a leaf: a number, or lists as deep as its path has brackets."""
    if not names:
        return value
    name, *below = names
    depth = name.count("[]")
    return in_lists(reach(value, name.removesuffix("[]" * depth)), depth, lambda one: nested(one, below, reach))


def in_lists(value: Any, depth: int, then: Callable[[Any], Any]) -> Any:
    return then(value) if depth == 0 else [in_lists(one, depth - 1, then) for one in value]


def elements(value: Any) -> Iterator[tuple[tuple[int, ...], Any]]:
    """Each element with its indices."""
    if isinstance(value, list | tuple | np.ndarray | bytes) or hasattr(value, "extend"):
        for index, one in enumerate(value):
            for below, element in elements(one):
                yield (index, *below), element
    else:
        yield (), value


def path_of(leaf: str, indices: Sequence[int]) -> str:
    marked = leaf
    for index in indices[: leaf.count("[]")]:
        marked = marked.replace("[]", f"[{index}]", 1)
    return f"/t.{marked}" + "".join(f"[{index}]" for index in indices[leaf.count("[]") :])


def assert_every_element(decoder: Decoder, encoded: Encoded, written: Sequence[Any], reach: Reach) -> int:
    """Read each element of each number by its own path; gives how many there were."""
    count = 0
    for info in decoder.fields:
        if info.kind != "number":
            continue
        found = [dict(elements(nested(value, info.path.split("."), reach))) for value in written]
        for indices in dict.fromkeys(one for message in found for one in message):
            path = path_of(info.path, indices)
            selector = resolve_fields(parse_message_path(path, ["/t"]), decoder.fields)
            decoded = decoder.columns(encoded, selector.leaves)
            assert not decoded.bad.any(), decoded.reasons
            selected = select(decoded, selector, ~decoded.bad)
            there = [indices in message for message in found]
            assert (selected.present is None and all(there)) or selected.present.tolist() == there, path
            assert selected.values[there].tolist() == [message[indices] for message in found if indices in message]
            count += 1
    return count


# --- ROS ---------------------------------------------------------------------------------------------------------


@given(root=st.sampled_from([1, 2]).flatmap(lambda ros: st.tuples(messages(ros=ros), st.just(ros))), data=st.data())
def test_any_ros_definition_gives_every_element_that_rosbags_wrote(root: Any, data: st.DataObject) -> None:
    message, ros = root
    oracle = Oracle(message, ros=ros)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    values = [oracle.value(rng, oracle.root) for _ in range(data.draw(st.integers(1, 4)))]
    encoded = batch_of([oracle.encode(value) for value in values], gaps=data.draw(st.sampled_from([(5,), (0, 9)])))
    decoder = make_decoder(
        message_encoding="cdr" if ros == 2 else "ros1",
        schema_name=f"demo/msg/{message.name}",
        schema_encoding="ros2msg" if ros == 2 else "ros1msg",
        schema_data=oracle.schema_text(),
    )
    assert_every_element(decoder, encoded, values, getattr)


def test_the_ros_2_decoder_of_mcap_finds_the_same_elements() -> None:
    text = (
        f"Group[] groups\nGroup[2] two\n{SEPARATOR}\nMSG: demo/Group\nfloat32[2] pair\nuint8 id\nPart[] parts\n"
        f"{SEPARATOR}\nMSG: demo/Part\nfloat64[] more\nstring label\nint16[3] fixed\n"
    )
    contents = [groups_of(index) for index in range(9)]
    schema = Schema(id=1, name="demo/msg/Demo", encoding="ros2msg", data=text.encode())
    one = DecoderFactory().decoder_for("cdr", schema)
    assert one is not None
    written = [one(content) for content in contents]
    assert assert_every_element(decoder_of(text), batch_of(contents), written, getattr) > 50


def groups_of(index: int) -> bytes:
    """A message whose lists all have lengths of their own, and numbers that occur once."""
    rng, writer = np.random.default_rng(index), CdrWriter()
    several = int(rng.integers(0, 4))
    for place in range(several + 2):
        if place == 0:
            writer.number("I", several)
        writer.number("f", *rng.integers(0, 2**20, 2)).number("B", place)
        parts = int(rng.integers(0, 3))
        writer.number("I", parts)
        for _ in range(parts):
            more = int(rng.integers(0, 3))
            writer.number("I", more).number("d", *rng.normal(size=more)).text("x" * more)
            writer.number("h", *rng.integers(-(2**15), 2**15, 3).tolist())
    return writer.message()


# --- IDL ---------------------------------------------------------------------------------------------------------

GRIDS = """
    typedef float row[3];
    struct Cell { double c[2]; string name; };
    struct S {
        double grid[2][3]; row rows[2]; Cell cells[2][2]; sequence<sequence<long>> ragged; sequence<row, 4> more[2];
    };
"""


def test_each_dimension_of_idl_has_its_index() -> None:
    written = []
    for start in range(4):
        number = iter(range(1000 * start, 10**9))
        take = [[next(number) for _ in range(3)] for _ in range(2)]
        rows = [[next(number) for _ in range(3)] for _ in range(2)]
        cells = [[{"c": [next(number), next(number)], "name": "n" * k} for k in range(2)] for _ in range(2)]
        ragged = [[next(number) for _ in range(k)] for k in range(start)]
        more = [[[next(number) for _ in range(3)] for _ in range(start)], []]
        written.append({"grid": take, "rows": rows, "cells": cells, "ragged": ragged, "more": more})
    encoded = []
    for value in written:
        writer = CdrWriter()
        writer.number("d", *np.ravel(value["grid"])).number("f", *np.ravel(value["rows"]))
        for cell in (one for row in value["cells"] for one in row):
            writer.number("d", *cell["c"]).text(cell["name"])
        writer.number("I", len(value["ragged"]))
        for one in value["ragged"]:
            writer.number("I", len(one)).number("i", *one)
        for one in value["more"]:
            writer.number("I", len(one)).number("f", *np.ravel(one))
        encoded.append(writer.message())
    decoder = make_decoder(
        message_encoding="cdr", schema_name="S", schema_encoding="omgidl", schema_data=GRIDS.encode()
    )
    assert {info.path: info.dims for info in decoder.fields} == {
        "grid[]": (2, 3), "rows[]": (2, 3), "cells[][].c": (2, 2, 2), "cells[][].name": (2, 2),
        "ragged[]": ("dynamic", "dynamic"), "more[][]": (2, "dynamic", 3),
    }  # fmt: skip
    assert assert_every_element(decoder, batch_of(encoded), written, dict.__getitem__) == 6 + 6 + 8 + 3 + 9


# --- JSON --------------------------------------------------------------------------------------------------------


def in_json(depth: int) -> st.SearchStrategy[Any]:
    numbers = st.floats(-1e6, 1e6) | st.integers(-100, 100)
    below = numbers if depth == 0 else in_json(depth - 1)
    record = st.fixed_dictionaries({"c": st.lists(numbers, max_size=3), "d": numbers})
    return st.lists(below, max_size=3) if depth else record


@given(written=st.lists(st.fixed_dictionaries({"a": in_json(1), "b": in_json(2), "e": in_json(0)}), min_size=1))
def test_lists_in_lists_of_json_give_every_element(written: list[Any]) -> None:
    encoded = batch_of([json.dumps(one).encode() for one in written])
    decoder = make_decoder(message_encoding="json", schema_name="", schema_encoding="", schema_data=b"")
    decoder = decoder.informed_by([encoded])
    assert_every_element(decoder, encoded, written, dict.__getitem__)


def test_a_schema_of_lists_in_lists_gives_every_element() -> None:
    number = {"type": "number"}
    rows = {"type": "array", "items": {"type": "array", "items": number}}
    cell = {"type": "object", "properties": {"rows": rows}}
    schema = {"type": "object", "properties": {"cells": {"type": "array", "items": cell}}}
    written = [{"cells": [{"rows": [[1.5, 2.5], [], [k]]}, {"rows": []}, {"rows": [[k + 0.5]]}]} for k in range(3)]
    decoder = make_decoder(
        message_encoding="json",
        schema_name="s",
        schema_encoding="jsonschema",
        schema_data=json.dumps(schema).encode(),
    )
    encoded = batch_of([json.dumps(one).encode() for one in written])
    assert assert_every_element(decoder, encoded, written, dict.__getitem__) == 4


# --- protobuf ----------------------------------------------------------------------------------------------------

FieldProto = descriptor_pb2.FieldDescriptorProto


def deep_class() -> tuple[Any, bytes]:
    """demo.A holds a list of B, each with packed arrays and a list of C, each with packed arrays."""
    file = descriptor_pb2.FileDescriptorProto(name="deep.proto", package="demo", syntax="proto3")
    for name, inner in (("A", "B"), ("B", "C"), ("C", None)):
        message = file.message_type.add(name=name)
        message.field.add(name="c", number=1, type=FieldProto.TYPE_DOUBLE, label=FieldProto.LABEL_REPEATED)
        message.field.add(name="n", number=2, type=FieldProto.TYPE_SINT32, label=FieldProto.LABEL_REPEATED)
        message.field.add(name="raw", number=3, type=FieldProto.TYPE_BYTES, label=FieldProto.LABEL_OPTIONAL)
        message.field.add(name="x", number=4, type=FieldProto.TYPE_FLOAT, label=FieldProto.LABEL_OPTIONAL)
        if inner is not None:
            message.field.add(
                name="b", number=5, type=FieldProto.TYPE_MESSAGE, label=FieldProto.LABEL_REPEATED,
                type_name=f".demo.{inner}",
            )  # fmt: skip
    pool = DescriptorPool()
    pool.Add(file)
    data = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.A")), data


def fill(message: Any, rng: np.random.Generator) -> None:
    message.c.extend(rng.normal(size=rng.integers(0, 3)))
    message.n.extend(rng.integers(-(2**31), 2**31, rng.integers(0, 3)).tolist())
    message.raw = rng.bytes(int(rng.integers(0, 3)))
    message.x = float(rng.integers(0, 100))
    if hasattr(message, "b"):
        for _ in range(int(rng.integers(0, 4))):
            fill(message.b.add(), rng)


@pytest.mark.parametrize("seed", range(5))
def test_lists_in_lists_of_protobuf_give_every_element(seed: int) -> None:
    kind, data = deep_class()
    rng, written = np.random.default_rng(seed), [kind() for _ in range(6)]
    for one in written:
        fill(one, rng)
    decoder = make_decoder(
        message_encoding="protobuf", schema_name="demo.A", schema_encoding="protobuf", schema_data=data
    )
    encoded = batch_of([one.SerializeToString() for one in written])
    assert assert_every_element(decoder, encoded, written, getattr) > 20


# --- damage and filters ------------------------------------------------------------------------------------------

TREE = (
    f"Branch[] b\n{SEPARATOR}\nMSG: demo/Branch\nstring name\nint32 kind\nstring[] names\nfloat64[] values\n"
    f"Leaf[] d\n{SEPARATOR}\nMSG: demo/Leaf\nstring id\nfloat64 x\n"
)


def tree_message(branches: Sequence[tuple[str, int, dict[str, float], dict[str, float]]]) -> bytes:
    writer = CdrWriter().number("I", len(branches))
    for name, kind, values, leaves in branches:
        writer.text(name).number("i", kind).number("I", len(values))
        for one in values:
            writer.text(one)
        writer.number("I", len(values)).number("d", *values.values()).number("I", len(leaves))
        for identity, x in leaves.items():
            writer.text(identity).number("d", x)
    return writer.message()


TREES = [
    [("left", 1, {"p": 1.0, "q": 2.0}, {"tip": 3.0, "root": 4.0}), ("right", 2, {"q": 5.0}, {"root": 6.0})],
    [("right", 2, {"q": 7.0, "p": 8.0}, {"root": 9.0, "tip": 10.0})],
    [],
    [("right", 2, {"p": 11.0}, {}), ("left", 1, {"q": 12.0}, {"tip": 13.0}), ("odd", 3, {"p": 14.0}, {})],
]


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ('/t.b[:]{name=="left"}.d[0].x', [3.0, None, None, 13.0]),
        ('/t.b[:]{name=="right"}.values[p]', [None, 8.0, None, 11.0]),
        ("/t.b[0].values[q]", [2.0, 7.0, None, None]),
        ('/t.b[:]{kind==2}.d[:]{id=="root"}.x', [6.0, 9.0, None, None]),
        ('/t.b[:]{kind<3}{name!="right"}.d[0].x', [3.0, None, None, 13.0]),
        ('/t.b[1].d[:]{id=="root"}.x', [6.0, None, None, None]),
    ],
)
def test_each_level_is_chosen_by_index_name_or_filter(path: str, expected: list[float | None]) -> None:
    damaged = tree_message(TREES[0])[:-3]
    encoded = batch_of([tree_message(TREES[0]), damaged, *(tree_message(one) for one in TREES[1:])])
    decoder = decoder_of(TREE)
    selector = resolve_fields(parse_message_path(path, ["/t"]), decoder.fields)
    decoded = decoder.columns(encoded, selector.leaves)
    assert decoded.bad.tolist() == [False, True, False, False, False]
    selected = select(decoded, selector, ~decoded.bad)
    there = np.asarray(selected.present)[~decoded.bad]
    assert there.tolist() == [one is not None for one in expected]
    assert selected.values[~decoded.bad][there].tolist() == [one for one in expected if one is not None]
    assert not selected.lost


def test_a_message_with_several_such_elements_is_lost_alone() -> None:
    twice = [("left", 1, {}, {"tip": 1.0}), ("left", 1, {}, {"tip": 2.0})]
    encoded = batch_of([tree_message(one) for one in (TREES[0], twice, TREES[3])])
    decoder = decoder_of(TREE)
    selector = resolve_fields(parse_message_path('/t.b[:]{name=="left"}.d[0].x', ["/t"]), decoder.fields)
    selected = select(decoder.columns(encoded, selector.leaves), selector, np.ones(3, np.bool_))
    assert selected.present is not None
    assert selected.present.tolist() == [True, False, True]
    assert selected.lost == {"several elements of one message pass b[].name == 'left'; add another filter": 1}


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("/t.b[0].values", r"b\[\].values is an array; name an element, /t.b\[0\].values\[0\]"),
        ("/t.b.values[0]", r"b\[\].values takes an index for each \[\]"),
        ("/t.b[0].values[0][0]", "takes an index for each array it is in; leave out the index"),
        ('/t.b[:]{names=="p"}.values[0]', "is an array; a filter on elements is written"),
        ("/t.b[:].values[:]{kind==1}", "have no field"),
        ("/t.b[:].values[0]", "a slice gives many numbers"),
    ],
)
def test_paths_that_fit_no_level_are_refused(path: str, told: str) -> None:
    with pytest.raises(LogError, match=told):
        resolve_fields(parse_message_path(path, ["/t"]), decoder_of(TREE).fields)


def test_a_message_that_ends_in_an_inner_list_costs_only_itself() -> None:
    text = f"Group[] g\n{SEPARATOR}\nMSG: demo/Group\nfloat64[] v\n"
    sound = CdrWriter().number("I", 2).number("I", 1).number("d", 4.0).number("I", 2).number("d", 5.0, 6.0).message()
    decoder = decoder_of(text)
    selector = resolve_fields(parse_message_path("/t.g[1].v[1]", ["/t"]), decoder.fields)
    for cut in range(8, len(sound)):
        decoded = decoder.columns(batch_of([sound, sound[:cut], sound]), ["g[].v"])
        assert decoded.bad.tolist() == [False, True, False], cut
        selected = select(decoded, selector, ~decoded.bad)
        assert selected.values[[0, 2]].tolist() == [6.0, 6.0]
