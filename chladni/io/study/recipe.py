"""A recipe: what is done with each log of a study, and how what it found is followed."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chladni.io.regular_file import read_text
from chladni.io.setup import load_setup
from chladni.io.toml_reader import MAX_BYTES, read_toml
from chladni.signals.errors import ChladniError, SetupError

if TYPE_CHECKING:
    from chladni.io.study.recipe_file import RecipeFile
    from chladni.io.toml_reader import TomlMistakes

STUDY_FORMAT: Final = "chladni.study/1"
#: In the order in which they are done.
STEPS: Final = ("info", "psd", "frf", "modes", "levels", "gap")
#: What decides no row: these tables may change between two runs into one folder.
_AFTERWARDS: Final = ("trend", "limit")


@dataclass(frozen=True, slots=True, kw_only=True)
class Attached:
    """A file that a recipe names: its text travels with the work, so that workers needn't have it.

    Attributes
    ----------
    path
        As messages call it.
    text
        Its content.
    """

    path: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """A recipe that was read and checked.

    Attributes
    ----------
    file
        What it says.
    setup, model
        Files that it names.
    """

    file: "RecipeFile"
    setup: Attached | None = None
    model: Attached | None = None

    @property
    def steps(self) -> tuple[str, ...]:
        """Names of the steps that it asks for."""
        return tuple(step for step in STEPS if getattr(self.file, step) is not None)

    @property
    def identity(self) -> str:
        """SHA-256, in hexadecimal, of all that decides the rows: steps, options, setup and model, not their paths."""
        told = self.file.model_dump(mode="json", exclude=set(_AFTERWARDS))
        told["setup"] = None if self.setup is None else self.setup.text
        if self.model is not None:
            told["gap"] = {**told["gap"], "model": self.model.text}
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()

    def to_json(self) -> str:
        """Give it as it travels to workers."""
        attached = {
            name: None if one is None else {"path": one.path, "text": one.text}
            for name, one in (("setup", self.setup), ("model", self.model))
        }
        return json.dumps({"recipe": self.file.model_dump(mode="json"), **attached}, sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> "Recipe":
        """Read what `to_json` gave."""
        from chladni.io.study.recipe_file import RecipeFile

        content = json.loads(text)
        return cls(
            file=RecipeFile.model_validate(content["recipe"]),
            setup=_attached(content["setup"]),
            model=_attached(content["model"]),
        )


def _attached(content: Mapping[str, str] | None) -> Attached | None:
    return None if content is None else Attached(**content)


def load_recipe(path: Path | str) -> Recipe:
    """Read a recipe, with the setup and the model that it names.

    Parameters
    ----------
    path
        TOML, format ``chladni.study/1``; what it names lies relative to its folder.

    Raises
    ------
    SetupError
        One line for each mistake: ``file:line: [table] key: found, rule``.
    """
    from chladni.io.study.recipe_file import RecipeFile

    path = Path(path)
    content, _ = read_toml(path, RecipeFile, kind=SetupError, check=partial(_require_files, path.parent))
    setup = None if content.setup is None else _read(path.parent / content.setup)
    model = None if content.gap is None else _read(path.parent / content.gap.model)
    return Recipe(file=content, setup=setup, model=model)


def _read(path: Path) -> Attached:
    return Attached(path=str(path.resolve()), text=read_text(path, MAX_BYTES, SetupError))


def _require_files(folder: Path, content: dict[str, Any], mistakes: "TomlMistakes") -> None:
    """Note files that aren't there or can't be read, beside all other mistakes of the recipe."""
    gap = content.get("gap")
    named = {
        ("setup",): content.get("setup"),
        ("gap", "model"): gap.get("model") if isinstance(gap, dict) else None,
    }
    for loc, name in named.items():
        if not isinstance(name, str) or not name:
            continue
        try:
            if loc == ("setup",):
                load_setup(folder / name)
            else:
                read_text(folder / name, MAX_BYTES, SetupError)
        except ChladniError as error:
            mistakes.add(loc, f"{'; '.join(error.mistakes)}; paths count from the recipe's folder")
