"""Lines of TOML values, and files that are no TOML."""

import os
import tomllib
from contextlib import suppress
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict

from chladni.io.toml_lines import Place, places_of
from chladni.io.toml_reader import MAX_BYTES, MAX_MISTAKES, TomlDocument, TomlMistakes, read_toml, tables
from chladni.signals.errors import ModelError
from chladni.signals.wording import near_words


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    mass: float
    place: dict[str, float] = {}


class Model(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    part: list[Part] = []
    tolerance: dict[str, float] = {}


def document(text: str) -> TomlDocument:
    return TomlDocument(text, name="a.toml", kind=ModelError)


TEXT = '''# a comment with mass = 1
[[part]]
mass = 1.0
[[part]]

mass = 2.0
place = { x = 1.0, y = 2.0 }
note = """
mass = 3
"""
list = [
  1,
  # two
  2,
]
[tolerance]
"part.mass" = 0.1
a.b.c = 3
'''


@pytest.mark.parametrize(
    ("loc", "line"),
    [
        (("part", 0), 2),
        (("part", 0, "mass"), 3),
        (("part", 1), 4),
        (("part", 1, "mass"), 6),
        (("part", 1, "place", "y"), 7),
        (("part", 1, "note"), 8),
        (("part", 1, "list", 1), 14),
        (("part", 1, "missing"), 4),
        (("tolerance",), 16),
        (("tolerance", "part.mass"), 17),
        (("tolerance", "a", "b", "c"), 18),
        (("nothing",), 1),
        ((), 1),
    ],
)
def test_lines(loc: tuple[str | int, ...], line: int) -> None:
    assert document(TEXT).line_of(loc) == line


def test_lines_are_the_same_with_windows_line_ends() -> None:
    assert document(TEXT.replace("\n", "\r\n")).line_of(("tolerance", "part.mass")) == 17


def test_every_key_of_a_generated_file_is_found() -> None:
    text = "".join(f"[[part]]\nmass = {n}.0\n\n" for n in range(60))
    lines = [document(text).line_of(("part", n, "mass")) for n in range(60)]
    assert lines == [3 * n + 2 for n in range(60)]


MISLEADING = '''# [[part]] in a comment
kind = """
[[part]]
name = 0
"""
[[part]]
mass = 1.0
text = """
[[part]]
mass = 7.0
"""
grid = [
  [1, 2],
  [3, 4],
]
[part.place]
x = 1.0
[[ "part" ]]   # quoted
mass = 2.0
[[part]]
mass = nan
[[other.part]]
mass = 3.0
[tolerance]
x = [
  [[1]],
]
'''


@pytest.mark.parametrize(
    ("loc", "line"),
    [
        (("part", 0, "mass"), 7),
        (("part", 0, "grid", 1), 14),
        (("part", 0, "place", "x"), 17),
        (("part", 1), 18),
        (("part", 1, "mass"), 19),
        (("part", 2, "mass"), 21),
        (("other", "part", 0, "mass"), 23),
        (("tolerance", "x"), 25),
        (("kind",), 2),
    ],
)
def test_lines_that_only_look_like_headers_mislead_nobody(loc: tuple[str | int, ...], line: int) -> None:
    assert document(MISLEADING).line_of(loc) == line


def test_a_list_with_many_lines_in_brackets_is_no_heap_of_tables() -> None:
    rows = "".join(f"  [{n}],\n" for n in range(60))
    text = f"[[part]]\nmass = 1.0\ngrid = [\n{rows}]\n[[part]]\nmass = 2.0\n"
    assert document(text).line_of(("part", 1, "mass")) == 66
    assert document(text).line_of(("part", 0, "grid")) == 3


PIECES = [
    "{key} = 1",
    "{key} = 1979-05-27 07:32:00 # = [x]",
    '{key} = """\n[[a]]\nb = \\""" c\n"""""',
    "{key} = '''\n[a]\nb = 2''''",
    '{key} = "[a] # \\" b = 3"',
    "{key} = [ # one\n  1,\n  [2, 1979-05-27 07:32:00], # two\n  {{ b = 4, c.d = [5] }},\n]",
    "{key} = {{ b = {{ }}, 'c d' = \"x\" }}",
    '{key}.b."c.d" = 6',
    '"{key} x" = [ ]',
    "[{key}]",
    "[ {key} . b ]",
    "[[{key}]]",
    "[[{key}.b]]",
    "# [[{key}]]",
    "",
]


def keys_of(content: object) -> object:
    """Keys and indices of all that lies in a value, without the values."""
    if isinstance(content, dict):
        return {key: keys_of(inner) for key, inner in content.items()}
    return {place: keys_of(inner) for place, inner in enumerate(content)} if isinstance(content, list) else {}


def places_in(place: Place) -> object:
    return {key: places_in(inner) for key, inner in place.inner.items()}


@given(pieces=st.lists(st.tuples(st.sampled_from(PIECES), st.sampled_from("abc")), max_size=12))
def test_every_value_of_any_file_has_its_line(pieces: list[tuple[str, str]]) -> None:
    valid: list[str] = []
    for piece, key in pieces:
        # What doesn't fit to the lines above it is left out.
        with suppress(tomllib.TOMLDecodeError):
            tomllib.loads("\n".join([*valid, piece.format(key=key)]))
            valid.append(piece.format(key=key))
    text = "\n".join(valid)
    content = tomllib.loads(text)
    places = places_of(text)
    assert places_in(places) == keys_of(content)
    # A key first stands in the first line with which the file has it.
    lines = text.split("\n")
    for key in content:
        assert key.split()[0] in lines[places.line_of((key,)) - 1]


@pytest.mark.nightly
def test_what_many_mistakes_cost_is_bounded(tmp_path: Path) -> None:
    looked = 0

    def check(content: dict[str, object], mistakes: TomlMistakes) -> None:
        nonlocal looked
        for place, _ in tables(content, "part"):
            looked += 1
            mistakes.add(("part", place), "is wrong")

    path = tmp_path / "m.toml"
    path.write_text("[[part]]\nmass = 1\n" * 20_000)
    with pytest.raises(ModelError, match=r"\.\.\. and at least 1 more mistake$"):
        read_toml(path, Model, kind=ModelError, check=check)
    assert looked == MAX_MISTAKES + 2
    path.write_text("".join(f"key{n} = 1\n" for n in range(20_000)))
    with (
        mock.patch("chladni.io.validation.near_words", wraps=near_words) as near,
        pytest.raises(ModelError, match="at least 19950 more mistakes"),
    ):
        read_toml(path, Model, kind=ModelError, check=check)
    assert near.call_count == MAX_MISTAKES


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"a = 1\nb = {'9' * 5000}", "m.toml:2: found a number of thousands of digits; a whole number has 64 bits"),
        (f"a = 1\nb = [1, 0x{'f' * 5000}]", "m.toml:2: [[b]] 2: found a whole number of 20000 bits; a whole number"),
        ("b = 9223372036854775808", "m.toml:1: b: found a whole number of 64 bits"),
        (f"c = 1\n{'.'.join('ab' * 3000)} = 1", "is nested too deeply for a file of this kind"),
        (f"a = {'[' * 40}{']' * 40}", "is nested too deeply for a file of this kind"),
        (f"{'x' * 100_000} = 1", "unknown key; known keys: part, tolerance"),
    ],
)
def test_numbers_and_tables_that_no_file_has(tmp_path: Path, text: str, told: str) -> None:
    found = read(tmp_path, text)
    assert told in found
    assert len(found) < 400


