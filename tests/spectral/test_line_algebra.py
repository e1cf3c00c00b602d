"""Systems of equations line by line against NumPy's least squares."""

import numpy as np
import pytest

from chladni.spectral.line_algebra import conditioned_density, solve_lines

SEGMENTS, LINES = 12, 6


def samples(channels, seed=0):
    rng = np.random.default_rng(seed)
    shape = (channels, SEGMENTS, LINES)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def density(x):
    return np.einsum("isf,jsf->ijf", x.conj(), x) / SEGMENTS


def test_the_answer_is_least_squares_over_the_segments():
    x = samples(5)
    solution = solve_lines(density(x), [0, 1, 2], [3, 4])
    for line in range(LINES):
        # y = H x over segments: numpy solves x^T h = y for each response.
        expected, residual, *_ = np.linalg.lstsq(x[:3, :, line].T, x[3:, :, line].T, rcond=None)
        np.testing.assert_allclose(solution.values[:, :, line], expected.T, rtol=1e-10)
        power = np.mean(np.abs(x[3:, :, line]) ** 2, axis=1)
        np.testing.assert_allclose(solution.explained[:, line], power - residual / SEGMENTS, rtol=1e-10)
    inverse = np.linalg.inv(density(x)[:3, :3].transpose(2, 0, 1))
    np.testing.assert_allclose(solution.inverse, np.einsum("fii->if", inverse).real, rtol=1e-10)


def test_units_far_apart_do_not_look_like_bad_condition():
    x = samples(3) * np.array([1e-9, 1e9, 1.0])[:, np.newaxis, np.newaxis]
    assert solve_lines(density(x), [0, 1], [2]).solvable.all()


@pytest.mark.parametrize("factor", [0.0, 1.0, -3j])
def test_references_that_are_one_are_not_solved(factor):
    x = samples(3)
    x[1, :, 2] = factor * x[0, :, 2]
    solution = solve_lines(density(x), [0, 1], [2])
    np.testing.assert_array_equal(solution.solvable, np.arange(LINES) != 2)
    assert np.isnan(solution.values[:, :, 2]).all()
    assert np.isinf(solution.inverse[:, 2]).all()
    assert solution.explained[0, 2] == 0


def test_conditioning_is_taking_the_fit_away():
    x = samples(4)
    rest = conditioned_density(density(x), [0, 1], [2, 3])
    for line in range(LINES):
        fit = np.linalg.lstsq(x[:2, :, line].T, x[2:, :, line].T, rcond=None)[0]
        left = x[2:, :, line] - fit.T @ x[:2, :, line]
        np.testing.assert_allclose(rest[:, :, line], left.conj() @ left.T / SEGMENTS, rtol=1e-10, atol=1e-14)


def test_nothing_to_condition_on_leaves_all():
    x = samples(3)
    x[0] = 0
    np.testing.assert_array_equal(conditioned_density(density(x), [0], [1, 2]), density(x)[1:, 1:])
