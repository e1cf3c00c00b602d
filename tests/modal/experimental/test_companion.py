"""Denominators of all orders against least squares on the full problem, and on which side their surplus roots lie."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.experimental.companion import denominators, participation, stable_roots
from chladni.modal.experimental.line_weights import weighted_lines
from chladni.modal.experimental.reduced_normal_equations import reduced_normal_matrix
from chladni.modal.experimental.unit_circle import unit_circle
from tests.modal.made_responses import chain, functions


def by_least_squares(lines, position, length, *, order, numerator_order):
    """Coefficients alpha_1.. of one order from the full overdetermined problem, all numerators among its unknowns."""
    responses, references, count = lines.values.shape
    z = np.exp(2j * np.pi * position / length)
    powers = z[:, None] ** np.arange(numerator_order + 1)
    size = (numerator_order + 1) * responses
    system = np.zeros((responses * count, size + order * references), dtype=complex)
    right = np.zeros((responses * count, references), dtype=complex)
    for response in range(responses):
        rows = slice(response * count, (response + 1) * count)
        weight = lines.weight[response][:, None]
        system[rows, response * (numerator_order + 1) : (response + 1) * (numerator_order + 1)] = weight * powers
        weighted = weight * lines.values[response].T
        terms = [-powers[:, power, None] * weighted for power in range(1, order + 1)]
        system[rows, size:] = np.concatenate(terms, axis=1)
        right[rows] = weighted
    solution = np.linalg.lstsq(system, right, rcond=None)[0]
    return solution[size:].reshape(order, references, references)


EVEN_HZ = np.arange(1.0, 60.0, 0.5)


def noisy(*, seed=0, references=("m1", "m3"), frequency_hz=EVEN_HZ):
    return functions(chain(), frequency_hz, references=references, noise=0.02, seed=seed)


def gappy(response):
    return replace(response, excited=np.arange(response.excited.size) % 4 != 2)


@pytest.mark.parametrize(
    "response",
    [noisy(), gappy(noisy(seed=1)), noisy(frequency_hz=np.geomspace(3, 60, 150))],
    ids=["even", "gaps", "geometric"],
)
@pytest.mark.parametrize("weighting", ["uniform", "relative"])
def test_every_order_is_the_least_squares_solution_of_its_own_problem(response, weighting):
    lines = weighted_lines(response, band_hz=None, weighting=weighting)
    circle = unit_circle(lines.frequency_hz)
    matrix = reduced_normal_matrix(lines, circle, 8)
    orders = range(1, 9)
    for order, coefficients in zip(orders, denominators(matrix, 2, orders), strict=True):
        expected = by_least_squares(lines, circle.position, circle.length, order=order, numerator_order=8)
        # The square of the condition of the powers on nine tenths of the circle, 1e3 for order 8, times rounding,
        # and more for the ridge.
        np.testing.assert_allclose(coefficients, expected, atol=1e-7 * np.max(np.abs(expected)))


def test_response_wise_weights_are_kept_apart():
    response = noisy()
    uneven = replace(response, std=np.random.default_rng(2).uniform(0.01, 1.0, response.std.shape))
    lines = replace(
        weighted_lines(uneven, band_hz=None, weighting="std"), noise_power=np.zeros((2, response.frequency_hz.size))
    )
    circle = unit_circle(lines.frequency_hz)
    (coefficients,) = denominators(reduced_normal_matrix(lines, circle, 6), 2, range(6, 7))
    expected = by_least_squares(lines, circle.position, circle.length, order=6, numerator_order=6)
    np.testing.assert_allclose(coefficients, expected, atol=1e-7 * np.max(np.abs(expected)))


def stable_with_highest_fixed(matrix, order):
    """Number of roots within the unit circle when the highest coefficient is 1 instead of the lowest."""
    coefficients = np.append(np.linalg.solve(matrix[:order, :order], -matrix[:order, order]), 1)
    return np.sum(np.abs(np.roots(coefficients[::-1])) < 1)


@pytest.mark.parametrize("seed", range(5))
def test_roots_that_model_noise_are_unstable_only_with_the_lowest_coefficient_fixed(seed):
    response = noisy(seed=seed, references=("m1",), frequency_hz=np.arange(0.1, 60, 0.1))
    lines = weighted_lines(response, band_hz=None, weighting="std")
    matrix = reduced_normal_matrix(lines, unit_circle(lines.frequency_hz), 40)
    (coefficients,) = denominators(matrix, 1, range(40, 41))
    # Five modes; a root or two of the 35 others may stray.
    assert 5 <= stable_roots(coefficients).size <= 9
    assert stable_with_highest_fixed(matrix, 40) > 25


def test_roots_of_a_known_polynomial():
    # (1 - z/0.5)(1 - z/(0.9j))(1 - z/2), of which two lie within the circle.
    inverse = np.array([1 / 0.5, 1 / 0.9j, 1 / 2])
    coefficients = np.poly(inverse)[1:].reshape(3, 1, 1)
    found = stable_roots(coefficients.astype(complex))
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.array([0.5, 0.9j])), atol=1e-12)


def test_participation_is_the_left_null_vector():
    random = np.random.default_rng(0)
    coefficients = random.standard_normal((4, 3, 3)) + 1j * random.standard_normal((4, 3, 3))
    roots = stable_roots(coefficients)
    vectors = participation(coefficients, roots)
    for root, vector in zip(roots, vectors, strict=True):
        value = np.eye(3) + sum(alpha * root ** (power + 1) for power, alpha in enumerate(coefficients))
        assert np.linalg.norm(vector @ value) < 1e-10
        assert np.linalg.norm(vector) == pytest.approx(1.0)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        next(denominators(-np.eye(4, dtype=complex), 1, range(1, 4)))


def test_roots_a_little_beyond_the_circle_are_given_when_asked_for():
    # The third grows by 0.001 in the logarithm of its magnitude.
    inverse = np.array([1 / 0.5, 1 / (np.exp(0.001) * 1j), 1 / 2])
    coefficients = np.poly(inverse)[1:].reshape(3, 1, 1).astype(complex)
    assert stable_roots(coefficients).size == 1
    assert stable_roots(coefficients, beyond=0.0009).size == 1
    assert stable_roots(coefficients, beyond=0.0011).size == 2
