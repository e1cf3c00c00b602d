"""Noise told from the scatter of lines, of functions whose noise is known."""

import numpy as np
import pytest

from chladni.spectral.line_scatter import line_scatter, std_or_scatter


def resonance(line, width):
    return 1 / (line - 100.3 - 1j * width)


@pytest.mark.parametrize("width", [0.01, 1.0, 30.0])
def test_scatter_from_line_to_line_is_that_of_the_noise(width):
    line = np.arange(400.0)
    rng = np.random.default_rng(1)
    made = rng.standard_normal((5, 400)) + 1j * rng.standard_normal((5, 400))
    found = line_scatter(1e-4 * made + resonance(line, width))
    assert found.shape == (5, 400)
    # The median of 64 squares scatters by 1/sqrt(64) of itself, more for neighbours that repeat each other; a root
    # halves it. Near the peak what curves may add.
    far = np.abs(line - 100) > 64
    assert np.median(found[:, far]) == pytest.approx(1e-4, rel=0.1)
    assert np.all((found[:, far] > 0.5e-4) & (found[:, far] < 2e-4))


def test_scatter_is_that_of_the_neighbours():
    line = np.arange(1000.0)
    rng = np.random.default_rng(2)
    made = rng.standard_normal(1000) + 1j * rng.standard_normal(1000)
    found = line_scatter(made * np.where(line < 500, 1.0, 100.0))
    assert np.median(found[:400]) == pytest.approx(1.0, rel=0.1)
    assert np.median(found[600:]) == pytest.approx(100.0, rel=0.1)


def test_exact_functions_scatter_by_no_more_than_they_curve():
    line = np.arange(400.0)
    curve = resonance(line, 0.01)
    scatter = line_scatter(curve)
    # 64 lines and more from a peak the second difference is less than 2/64^2 of the function, those of higher order
    # are less yet.
    far = np.abs(line - 100) > 2 * 64
    assert np.all(scatter[far] < 2 / 64**2 * np.abs(curve[far]))
    # The peak itself stands out of it a hundredfold.
    assert scatter[100] < 0.01 * np.abs(curve[100])
    assert np.all(np.isinf(line_scatter(curve[:2])))


def test_only_functions_without_any_std_get_that_of_their_scatter():
    line = np.arange(50.0)
    values = np.stack([resonance(line, 3.0), resonance(line, 3.0)])
    std = np.full(values.shape, np.inf)
    std[0, 10] = 0.5
    filled = std_or_scatter(values, std)
    np.testing.assert_array_equal(filled[0], std[0])
    np.testing.assert_array_equal(filled[1], line_scatter(values)[1])
