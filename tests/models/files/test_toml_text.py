"""TOML that is written reads back as what it was."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.files.toml_text import toml_text
from chladni.signals.errors import ModelError

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
SCALARS = TEXTS | st.booleans() | st.floats(allow_nan=False, allow_infinity=False)
VALUES = SCALARS | st.lists(SCALARS, max_size=4)
TABLES = st.dictionaries(TEXTS, VALUES | st.dictionaries(TEXTS, VALUES, max_size=3), max_size=4)


@given(
    head=st.dictionaries(TEXTS, VALUES.filter(lambda value: value != []), max_size=4),
    tables=st.dictionaries(TEXTS, TABLES | st.lists(TABLES, min_size=1, max_size=3), max_size=3),
)
def test_any_document_reads_back(head: dict[str, object], tables: dict[str, object]) -> None:
    content = head | tables
    assert tomllib.loads(toml_text(content)) == content  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [0.1, 1e-300, 5e-324, 1.7976931348623157e308, -0.0, 1 / 3, 1e22, 1e16])
def test_numbers_read_back_bit_for_bit(value: float) -> None:
    assert tomllib.loads(toml_text({"x": value}))["x"].hex() == value.hex()


def test_whole_numbers_are_written_as_numbers() -> None:
    assert toml_text({"x": 3}) == "x = 3.0\n"


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_no_file_may_hold_are_refused(value: float) -> None:
    with pytest.raises(ModelError, match="finite"):
        toml_text({"x": value})
