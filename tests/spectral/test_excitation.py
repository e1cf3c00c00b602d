"""Which lines are excited."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from scipy.stats import f as f_distribution

from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.excitation import _stands_out, excitation_notes, excited_lines, repeated_density
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from tests.spectral.aircraft import SHAKER, aircraft
from tests.spectral.made_signals import multisine, noise, series


def periodic(excitation, periods=8, level=1e-3):
    signal = np.tile(excitation, periods)
    source = series(signal + level * noise(1, signal.size))
    return periodic_cross_spectra(source, find_period(source, channel="a"))


@pytest.mark.parametrize("level", [1, 3, 5, 7])
def test_the_aircraft_is_excited_on_exactly_its_267_lines(shared_data, level):
    source = aircraft(shared_data, level)
    spectra = periodic_cross_spectra(source, find_period(source, channel=SHAKER))
    mask = excited_lines(spectra, [SHAKER])[0]
    frequency_hz = spectra.frequency_hz[mask]
    assert mask.sum() == 267
    assert frequency_hz[0] == pytest.approx(2.002, abs=5e-4)
    assert frequency_hz[-1] == pytest.approx(14.990, abs=5e-4)


def test_the_aircraft_under_a_window_is_excited_in_its_band(shared_data):
    spectra = cross_spectra(aircraft(shared_data, 1), resolution_hz=0.1)
    frequency_hz = spectra.frequency_hz[excited_lines(spectra, [SHAKER])[0]]
    # Hann widens the band by up to two lines on each side.
    assert 1.8 <= frequency_hz[0] <= 2.1
    assert 14.9 <= frequency_hz[-1] <= 15.2
    assert np.all(np.diff(frequency_hz) < 0.11)


@pytest.mark.parametrize(
    "lines",
    [np.arange(1, 256), np.arange(20, 60), np.arange(21, 200, 2), np.array([7, 8, 30, 31, 90, 91, 150, 151, 200])],
)
def test_a_multisine_excites_its_own_lines(lines):
    mask = excited_lines(periodic(multisine(512, lines)), ["a"])[0]
    np.testing.assert_array_equal(np.flatnonzero(mask), lines)


def test_a_multisine_that_falls_off_gently_keeps_its_weak_lines():
    spectrum = np.zeros(257, dtype=complex)
    spectrum[1:200] = np.logspace(0, -2, 199) * np.exp(2j * np.pi * np.random.default_rng(1).random(199))
    period = np.fft.irfft(spectrum, 512)
    mask = excited_lines(periodic(period / period.std(), level=1e-4), ["a"])[0]
    np.testing.assert_array_equal(np.flatnonzero(mask), np.arange(1, 200))


@pytest.mark.parametrize("samples", [3000, 100_000])
def test_white_noise_excites_all_lines_but_the_offset(samples):
    spectra = cross_spectra(series(noise(1, samples) + 5.0))
    assert excited_lines(spectra, ["a"])[0, 2:].all()


def test_hammer_hits_excite_what_their_pulse_holds():
    signal = np.zeros(40_000)
    for hit in range(500, 40_000, 1900):
        signal[hit : hit + 20] = np.hanning(20)
    mask = excited_lines(cross_spectra(series(signal + 1e-4 * noise(1, 40_000)[0])), ["a"])[0]
    # A 20 ms Hann pulse reaches to 100 Hz before its first zero.
    assert mask[2:80].all()
    assert mask.mean() > 0.2


def test_a_brick_wall_ends_the_excitation():
    low = sosfilt(butter(12, 100, fs=1000, output="sos"), noise(1, 100_000))
    mask = excited_lines(cross_spectra(series(low), resolution_hz=1.0), ["a"])[0]
    assert mask[2:100].all()
    assert not mask[250:].any()


def test_a_hum_does_not_hide_the_noise_under_it():
    x = noise(1, 100_000) + 100 * np.sin(2 * np.pi * 50 * np.arange(100_000) / 1000)
    assert excited_lines(cross_spectra(series(x), resolution_hz=1.0), ["a"])[0, 2:].mean() > 0.99


def test_each_reference_has_its_own_mask():
    x = np.stack([np.tile(multisine(512, np.arange(5, 50)), 8), np.tile(multisine(512, np.arange(40, 90)), 8)])
    source = series(x + 1e-3 * noise(2, 4096))
    mask = excited_lines(periodic_cross_spectra(source, find_period(source, channel="a")), ["b", "a"])
    np.testing.assert_array_equal(np.flatnonzero(mask[0]), np.arange(40, 90))
    np.testing.assert_array_equal(np.flatnonzero(mask[1]), np.arange(5, 50))


def test_silence_excites_nothing():
    assert not excited_lines(cross_spectra(series(np.zeros((1, 1000)))), ["a"]).any()


@pytest.mark.parametrize("periods", [2, 3, 9])
def test_the_test_is_fishers(periods):
    # One power over the chance of 0.1/50 a line, at the quantile of F(2, 2M - 2) from scipy.stats.
    quantile = f_distribution.isf(0.1 / 50, 2, 2 * (periods - 1))
    power = np.full(50, quantile / periods) * np.where(np.arange(50) % 2, 1.001, 0.999)
    np.testing.assert_array_equal(_stands_out(power, np.ones(50), periods), np.arange(50) % 2 == 1)


def test_what_repeats_is_the_mean_period():
    period = multisine(64, np.arange(3, 20))
    signal = np.tile(period, 5) + 0.1 * noise(1, 320)[0]
    source = series(signal)
    spectra = periodic_cross_spectra(source, find_period(source, channel="a"))
    mean = signal.reshape(5, 64).mean(axis=0)
    power = np.abs(np.fft.rfft(mean - mean.mean())) ** 2 * 2 / (1000 * 64)
    np.testing.assert_allclose(repeated_density(spectra)[0, 0, 1:-1].real, power[1:-1], rtol=1e-9)


def test_notes_count_what_is_masked_and_skip_the_offset():
    mask = np.array([[False, True, True], [False, False, True]])
    assert excitation_notes(mask, ["/x", "/y"]) == ("2 of 3 lines are not excited by /y and are masked",)
