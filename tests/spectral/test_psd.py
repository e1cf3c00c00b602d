"""Power spectral densities and their error bars."""

import numpy as np
import pytest
from scipy.signal import welch

from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from chladni.spectral.psd import power_spectral_density
from tests.spectral.made_signals import multisine, noise, series


def test_values_are_welchs():
    source = series(noise(2, 10_000), units=["N", "m/s^2"])
    psd = power_spectral_density(cross_spectra(source, resolution_hz=5.0))
    np.testing.assert_allclose(psd.values, welch(source.values, fs=1000.0, nperseg=200)[1], rtol=1e-12)
    assert psd.units == ("N^2/Hz", "(m/s^2)^2/Hz")
    assert psd.provenance.estimator == "PSD"


@pytest.mark.parametrize(("window", "overlap"), [("hann", 0.5), ("hann", 0.75), ("boxcar", 0.0), ("boxcar", 0.5)])
def test_the_error_bar_is_the_scatter_of_many_records(window, overlap):
    records = 400
    source = series(noise(records, 2000), names=[str(record) for record in range(records)])
    # A channel a record; only the diagonal is looked at.
    values = []
    for first in range(0, records, 20):
        spectra = cross_spectra(
            source.select([str(r) for r in range(first, first + 20)]),
            resolution_hz=10.0,
            window=window,
            overlap=overlap,
        )
        psd = power_spectral_density(spectra)
        values.append(psd.values[:, 2:-2])
    scatter = np.concatenate(values).std(axis=0)
    predicted = np.full(scatter.shape, 1 / 500) / np.sqrt(psd.provenance.effective_averages)
    # Mean over 47 lines of a standard deviation from 400 records: 1/sqrt(2 * 400 * 47 / 2) = 0.7 %; five sigma.
    assert np.mean(scatter / predicted) == pytest.approx(1.0, abs=0.035)
    np.testing.assert_allclose(psd.std * np.sqrt(psd.provenance.effective_averages), psd.values, rtol=1e-12)


def test_the_error_bar_of_periods_is_the_scatter_of_many_records():
    period = multisine(256, np.arange(5, 100))
    records, periods = 300, 8
    rng = np.random.default_rng(2)
    lines, predicted = [], []
    for _ in range(records):
        signal = np.tile(period, periods) + 0.2 * rng.standard_normal(256 * periods)
        source = series(signal)
        psd = power_spectral_density(periodic_cross_spectra(source, find_period(source, channel="a")))
        lines.append(psd.values[0, 5:127])
        predicted.append(psd.std[0, 5:127])
    ratio = np.std(lines, axis=0) / np.sqrt(np.mean(np.square(predicted), axis=0))
    # 122 lines, each sigma known to 1/sqrt(2 * 300) = 4 % (worse where there is noise only, whose power is no
    # Gaussian): the mean to 0.5 %; five sigma.
    assert ratio.mean() == pytest.approx(1.0, abs=0.025)
