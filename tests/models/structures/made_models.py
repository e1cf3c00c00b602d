"""Models that the tests of this room share."""

from typing import Any

from chladni.models.structures.controller import Controller
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

MASS, VISCOUS = 95.0, 300.0
KP, KV, GAIN, LIMIT = 160.18, 243.45, 35.15, 10.0


def axis(**changes: Any) -> StructureModel:
    """One carriage on a guide without stiffness, position over velocity control, a disturbance of its command."""
    controller: dict[str, Any] = {
        "name": "axis",
        "feedback": "position",
        "drives": "motor",
        "law": "p-p",
        "gains": {"kp": KP, "kv": KV},
        "gain": GAIN,
        "gain_unit": "N/V",
        "reference": "/command",
    }
    return StructureModel(
        name="axis",
        structure=Structure(
            bodies=(Body(name="carriage", mass=MASS),),
            joints=(Joint(name="guide", between=("ground", "carriage"), stiffness=0.0, damping=VISCOUS),),
        ),
        inputs=(
            StructureInput(name="motor", at="carriage", channel="/effort"),
            StructureInput(name="pulses", at="axis", kind="disturbance", channel="/pulses"),
        ),
        outputs=(
            StructureOutput(name="position", measures="displacement", at="carriage"),
            StructureOutput(name="speed", measures="velocity", at="carriage"),
            StructureOutput(name="acceleration", measures="acceleration", at="carriage"),
        ),
        controllers=(Controller(**(controller | changes)),),
    )


def tree() -> StructureModel:
    """A base that carries two branches, one of them closed to a loop of springs, with everything measured."""
    return StructureModel(
        name="tree",
        structure=Structure(
            bodies=tuple(Body(name=name, mass=mass) for name, mass in (("base", 8.0), ("left", 2.0), ("right", 3.0))),
            joints=(
                Joint(name="foot", between=("ground", "base"), stiffness=4e5, damping=60.0),
                Joint(name="hip", between=("base", "left"), stiffness=9e4, damping=9.0),
                Joint(name="knee", between=("base", "right"), stiffness=5e4, damping=4.0),
                Joint(name="tie", between=("left", "right"), stiffness=2e4, damping=3.0),
            ),
        ),
        inputs=(
            StructureInput(name="hammer", at="left"),
            StructureInput(name="actuator", at="knee"),
            StructureInput(name="floor", at="ground", kind="base_acceleration"),
        ),
        outputs=(
            StructureOutput(name="acc", measures="acceleration", at="right"),
            StructureOutput(name="vel", measures="velocity", at="base"),
            StructureOutput(name="dis", measures="displacement", at="left"),
            StructureOutput(name="stretch", measures="displacement", at="tie"),
            StructureOutput(name="stretching", measures="acceleration", at="tie"),
            StructureOutput(name="pull", measures="force", at="tie"),
        ),
    )
