"""The instrument of the DC servo drive."""

from collections.abc import Mapping
from dataclasses import replace

from chladni.models.core.instrument import Instrument, Option
from chladni.models.drives.dc_servo import DC_SERVO
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.selection import ChosenSignal
from chladni.models.instruments.drive_pages import COMMAND, drive_at

#: What the page starts with, where it isn't what a bare model has.
_STARTS = {"loop": "velocity", "converter_lag": "on"}


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    commanded = "voltage" if options["loop"] == "open" else f"{options['loop']}_reference"
    # One name whatever loop is closed, so that the page can step it.
    inputs = (ChosenSignal(signal=commanded, name=COMMAND), ChosenSignal(signal="load_torque"))
    return drive_at(DC_SERVO, values, options, inputs=inputs)


def _option(option: Option) -> Option:
    return replace(option, default=_STARTS.get(option.name, option.default))


#: The command is a voltage, a current, a velocity or a position, by the loop that is closed.
INSTRUMENT = Instrument(
    name=DC_SERVO.name,
    title=DC_SERVO.title,
    parameters=DC_SERVO.parameters,
    build=_build,
    options=tuple(_option(option) for option in DC_SERVO.options),
    step_input=COMMAND,
    step_output="velocity",
    # A position of 0.1 rad is reached without the limits; ten times as much isn't.
    step_size=0.1,
    load_input="load_torque",
    # A tenth of the torque that the rated current gives.
    load_size=0.25,
    views=("step", "bode", "nyquist", "poles", "root-locus", "influence"),
)
