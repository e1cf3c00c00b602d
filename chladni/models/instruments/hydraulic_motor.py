"""The instrument of the linear hydraulic motor."""

from collections.abc import Mapping
from typing import cast

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.step_response import step_response
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.core.reading import Chart, Curve
from chladni.models.drives.drive_model import DriveModel
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from chladni.models.drives.selection import ChosenSignal
from chladni.models.instruments.drive_pages import COMMAND, drive_at

#: Flow, or with the position loop closed a tenth of a millimetre: small against dead zone and limits.
STEP_SIZE = 100e-6

# Without the flow, which has a chart of its own: in the command's unit it would pass for what follows the command.
_SHOWN = tuple(
    ChosenSignal(signal=signal) for signal in ("displacement", "velocity", "acceleration", "pressure_drop")
)


#: Name and title of the page's own chart.
FLOW = ("flow", "Flow asked for, without dead zone and limit")


def _build(values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    commanded = "reference" if options["loop"] == "position" else "flow"
    inputs = (ChosenSignal(signal=commanded, name=COMMAND), ChosenSignal(signal="load"))
    return drive_at(HYDRAULIC_MOTOR, values, options, inputs=inputs, outputs=_SHOWN)


def _flow_chart(model: Model) -> tuple[Chart, ...]:
    """Flow that the command asks for: what a correction costs."""
    drive = cast("DriveModel", model)
    flow = drive_at(
        HYDRAULIC_MOTOR,
        drive.parameters.numbers(),
        drive.options,
        inputs=drive.inputs,
        outputs=(ChosenSignal(signal="motor_flow"),),
    ).with_effects(drive.effects)
    response = step_response(linear_path(flow, from_input=COMMAND), size=STEP_SIZE)
    curve = Curve(label="motor_flow", x=response.time_s[0], y=response.values[0])
    return (
        Chart(
            name=FLOW[0],
            title=FLOW[1],
            x_label="time [s]",
            y_label="motor_flow [m^3/s]",
            curves=(curve,),
        ),
    )


INSTRUMENT = Instrument(
    name=HYDRAULIC_MOTOR.name,
    title=HYDRAULIC_MOTOR.title,
    parameters=HYDRAULIC_MOTOR.parameters,
    build=_build,
    options=HYDRAULIC_MOTOR.options,
    step_input=COMMAND,
    step_output="velocity",
    step_size=STEP_SIZE,
    load_input="load",
    # A fifth of what is rated.
    load_size=1000.0,
    extra_charts=_flow_chart,
    extra_titles=(FLOW,),
    views=("step", "bode", "nyquist", "poles", "root-locus", "influence"),
)
