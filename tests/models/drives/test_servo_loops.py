"""The textbook's rules give the textbook's step responses where its assumptions hold."""

import numpy as np
import pytest

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.step_response import step_response
from chladni.models.drives.dc_servo import DC_SERVO
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.servo_loops import LOOPS, tuned_gains

# Neither back-EMF nor friction: the plant of the rules, an integrator behind the current.
IDEAL = {"back_emf": 0.0, "viscous_loss": 0.0}


def overshoot(loop, output, seconds):
    model = drive_model(DC_SERVO, IDEAL, {"loop": loop, "converter_lag": "on"})
    path = linear_path(model, from_input=f"{loop}_reference", to_outputs=[output])
    return float(step_response(path, seconds=seconds).values.max()) - 1.0


def test_magnitude_optimum_overshoots_by_4_3_percent():
    # Damping ratio 1/sqrt(2): exp(-pi).
    assert overshoot("current", "current", 5e-3) == pytest.approx(np.exp(-np.pi), rel=1e-3)


def test_symmetrical_optimum_with_its_filter_overshoots_by_8_1_percent():
    # The rule takes the current loop for a lag of 2 T, which costs a few percent of its 8.1.
    assert overshoot("velocity", "velocity", 2e-2) == pytest.approx(0.081, abs=0.02)


def test_position_loop_does_not_overshoot():
    assert overshoot("position", "position", 0.1) < 1e-3


def test_rules_of_the_current_loop_cancel_the_armature():
    values = {"resistance": 2.0, "inductance": 8e-3, "torque_constant": 0.2, "converter_time": 2e-4}
    gains = tuned_gains(values, inertia=5e-4)
    assert gains["current_time"] == pytest.approx(4e-3)
    assert gains["current_gain"] == pytest.approx(20.0)
    assert gains["velocity_gain"] == pytest.approx(5e-4 / (2 * 0.2 * 4e-4))
    assert gains["velocity_time"] == pytest.approx(1.6e-3)


def test_each_loop_has_those_inside_it():
    assert LOOPS == ("open", "current", "velocity", "position")
    counts = [len(DC_SERVO.loops(DC_SERVO.parameters.numbers(), DC_SERVO.choices({"loop": word}))) for word in LOOPS]
    assert counts == [0, 1, 2, 3]
