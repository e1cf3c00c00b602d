"""Reading the model file of a block scheme."""

from pathlib import Path

from chladni.io.toml_reader import TomlMistakes, read_toml
from chladni.models.files.file_reading import Content, FileReading
from chladni.models.files.quantity import number
from chladni.models.files.site_units import SiteUnits, compiled_site_units
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_tables import KEYS, read_scheme
from chladni.signals.errors import ModelError


def read_scheme_file(path: Path) -> SchemeModel:
    """Read the model file of a scheme.

    Raises
    ------
    ModelError
        With a line for each mistake.
    """
    from chladni.models.files.model_tables import SchemeFile

    made: list[SchemeModel] = []

    def check(content: Content, mistakes: TomlMistakes) -> None:
        made.extend(_models(content, mistakes))

    read_toml(path, SchemeFile, kind=ModelError, check=check)
    return made[0]


def _models(content: Content, mistakes: TomlMistakes) -> list[SchemeModel]:
    """Give the model, or none when anything is wrong."""
    file = FileReading(content, mistakes)
    tables = {key: content[key] for key in KEYS if key in content}
    reading = read_scheme(str(content.get("name")), tables, number=number)
    for loc, text in reading.mistakes:
        mistakes.add(loc, text)
    model = reading.model
    if model is not None and file.tried((), model.compile) is None:
        model = None
    effects = file.effects(_sites(file, model))
    if model is None or mistakes:
        return []
    for count in range(len(effects)):
        file.tried(("effect", count), model.with_effects(effects[: count + 1]).compile)
    return [model.with_effects(effects)]


def _sites(file: FileReading, model: SchemeModel | None) -> dict[str, SiteUnits | None]:
    """Inputs, outputs and blocks; what enters a block and what leaves it have the block's units."""
    names = [
        name
        for part in ("block", "input", "output")
        for _, table in file.tables(part)
        if (name := file.text(table, "name")) is not None
    ]
    sites: dict[str, SiteUnits | None] = dict.fromkeys(names)
    if model is not None:
        sites |= compiled_site_units(model.compile())
        # An effect at a block may sit before it or behind it, with another unit each.
        sites |= dict.fromkeys(block.name for block in model.blocks if block.unit != block.input_unit)
    return sites
