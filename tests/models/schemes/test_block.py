import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.elements.catalogue import element
from chladni.models.schemes.block import Block, element_block
from chladni.signals.errors import ModelError


def spring_state_space(inputs: int = 1) -> StateSpace:
    return StateSpace(
        a=np.array([[-2.0]]),
        b=np.ones((1, inputs)),
        c=np.array([[4.0]]),
        d=np.zeros((1, inputs)),
        inputs=tuple(Terminal(name=f"in{number}", unit="N") for number in range(inputs)),
        outputs=(Terminal(name="out", unit="m"),),
        states=("x",),
    )


@pytest.mark.parametrize(
    ("text", "source"),
    [("+a", ("a", 1.0)), ("-a", ("a", -1.0)), ("a", ("a", 1.0)), (" - a ", ("a", -1.0)), ("a-b", ("a-b", 1.0))],
)
def test_sources_have_a_name_and_a_sign(text: str, source: tuple[str, float]) -> None:
    assert element_block("b", "p", text).sources == (source,)


@pytest.mark.parametrize("name", ["", "1a", "a b", "ground", "a.b", "a" * 65])
def test_impossible_names_are_refused(name: str) -> None:
    with pytest.raises(ModelError, match="a name is a letter"):
        element_block(name, "p")


@pytest.mark.parametrize("text", ["", "+", "  "])
def test_a_source_without_name_is_refused(text: str) -> None:
    with pytest.raises(ModelError, match=r"block 'b': input .* names nothing"):
        element_block("b", "p", text)


def test_a_source_named_twice_is_refused() -> None:
    with pytest.raises(ModelError, match="block 'b': input 'a' is named 2 times"):
        element_block("b", "p", "+a", "-a")


def test_an_unknown_word_for_off_is_refused() -> None:
    with pytest.raises(ModelError, match="when_off = 'open'; it is pass or cut"):
        Block(name="b", content=element("p"), when_off="open")


def test_off_means_passing_or_cutting() -> None:
    passing = element_block("b", "pt1", "a").switched(on=False)
    assert passing.acting.transfer.static_gain() == 1.0
    cutting = element_block("b", "pt1", "a", when_off="cut").switched(on=False)
    assert cutting.acting.transfer.static_gain() == 0.0
    assert cutting.switched(on=True).acting is cutting.content


def test_units_are_those_of_the_content_unless_told() -> None:
    assert (element_block("b", "inertia").input_unit, element_block("b", "inertia").unit) == ("N m", "rad/s")
    assert element_block("b", "inertia", unit="1/s").unit == "1/s"
    made = Block(name="b", content=spring_state_space())
    assert (made.input_unit, made.unit) == ("N", "m")


def test_a_state_space_has_one_input_one_output_and_no_parameters() -> None:
    made = Block(name="b", content=spring_state_space())
    assert len(made.parameters) == 0
    assert made.with_values({}) == made
    assert made.with_tolerances({}) == made
    with pytest.raises(ModelError, match="no parameter 'gain'"):
        made.with_values({"gain": 1.0})
    with pytest.raises(ModelError, match="has 2 inputs and 1 outputs; a block has one of each"):
        Block(name="b", content=spring_state_space(inputs=2))
