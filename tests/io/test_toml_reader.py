"""Lines of TOML values, and files that are no TOML."""

import tomllib
from pathlib import Path
from unittest import mock

import pytest
from pydantic import BaseModel, ConfigDict

from chladni.io.toml_reader import MAX_BYTES, MAX_MISTAKES, TomlDocument, read_toml, tables
from chladni.signals.errors import ModelError


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
        (("part", 1, "list", 1), 11),
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
        (("part", 0, "grid", 1), 12),
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


def test_a_thousand_mistakes_take_no_longer_than_their_tables() -> None:
    # Every look-up parses a few lines, not the file: counted, since time depends on the machine.
    text = "".join(f"[[part]]\nmass = {n}.0\n" for n in range(1000))
    whole = document(text)
    with mock.patch("chladni.io.toml_reader.tomllib.loads", wraps=tomllib.loads) as loads:
        assert [whole.line_of(("part", n, "mass")) for n in range(1000)] == list(range(2, 2001, 2))
    assert max(len(call.args[0]) for call in loads.call_args_list) < 60


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
    with pytest.raises(ModelError, match="can't be read: No such file"):
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
