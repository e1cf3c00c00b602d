import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.elements.catalogue import ELEMENTS
from chladni.models.schemes.block import Block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_tables import read_scheme, scheme_from_tables, scheme_tables
from chladni.models.schemes.wiring import MAX_BLOCKS
from chladni.signals.errors import ModelError


def tables() -> dict[str, Any]:
    return {
        "input": [{"name": "reference", "unit": "V", "channel": "/command.data"}, {"name": "load"}],
        "block": [
            {
                "name": "regulator",
                "kind": "pi",
                "parameters": {"gain": "35 N/V", "integral_time": "9900 ms"},
                "input": ["+reference", "-sensor"],
            },
            {"name": "plant", "num": [2], "den": [0.7, 1], "delay": "20 ms", "input": ["+regulator", "-drag"]},
            {"name": "drag", "kind": "p", "input": "load", "when_off": "cut", "on": False, "unit": "N m"},
            {"name": "sensor", "kind": "pt1", "parameters": {"time_constant": 0.01}, "input": ["plant"]},
        ],
        "output": [
            {"name": "speed", "at": "plant", "channel": "/joint.velocity[0]", "unit": "rad/s"},
            {"name": "sensor"},
        ],
        "tolerance": {"default": "10 %", "plant.den_s1": 0.3},
        "derivative_filter": "2 ms",
    }


def test_tables_become_the_scheme_that_they_say() -> None:
    model = scheme_from_tables("loop", tables())
    assert (model.name, model.derivative_filter_s) == ("loop", 0.002)
    assert model.parameters["regulator.gain"].value == 35.0
    assert model.parameters["regulator.integral_time"].value == pytest.approx(9.9)
    assert model.parameters["plant.delay"].value == 0.02
    assert model.parameters["sensor.time_constant"].tolerance == 0.1
    assert model.parameters["plant.den_s1"].tolerance == 0.3
    assert not model.parameters.unusual()
    assert (model.block("drag").on, model.block("drag").when_off, model.block("drag").unit) == (False, "cut", "N m")
    assert model.inputs[0] == Terminal(name="reference", unit="V", channel="/command.data")
    assert [point.terminal.name for point in model.points][:2] == ["speed", "sensor"]


def test_a_scheme_survives_its_tables() -> None:
    model = scheme_from_tables("loop", tables())
    again = scheme_from_tables("loop", scheme_tables(model))
    frequency_hz = np.array([0.01, 0.3, 7.0])
    np.testing.assert_array_equal(again.frequency_response(frequency_hz), model.frequency_response(frequency_hz))
    assert scheme_tables(again) == scheme_tables(model)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_every_kind_can_be_named_in_a_file(kind: str) -> None:
    numbers = {name: item.value * 1.5 for name, item in ELEMENTS[kind].parameters.items()}
    content = {
        "input": [{"name": "u"}],
        "block": [{"name": "b", "kind": kind, "parameters": numbers, "input": ["u"]}],
    }
    assert scheme_tables(scheme_from_tables("x", content))["block"][0]["parameters"] == numbers


def test_a_state_space_has_no_table() -> None:
    content = StateSpace(
        a=np.zeros((0, 0)),
        b=np.zeros((0, 1)),
        c=np.zeros((1, 0)),
        d=np.ones((1, 1)),
        inputs=(Terminal(name="u", unit="1"),),
        outputs=(Terminal(name="y", unit="1"),),
        states=(),
    )
    with pytest.raises(ModelError, match="block 'b' is a state space; files hold elements and num/den"):
        scheme_tables(SchemeModel(name="x", blocks=(Block(name="b", content=content),)))


def with_change(path: tuple[str | int, ...], value: object) -> dict[str, Any]:
    changed: Any = tables()
    target = changed
    for part in path[:-1]:
        target = target[part]
    target[path[-1]] = value
    return changed


