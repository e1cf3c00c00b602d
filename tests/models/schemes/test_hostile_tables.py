"""Files are untrusted: what they hold gives a scheme or mistakes with places, and a scheme compiles or says why."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.elements.catalogue import ELEMENTS
from chladni.models.schemes.scheme_tables import KEYS, read_scheme
from chladni.models.schemes.table_reader import BLOCK_KEYS, INPUT_KEYS, OUTPUT_KEYS
from chladni.signals.errors import ModelError

words = st.sampled_from(["a", "b", "+a", "-b", "", "+", "pi", "pt1", "1 s", "3 kN", "x" * 90, "pass", "µ", "a\nb"])
numbers = st.integers() | st.floats() | st.sampled_from([10**400, -(10**400), 1e308, 5e-324])
scalars = st.none() | st.booleans() | numbers | words
anything = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3)
)


def tables_of(keys: tuple[str, ...]) -> st.SearchStrategy[object]:
    return st.lists(st.dictionaries(st.sampled_from(keys), anything, max_size=6), max_size=3) | anything


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "block": tables_of(BLOCK_KEYS),
            "input": tables_of(INPUT_KEYS),
            "output": tables_of(OUTPUT_KEYS),
            "tolerance": anything,
            "derivative_filter": anything,
            "other": anything,
        },
    )
)
def test_any_content_is_read_or_told(content: dict[str, object]) -> None:
    reading = read_scheme("x", content)
    assert (reading.model is None) == bool(reading.mistakes)
    for loc, text in reading.mistakes:
        assert loc[0] in (*KEYS, "other")
        assert 0 < len(text) < 1500


sizes = st.sampled_from([1e-300, 1e-30, 1e-9, 0.3, 1.0, 1e9, 1e30, 1e300])


@st.composite
def wild_blocks(draw: st.DrawFn) -> list[dict[str, object]]:
    """Blocks in loops with numbers of any size that a parameter takes."""
    names = ["a", "b", "c"]
    made = []
    for name in names:
        kind = draw(st.sampled_from(list(ELEMENTS)))
        parameters = {
            item: max(draw(sizes), 1.0) if item == "ratio" else draw(sizes) for item in ELEMENTS[kind].parameters
        }
        sources = draw(st.lists(st.sampled_from([*names, "u"]), min_size=1, max_size=2, unique=True))
        made.append({"name": name, "kind": kind, "parameters": parameters, "input": sources})
    return made


@given(wild_blocks())
def test_numbers_of_any_size_compile_or_are_refused_in_words(blocks: list[dict[str, object]]) -> None:
    reading = read_scheme("x", {"input": [{"name": "u"}], "block": blocks})
    if reading.model is None:
        return
    try:
        compiled = reading.model.compile()
    except ModelError:
        return
    assert np.all(np.isfinite(compiled.a))
