"""The instrument of the linear hydraulic motor."""

from collections.abc import Mapping

from chladni.models.core.instrument import Instrument
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from chladni.models.instruments.drive_pages import drive_at


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    return drive_at(HYDRAULIC_MOTOR, values, options)


#: A flow is an input with and without the position loop, so that both answer the same step.
INSTRUMENT = Instrument(
    name=HYDRAULIC_MOTOR.name,
    title=HYDRAULIC_MOTOR.title,
    parameters=HYDRAULIC_MOTOR.parameters,
    build=_build,
    options=HYDRAULIC_MOTOR.options,
    step_input="flow",
    step_output="velocity",
    step_size=100e-6,
    load_input="load",
    views=("step", "bode", "nyquist", "poles", "root-locus", "influence"),
)
