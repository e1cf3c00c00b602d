"""Recipes: every mistake at once, with its line and key."""

from pathlib import Path

import pytest

from chladni.io.study.recipe import Recipe, load_recipe
from chladni.signals.errors import SetupError


def recipe(folder: Path, text: str) -> Path:
    path = folder / "recipe.toml"
    path.write_text('format = "chladni.study/1"\n' + text)
    return path


def test_all_mistakes_are_told_with_line_and_key(tmp_path: Path) -> None:
    path = recipe(
        tmp_path,
        'setup = "none.toml"\n[psd]\nresolution_hz = -1.0\nchanels = ["/a"]\n[modes]\nmethod = "plscf"\n'
        "operational = true\n[levels]\nbands_hz = [[50, 5]]\n[gap]\nmodel = 3\n",
    )
    with pytest.raises(SetupError) as told:
        load_recipe(path)
    lines = {int(one.removeprefix(f"{path}:").split(":")[0]): one for one in told.value.mistakes}
    assert sorted(lines) == [2, 4, 5, 6, 10, 12]
    assert "no such file" in lines[2]
    assert "resolution_hz: found -1.0; must be greater than 0" in lines[4]
    assert "did you mean channels?" in lines[5]
    assert "method plscf needs an excitation" in lines[6]
    assert "from 50 to 5 Hz is empty" in lines[10]
    assert "must be text in quotes" in lines[12]


def test_a_recipe_that_asks_for_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"asks for nothing; add a table of \[info\]"):
        load_recipe(recipe(tmp_path, ""))


def test_what_decides_rows_is_its_identity(tmp_path: Path) -> None:
    (tmp_path / "setup.toml").write_text('format = "chladni.setup/1"\n')
    first = load_recipe(recipe(tmp_path, 'setup = "setup.toml"\n[psd]\n'))
    assert (
        load_recipe(recipe(tmp_path, 'setup = "setup.toml" # the same\n[psd]\n[trend]\n')).identity == first.identity
    )
    assert load_recipe(recipe(tmp_path, 'setup = "setup.toml"\n[psd]\noverlap = 0.25\n')).identity != first.identity
    (tmp_path / "setup.toml").write_text('format = "chladni.setup/1"\n[[point]]\nname = "a"\nposition = [0, 0, 0]\n')
    assert load_recipe(recipe(tmp_path, 'setup = "setup.toml"\n[psd]\n')).identity != first.identity


def test_a_recipe_travels_whole(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text("any text")
    sent = load_recipe(recipe(tmp_path, '[levels]\nbands_hz = [[1, 2.5]]\n[gap]\nmodel = "arm.toml"\n'))
    got = Recipe.from_json(sent.to_json())
    assert got == sent
    assert got.steps == ("levels", "gap")
