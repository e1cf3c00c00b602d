"""Zeros against python-control and by construction."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.zeros import relative_degree, zeros
from tests.models.analysis.systems import of_control, random_stable, state_space


@pytest.mark.parametrize("seed", range(8))
def test_random_systems_have_the_zeros_of_python_control(seed: int) -> None:
    system = random_stable(6, seed)
    expected = control.ss(system.a, system.b, system.c, system.d).zeros()

    found = zeros(linear_path(system))

    assert found.size == 5
    distance = np.abs(found[:, None] - expected[None]).min(axis=1)
    np.testing.assert_allclose(distance, 0, atol=1e-9 * np.abs(expected).max())


@given(st.lists(st.floats(-9.0, 3.0), min_size=0, max_size=4, unique_by=lambda x: round(x, 1)))
def test_zeros_put_in_come_out(wanted: list[float]) -> None:
    s = control.tf("s")
    function = 3.0 / ((s + 0.5) * (s + 1.5) * (s + 2.5) * (s + 10) * (s + 20))
    for zero in wanted:
        function *= s - zero
    path = linear_path(of_control(function))

    assert relative_degree(path)[0] == 5 - len(wanted)
    found = np.sort(zeros(path).real)
    # Roots of a polynomial given by its coefficients: the realisation rounds those.
    np.testing.assert_allclose(found, np.sort(wanted), atol=1e-6)


def test_with_a_direct_way_there_are_as_many_zeros_as_poles() -> None:
    lead = state_space([[-5.0]], [-4.0], [1.0], 1.0)  # (s + 1)/(s + 5)
    np.testing.assert_allclose(zeros(linear_path(lead)), [-1.0], rtol=1e-14)


def test_units_far_apart_add_no_zero() -> None:
    # z/Q of a piston: three poles, no zero, though pressure in Pa stands beside metres.
    a = [[0, 1, 0], [0, -4.3, 2.3e-5], [0, -6.5e9, -4.2e-3]]
    path = linear_path(state_space(a, [0, 0, 9.3e8], [1, 0, 0]))
    assert zeros(path).size == 0
    assert relative_degree(path)[0] == 3


def test_what_doesn_t_answer_has_no_zeros() -> None:
    split = state_space(np.diag([-1.0, -2.0]), [1.0, 0.0], [0.0, 1.0])
    assert zeros(linear_path(split).to("y")).size == 0
