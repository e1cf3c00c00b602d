import numpy as np
import pytest
from scipy import signal

from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.pneumatic_motor import PNEUMATIC_MOTOR
from chladni.models.drives.seal_friction import seal_friction_force
from chladni.signals.errors import ModelError
from chladni.signals.units import si_factor
from tests.models.drives.oracles import assert_same_response, piston, response

CORNERS = [
    {},
    {"active_area": 50e-4, "air_volume": 1000e-6, "reduced_mass": 600.0, "leakage": 0.7e-11, "viscous_loss": 800.0},
    {"active_area": 80e-4, "air_volume": 500e-6, "reduced_mass": 100.0, "leakage": 0.2e-11, "viscous_loss": 1800.0},
    # Overdamped: both roots real.
    {"active_area": 5e-4, "viscous_loss": 4000.0, "reduced_mass": 100.0},
]


def numbers(values):
    given = PNEUMATIC_MOTOR.parameters.with_values(values).numbers()
    capacity = given["air_volume"] / (given["adiabatic_exponent"] * given["pressure"])
    return given, capacity


@pytest.mark.parametrize("values", CORNERS)
def test_transfer_function_has_the_papers_coefficients(values):
    p, capacity = numbers(values)
    system = drive_model(PNEUMATIC_MOTOR, values).compile().state_space()
    below = np.poly(system.a)
    area, mass, leakage, loss = p["active_area"], p["reduced_mass"], p["leakage"], p["viscous_loss"]
    printed = np.array([capacity * mass, capacity * loss + mass * leakage, area**2 + leakage * loss, 0.0])
    np.testing.assert_allclose(below[:-1], (printed / printed[0])[:-1], rtol=1e-12)
    # det(s I - A) of an integrator ends in a rounded zero.
    assert abs(below[-1]) <= 1e-12 * below[-2]
    # The numerator: C adj(s I - A) B, read off one real point where nothing cancels.
    s = 10.0
    value = (system.c @ np.linalg.solve(s * np.eye(3) - system.a, system.b))[0, 0]
    np.testing.assert_allclose(value * s * np.polyval(printed[:-1], s), area, rtol=1e-12)


@pytest.mark.parametrize("values", CORNERS)
def test_every_response_is_that_of_the_balances(values):
    p, capacity = numbers(values)
    compiled = drive_model(PNEUMATIC_MOTOR, values).compile()
    for (output, entry), expected in piston(p, capacity).items():
        assert_same_response(compiled, output, entry, response(expected))
        assert_same_response(compiled.state_space(), output, entry, response(expected))


@pytest.mark.parametrize("values", CORNERS)
def test_poles_are_those_of_the_quadratic(values):
    p, capacity = numbers(values)
    scale = capacity * p["reduced_mass"]
    damping = (capacity * p["viscous_loss"] + p["reduced_mass"] * p["leakage"]) / scale
    stiffness = (p["active_area"] ** 2 + p["leakage"] * p["viscous_loss"]) / scale
    expected = np.sort_complex([0.0, *np.roots([1.0, damping, stiffness])])
    found = np.sort_complex(drive_model(PNEUMATIC_MOTOR, values).compile().state_space().poles())
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


def test_velocity_after_a_step_of_flow_is_the_closed_form():
    p, capacity = numbers({})
    system = drive_model(PNEUMATIC_MOTOR).compile().state_space()
    scale = capacity * p["reduced_mass"]
    decay = (capacity * p["viscous_loss"] + p["reduced_mass"] * p["leakage"]) / scale / 2
    stiffness = (p["active_area"] ** 2 + p["leakage"] * p["viscous_loss"]) / scale
    omega = np.sqrt(stiffness - decay**2)
    flow, time_s = 50e-6, np.linspace(0.0, 4.0, 401)
    final = flow * p["active_area"] / scale / stiffness
    wave = np.cos(omega * time_s) + decay / omega * np.sin(omega * time_s)
    expected = final * (1 - np.exp(-decay * time_s) * wave)
    _, found, _ = signal.lsim((system.a, system.b, system.c, system.d), np.tile([flow, 0.0], (401, 1)), time_s)
    np.testing.assert_allclose(found[:, 1], expected, rtol=1e-9, atol=1e-11 * final)


