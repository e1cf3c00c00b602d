"""Step and impulse responses against closed forms and python-control."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.step_response import impulse_response, step_response
from chladni.models.core.compiled_model import DelayLine
from chladni.models.core.port import Port
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import compiled, gain_only, pt2, random_stable, state_space


@given(zeta=st.floats(0.01, 0.99), omega=st.floats(1e-3, 1e5))
def test_a_pt2_answers_by_its_closed_form(zeta: float, omega: float) -> None:
    found = step_response(linear_path(pt2(omega, zeta, gain=2.0)), size=3.0)

    t = found.time_s[0]
    damped = omega * np.sqrt(1 - zeta**2)
    swing = np.cos(damped * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(damped * t)
    np.testing.assert_allclose(found.values[0], 6.0 * (1 - np.exp(-zeta * omega * t) * swing), atol=1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_random_systems_answer_like_python_control(seed: int) -> None:
    system = random_stable(5, seed)
    found = step_response(linear_path(system))

    # The oracle wants equal steps: from the last stage on ours are.
    step = found.time_s[0, -1] - found.time_s[0, -2]
    t = np.arange(0, found.time_s[0, -1], step)
    expected = control.step_response(control.ss(system.a, system.b, system.c, system.d), T=t)
    ours = np.interp(t, found.time_s[0], found.values[0])
    shared = np.isin(np.round(t / step, 6), np.round(found.time_s[0] / step, 6))
    assert shared.sum() > 100
    scale = np.abs(expected.outputs).max()
    np.testing.assert_allclose(ours[shared], expected.outputs[shared], atol=1e-9 * scale)


def test_an_impulse_is_the_rate_of_a_step() -> None:
    path = linear_path(pt2(5.0, 0.3))
    impulse = impulse_response(path, area=2.0)
    t = impulse.time_s[0]
    damped = 5 * np.sqrt(1 - 0.09)
    np.testing.assert_allclose(impulse.values[0], 2 * 25 / damped * np.exp(-1.5 * t) * np.sin(damped * t), atol=1e-12)
    assert impulse.notes == ()


def test_an_impulse_that_passes_directly_is_told() -> None:
    lead = state_space([[-1.0]], [1.0], [1.0], 2.0)
    assert "the impulse itself passes too" in impulse_response(linear_path(lead)).notes[0]


def test_dead_time_shifts_the_answer() -> None:
    plain = step_response(linear_path(pt2(5.0, 0.3)))
    late = step_response(linear_path(compiled(pt2(5.0, 0.3), input_delays_s=(0.25,))))

    assert late.values[0, :2].tolist() == [0.0, 0.0]
    assert late.time_s[0, :2].tolist() == [0.0, 0.25]
    np.testing.assert_array_equal(late.time_s[0, 2:], plain.time_s[0] + 0.25)
    np.testing.assert_array_equal(late.values[0, 2:], plain.values[0])


def test_integrators_ramp_for_as_long_as_the_rest_moves() -> None:
    integrating = state_space([[0, 1], [0, -2.0]], [0, 2.0], [1, 0])
    found = step_response(linear_path(integrating))
    t = found.time_s[0]
    np.testing.assert_allclose(found.values[0], t - (1 - np.exp(-2 * t)) / 2, atol=1e-13)
    assert t[-1] == pytest.approx(3.5, rel=0.1)


def test_what_grows_is_shown_growing_and_told() -> None:
    found = step_response(linear_path(state_space([[2.0]], [1.0], [1.0])))
    np.testing.assert_allclose(found.values[0], (np.exp(2 * found.time_s[0]) - 1) / 2, rtol=1e-12, atol=1e-15)
    assert "the response grows" in found.notes[0]
    assert np.exp(2 * found.time_s[0, -1]) == pytest.approx(np.exp(5), rel=0.05)


def test_what_swings_on_is_cut_and_told() -> None:
    found = step_response(linear_path(pt2(2 * np.pi, 1e-4)))
    assert found.time_s[0, -1] == pytest.approx(60.0, rel=0.01)
    assert "goes on after 60 periods" in found.notes[0]


def test_fast_and_slow_are_both_resolved() -> None:
    stiff = state_space(np.diag([-1e6, -1.0]), [1e6, 1.0], [1.0, 1.0])
    found = step_response(linear_path(stiff))
    t = found.time_s[0]
    np.testing.assert_allclose(found.values[0], 2 - np.exp(-1e6 * t) - np.exp(-t), atol=1e-11)
    assert np.count_nonzero((t > 0) & (t < 5e-6)) > 20


def test_a_gain_and_integrators_alone_have_a_picture() -> None:
    gain = step_response(linear_path(gain_only(3.0)))
    assert np.all(gain.values == 3.0)
    double = step_response(linear_path(state_space([[0, 1], [0, 0]], [0, 1], [1, 0])))
    np.testing.assert_allclose(double.values[0], double.time_s[0] ** 2 / 2, rtol=1e-12, atol=1e-16)


def test_a_length_can_be_chosen() -> None:
    path = linear_path(pt2(5.0, 0.3))
    assert step_response(path, seconds=0.1).time_s[0, -1] == pytest.approx(0.1, rel=0.05)
    for seconds in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(ModelError, match="give a length above 0 s"):
            step_response(path, seconds=seconds)


def test_dead_time_inside_a_loop_is_left_to_simulation() -> None:
    port = Port(name="y", kind="output")
    looped = compiled(
        pt2(5.0, 0.3), g=np.ones((2, 1)), h=np.zeros((1, 1)), displacement_state=np.ones((1, 2)),
        displacement_column=np.zeros((1, 1)), displacement_port=np.zeros((1, 1)), velocity_state=np.zeros((1, 2)),
        velocity_column=np.zeros((1, 1)), velocity_port=np.zeros((1, 1)), ports=(port,),
        delays=(DelayLine(port=0, delay_s=0.1),),
    )  # fmt: skip
    with pytest.raises(ModelError, match="simulate the model"):
        step_response(linear_path(looped))
