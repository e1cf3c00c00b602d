"""Synthesised against measured functions: exact models fit exactly, and errors are what they are by definition."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.synthesis import modal_fit
from tests.modal.modal_coverage import averaged_random
from tests.modal.truth import chain, noisy_response

FREQUENCY_HZ = np.linspace(0.2, 8, 400)


def measured(noise=0.0, at=(0, 2)):
    truth = chain()
    response = noisy_response(truth, FREQUENCY_HZ, at, noise=max(noise, 1e-6), rng=np.random.default_rng(1))
    return truth, response if noise else replace(response, values=truth.accelerance(FREQUENCY_HZ, at))


def test_an_exact_model_fits_exactly():
    truth, response = measured()
    model = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, [0, 2]])
    fit = modal_fit(response, model)
    assert fit.error < 1e-10
    np.testing.assert_allclose(fit.synthesised, model.synthesise(FREQUENCY_HZ, "accelerance"), rtol=1e-9, atol=1e-12)


def test_errors_by_definition():
    truth, response = measured(noise=0.2)
    model = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, [0, 2]])
    fit = modal_fit(response, model, band_hz=(0.5, 6.0))
    inside = (FREQUENCY_HZ >= 0.5) & (FREQUENCY_HZ <= 6.0)
    np.testing.assert_array_equal(fit.frequency_hz, FREQUENCY_HZ[inside])
    values = response.values[..., inside]
    wrong = values - model.synthesise(FREQUENCY_HZ[inside], "accelerance")
    assert fit.error == pytest.approx(np.linalg.norm(wrong) / np.linalg.norm(values), rel=1e-9)
    each = np.linalg.norm(wrong, axis=2) / np.linalg.norm(values, axis=2)
    np.testing.assert_allclose(fit.function_error, each, rtol=1e-9)
    assert 0.15 < fit.error < 0.25
    low, high = fit.bands_hz[1]
    band = (fit.frequency_hz >= low) & (fit.frequency_hz <= high)
    expected = np.linalg.norm(wrong[..., band]) / np.linalg.norm(values[..., band])
    assert fit.band_error[1] == pytest.approx(expected, rel=1e-9)


def test_bands_are_midway_between_modes_and_without_gaps():
    truth, response = measured()
    model = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, [0, 2]])
    fit = modal_fit(response, model, band_hz=(0.5, 6.5))
    # The fifth mode lies above the band.
    assert fit.bands_hz.shape == (4, 2)
    np.testing.assert_array_equal(fit.bands_hz[1:, 0], fit.bands_hz[:-1, 1])
    assert fit.bands_hz[0, 0] == fit.frequency_hz[0]
    assert fit.bands_hz[-1, 1] == fit.frequency_hz[-1]
    np.testing.assert_allclose(fit.bands_hz[0, 1], truth.frequency_hz[:2].mean())


def test_without_modes_there_are_no_bands():
    truth, response = measured()
    model = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, [0, 2]]).select([])
    fit = modal_fit(response, model)
    assert fit.bands_hz.shape == (0, 2)
    assert fit.band_error.size == 0
    assert fit.error == pytest.approx(1.0, abs=0.2)


def test_a_windowed_average_is_compared_with_what_the_window_shows():
    truth = chain()
    response = averaged_random(
        truth, np.random.default_rng(2), at=(0,), noise=1e-4, cycles=6000, resolution_hz=0.01, window="hann"
    )
    model = least_squares_frequency_domain(response, truth.poles, band_hz=(0.5, 7.5))
    fit = modal_fit(response, model, band_hz=(0.5, 7.5))
    first = fit.frequency_hz < fit.bands_hz[0, 1]
    values = response.values[..., np.isin(response.frequency_hz, fit.frequency_hz[first])]
    bare = model.synthesise(fit.frequency_hz[first], "accelerance")
    # Six decay times a segment: the first resonance looks a fifth lower than it is.
    assert fit.band_error[0] < 0.3 * np.linalg.norm(values - bare) / np.linalg.norm(values)


def test_missing_values_are_no_error():
    truth, response = measured()
    values = response.values.copy()
    values[1, 0, 50:60] = np.nan
    model = least_squares_frequency_domain(replace(response, values=values), truth.poles, truth.shapes[:, [0, 2]])
    fit = modal_fit(replace(response, values=values), model)
    assert fit.error < 1e-10
    assert np.all(np.isfinite(fit.synthesised))
