"""Frequency responses, their grid and their phase against python-control and closed forms."""

import control
import numpy as np
import pytest

from chladni.models.analysis.frequency_curve import frequency_curve
from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.core.compiled_model import CompiledModel, DelayLine
from chladni.models.core.port import Port
from tests.models.analysis.systems import compiled, gain_only, of_control, pt2, random_stable, state_space

S = control.tf("s")


def loop_with_dead_time(gain: float, delay_s: float) -> CompiledModel:
    """``y' = gain (u - y(t - delay))``: an integrator in a loop with dead time."""
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    # The undelayed loop is in A; the delay line adds f = y(t - delay) - y(t), which enters with -gain.
    return compiled(
        state_space([[-gain]], [gain], [1.0], input_unit="m"),
        g=-gain * one, h=none, displacement_state=one, displacement_column=none, displacement_port=none,
        velocity_state=none, velocity_column=none, velocity_port=none,
        ports=(Port(name="y", kind="output"),), delays=(DelayLine(port=0, delay_s=delay_s),),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
def test_random_systems_respond_like_python_control(seed: int) -> None:
    system = random_stable(7, seed)
    curve = frequency_curve(linear_path(system))
    oracle = control.ss(system.a, system.b, system.c, system.d)

    expected = oracle(2j * np.pi * curve.frequency_hz)

    np.testing.assert_allclose(curve.response, expected, atol=1e-9 * np.abs(expected).max())
    # Far out the response is small beside its parts; rounding of those is what is left.
    np.testing.assert_allclose(curve.response, expected, rtol=1e-7)
    turns = (curve.phase_deg - np.degrees(np.angle(expected))) / 360
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)
    assert np.abs(np.diff(curve.phase_deg)).max() < 90


def test_the_phase_is_unwrapped_through_the_lightest_resonances() -> None:
    system = 1.0
    for omega in (1.0, 10.0, 100.0):
        system = system / (S**2 / omega**2 + 2e-5 * S / omega + 1)
    curve = frequency_curve(linear_path(of_control(system)))
    assert curve.phase_deg[0] == pytest.approx(0, abs=0.01)
    assert curve.phase_deg[-1] == pytest.approx(-540, abs=0.01)
    # At the far end six poles leave 1e-10 of the parts of the response, and of their digits six.
    assert np.all(np.diff(curve.phase_deg) < 1e-3)


@pytest.mark.parametrize(("order", "sign"), [(1, 1), (1, -1), (2, 1), (0, -1)])
def test_the_phase_begins_where_integrators_and_sign_put_it(order: int, sign: int) -> None:
    curve = frequency_curve(linear_path(of_control(sign / (S**order * (S + 1)))))
    assert curve.phase_deg[0] == pytest.approx(-90 * order + (180 if sign < 0 else 0), abs=3)
    assert curve.sign == sign


def test_dead_time_turns_the_phase_and_nothing_else() -> None:
    plain, late = frequency_curve(linear_path(pt2(5.0, 0.3))), compiled(pt2(5.0, 0.3), input_delays_s=(0.2,))
    curve = frequency_curve(linear_path(late))
    expected = plain.response[0] * np.exp(-2j * np.pi * plain.frequency_hz[0] * 0.2)
    assert curve.response[0] == pytest.approx(expected, rel=1e-12)
    at = curve.frequency_hz
    rational = np.interp(at, plain.frequency_hz, plain.phase_deg)
    inside = at < plain.frequency_hz[-1]
    np.testing.assert_allclose(curve.phase_deg[inside], (rational - 360 * at * 0.2)[inside], atol=0.3)


def test_a_loop_with_dead_time_has_its_own_exact_response() -> None:
    curve = frequency_curve(linear_path(loop_with_dead_time(2.0, 0.3)))
    s = 2j * np.pi * curve.frequency_hz
    expected = 2 / (s + 2 * np.exp(-0.3 * s))
    np.testing.assert_allclose(curve.response, expected, rtol=1e-11)


def test_a_gain_is_flat() -> None:
    curve = frequency_curve(linear_path(gain_only(-10.0)))
    np.testing.assert_allclose(curve.magnitude_db(), 20.0, rtol=1e-15)
    assert np.all(curve.phase_deg == 180.0)


def test_a_band_can_be_chosen() -> None:
    curve = frequency_curve(linear_path(pt2(5.0, 0.3)), band_hz=(0.5, 2.0))
    assert curve.frequency_hz[0] == pytest.approx(0.5)
    assert curve.frequency_hz[-1] == pytest.approx(2.0)


def test_many_decades_are_limited() -> None:
    wide = state_space(np.diag([-1e-6, -1e9]), [1e-6, 1e9], [1, 1])
    frequency_hz = frequency_curve(linear_path(wide)).frequency_hz
    assert np.log10(frequency_hz[-1] / frequency_hz[0]) <= 10.001


def test_derivatives_of_the_response_are_exact() -> None:
    resolvent = Resolvent(linear_path(pt2(2.0, 0.1, gain=3.0)))
    omega = 1.7
    value, slope, curve = resolvent.derivatives(omega)
    below = 4 - omega**2 + 0.4j * omega
    rate = -2 * omega + 0.4j
    assert value == pytest.approx(12 / below, rel=1e-13)
    assert slope == pytest.approx(-12 * rate / below**2, rel=1e-13)
    assert curve == pytest.approx(12 * (2 * rate**2 / below**3 + 2 / below**2), rel=1e-13)


def test_on_an_undamped_pole_to_the_last_digit_the_response_is_that_beside_it() -> None:
    path = linear_path(pt2(2.0, 0.0))
    resolvent = Resolvent(path)
    (pole,) = resolvent._diagonal.imag[resolvent._diagonal.imag > 0]
    on, off = resolvent(np.array([pole, 1.001 * pole]))
    assert np.isfinite(on)
    assert abs(on) > 1e9 * abs(off)
