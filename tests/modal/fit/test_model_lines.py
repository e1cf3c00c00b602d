"""Weights of lines: stated, or found from what a fit leaves."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.fit.model_lines import model_lines, reweighted
from tests.modal.truth import chain, noisy_response

LINES_HZ = np.linspace(0.25, 8, 2000)


def lines_of(*, noise=0.01):
    response = noisy_response(chain(), LINES_HZ, (0, 3), noise=noise, rng=np.random.default_rng(1))
    return model_lines(response, None)


def left(lines, level, share, seed=2):
    """Complex noise whose real and imaginary part have the variance level^2 + share^2 |H|^2."""
    rng = np.random.default_rng(seed)
    made = rng.standard_normal(lines.values.shape) + 1j * rng.standard_normal(lines.values.shape)
    return np.hypot(level, share * np.abs(lines.values)) * made


@pytest.mark.parametrize(("level", "share"), [(0.02, 0.0), (0.0, 0.01), (0.002, 0.01)])
def test_level_and_share_of_the_noise_are_found_from_what_is_left(level, share):
    lines = lines_of(noise=0.0)
    residual = left(lines, level, share)
    found = reweighted(lines, residual, parameters=0)
    true = 1 / np.hypot(level, share * np.abs(lines.values - residual)) ** 2
    # Each function has 2000 squares, but the share is told by the lines on its peaks alone, some 50 that know a
    # variance to 1/sqrt(50): two sigma of that, where it matters.
    np.testing.assert_allclose(found.weights / true, 1, atol=0.3)
    assert np.mean(np.abs(found.weights / true - 1) < 0.1) > 0.95


def test_parameters_of_the_fit_have_taken_their_part():
    lines = lines_of(noise=0.0)
    residual = left(lines, 0.02, 0.0)
    free = reweighted(lines, residual, parameters=0)
    spent = reweighted(lines, residual, parameters=2000)
    # 2000 parameters a response are 1000 of the 4000 real numbers of each of its two functions.
    np.testing.assert_allclose(spent.weights / free.weights, 0.75, rtol=0.02)


def test_lines_that_are_left_out_and_exact_functions_keep_sound_weights():
    lines = lines_of(noise=0.0)
    exact = reweighted(lines, np.zeros_like(lines.values), parameters=10)
    assert np.all(np.isfinite(exact.weights))
    assert np.all(exact.weights > 0)
    weights = lines.weights.copy()
    weights[1, 0, :] = 0
    weights[0, 1, ::2] = 0
    part = reweighted(replace(lines, weights=weights), left(lines, 0.02, 0.0), parameters=10)
    np.testing.assert_array_equal(part.weights == 0, weights == 0)
    assert np.all(np.isfinite(part.weights))
