"""Lines and numbers in text: one grammar, whatever Python's own functions take."""

import ast
import io
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import chladni
from chladni.signals.text_reading import lines_of, real_number, whole_number

# What `str.splitlines` takes for ends of lines, beside the three that are.
INNER = "\v\f\x1c\x1d\x1e\x85\u2028\u2029"


@given(text=st.text(st.sampled_from(f"a,1 \n\r{INNER}")))
def test_lines_are_those_that_python_reads_from_a_file(text: str) -> None:
    read = [line.removesuffix("\n") for line in io.StringIO(text, newline=None)]
    assert lines_of(text) == read


@given(number=st.floats(allow_nan=False))
def test_numbers_come_back_to_the_bit(number: float) -> None:
    assert real_number(f" {number!r} ") == number


@given(number=st.integers(-(10**30), 10**30))
def test_whole_numbers_come_back(number: int) -> None:
    assert whole_number(f"{number:+d}") == number


@pytest.mark.parametrize("text", ["1_0", "1_000.5", "١٢", "１２", "1e1_0", "1\u00a0", "", "-", "0x1f", "one"])
def test_what_is_no_number_in_a_file(text: str) -> None:
    with pytest.raises(ValueError, match=r"number|convert|literal"):
        real_number(text)
    with pytest.raises(ValueError, match=r"number|literal"):
        whole_number(text)


def test_a_number_of_thousands_of_digits_is_none() -> None:
    with pytest.raises(ValueError, match="digits"):
        whole_number("1" * 5000)


def test_no_module_splits_lines_in_another_way() -> None:
    # Of text that the project holds itself, or that another program of the system says, any way is right.
    own = {"ros2_definitions.py", "process.py"}
    found = [
        path.name
        for path in Path(chladni.__file__).parent.rglob("*.py")
        # To parse every module would take seconds.
        if "splitlines" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute) and node.attr == "splitlines"
    ]
    assert set(found) <= own
