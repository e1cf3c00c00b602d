"""A recipe on a worker: what it names loaded once, and its words for what goes wrong."""

import re
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from chladni.io.files.formats import fitting_options
from chladni.io.log import Log, open_log
from chladni.io.setup import Setup, load_setup
from chladni.io.study.recipe import Attached, Recipe

#: An option that a message advises; those of a whole command that it gives stay as they are.
_OPTION: Final = re.compile(r"chladni [a-z]+ [^;]*|--[a-z][a-z-]*")
_KEYS: Final = {
    "--setup": "setup", "--rate": "[open] sample_rate_hz", "--time": "[open] time", "--time-unit": "[open] time_unit",
    "--stamp": "[open] stamp", "--unit": "[open] units", "--channel": "channels", "--reference": "references",
    "--response": "responses", "--resolution": "resolution_hz", "--start": "start_s", "--end": "end_s",
    "--join": "join", "--operational": "operational = true", "--state": "state", "--command": "command",
    "--without": "leave_out",
}  # fmt: skip


class Prepared:
    """A recipe with what it names loaded, kept for the batches to come."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.setup: Setup | None = None
        self.model: Any = None
        with TemporaryDirectory(prefix="chladni-recipe-") as folder:
            # Errors name the file as the user does, not as it was laid down here.
            self._folder = Path(folder)
            if recipe.setup is not None:
                self.setup = load_setup(self._laid_down(recipe.setup))
            if recipe.model is not None:
                self.model = self._loaded(recipe.model)

    def told(self, text: str) -> str:
        """Give a message with files called as the user calls them, and keys of the recipe in place of options."""
        text = _OPTION.sub(lambda found: _KEYS.get(found[0], found[0]), text)
        for one in (self.recipe.setup, self.recipe.model):
            if one is not None:
                text = text.replace(str(self._path(one)), one.path)
        return text

    def open(self, path: Path) -> Log:
        """Open a log as the recipe says; of its keys, those that are for this kind of file."""
        told: dict[str, Any] = self.recipe.file.open.model_dump(exclude_none=True)
        return open_log(path, setup=self.setup, **fitting_options(path, told))

    def _path(self, attached: Attached) -> Path:
        return self._folder / Path(attached.path).name

    def _laid_down(self, attached: Attached) -> Path:
        path = self._path(attached)
        path.write_text(attached.text, encoding="utf-8")
        return path

    def _loaded(self, attached: Attached) -> Any:
        from chladni.gap.kept_memory import keep_memory
        from chladni.models.files.model_file import load_model
        from chladni.robots.loading import is_robot_file, load_robot

        keep_memory()
        path = self._laid_down(attached)
        # A robot's description names further files beside it: workers need the same folder.
        return load_robot(attached.path, meshes=False) if is_robot_file(path) else load_model(path)


@lru_cache(maxsize=4)
def prepared(recipe: str) -> Prepared:
    """Give a recipe's, from `Recipe.to_json`; made once for all batches of a worker."""
    return Prepared(Recipe.from_json(recipe))
