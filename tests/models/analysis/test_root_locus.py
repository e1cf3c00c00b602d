"""Root loci and the precision-stability field against polynomials and textbook rules."""

import control
import numpy as np
import pytest

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.precision_stability import error_constant, precision_stability
from chladni.models.analysis.root_locus import gain_root_locus, parameter_root_locus
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import (
    FunctionModel,
    compiled,
    gain_only,
    of_control,
    oscillator,
    pt2,
    random_stable,
    state_space,
)

S = control.tf("s")


def test_branches_are_the_roots_of_the_closed_loop() -> None:
    locus = gain_root_locus(linear_path(of_control((S + 3) / (S * (S + 1) * (S + 2)))))
    for gain, roots in zip(locus.values, locus.roots.T, strict=True):
        expected = np.roots(np.polyadd([1, 3, 2, 0], gain * np.array([1, 3])))
        np.testing.assert_allclose(np.sort_complex(roots), np.sort_complex(expected), atol=1e-7 * (1 + gain))
    np.testing.assert_allclose(np.sort(locus.start.real), [-2, -1, 0], atol=1e-12)
    np.testing.assert_allclose(locus.end, [-3], rtol=1e-9)


def test_a_branch_follows_one_root() -> None:
    locus = gain_root_locus(linear_path(random_stable(5, 3)), gains=np.linspace(0, 1, 400))
    steps = np.abs(np.diff(locus.roots, axis=1)).max()
    shuffled = np.abs(np.diff(np.sort_complex(locus.roots.T).T, axis=1)).max()
    assert steps <= shuffled + 1e-12
    assert steps < 0.3


def test_stability_ends_where_the_gain_margin_says() -> None:
    # 1/(s + 1)^3 is stable up to a gain of 8.
    locus = gain_root_locus(linear_path(of_control(1 / (S + 1) ** 3)), gains=[7.99, 8.01])
    assert locus.stable().tolist() == [True, False]


def test_a_direct_way_bends_the_gain_and_can_have_no_solution() -> None:
    lead = linear_path(state_space([[-5.0]], [-4.0], [1.0], 1.0))
    locus = gain_root_locus(lead, gains=[1.0])
    # 1 + k (s + 1)/(s + 5) = 0 at k = 1.
    np.testing.assert_allclose(locus.roots, [[-3.0]], rtol=1e-14)
    with pytest.raises(ModelError, match="algebraic loop"):
        gain_root_locus(lead, gains=[-1.0])


def test_dead_time_has_too_many_roots() -> None:
    with pytest.raises(ModelError, match="infinitely many roots"):
        gain_root_locus(linear_path(compiled(pt2(1.0, 0.5), input_delays_s=(0.1,))))


def test_a_gain_alone_has_no_roots() -> None:
    assert gain_root_locus(linear_path(gain_only(2.0))).roots.shape[0] == 0


def test_poles_against_a_parameter() -> None:
    locus = parameter_root_locus(oscillator(), "k", [1.0, 4.0, 9.0])
    for stiffness, roots in zip(locus.values, locus.roots.T, strict=True):
        np.testing.assert_allclose(np.sort_complex(roots), np.sort_complex(np.roots([1, 0.4, stiffness])), rtol=1e-12)
    with pytest.raises(ModelError, match="no parameter 'q'"):
        parameter_root_locus(oscillator(), "q", [1.0])


def test_a_parameter_that_changes_the_number_of_poles_is_told() -> None:
    def equations(values) -> CompiledModel:
        return compiled(pt2(1.0, 0.5) if values["m"] > 1 else state_space([[-1.0]], [1.0], [1.0]))

    model = FunctionModel(parameters=oscillator().parameters, equations=equations)
    with pytest.raises(ModelError, match="number of poles changes"):
        parameter_root_locus(model, "m", [0.5, 2.0])


@pytest.mark.parametrize(
    ("function", "constant", "follows"),
    [(6 / ((S + 1) * (S + 2)), 3.0, "step"), (6 / (S * (S + 2)), 3.0, "ramp"),
     (6 * (S + 1) / (S**2 * (S + 2)), 3.0, "parabola")],
)  # fmt: skip
def test_errors_that_stay_by_ogata(function: control.TransferFunction, constant: float, follows: str) -> None:
    path = linear_path(of_control(function, input_unit="1", output_unit="1"))
    assert error_constant(path) == pytest.approx(constant, rel=1e-9)
    field = precision_stability(path)
    assert field.follows == follows
    expected = 1 / (field.gain * constant + (1 if follows == "step" else 0))
    np.testing.assert_allclose(field.error, expected, rtol=1e-9)


def test_precision_costs_stability() -> None:
    field = precision_stability(linear_path(of_control(1 / (S + 1) ** 3)))
    assert np.all(np.diff(field.error) < 0)
    assert np.all(np.diff(field.decay_per_s) < 0)
    # -s = 1 - k^(1/3) e^{j pi/3}: the dominant pair crosses at k = 8.
    exact = 1 - np.cbrt(field.gain) / 2
    np.testing.assert_allclose(field.decay_per_s, exact, atol=1e-4)
    assert field.damping_ratio[0] < 1


def test_three_integrators_are_outside_of_the_field() -> None:
    with pytest.raises(ModelError, match="two at most"):
        precision_stability(linear_path(state_space(np.diag([1.0, 1.0], k=1), [0, 0, 1], [1, 0, 0])))


def test_a_direct_way_beside_an_integrator_counts_for_nothing_in_the_limit() -> None:
    # The paper's regulator, 0.9 (9.9 s + 1)/(3 s): K_v = 0.3.
    assert error_constant(linear_path(of_control(0.9 * (9.9 * S + 1) / (3 * S)))) == pytest.approx(0.3, rel=1e-12)