def test_the_least_and_greatest_whole_numbers_are_read(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text("[tolerance]\na = -9223372036854775808\nb = 9223372036854775807")
    assert read_toml(path, Model, kind=ModelError)[0].tolerance == {"a": -(2.0**63), "b": 2.0**63}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "m.toml")
    with pytest.raises(ModelError, match=r"m\.toml: is a named pipe; files alone are read"):
        read_toml(tmp_path / "m.toml", Model, kind=ModelError)
    with pytest.raises(ModelError, match="is a folder"):
        read_toml(tmp_path, Model, kind=ModelError)
    with pytest.raises(ModelError, match="is a device"):
        read_toml(Path("/dev/zero"), Model, kind=ModelError)


def read(tmp_path: Path, content: str | bytes) -> str:
    path = tmp_path / "m.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ModelError) as caught:
        read_toml(path, Model, kind=ModelError)
    return str(caught.value).replace(str(path), "m.toml")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("a = \n", "m.toml:1: not TOML: "),
        ("<html><body>404</body></html>", "m.toml: is XML, and TOML is read here"),
        (
            "a = 1\nmass = 8.0e3x\n",
            "m.toml:2: not TOML: expected newline or end of document after a statement, in 'mass = 8.0e3x'",
        ),
        (f"a = {'x' * 5000}", "xxx..."),
        ("\n\n[[part]\n", "m.toml:3: not TOML: "),
        ("a = '''\n\n", "m.toml:3: not TOML: "),
        (b"\n\xff", "m.toml:2: byte 0xff isn't UTF-8"),
        ("a = " + "[" * 5000, "m.toml:1: "),
        (b"#" * (MAX_BYTES + 1), f"m.toml: is larger than {MAX_BYTES} bytes"),
        ("[[part]]\nmas = 1", "m.toml:1: [[part]] 1 mass: is missing, and is needed\n"),
        ("[[part]]\nmas = 1", "m.toml:2: [[part]] 1 mas: unknown key; did you mean mass?"),
        ("qqq = 1", "m.toml:1: qqq: unknown key; known keys: part, tolerance"),
        ("part = 3", "m.toml:1: part: found 3; must be a list in brackets"),
        ("part = [3]", "m.toml:1: [[part]] 1: found 3; must be a table"),
        ("[[part]]\nmass = nan", "must be finite, not inf or nan"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, content: str | bytes, told: str) -> None:
    assert told in read(tmp_path, content)


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        read_toml(tmp_path / "none.toml", Model, kind=ModelError)


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(b"\xef\xbb\xbf[[part]]\nmass = 2")
    content, known = read_toml(path, Model, kind=ModelError)
    assert content.part[0].mass == 2.0
    assert known.place(("part", 0, "mass")) == f"{path}:2"


@pytest.mark.parametrize("content", ["", "\n \n", "# later\n"])
def test_an_empty_file_is_told_as_that(tmp_path: Path, content: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(content)
    with pytest.raises(ModelError, match=r"m\.toml: is empty, or holds comments alone"):
        read_toml(path, Part, kind=ModelError)
    # A file in which nothing is needed may be empty.
    assert read_toml(path, Model, kind=ModelError)[0] == Model()


def test_mistakes_are_bounded(tmp_path: Path) -> None:
    assert read(tmp_path, "".join(f"key{n} = 1\n" for n in range(MAX_MISTAKES + 1))).endswith("1 more mistake")
    told = read(tmp_path, "".join(f"key{n} = 1\n" for n in range(MAX_MISTAKES + 7))).split("\n")
    assert len(told) == MAX_MISTAKES + 1
    assert told[-1] == "... and 7 more mistakes"


def test_long_values_are_shortened(tmp_path: Path) -> None:
    assert len(read(tmp_path, f'tolerance = "{"x" * 5000}"')) < 200


def test_tables_leaves_out_what_is_none() -> None:
    assert tables({"a": [{"b": 1}, 3]}, "a") == [(0, {"b": 1})]
    assert tables({"a": 3}, "a") == []
