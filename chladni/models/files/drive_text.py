"""Writing the model file of a drive."""

from chladni.models.core.model import Model
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.selection import ChosenSignal
from chladni.models.files.effect_text import effect_tables
from chladni.models.files.toml_text import Entry
from chladni.signals.errors import ModelError

Table = dict[str, Entry]


def drive_content(model: Model) -> Table:
    """Tables of the file; `ModelError` for a drive that isn't in the catalogue."""
    if not isinstance(model, DriveModel) or DRIVES.get(model.drive.name) is not model.drive:
        raise ModelError(f"model {model.name!r} is no drive of the catalogue, so no file can hold it")
    return {
        "drive": model.drive.name,
        "options": dict(model.options),
        "parameters": dict(model.parameters.numbers()),
        "input": [_signal(one) for one in model.inputs],
        "output": [_signal(one) for one in model.outputs],
        "effect": effect_tables(model.effects),
        # One by one, since kinds declare tolerances of their own that no single default stands for.
        "tolerance": {one.name: one.tolerance for one in model.parameters.values()},
    }


def _signal(one: ChosenSignal) -> Table:
    table: Table = {"signal": one.signal}
    if one.name:
        table["name"] = one.name
    if one.channel is not None:
        table["channel"] = one.channel
    if one.hold is not None:
        table["hold"] = one.hold
    return table
