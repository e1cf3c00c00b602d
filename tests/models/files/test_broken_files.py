"""However a file is broken, it's told in words: `ModelError`, never a traceback of another kind."""

import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chladni.models.files.model_file import load_model
from chladni.models.files.toml_text import toml_text
from chladni.signals.errors import ModelError
from tests.models.files.made_files import DRIVE, SCHEME, STRUCTURE

FILES = [STRUCTURE, DRIVE, SCHEME]
# What people and programs put where something else belongs.
WRONG: list[Any] = [
    "", "ground", "wrist", "3 kg", "1e400 N", "-1 N", "x" * 300, "\x00", 0.0, -1.0, 1e308, 5e-324, True,
    [], [1.0], ["a", "b"], [[1.0]], {}, {"a": 1.0}, [{}], [{"name": "wrist"}], {"force": {"x": 1.0}},
]  # fmt: skip
SETTINGS = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def paths_in(content: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Place of every value, at any depth."""
    keys = range(len(content)) if isinstance(content, list) else content if isinstance(content, dict) else ()
    return [place for key in keys for place in [(*path, key), *paths_in(content[key], (*path, key))]]


def load(folder: Path, text: str) -> None:
    path = folder / "m.toml"
    path.write_text(text, encoding="utf-8")
    told = [str(path)]
    try:
        load_model(path)
    except ModelError as error:
        told = str(error).split("\n")
    assert all(line.startswith((str(path), "... and ")) for line in told), told


@pytest.mark.parametrize("text", FILES)
@given(data=st.data())
@SETTINGS
def test_any_value_in_any_place(tmp_path: Path, text: str, data: st.DataObject) -> None:
    content = tomllib.loads(text)
    for _ in range(data.draw(st.integers(1, 3))):
        *parents, key = data.draw(st.sampled_from(paths_in(content)))
        inner = content
        for parent in parents:
            inner = inner[parent]
        if data.draw(st.booleans()) and isinstance(inner, dict):
            inner[data.draw(st.sampled_from(["extra", "name", "kind", "at", "joint", "gain", "from"]))] = inner.pop(
                key
            )
        else:
            inner[key] = deepcopy(data.draw(st.sampled_from(WRONG)))
    load(tmp_path, toml_text(content))


@pytest.mark.parametrize("text", FILES)
@given(data=st.data())
@SETTINGS
def test_any_line_lost_doubled_or_moved(tmp_path: Path, text: str, data: st.DataObject) -> None:
    lines = text.split("\n")
    place = data.draw(st.integers(0, len(lines) - 1))
    taken = lines.pop(place)
    for _ in range(data.draw(st.integers(0, 2))):
        lines.insert(data.draw(st.integers(0, len(lines))), taken)
    load(tmp_path, "\n".join(lines))


@given(text=st.text(max_size=200))
@SETTINGS
def test_any_text(tmp_path: Path, text: str) -> None:
    try:
        load(tmp_path, text)
    except UnicodeEncodeError:
        # Half a surrogate pair can't be written to a file at all.
        assert any("\ud800" <= character <= "\udfff" for character in text)


def test_a_gain_that_equations_can_t_hold_is_told_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(STRUCTURE.replace('kp = "20 V/mm"', "kp = 1e308"), encoding="utf-8")
    with pytest.raises(
        ModelError, match=r"m\.toml:\d+: \[\[controller\]\] 1 gains kp: found 1e\+308 V/m is too large"
    ):
        load_model(path)
