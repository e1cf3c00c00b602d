"""Behaviour after a step against closed forms, and the reason where there is none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.analysis.behaviour import behaviour
from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.step_behaviour import step_marks, step_quantities
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.reading import Quantity
from chladni.models.core.state_space import StateSpace
from chladni.models.instruments import robot_arm as robot_arm_instrument
from tests.models.analysis.systems import compiled, gain_only, pt2, state_space


def told(system: StateSpace | CompiledModel, *, size: float = 1.0, band: float = 0.02) -> dict[str, Quantity]:
    path = linear_path(system).to("y")
    return {one.name: one for one in step_quantities(path, step_marks(path, band=band), size=size, band=band)}


def number(quantity: Quantity) -> float:
    assert quantity.value is not None
    return quantity.value


@given(zeta=st.floats(0.05, 0.9), omega=st.floats(1e-2, 1e4))
def test_a_pt2_has_the_textbook_behaviour(zeta: float, omega: float) -> None:
    found = told(pt2(omega, zeta, gain=2.0), size=3.0)

    damped = omega * np.sqrt(1 - zeta**2)
    peak = np.pi / damped
    # Zeros of the rate and its derivative: rounding of the state, over the slope there.
    assert number(found["answer_time"]) == pytest.approx(peak, rel=1e-10)
    assert number(found["peak_time"]) == pytest.approx(peak, rel=1e-10)
    assert number(found["overshoot"]) == pytest.approx(100 * np.exp(-zeta * omega * peak), rel=1e-9, abs=1e-9)
    assert number(found["final_value"]) == pytest.approx(6.0, rel=1e-13)
    # Of a displacement the acceleration is largest at the step itself: k omega^2 times the step.
    assert number(found["peak_acceleration"]) == pytest.approx(6.0 * omega**2, rel=1e-12)
    assert found["acceleration_time"].value == 0.0


def test_the_acceleration_of_a_velocity_is_its_rate() -> None:
    zeta, omega = 0.3, 5.0
    found = told(pt2(omega, zeta, output_unit="m/s"), size=2.0)
    damped = omega * np.sqrt(1 - zeta**2)
    at = np.arccos(zeta) / damped
    largest = 2 * omega**2 / damped * np.exp(-zeta * omega * at) * np.sin(damped * at)
    assert number(found["acceleration_time"]) == pytest.approx(at, rel=1e-12)
    assert number(found["peak_acceleration"]) == pytest.approx(largest, rel=1e-13)
    assert found["peak_acceleration"].unit == "m/s^2"


def test_a_first_order_lag() -> None:
    found = told(state_space([[-4.0]], [4.0], [1.0], output_unit="N"))
    assert number(found["rise_time"]) == pytest.approx(np.log(9) / 4, rel=1e-13)
    assert number(found["settling_time"]) == pytest.approx(np.log(50) / 4, rel=1e-13)
    assert found["overshoot"].value == 0.0
    assert found["answer_time"].value is None
    assert "none here: it has no such peak" in found["answer_time"].definition
    assert "it's no motion" in found["peak_acceleration"].definition
    assert found["steady_state_error"].value == 0.0
    assert number(found["tracking_error"]) == pytest.approx(0.25, rel=1e-13)


def test_settling_is_the_last_entry_into_the_band() -> None:
    zeta, omega = 0.1, 1.0
    found = number(told(pt2(omega, zeta), band=0.05)["settling_time"])
    t = np.linspace(0, 80, 2_000_001)
    damped = omega * np.sqrt(1 - zeta**2)
    away = np.exp(-zeta * omega * t) * np.abs(np.cos(damped * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(damped * t))
    # On a grid of 40 us the last point outside lies at most a step before.
    assert 0 <= found - t[np.flatnonzero(away > 0.05)[-1]] <= 4.1e-5


def test_where_the_output_integrates_its_rate_is_read() -> None:
    velocity = told(pt2(5.0, 0.3, output_unit="m/s"))
    integrated = told(state_space([[0, 1, 0], [0, 0, 1], [0, -25, -3]], [0, 0, 25], [1, 0, 0]))
    for name in ("answer_time", "overshoot", "settling_time", "rise_time", "peak_acceleration", "final_value"):
        assert number(integrated[name]) == pytest.approx(number(velocity[name]), rel=1e-11)
    assert "rate of" in integrated["answer_time"].definition
    assert integrated["final_value"].unit == "m/s"


def test_errors_that_stay_are_those_of_the_loop() -> None:
    # k/(s + 1) in a unit loop with k = 4: error 1/(1 + k); an integral loop k/(s (s + 1)): lag 1/k behind a ramp.
    first = told(state_space([[-5.0]], [4.0], [1.0], input_unit="m"), size=10.0)
    assert number(first["steady_state_error"]) == pytest.approx(2.0, rel=1e-13)
    assert first["tracking_error"].value is None
    assert "it grows for ever" in first["tracking_error"].definition
    second = told(state_space([[0, 1], [-4, -1]], [0, 4], [1, 0], input_unit="m"))
    assert second["steady_state_error"].value == 0.0
    assert number(second["tracking_error"]) == pytest.approx(0.25, rel=1e-13)


def test_an_output_of_another_unit_follows_nothing() -> None:
    assert "can't follow an input of another unit (N)" in told(pt2(1.0, 0.5))["steady_state_error"].definition


def test_dead_time_comes_before_every_time_but_the_rise() -> None:
    plain, late = told(pt2(5.0, 0.3)), told(compiled(pt2(5.0, 0.3), input_delays_s=(0.5,)))
    for name in ("answer_time", "peak_time", "settling_time"):
        assert number(late[name]) == pytest.approx(number(plain[name]) + 0.5, rel=1e-14)
    assert number(late["rise_time"]) == number(plain["rise_time"])


@pytest.mark.parametrize(
    ("system", "reason"),
    [
        (state_space([[0.5]], [1], [1]), "the response grows"),
        (pt2(3.0, 0.0), "swings for ever"),
    ],
)
def test_what_never_settles_has_no_behaviour(system: StateSpace, reason: str) -> None:
    found = told(system)
    assert all(quantity.value is None for quantity in found.values())
    assert reason in found["answer_time"].definition


def test_a_response_that_returns_to_zero() -> None:
    # The rate of a lag: y = 4 s/(s + 4) u jumps to 4 and dies out.
    found = told(state_space([[-4.0]], [-16.0], [1.0], 4.0))
    assert found["final_value"].value == pytest.approx(0.0, abs=1e-14)
    assert found["overshoot"].value is None
    assert found["rise_time"].value is None
    assert "jumps at the step" in found["peak_acceleration"].definition


def test_a_gain_follows_at_once() -> None:
    found = told(gain_only(1.0))
    assert (found["settling_time"].value, found["steady_state_error"].value) == (0.0, 0.0)


def test_a_light_damping_is_followed_until_it_settles() -> None:
    zeta = 2e-3
    found = number(told(pt2(1.0, zeta))["settling_time"])
    # The envelope reaches 2 % at ln(50)/zeta; the last swing out of it is at most half a period before.
    assert np.log(50) / zeta - np.pi <= found <= np.log(50) / zeta + 1


def test_what_integrates_and_is_reached_directly_has_no_reading() -> None:
    found = told(state_space([[0.0]], [1.0], [1.0], 2.0))
    assert "it integrates and is reached directly" in found["answer_time"].definition


@pytest.mark.parametrize(("row", "direct", "unit"), [([0, 1], 0.0, "m/s"), ([-25, -3], 25.0, "m/s^2")])
def test_where_a_motion_dies_out_the_displacement_behind_it_is_read(row, direct: float, unit: str) -> None:
    displacement = told(pt2(5.0, 0.3))
    behind = told(state_space([[0, 1], [-25, -3]], [0, 25], row, direct, output_unit=unit))
    for name in ("answer_time", "overshoot", "settling_time", "rise_time", "peak_acceleration", "final_value"):
        assert number(behind[name]) == pytest.approx(number(displacement[name]), rel=1e-11)
    assert "integral of y" in behind["answer_time"].definition


def test_what_dies_out_but_is_no_motion_is_read_as_it_is() -> None:
    high_pass = told(state_space([[-4.0]], [-16.0], [1.0], 4.0, output_unit="V"))
    assert high_pass["answer_time"].value is None


def test_an_accelerometer_on_a_structure_tells_the_behaviour_of_its_displacement() -> None:
    model = robot_arm_instrument.INSTRUMENT.model()
    displacement, acceleration = (
        behaviour(model, from_input="push", to_output=name) for name in ("tool_displacement", "acc_tool")
    )
    for name in ("answer_time", "overshoot", "settling_time", "rise_time", "peak_acceleration", "final_value"):
        # Two integrations cost the digits of the stiffest joint over the softest, squared.
        assert acceleration.value(name) == pytest.approx(displacement.value(name), rel=1e-9), name
