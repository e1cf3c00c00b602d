"""Writing the model file of a block scheme."""

from chladni.models.core.model import Model
from chladni.models.files.effect_text import effect_tables
from chladni.models.files.toml_text import Entry
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.schemes.scheme_tables import scheme_tables
from chladni.signals.errors import ModelError


def scheme_content(model: Model) -> dict[str, Entry]:
    """Tables of the file; `ModelError` for anything but a `SchemeModel` of elements."""
    if not isinstance(model, SchemeModel):
        raise ModelError(f"model {model.name!r} is no SchemeModel, so no file can hold it")
    tolerances = {one.name: one.tolerance for one in model.parameters.values()}
    return {**scheme_tables(model), "effect": effect_tables(model.effects), "tolerance": tolerances}
