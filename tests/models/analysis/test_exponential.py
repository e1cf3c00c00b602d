"""The exponential of a matrix against SciPy's, closed forms and its own rules."""

import numpy as np
import pytest
from scipy.linalg import expm

from chladni.models.analysis.exponential import exponential, moved


@pytest.mark.parametrize("size", [1e-6, 1e-2, 1.0, 30.0, 1000.0])
@pytest.mark.parametrize("order", [1, 4, 9])
def test_it_agrees_with_scipy(order: int, size: float) -> None:
    matrix = size * (np.random.default_rng(order).standard_normal((order, order)) - 3 * np.eye(order))

    found, expected = exponential(matrix), expm(matrix)

    # Rounding of the matrix itself moves its exponential by about epsilon times its norm.
    norm = max(np.linalg.norm(matrix, 1), 1.0)
    assert np.abs(found - expected).max() <= 1e-14 * norm * np.abs(expected).max()


def test_a_rotation_is_a_rotation() -> None:
    angle = 1.234
    expected = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    np.testing.assert_allclose(exponential(np.array([[0.0, angle], [-angle, 0.0]])), expected, atol=1e-15)


def test_an_empty_matrix_and_zero() -> None:
    assert exponential(np.zeros((0, 0))).shape == (0, 0)
    np.testing.assert_allclose(exponential(np.zeros((3, 3))), np.eye(3), rtol=3e-16)


def test_nilpotent_matrices_are_exact() -> None:
    found = exponential(np.diag([2.0, 3.0], k=1))
    np.testing.assert_allclose(found, [[1, 2, 3], [0, 1, 3], [0, 0, 1]], rtol=4e-16)


@pytest.mark.parametrize("norm", [0.0, 1e-9, 0.1, 0.999, 1.001, 40.0])
def test_a_moved_state_is_the_exponential_times_it(norm: float) -> None:
    rng = np.random.default_rng(5)
    matrix = rng.standard_normal((5, 5))
    matrix *= norm / np.linalg.norm(matrix, 1)
    state = rng.standard_normal(5)
    expected = exponential(matrix) @ state
    np.testing.assert_allclose(moved(matrix, state), expected, atol=1e-15 * max(norm, 1) * np.abs(expected).max())
