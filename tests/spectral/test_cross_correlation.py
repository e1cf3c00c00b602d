"""Cross-correlation beside SciPy."""

import numpy as np
import pytest
from scipy.signal import correlate

from chladni.spectral.cross_correlation import cross_correlation
from tests.spectral.made_signals import noise, series

RATE_HZ = 1000.0


def test_coefficients_are_those_of_scipy():
    x = noise(3, 500)
    found = cross_correlation(series(x, rate_hz=RATE_HZ), references="b", responses=["a", "c"], longest_lag_s=0.2)
    centred = x - x.mean(axis=1, keepdims=True)
    for row, other in enumerate((0, 2)):
        expected = correlate(centred[other], centred[1], method="direct")[299:700]
        expected /= np.sqrt(np.sum(centred[other] ** 2) * np.sum(centred[1] ** 2))
        np.testing.assert_allclose(found.values[row], expected, atol=1e-12)
    assert found.lag_s[0] == -0.2
    assert [channel.name for channel in found.responses] == ["a", "c"]


def test_a_record_is_its_own_image_at_no_lag():
    x = noise(1, 1000)[0]
    found = cross_correlation(series(np.stack([x, -2 * x]), rate_hz=RATE_HZ), references="a")
    assert found.values[0].min() == pytest.approx(-1)
    assert found.lag_s[found.values[0].argmin()] == 0
