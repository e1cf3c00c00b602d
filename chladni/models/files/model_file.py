"""Model files: what a simulation believes, read and written.

The format is described in docs/model-file.md.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from chladni.io.atomic import atomic_write
from chladni.io.toml_reader import read_toml
from chladni.models.core.model import Model
from chladni.models.files.toml_text import Entry, toml_text
from chladni.signals.errors import ModelError

MODEL_FORMAT: Final = "chladni.model/1"


def load_model(path: Path | str) -> Model:
    """Read a model file: a structure, a drive or a block scheme.

    Parameters
    ----------
    path
        A TOML file of format ``chladni.model/1``.

    Raises
    ------
    ModelError
        With a line for each mistake: ``file:line: table key: what was found; what would be right``.

    Examples
    --------
    >>> import tempfile
    >>> text = '''format = "chladni.model/1"
    ... name = "one"
    ... kind = "structure"
    ... body = [{ name = "mass", mass = "2 kg" }]
    ... joint = [{ name = "spring", between = ["ground", "mass"], stiffness = "1.2 kN/mm", damping = 0.0 }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "one.toml"
    ...     _ = path.write_text(text)
    ...     load_model(path).parameters.numbers()
    {'mass.mass': 2.0, 'spring.stiffness': 1200000.0, 'spring.damping': 0.0}
    """
    path = Path(path)
    # Numbers far outside of physics overflow in the equations. What comes of it isn't finite, and that is told.
    with np.errstate(all="ignore"):
        return _read(path)


def write_model(model: Model, path: Path | str, *, overwrite: bool = True) -> None:
    """Write a model file, whole or not at all; every number reads back bit for bit.

    Raises
    ------
    ModelError
        When the model holds something that no file can say: an effect or a block of one's own making.
    LogError
        When the file can't be written.
    """
    content: dict[str, Entry] = {"format": MODEL_FORMAT, "name": model.name, "kind": model.kind, **_content(model)}
    # Empty lists would be written as keys, between or behind tables.
    text = toml_text({key: entry for key, entry in content.items() if entry != [] and entry != {}})
    with atomic_write(path, overwrite=overwrite) as file:
        file.write(text.encode())


def _read(path: Path) -> Model:
    """Give the model; the rooms of the other kinds stay unloaded."""
    match _kind(path):
        case "drive":
            from chladni.models.files.drive_file import read_drive

            return read_drive(path)
        case "scheme":
            from chladni.models.files.scheme_file import read_scheme_file

            return read_scheme_file(path)
        case _:
            # Without a kind, too: the reader of structures tells that it's missing, and all else with it.
            from chladni.models.files.structure_file import read_structure

            return read_structure(path)


def _kind(path: Path) -> object:
    from chladni.models.files.model_tables import AnyFile

    return read_toml(path, AnyFile, kind=ModelError)[0].kind


def _content(model: Model) -> Mapping[str, Entry]:
    """Tables of the file, by the kind of model."""
    match model.kind:
        case "structure":
            from chladni.models.files.structure_text import structure_content

            return structure_content(model)
        case "drive":
            from chladni.models.files.drive_text import drive_content

            return drive_content(model)
        case "scheme":
            from chladni.models.files.scheme_text import scheme_content

            return scheme_content(model)
    raise ModelError(f"model {model.name!r}: {model.kind!r} is no kind of model that a file can hold")