def test_ranges_are_the_papers_in_si():
    shown = {
        "active_area": (50, 80, "cm^2"), "air_volume": (500, 1000, "cm^3"), "leakage": (0.02, 0.07, "cm^5/(N s)"),
        "pressure": (4, 6, "bar"), "reduced_mass": (100, 600, "kg"), "viscous_loss": (8, 18, "N s/cm"),
        "stroke": (30, 40, "cm"), "rated_flow": (20, 100, "cm^3/s"), "rated_load": (100, 300, "N"),
    }  # fmt: skip
    for name, (low, high, unit) in shown.items():
        parameter = PNEUMATIC_MOTOR.parameters[name]
        factor, si_unit = si_factor(unit)
        assert si_factor(parameter.shown_unit or parameter.unit)[1] == si_unit == si_factor(parameter.unit)[1]
        np.testing.assert_allclose([parameter.low, parameter.high], [low * factor, high * factor], rtol=1e-12)
        assert parameter.usual


def test_leakage_hardly_matters_over_the_papers_ranges():
    p = PNEUMATIC_MOTOR.parameters
    assert p["leakage"].high * p["viscous_loss"].high / p["active_area"].low ** 2 <= 5.1e-4


def test_end_stops_are_a_law_at_the_piston_between_both_ends():
    compiled = drive_model(PNEUMATIC_MOTOR, {"start_position": 0.1}, {"end_stops": "on"}).compile()
    (law,) = compiled.laws
    assert compiled.ports[law.port].name == "piston"
    assert law.parameters[:2] == (-0.1, pytest.approx(0.25))
    assert law.function(0.0, 1.0, 0.0, law.parameters, (), ()) == 0.0
    assert not drive_model(PNEUMATIC_MOTOR).compile().laws


def test_stops_act_only_when_they_are_on():
    assert "stop_stiffness" not in drive_model(PNEUMATIC_MOTOR).parameters
    with pytest.raises(ModelError, match="stop_stiffness acts only with option end_stops = on"):
        drive_model(PNEUMATIC_MOTOR, {"stop_stiffness": 1e7})


def test_a_start_outside_the_stroke_is_refused():
    with pytest.raises(ModelError, match=r"start_position: 0\.36 m lies beyond the stroke of 0\.35 m"):
        drive_model(PNEUMATIC_MOTOR, {"start_position": 0.36})


def test_measured_friction_of_the_seals_acts_at_the_piston_over_the_pressure():
    compiled = drive_model(PNEUMATIC_MOTOR, {}, {"seal_friction": "on"}).compile()
    (law,) = compiled.laws
    assert compiled.ports[law.port].name == "piston"
    force, _ = seal_friction_force(5e5 - 101325.0, active_area=70e-4)
    assert force in law.parameters
    assert 10.0 < force < 40.0


def test_joint_carries_the_viscous_loss_for_laws_that_need_it():
    compiled = drive_model(DRIVES["pneumatic-motor"], {"viscous_loss": 900.0}).compile()
    assert compiled.ports[compiled.port_index("piston", "joint")].damping == 900.0


def test_a_force_at_the_joint_resists_and_one_on_the_body_pushes():
    compiled = drive_model(PNEUMATIC_MOTOR).compile()
    velocity = compiled.states.index("velocity")
    mass = PNEUMATIC_MOTOR.parameters["reduced_mass"].value
    assert compiled.g[velocity, compiled.port_index("piston", "joint")] == pytest.approx(-1 / mass)
    assert compiled.g[velocity, compiled.port_index("axis", "body")] == pytest.approx(1 / mass)
    # What helps the load resists as the load does.
    assert compiled.g[velocity, compiled.port_index("load", "actuation")] == compiled.b[velocity, 1]
    pressure = compiled.states.index("pressure_drop")
    assert compiled.g[pressure, compiled.port_index("flow", "actuation")] == compiled.b[pressure, 0]
    acceleration = [terminal.name for terminal in compiled.outputs].index("acceleration")
    np.testing.assert_array_equal(compiled.h[acceleration], compiled.g[velocity])


@pytest.mark.parametrize("pressure", [5e4, 20e5])
def test_seals_at_a_pressure_that_was_not_measured_are_refused_by_the_motors_own_number(pressure):
    drive_model(PNEUMATIC_MOTOR, {"pressure": pressure})
    with pytest.raises(ModelError, match=f"^pressure = {pressure / 1e5:g} bar absolute: seal friction: "):
        drive_model(PNEUMATIC_MOTOR, {"pressure": pressure}, {"seal_friction": "on"})
