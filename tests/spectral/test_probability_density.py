"""Spread of amplitudes of noise and of sines, against closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from chladni.signals.errors import EstimateError
from chladni.spectral.probability_density import probability_density
from tests.spectral.made_signals import noise, series


# Of samples that hang together the error bar is an upper bound.
@pytest.mark.parametrize(("smoothing", "least"), [(1, 0.4), (20, 0.0)])
def test_gaussian_noise_is_gaussian_within_its_error(smoothing, least):
    x = np.convolve(noise(1, 200_000)[0], np.ones(smoothing), mode="valid")
    found = probability_density(series(7 + 3 * x))
    truth = np.diff(norm.cdf(np.linspace(-5, 5, 61))) / (10 / 60)
    inner = np.abs(found.deviation) < 2.5
    apart = (found.density[0] - truth)[inner] / found.std[0, inner]
    # 30 bins: their RMS error is one sigma, which scatters by 1/sqrt(60); the scale is taken from the record itself.
    assert least < np.sqrt(np.mean(apart**2)) < 1.5
    np.testing.assert_allclose(found.gaussian[inner], truth[inner], rtol=0.01)
    assert found.mean[0] == pytest.approx(7, abs=0.5)


def test_a_sine_has_the_arcsine_law():
    found = probability_density(series(np.sin(0.1 * np.arange(200_000) + 0.3)), bins=60, widest=3.0)
    inner = np.abs(found.deviation) < 1.2
    law = 1 / (np.pi * np.sqrt(2 - found.deviation[inner] ** 2))
    np.testing.assert_allclose(found.density[0, inner], law, rtol=0.01)


def test_what_has_no_spread_is_refused():
    with pytest.raises(EstimateError, match="a never changes"):
        probability_density(series(np.ones(100)))
    with pytest.raises(EstimateError, match="give 2 or more"):
        probability_density(series(noise(1, 100)), bins=1)