MISTAKES: list[tuple[tuple[str | int, ...], object, tuple[str | int, ...], str]] = [
    (("blocks",), [], ("blocks",), "unknown key; did you mean block"),
    (("block",), {}, ("block",), "must be a list of tables [[block]]"),
    (("block",), [{}] * (MAX_BLOCKS + 1), ("block",), "there are 1001; at most 1000"),
    (("block", 0, "name"), "2b", ("block", 0, "name"), "found '2b'; must be a letter"),
    (("block", 0, "name"), "ground", ("block", 0, "name"), "found 'ground'; must be"),
    (("block", 0, "name"), 7, ("block", 0, "name"), "found 7; must be a letter"),
    (("block", 0, "kind"), "pj", ("block", 0, "kind"), "no element 'pj'; did you mean p"),
    (("block", 0, "kind"), 3, ("block", 0, "kind"), "found 3; must be text, one of p, pt1"),
    (("block", 0, "num"), [1], ("block", 0, "num"), "either a kind or num and den"),
    (("block", 0, "gain"), 3, ("block", 0, "gain"), "unknown key"),
    (("block", 0, "parameters"), 3, ("block", 0, "parameters"), "must be a table, such as"),
    (("block", 0, "parameters", "gian"), 3, ("block", 0, "parameters", "gian"), "of pi; did you mean gain"),
    (
        ("block", 0, "parameters", "gain"),
        True,
        ("block", 0, "parameters", "gain"),
        "found True; must be a number",
    ),
    (("block", 0, "parameters", "gain"), float("nan"), ("block", 0, "parameters", "gain"), "must be finite"),
    (("block", 0, "parameters", "gain"), 10**400, ("block", 0, "parameters", "gain"), "must be finite"),
    (
        ("block", 0, "parameters", "integral_time"),
        "3 m",
        ("block", 0, "parameters", "integral_time"),
        "give it in s",
    ),
    (("block", 0, "parameters", "integral_time"), 0, ("block", 0, "parameters", "integral_time"), "not possible"),
    (
        ("block", 0, "parameters", "integral_time"),
        "fast",
        ("block", 0, "parameters", "integral_time"),
        "no finite number",
    ),
    (("block", 0, "input"), 5, ("block", 0, "input"), "must be a list of names with signs"),
    (("block", 0, "input"), ["+"], ("block", 0, "input"), "names nothing"),
    (
        ("block", 0, "input"),
        ["+reference", "-sensr"],
        ("block", 0, "input", 1),
        "found 'sensr'; did you mean sensor",
    ),
    (("block", 1, "parameters"), {}, ("block", 1, "parameters"), "belong to a kind"),
    (("block", 1, "num"), 3, ("block", 1, "num"), "must be a list of coefficients"),
    (("block", 1, "num"), ["x"], ("block", 1, "num", 0), "no finite number"),
    (("block", 1, "den"), [0], ("block", 1), "den is zero"),
    (("block", 1, "delay"), -1, ("block", 1), "delay_s = -1"),
    (("block", 2, "on"), "no", ("block", 2, "on"), "must be true or false"),
    (("block", 2, "when_off"), "open", ("block", 2, "when_off"), "must be pass or cut"),
    (("block", 2, "unit"), "kN", ("block", 2, "unit"), "signals of a scheme are in SI, here N"),
    (("block", 2, "unit"), "furlong", ("block", 2, "unit"), "furlong"),
    (("block", 3, "name"), "plant", ("block", 3, "name"), "the name 'plant' is taken"),
    (("input", 0, "channel"), 3, ("input", 0, "channel"), "must be text in quotes"),
    (("input", 0, "at"), "x", ("input", 0, "at"), "unknown key"),
    (("output", 0, "at"), "plan", ("output", 0, "at"), "no block 'plan'; did you mean plant"),
    (("output", 0), {}, ("output", 0, "name"), "is missing"),
    (("tolerance",), 3, ("tolerance",), "must be a table"),
    (("tolerance", "plant.gian"), 0.1, ("tolerance", "plant.gian"), "unknown parameter"),
    (("tolerance", "default"), -0.1, ("tolerance", "default"), "must be 0 or more"),
    (("derivative_filter",), 0, ("block",), "derivative_filter_s = 0"),
    (("derivative_filter",), None, ("derivative_filter",), "found None; must be a number"),
]


@pytest.mark.parametrize(("path", "value", "loc", "words"), MISTAKES, ids=[row[-1] for row in MISTAKES])
def test_mistakes_are_told_with_their_place(
    path: tuple[str | int, ...], value: object, loc: tuple[str | int, ...], words: str
) -> None:
    reading = read_scheme("x", with_change(path, value))
    assert reading.model is None
    told = [text for place, text in reading.mistakes if place == loc]
    assert len(told) == 1, reading.mistakes
    assert words in told[0]


def test_a_block_without_content_is_a_mistake() -> None:
    reading = read_scheme("x", {"block": [{"name": "b"}]})
    assert reading.mistakes[0][0] == ("block", 0)
    assert reading.mistakes[0][1].startswith("has neither kind nor num; kinds: p, pt1")


def test_all_mistakes_come_at_once_each_with_its_key() -> None:
    content = with_change(("block", 0, "kind"), "pj") | {"derivative_filter": "x", "input": [{"name": "a b"}]}
    with pytest.raises(ModelError) as caught:
        scheme_from_tables("x", content)
    assert [line.split(":")[0] for line in str(caught.value).splitlines()] == [
        *("input[0].name", "block[0].kind", "derivative_filter"),
    ]


def test_a_dead_time_alone_is_a_block() -> None:
    model = scheme_from_tables(
        "x", {"input": [{"name": "u"}], "block": [{"name": "b", "delay": 0.5, "input": ["u"]}]}
    )
    np.testing.assert_allclose(model.frequency_response(np.array([1.0]))[0, 0], np.exp(-1j * np.pi), atol=1e-15)


def test_the_documents_example_is_a_scheme() -> None:
    page = (Path(__file__).parents[3] / "docs" / "methods" / "schemes.md").read_text(encoding="utf-8")
    content = tomllib.loads(page.split("```toml")[1].split("```")[0])
    model = scheme_from_tables(
        "loop", {key: content[key] for key in content if key not in ("format", "kind", "name")}
    )
    assert model.parameters["plant.delay"].value == 0.02
    assert model.points[0].terminal.name == "speed"
    assert model.remarks() == ()
