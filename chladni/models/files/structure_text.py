"""Writing the model file of a structure."""

from chladni.models.core.model import Model
from chladni.models.files.effect_text import effect_tables
from chladni.models.files.toml_text import Entry
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure import Body
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.models.structures.structure_parameters import inertia_key
from chladni.signals.errors import ModelError

Table = dict[str, Entry]


def structure_content(model: Model) -> Table:
    """Tables of the file; `ModelError` for anything but a `StructureModel`."""
    if not isinstance(model, StructureModel):
        raise ModelError(f"model {model.name!r} is no StructureModel, so no file can hold it")
    joints = {joint.name for joint in model.structure.joints}
    return {
        "body": [_body(body) for body in model.structure.bodies],
        "joint": [
            {"name": one.name, "between": list(one.between), "stiffness": one.stiffness, "damping": one.damping}
            for one in model.structure.joints
        ],
        "input": [_input(one, joints) for one in model.inputs],
        "output": [_output(one, joints) for one in model.outputs],
        "controller": [_controller(one) for one in model.controllers],
        "effect": effect_tables(model.effects),
        "tolerance": {"default": model.default_tolerance, **model.tolerances},
    }


def _body(body: Body) -> Table:
    table: Table = {"name": body.name, inertia_key(body): body.mass}
    # What has its default is left out, as people write such files.
    if body.position != (0.0, 0.0, 0.0):
        table["position"] = list(body.position)
    return table


def _input(one: StructureInput, joints: set[str]) -> Table:
    table: Table = {"name": one.name, "kind": one.kind, "joint" if one.at in joints else "at": one.at}
    return table | _stated(channel=one.channel, hold=one.hold)


def _output(one: StructureOutput, joints: set[str]) -> Table:
    table: Table = {"name": one.name, "measures": one.measures, "joint" if one.at in joints else "at": one.at}
    return table | _stated(channel=one.channel, hold=one.hold)


def _stated(**values: str | None) -> Table:
    return {key: value for key, value in values.items() if value is not None}


def _controller(one: Controller) -> Table:
    table: Table = {"name": one.name} | _stated(reference=one.reference, hold=one.hold)
    table |= {"feedback": one.feedback, "law": one.law}
    if one.gains:
        table["gains"] = dict(one.gains)
    if one.num:
        table |= {"num": list(one.num), "den": list(one.den)}
    if one.rate_of != "feedback":
        table["rate_of"] = one.rate_of
    table |= {"drives": one.drives, "gain": _quantity(one.gain, one.gain_unit)}
    if one.limit is not None:
        table["limit"] = _quantity(one.limit, one.limit_unit)
    return table


def _quantity(value: float, unit: str | None) -> Entry:
    # In an SI unit the number is read back as it stands.
    return value if unit is None else f"{float(value)!r} {unit}"
