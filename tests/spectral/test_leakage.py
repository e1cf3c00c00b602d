"""What windows do between lines, against known values."""

import numpy as np
import pytest

from chladni.spectral.leakage import leakage, line_correlation, named_window


@pytest.mark.parametrize("name", ["boxcar", "hann", "kaiser 8.6", "blackmanharris"])
def test_leakage_is_the_window_s_spectrum(name):
    window = named_window(name)
    padded = np.abs(np.fft.fft(window, 8 * window.size)) ** 2 / window.sum() ** 2
    np.testing.assert_allclose(leakage(window, np.arange(30) / 8), padded[:30], atol=1e-12)
    np.testing.assert_allclose(leakage(window, -np.arange(30) / 8), padded[:30], atol=1e-12)


def test_far_away_the_bound_stays():
    window = named_window("boxcar")
    np.testing.assert_array_equal(leakage(window, np.array([1e6])), leakage(window, np.array([255.5])))


def test_what_names_no_window_counts_as_bare():
    for name in ("", "force", "force + exponential 5/s", "no such window"):
        assert np.all(named_window(name) == 1)


@pytest.mark.parametrize(("name", "expected"), [("boxcar", 1.0), ("hann", 35 / 18)])
def test_line_correlation_of_noise(name, expected):
    assert line_correlation(named_window(name)) == pytest.approx(expected, rel=1e-12)
