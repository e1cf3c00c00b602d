"""The instrument of a robot's structure: where a damper helps, and what stiffer joints do."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.structures.robot_arm import robot_arm
from chladni.models.structures.structure import Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

NO_DAMPER = "none"
DAMPER = Parameter(
    name="damper",
    value=500.0,
    unit="N s/m",
    low=0.0,
    high=5000.0,
    minimum=0.0,
    symbol="c_d",
    meaning="added to the damping of the chosen joint",
)


def arm_model(structure: Structure | None = None) -> StructureModel:
    """Give the robot arm pushed at its tool, with the motion of its tool and the acceleration of every body."""
    arm = robot_arm() if structure is None else structure
    accelerations = tuple(
        StructureOutput(name=f"acc_{body.name}", measures="acceleration", at=body.name) for body in arm.bodies
    )
    return StructureModel(
        name="robot-arm",
        structure=arm,
        inputs=(StructureInput(name="push", at="tool"),),
        outputs=(StructureOutput(name="tool_displacement", measures="displacement", at="tool"), *accelerations),
    )


@cache
def _nominal() -> StructureModel:
    return arm_model()


def _with_damper(structure: Structure, joint: str, damping: float) -> Structure:
    joints = tuple(
        replace(one, damping=one.damping + damping) if one.name == joint else one for one in structure.joints
    )
    return replace(structure, joints=joints)


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> StructureModel:
    numbers = {name: value for name, value in values.items() if name != DAMPER.name}
    model = _nominal().with_values(numbers)
    if options["damper_at"] == NO_DAMPER:
        return model
    return arm_model(_with_damper(model.structure, options["damper_at"], values[DAMPER.name]))


INSTRUMENT = Instrument(
    name="robot-arm",
    title="Structure of a robot: base, column, arm, wrist, tool",
    parameters=Parameters((DAMPER, *arm_model().parameters.items_in_order)),
    build=_build,
    options=(
        Option(
            name="damper_at",
            choices=(NO_DAMPER, *(joint.name for joint in robot_arm().joints)),
            default=NO_DAMPER,
            meaning="joint that a viscous damper is added to",
        ),
    ),
    step_input="push",
    step_output="tool_displacement",
    step_size=100.0,
)
