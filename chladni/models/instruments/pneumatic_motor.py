"""The instrument of the linear pneumatic motor."""

from collections.abc import Mapping

from chladni.models.core.instrument import Instrument
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.pneumatic_motor import PNEUMATIC_MOTOR
from chladni.models.instruments.drive_pages import drive_at


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    return drive_at(PNEUMATIC_MOTOR, values, options)


#: The paper reads its table 1 off the velocity after a step of flow.
INSTRUMENT = Instrument(
    name=PNEUMATIC_MOTOR.name,
    title=PNEUMATIC_MOTOR.title,
    parameters=PNEUMATIC_MOTOR.parameters,
    build=_build,
    options=PNEUMATIC_MOTOR.options,
    step_input="flow",
    step_output="velocity",
    step_size=50e-6,
    load_input="load",
    # The least resisting force of the paper's range, a third of what is rated.
    load_size=100.0,
)
