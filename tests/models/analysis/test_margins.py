"""Margins, crossings and peaks against python-control and closed forms."""

from dataclasses import replace

import control
import numpy as np
import pytest

from chladni.models.analysis.frequency_behaviour import frequency_behaviour, frequency_quantities
from chladni.models.analysis.frequency_curve import frequency_curve
from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.margins import FrequencyMarks
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.state_space import StateSpace
from tests.models.analysis.systems import compiled, gain_only, of_control, pt2, state_space
from tests.models.analysis.test_frequency_curve import loop_with_dead_time

S = control.tf("s")


def found(system: StateSpace | CompiledModel) -> dict[str, float | None]:
    path = linear_path(system).to("y")
    return {one.name: one.value for one in frequency_quantities(path, frequency_behaviour(path))}


@pytest.mark.parametrize(
    "function",
    [
        8 / ((S + 1) * (S + 2) * (S + 3)),
        30 * (S + 1) / (S * (S + 2) * (S**2 + 0.4 * S + 25)),
        5 * (S**2 + 0.1 * S + 4) / ((S + 1) * (S**2 + 0.05 * S + 9) * (S + 0.1)),
        20 / (S * (S**2 + 0.2 * S + 4) * (S + 5)),
    ],
)
def test_all_margins_are_those_of_python_control(function: control.TransferFunction) -> None:
    behaviour = frequency_behaviour(linear_path(of_control(function)))
    gains, phases, _, at_gain, at_phase, _ = control.stability_margins(function, returnall=True)

    ours = [(margin.frequency_hz * 2 * np.pi, margin.gain) for margin in behaviour.gain_margins]
    expected = [(w, g) for w, g in zip(at_gain, gains, strict=True) if 0 < w < np.inf]
    # The oracle finds them as roots of polynomials, good to about 1e-8.
    np.testing.assert_allclose(ours, expected, rtol=1e-6)
    ours = [(margin.frequency_hz * 2 * np.pi, margin.phase_deg) for margin in behaviour.phase_margins]
    wrapped = (np.asarray(phases) + 180) % 360 - 180
    np.testing.assert_allclose(ours, np.column_stack([at_phase, wrapped]), rtol=1e-6, atol=1e-6)


def test_a_cubic_lag_has_the_textbook_margins() -> None:
    # 8/(s + 1)^3: -180 degrees at sqrt(3), where the magnitude is 1; the limit of stability.
    behaviour = frequency_behaviour(linear_path(of_control(4 / (S + 1) ** 3)))
    (margin,) = behaviour.gain_margins
    assert margin.frequency_hz * 2 * np.pi == pytest.approx(np.sqrt(3), rel=1e-12)
    assert margin.gain == pytest.approx(2.0, rel=1e-12)


def test_dead_time_has_many_crossings() -> None:
    behaviour = frequency_behaviour(linear_path(compiled(gain_only(0.5), input_delays_s=(1.0,))))
    at = [margin.frequency_hz * 2 * np.pi for margin in behaviour.gain_margins]
    np.testing.assert_allclose(at, np.pi * (2 * np.arange(len(at)) + 1), rtol=1e-12)
    assert len(at) >= 3
    assert behaviour.phase_margins == ()


@pytest.mark.parametrize("zeta", [1e-3, 0.1, 0.6])
def test_a_pt2_resonates_by_its_closed_forms(zeta: float) -> None:
    omega = 7.0
    numbers = found(pt2(omega, zeta))
    turn = 2 * np.pi
    assert numbers["resonance_frequency"] == pytest.approx(omega * np.sqrt(1 - zeta**2) / turn, rel=1e-12)
    assert numbers["damping_ratio"] == pytest.approx(zeta, rel=1e-10)
    assert numbers["peak_frequency"] == pytest.approx(omega * np.sqrt(1 - 2 * zeta**2) / turn, rel=1e-12)
    inner = 1 - 2 * zeta**2
    assert numbers["bandwidth"] == pytest.approx(omega * np.sqrt(inner + np.sqrt(inner**2 + 1)) / turn, rel=1e-12)


