"""Band levels: Parseval to the last digit, shares of lines, errors as large as the scatter."""

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.spectral.bands import band_rms, total_rms
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.integration import integrate_density
from chladni.spectral.psd import power_spectral_density

RATE_HZ = 100.0


def noise(channels, samples, seed=1):
    values = np.random.default_rng(seed).standard_normal((channels, samples))
    names = tuple(Channel(name=f"c{row}", unit="m/s^2") for row in range(channels))
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=names)


def flat(level=0.04, lines=101, spacing_hz=1.0):
    values = np.full((1, lines), level)
    return PowerSpectralDensity(
        frequency_hz=np.arange(lines) * spacing_hz,
        values=values,
        std=values / 10,
        channels=(Channel(name="a", unit="N"),),
        bandwidth_hz=spacing_hz,
        provenance=Provenance(),
    )


@pytest.mark.parametrize("samples", [100, 101])
def test_the_whole_is_parseval(samples):
    series = noise(2, samples)
    psd = power_spectral_density(
        cross_spectra(series, resolution_hz=RATE_HZ / samples, window="boxcar", overlap=0.0, detrend="none")
    )
    levels = total_rms(psd)
    np.testing.assert_allclose(levels.rms[:, 0], np.sqrt(np.mean(series.values**2, axis=1)), rtol=1e-13)
    assert levels.low_hz[0] == 0
    top = band_rms(psd, bands_hz=[(0, RATE_HZ / 2)])
    np.testing.assert_allclose(top.rms, levels.rms, rtol=1e-13)


@pytest.mark.parametrize("cut_hz", [10.0, 10.3, 10.5, 33.333])
def test_adjoining_bands_add_up_to_the_whole(cut_hz):
    psd = power_spectral_density(cross_spectra(noise(2, 5000), resolution_hz=1.0))
    parts = band_rms(psd, bands_hz=[(0, cut_hz), (cut_hz, 50)])
    np.testing.assert_allclose(np.sum(parts.rms**2, axis=1), total_rms(psd).rms[:, 0] ** 2, rtol=1e-13)


@pytest.mark.parametrize("band", [(10, 35), (10.5, 11.5), (10.25, 10.75), (7.3, 7.31)])
def test_of_a_flat_spectrum_a_band_holds_its_width(band):
    levels = band_rms(flat(), bands_hz=[band])
    np.testing.assert_allclose(levels.rms[0, 0], np.sqrt(0.04 * (band[1] - band[0])), rtol=1e-12)


@pytest.mark.parametrize("window", ["hann", "boxcar"])
@pytest.mark.parametrize("overlap", [0.0, 0.5])
def test_the_stated_error_is_the_scatter(window, overlap):
    trials = 100
    psd = power_spectral_density(
        cross_spectra(noise(trials, 10_000), resolution_hz=0.5, window=window, overlap=overlap)
    )
    levels = band_rms(psd, bands_hz=[(10, 20), (20, 22)])
    scatter = levels.rms.std(axis=0)
    # 100 trials know a standard deviation to 7 %; neighbouring lines under overlap are the rest.
    np.testing.assert_allclose(levels.std.mean(axis=0), scatter, rtol=0.25)


def test_a_band_outside_the_spectrum_has_no_level_and_says_so():
    levels = band_rms(flat(), bands_hz=[(50, 100), (90, 120)])
    assert np.isfinite(levels.rms[0, 0])
    assert np.isnan(levels.rms[0, 1])
    assert np.isinf(levels.std[0, 1])
    assert "no level for 90-120 Hz" in levels.provenance.notes[0]
    many = band_rms(flat(), bands_hz=[(200 + k, 300) for k in range(5)])
    assert "and 2 more: the spectrum covers 0 to 100 Hz" in many.provenance.notes[0]


def test_an_integrated_spectrum_does_not_reach_zero():
    acceleration = power_spectral_density(cross_spectra(noise(1, 5000), resolution_hz=1.0))
    velocity = integrate_density(acceleration, low_hz=5.0)
    levels = band_rms(velocity, bands_hz=[(1, 20), (5, 20)])
    assert np.isnan(levels.rms[0, 0])
    assert np.isfinite(levels.rms[0, 1])


@pytest.mark.parametrize("bands", [[(10, 10)], [(20, 10)], [(-1, 10)], [(np.nan, 10)]])
def test_bands_must_rise(bands):
    with pytest.raises(EstimateError, match="rising frequencies"):
        band_rms(flat(), bands_hz=bands)


def test_one_line_is_no_spectrum():
    with pytest.raises(EstimateError, match="two lines"):
        band_rms(flat(lines=1), bands_hz=[(0, 1)])
