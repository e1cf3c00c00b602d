import numpy as np
import pytest

from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from tests.models.drives.oracles import named


def steady_flow(command, options, values=None):
    """Flow into the motor at rest of the spool: the valve's port alone, its law called as Python."""
    compiled = drive_model(HYDRAULIC_MOTOR, values or {}, options).compile()
    row = named(compiled.outputs).index("motor_flow")
    # The spool has come to rest where it is commanded.
    spool = command if "spool" in compiled.states else 0.0
    states = np.array([spool if name == "spool" else 0.0 for name in compiled.states])
    inputs = np.array([command, 0.0])
    forces = np.zeros(len(compiled.ports))
    for law in compiled.laws:
        d = compiled.displacement_state[law.port] @ states + compiled.displacement_column[law.port] @ inputs
        forces[law.port] += law.function(d, 0.0, 0.0, law.parameters, (), ())
    return compiled.c[row] @ states + compiled.d[row] @ inputs + compiled.h[row] @ forces


@pytest.mark.parametrize("lag", ["off", "on"])
@pytest.mark.parametrize(
    ("options", "commands", "flows"),
    [
        ({}, [10e-6, -500e-6], [10e-6, -500e-6]),
        ({"saturation": "on"}, [10e-6, 500e-6, -500e-6], [10e-6, 400e-6, -400e-6]),
        ({"dead_zone": "on"}, [10e-6, 30e-6, -30e-6, 900e-6], [0.0, 10e-6, -10e-6, 880e-6]),
        ({"dead_zone": "on", "saturation": "on"}, [19e-6, 410e-6, 430e-6, -900e-6], [0.0, 390e-6, 400e-6, -400e-6]),
    ],
)
def test_flow_against_command(lag, options, commands, flows):
    values = {"valve_overlap": 0.05} if "dead_zone" in options else {}
    for command, flow in zip(commands, flows, strict=True):
        found = steady_flow(command, {**options, "valve_lag": lag}, values)
        assert found == pytest.approx(flow, rel=1e-12, abs=1e-20)


def test_an_ideal_valve_has_no_law():
    assert drive_model(HYDRAULIC_MOTOR, {}, {"valve_lag": "on"}).compile().is_linear()