def test_what_is_damped_has_no_peak() -> None:
    numbers = found(pt2(7.0, 0.8))
    assert numbers["peak_frequency"] is None
    overdamped = found(of_control(6 / ((S + 2) * (S + 3))))
    assert overdamped["resonance_frequency"] is None
    assert overdamped["damping_ratio"] is None


def test_the_critical_frequency_is_that_of_the_displacement() -> None:
    displacement = of_control(25 / (S * (S**2 + 3 * S + 25)))
    velocity = pt2(5.0, 0.3, output_unit="m/s")
    acceleration = of_control(25 * S / (S**2 + 3 * S + 25), output_unit="m/s^2")
    for system in (displacement, velocity, acceleration):
        assert found(system)["critical_frequency"] == pytest.approx(5 / (2 * np.pi), rel=1e-12)


def test_the_sign_of_the_path_doesn_t_move_the_critical_frequency() -> None:
    assert found(pt2(5.0, 0.3, gain=-2.0, output_unit="m/s"))["critical_frequency"] == pytest.approx(
        5 / (2 * np.pi), rel=1e-12
    )


def test_two_integrators_lie_on_the_level_but_don_t_cross_it() -> None:
    behaviour = frequency_behaviour(linear_path(state_space([[0, 1], [0, 0]], [0, 1], [1, 0])))
    assert behaviour.gain_margins == ()
    (margin,) = behaviour.phase_margins
    assert margin.phase_deg == pytest.approx(0, abs=1e-9)


def test_an_integrator_has_no_bandwidth() -> None:
    assert found(of_control(1 / (S * (S + 1))))["bandwidth"] is None


def test_marks_of_a_loop_with_dead_time_are_on_its_exact_response() -> None:
    gain, delay = 2.0, 0.3
    behaviour = frequency_behaviour(linear_path(loop_with_dead_time(gain, delay)))
    assert behaviour.peak is not None
    omega, height = behaviour.peak
    grid = np.linspace(0.99, 1.01, 20001) * omega
    values = np.abs(gain / (1j * grid + gain * np.exp(-1j * grid * delay)))
    assert height == pytest.approx(values.max(), rel=1e-9)
    # On a grid of 1e-6 the place of a maximum is good to a step.
    assert grid[values.argmax()] == pytest.approx(omega, rel=2e-6)


def test_a_crossing_on_a_point_of_the_grid_is_one_crossing() -> None:
    system = pt2(2.0, 0.2)
    path = linear_path(system)
    # Grids of odd and even numbers about the corner, so that -90 degrees lies on a point of one of them.
    for points in (40, 41, 60, 61):
        curve = frequency_curve(path, band_hz=(0.2 / (2 * np.pi), 20 / (2 * np.pi)))
        omega = np.geomspace(0.2, 20.0, points)
        response = Resolvent(path)(omega)
        phase = np.degrees(np.unwrap(np.angle(response)))
        on_grid = replace(curve, frequency_hz=omega / (2 * np.pi), response=response, phase_deg=phase)
        marks = FrequencyMarks(on_grid, Resolvent(path), 0.0)
        assert marks.phase_crossings(-90.0) == pytest.approx([2.0], rel=1e-12)
        assert marks.phase_crossings(-90.0, falling_only=True) == pytest.approx([2.0], rel=1e-12)


def test_a_magnitude_that_is_one_but_for_rounding_passes_no_level() -> None:
    # Dead time alone: rounding puts the magnitude now above one and now below.
    assert found(compiled(gain_only(1.0), input_delays_s=(0.37,)))["phase_margin"] is None
    # A band pass touches one at its peak.
    touching = frequency_behaviour(linear_path(of_control(0.3 * S / (S**2 + 0.3 * S + 1))))
    assert touching.phase_margins == ()
