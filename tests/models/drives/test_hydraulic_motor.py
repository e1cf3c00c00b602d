import control
import numpy as np
import pytest

from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from tests.models.drives.oracles import S, assert_same_response, named, piston, response


def plant(values=None, *, lag=False):
    p = HYDRAULIC_MOTOR.parameters.with_values(values or {}).numbers()
    found = piston(p, p["oil_volume"] / p["bulk_modulus"])
    valve = 1 / (p["valve_time"] * S + 1) if lag else control.tf(1, 1)
    for output in ("displacement", "velocity", "acceleration", "pressure_drop"):
        found[output, "flow"] = found[output, "flow"] * valve
    found["motor_flow", "flow"], found["motor_flow", "load"] = valve, control.tf(0, 1)
    return p, found


def pd2(p):
    above = 1 + p["pd2_derivative"] * S + p["pd2_second_derivative"] * S**2
    return p["pd2_gain"] * above / (1 + p["pd2_filter"] * S) ** 2


def around(found, p, series):
    """Close z -> K_p -> series -> flow by hand: every response is the open one over 1 + L, or with its detour."""
    closed, gain = {}, p["position_gain"]
    back = response(found["displacement", "flow"]) * response(series) * gain
    for output in ("displacement", "velocity", "acceleration", "pressure_drop", "motor_flow"):
        forward = response(found[output, "flow"]) * response(series)
        closed[output, "flow"] = forward / (1 + back)
        closed[output, "reference"] = gain * forward / (1 + back)
        detour = gain * response(found["displacement", "load"]) * forward / (1 + back)
        closed[output, "load"] = response(found[output, "load"]) - detour
    return closed


@pytest.mark.parametrize("values", [{}, {"oil_volume": 300e-6, "bulk_modulus": 1.2e9, "reduced_mass": 600.0}])
@pytest.mark.parametrize("lag", [False, True])
def test_open_loop_is_the_balances_with_oil(values, lag):
    _, found = plant(values, lag=lag)
    compiled = drive_model(HYDRAULIC_MOTOR, values, {"valve_lag": "on" if lag else "off"}).compile()
    assert named(compiled.inputs) == ["flow", "load"]
    for (output, entry), expected in found.items():
        assert_same_response(compiled, output, entry, response(expected))


def test_pd2_stands_in_front_of_the_valve():
    p, found = plant(lag=True)
    compiled = drive_model(HYDRAULIC_MOTOR, {}, {"valve_lag": "on", "correction": "pd2"}).compile()
    for (output, entry), expected in found.items():
        wanted = response(expected) * (response(pd2(p)) if entry == "flow" else 1.0)
        assert_same_response(compiled, output, entry, wanted)


@pytest.mark.parametrize("correction", ["off", "pd2"])
@pytest.mark.parametrize("lag", ["off", "on"])
def test_position_loop_feeds_the_displacement_back(correction, lag):
    p, found = plant(lag=lag == "on")
    series = pd2(p) if correction == "pd2" else control.tf(1, 1)
    options = {"loop": "position", "correction": correction, "valve_lag": lag}
    compiled = drive_model(HYDRAULIC_MOTOR, {}, options).compile()
    assert named(compiled.inputs) == ["flow", "reference", "load"]
    for (output, entry), expected in around(found, p, series).items():
        assert_same_response(compiled, output, entry, expected)


def test_position_loop_ends_at_the_reference_and_a_load_moves_it_by_the_leakage():
    p, _ = plant()
    state_space = drive_model(HYDRAULIC_MOTOR, {}, {"loop": "position"}).compile().state_space()
    static = -state_space.c @ np.linalg.solve(state_space.a, state_space.b)
    assert static[0, 1] == pytest.approx(1.0, rel=1e-12)
    # At rest dp = F/A, and the loop replaces what leaks: K_p z = -a_m F/A.
    assert static[0, 2] == pytest.approx(-p["leakage"] / p["active_area"] / p["position_gain"], rel=1e-9)


def test_stability_limit_of_the_position_loop_is_that_of_routh():
    p, _ = plant()
    capacity = p["oil_volume"] / p["bulk_modulus"]
    cubic = capacity * p["reduced_mass"]
    square = capacity * p["viscous_loss"] + p["reduced_mass"] * p["leakage"]
    linear = p["active_area"] ** 2 + p["leakage"] * p["viscous_loss"]
    limit = square * linear / (cubic * p["active_area"])
    for share, stable in ((0.999, True), (1.001, False)):
        model = drive_model(HYDRAULIC_MOTOR, {"position_gain": share * limit}, {"loop": "position"})
        assert bool(np.all(model.compile().state_space().poles().real < 0)) is stable


def test_default_damping_ratio_is_that_of_a_valve_controlled_drive():
    pair = drive_model(HYDRAULIC_MOTOR).compile().state_space().poles()[1]
    assert 0.05 < -pair.real / abs(pair) < 0.3


def test_parameters_of_options_that_are_off_are_not_there():
    assert not {"valve_time", "valve_overlap", "pd2_gain", "position_gain"} & set(
        drive_model(HYDRAULIC_MOTOR).parameters
    )
    every = {"valve_lag": "on", "dead_zone": "on", "correction": "pd2", "loop": "position", "end_stops": "on"}
    assert set(drive_model(HYDRAULIC_MOTOR, {}, every).parameters) == set(HYDRAULIC_MOTOR.parameters)
