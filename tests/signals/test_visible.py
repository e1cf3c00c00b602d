"""What is shown of a name: every character seen, none obeyed, two names never as one, and back again."""

import csv
import io
import json
import re
import sys
import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chladni.signals.channel import Channel, find_channel
from chladni.signals.errors import EstimateError
from chladni.signals.visible import as_meant, cell_meant, cell_text, place_of, visible, visible_json

#: Texts of what makes trouble together: escapes and what looks like them, quotes, formulas.
TRICKY = st.text(st.sampled_from("\\x1bnu0\"\x1b\n\r\t\u202e\x9b=+-@'{}[]. é")) | st.text()


def controls() -> list[str]:
    """Characters that move, hide or reorder others, or end a line, in Unicode's own words."""
    return [
        chr(code)
        for code in range(sys.maxunicode + 1)
        if unicodedata.category(chr(code)) in ("Cc", "Cf", "Cs", "Zl", "Zp")
        or unicodedata.bidirectional(chr(code)) in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
    ]


def quoted(name: str) -> str:
    """A name as quoted parts of a message path hold it."""
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def test_no_control_character_stays() -> None:
    found = controls()
    assert len(found) > 2000, "the list was lost"
    for character in found:
        shown = visible(f"a{character}b")
        assert shown.isprintable(), hex(ord(character))
        assert shown.startswith("a\\")
        assert as_meant(shown) == f"a{character}b"


@pytest.mark.parametrize(
    "name",
    ["/imu/wrist.linear_acceleration.x", "Größe", "ω̇ [rad/s²]", "速度", "🤖❤️", "a b", "C:\\data", "日本語", "αβγ"],
)
def test_ordinary_names_stay(name: str) -> None:
    assert visible(name) == name
    assert as_meant(name) == name


@pytest.mark.parametrize(
    "blank", ["\u200b", "\u200d", "\ufeff", "\u00ad", "\u3164", "\u115f", "\u034f", "\u2028", "\xa0"]
)
def test_what_is_drawn_as_nothing_is_shown(blank: str) -> None:
    assert visible(f"a{blank}b") == rf"a\x{ord(blank):02x}b" if ord(blank) < 256 else rf"a\u{ord(blank):04x}b"


@given(text=TRICKY)
def test_what_is_visible_stays_visible(text: str) -> None:
    assert visible(text).isprintable()
    assert visible(visible(text)) == visible(text)


@given(name=TRICKY)
def test_a_quoted_name_comes_back_from_what_is_shown(name: str) -> None:
    assert as_meant(visible(quoted(name))) == quoted(name)


@given(one=TRICKY, other=TRICKY)
@example(one="\x1b", other="\\x1b")
@example(one="\\\n", other="\\\\n")
def test_two_quoted_names_are_never_shown_as_one(one: str, other: str) -> None:
    assert (visible(quoted(one)) == visible(quoted(other))) == (one == other)


@given(name=TRICKY)
@example(name="'=x")
@example(name="''x")
@example(name="=a\\nb")
def test_a_cell_is_no_formula_and_comes_back(name: str) -> None:
    cell = cell_text(name)
    assert cell.isprintable()
    assert not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
    assert cell_meant(cell) == name
    assert next(csv.reader(io.StringIO(f'"{cell.replace(chr(34), chr(34) * 2)}"')), [""]) == [cell]


@pytest.mark.parametrize("name", ["tip", "a,b", "'plain", "C:\\data", "Kraft (kN)"])
def test_an_ordinary_cell_stays(name: str) -> None:
    assert cell_text(name) == name
    assert cell_meant(name) == name


@given(document=st.recursive(TRICKY | st.integers(), lambda inner: st.lists(inner) | st.dictionaries(TRICKY, inner)))
def test_a_document_stays_the_same_and_is_harmless(document: object) -> None:
    shown = visible_json(json.dumps(document, indent=1, ensure_ascii=False))
    assert json.loads(shown) == document
    assert shown.replace("\n", "").isprintable()
    assert re.sub(r"[^\n]", "", shown) == re.sub(r"[^\n]", "", json.dumps(document, indent=1))


def test_a_channel_is_found_by_what_is_shown_of_it() -> None:
    names = ["a", "b\x1b[2J", "c\nd"]
    assert [place_of(visible(name), names) for name in names] == [0, 1, 2]
    assert find_channel([Channel(name=name) for name in names], r"c\nd") == 2
    assert place_of("b", names) is None
    with pytest.raises(EstimateError, match="no channel 'b'"):
        find_channel([Channel(name=name) for name in names], "b")


def test_the_name_itself_goes_before_what_another_is_shown_as() -> None:
    assert place_of("a\\nb", ["a\nb", "a\\nb"]) == 1
