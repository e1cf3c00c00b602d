import pytest

from chladni.models.drives.dc_servo import DC_SERVO
from chladni.models.instruments.dc_servo import INSTRUMENT


@pytest.mark.parametrize(
    ("loop", "unit"), [("open", "V"), ("current", "A"), ("velocity", "rad/s"), ("position", "rad")]
)
def test_the_command_is_that_of_the_loop_that_is_closed(loop, unit):
    compiled = INSTRUMENT.model({}, {"loop": loop}).compile()
    assert [(t.name, t.unit) for t in compiled.inputs] == [("command", unit), ("load_torque", "N m")]


def test_the_page_starts_with_a_velocity_loop_and_a_bare_model_with_none():
    assert INSTRUMENT.model().compile().inputs[0].unit == "rad/s"
    assert DC_SERVO.choices({})["loop"] == "open"
    assert "armature_voltage" in INSTRUMENT.model().compile().states


def test_knobs_are_those_of_the_kind():
    assert INSTRUMENT.parameters is DC_SERVO.parameters
    assert "load_inertia" in INSTRUMENT.model({}, {"gear": "on"}).parameters
    assert "load_inertia" not in INSTRUMENT.model({"load_inertia": 1e-3}).parameters
