"""The lag window against its definition, and its transform against numerical integration."""

import numpy as np
import pytest

from chladni.modal.fit.lag_window import lag_window
from chladni.signals.provenance import Provenance
from chladni.spectral.windows import window_samples


def provenance(window="hann", segment_s=2.0, **others):
    return Provenance(estimator="H1", window=window, segment_s=segment_s, averages=4, **others)


def by_definition(window, u, samples=4096):
    """Correlation of the window with itself at share u of its length, over that at 0."""
    w = window_samples(window, samples)
    lags = np.rint(u * samples).astype(int)
    return np.array([w[lag:] @ w[: samples - lag] for lag in lags]) / (w @ w)


def from_coefficients(window, u):
    orders = np.arange(len(window.tapered))
    tapers = (1 - u)[:, None] * np.cos(2 * np.pi * u[:, None] * orders)
    waves = np.sin(2 * np.pi * u[:, None] * orders[1:])
    return tapers @ window.tapered + waves @ window.sines


@pytest.mark.parametrize(
    "name", ["hann", "boxcar", "hamming", "blackmanharris", "flattop", "kaiser 8.6", "tukey 0.5"]
)
def test_the_correlation_of_the_window(name):
    u = np.arange(0, 4096, 64) / 4096
    found = from_coefficients(lag_window(provenance(name)), u)
    # Tukey's window is no sum of five cosines; 0.5 % of the lag window is what the nearest one leaves.
    np.testing.assert_allclose(found, by_definition(name, u), atol=5e-3 if "tukey" in name else 2e-5)


@pytest.mark.parametrize("pole", [-0.5 + 30j, -3 + 80j, -0.01 + 12j])
@pytest.mark.parametrize("name", ["hann", "boxcar"])
def test_the_transform_is_the_integral(pole, name):
    window = lag_window(provenance(name))
    s = 2j * np.pi * np.array([1.0, 1.9, 4.8, 12.7, pole.imag / (2 * np.pi)])
    value, slope = window.decay_transform(s, np.array([pole]))
    nodes, weights = np.polynomial.legendre.leggauss(400)
    u = (nodes + 1) / 2
    decay = np.exp(np.multiply.outer(pole - s, 2.0 * u)) * from_coefficients(window, u) * weights
    np.testing.assert_allclose(value[0], decay.sum(axis=-1), rtol=1e-9)
    np.testing.assert_allclose(slope[0], (decay * 2 * u).sum(axis=-1), rtol=1e-9)


def test_long_segments_see_the_whole_decay():
    window = lag_window(provenance(segment_s=5000.0))
    s, pole = 2j * np.pi * np.array([3.0, 5.0]), np.array([-1 + 25j])
    value, slope = window.decay_transform(s, pole)
    # The lag window falls by 6.6 (tau/T)^2: parts in 10^6 for a decay time of a 5000th of the segment.
    np.testing.assert_allclose(value[0], 1 / (s - pole[0]), rtol=1e-5)
    np.testing.assert_allclose(slope[0], 1 / (s - pole[0]) ** 2, rtol=1e-5)


def test_the_slope_at_lag_zero():
    assert lag_window(provenance("boxcar", 4.0)).slope_per_s == pytest.approx(-0.25, rel=1e-6)
    assert lag_window(provenance("hann", 4.0)).slope_per_s == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("whole", [{"averaging": "periodic"}, {"averaging": "impact"}, {"segment_s": 0.0}])
def test_whole_responses_have_none(whole):
    assert lag_window(provenance(**whole)) is None
