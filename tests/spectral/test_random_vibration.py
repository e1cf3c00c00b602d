"""Random test tools against closed forms: profiles, amplitudes of noise and sines, oscillators on flat densities."""

import numpy as np
import pytest
from scipy.stats import norm

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.spectral.random_vibration import check_profile, probability_density, random_profile, vibration_response
from chladni.spectral.srs import srs
from tests.spectral.made_signals import noise, series

G = 9.80665
NAVMAT = [(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)]


def density(values, *, unit="m/s^2", last_hz=2500.0, std=0.1):
    values = np.atleast_2d(values)
    return PowerSpectralDensity(
        frequency_hz=np.linspace(0, last_hz, values.shape[1]),
        values=values,
        std=std * values,
        channels=tuple(Channel(name=f"c{row}", unit=unit) for row in range(len(values))),
        bandwidth_hz=1.0,
        provenance=Provenance(),
    )


# --- profiles ----------------------------------------------------------------------------------------------------


def test_the_level_of_a_profile_is_the_integral_of_its_power_laws():
    # NAVMAT P-9492 states 6.06 g RMS.
    assert random_profile(NAVMAT).rms() / G == pytest.approx(6.06, abs=0.005)
    # -3 dB an octave, G = 1/f: the integral is a logarithm.
    pink = random_profile([(10.0, 0.1), (1000.0, 0.001)], unit="m/s^2")
    assert pink.rms() == pytest.approx(np.sqrt(np.log(100)), rel=1e-12)
    grid = np.geomspace(20, 2000, 200_000)
    profile = random_profile(NAVMAT)
    assert profile.rms() == pytest.approx(np.sqrt(np.trapezoid(profile.at(grid), grid)), rel=1e-6)
    assert np.isnan(profile.at(np.array([19.9, 2001.0]))).all()


def test_what_lies_outside_the_tolerance_is_told():
    profile = random_profile(NAVMAT, upper_db=3.0, lower_db=1.0)
    asked = profile.at(np.linspace(0, 2500, 2501))
    measured = np.stack([asked * 10**0.2, asked * 10**-0.2, asked])
    # One line 6 dB too high, in a spectrum that keeps the profile.
    measured[2, 500] *= 4
    found = check_profile(density(np.nan_to_num(measured)), profile)
    assert found.frequency_hz[[0, -1]].tolist() == [20.0, 2000.0]
    np.testing.assert_allclose(found.deviation_db[0], 2.0)
    np.testing.assert_allclose(found.outside, [0.0, 1.0, 1 / 1981], atol=1e-12)
    # The integral over the lines is coarse where the profile bends.
    np.testing.assert_allclose(found.rms[:2] / found.profile_rms, [10**0.1, 10**-0.1], rtol=1e-4)
    np.testing.assert_allclose(found.std_db, 0.1 * 10 / np.log(10))


@pytest.mark.parametrize(
    ("points", "options", "words"),
    [
        ([(20, 0.1)], {}, "two breakpoints or more"),
        ([(0, 0.1), (20, 0.1)], {}, "above 0 Hz"),
        ([(20, 0.1), (10, 0.1)], {}, "10 Hz follows 20 Hz"),
        ([(20, 0.1), (30, 0.0)], {}, "finite and above 0"),
        (NAVMAT, {"upper_db": -1.0}, "both must be 0 or more"),
        (NAVMAT, {"unit": "gg"}, "gg"),
    ],
)
def test_what_is_no_profile_is_refused(points, options, words):
    with pytest.raises((EstimateError, SetupError), match=words):
        random_profile(points, **options)


def test_another_unit_and_too_few_lines_are_refused():
    with pytest.raises(EstimateError, match="c0 is in N, the profile in m/s"):
        check_profile(density(np.ones(100), unit="N"), random_profile(NAVMAT))
    with pytest.raises(EstimateError, match="between 20 and 2000 Hz; ask for a finer resolution"):
        check_profile(density(np.ones(100), last_hz=15.0), random_profile(NAVMAT))


# --- amplitudes --------------------------------------------------------------------------------------------------


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


# --- response ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("q", [5.0, 10.0, 50.0])
def test_on_a_flat_density_the_level_is_the_closed_form(q):
    found = vibration_response(density(np.full(20_001, 0.3), last_hz=20_000.0), frequencies_hz=[50.0, 200.0], q=q)
    # Of a flat density without end: pi/2 f q G (1 + 1/q^2); Miles leaves out the second term.
    miles = np.sqrt(np.pi / 2 * found.frequency_hz * q * 0.3)
    np.testing.assert_allclose(found.miles[0], miles, rtol=1e-12)
    # What lies above 20 kHz is missing: 2 zeta^2 of it over f/20 kHz.
    np.testing.assert_allclose(found.rms[0], miles * np.sqrt(1 + q**-2), rtol=3e-3)


def test_the_peak_is_that_of_oscillators_on_noise():
    rate_hz, seconds, trials = 1000.0, 20.0, 40
    x = noise(trials, round(rate_hz * seconds), seed=4)
    peaks = srs(
        series(x, rate_hz=rate_hz, names=[f"c{row}" for row in range(trials)], units=["m/s^2"] * trials),
        frequencies_hz=[12.0, 30.0],
        offset="keep",
    ).maximax
    flat = density(np.full(1001, 2 / rate_hz), last_hz=500.0)
    found = vibration_response(flat, frequencies_hz=[12.0, 30.0], duration_s=seconds)
    # Highest peaks scatter by 13 % here, so their median by 1.25 times that over the root of the trials.
    np.testing.assert_allclose(np.median(peaks, axis=0), found.peak[0], rtol=3 * 0.13 * 1.25 / np.sqrt(trials))
    assert 3 < found.peak[0, 1] / found.rms[0, 1] < 4.5
    surer = vibration_response(flat, frequencies_hz=[12.0, 30.0], duration_s=seconds, probability=0.95)
    share = np.mean(peaks < surer.peak[0][None], axis=0)
    assert np.all(share > 0.8)


def test_of_many_peaks_the_highest_grows_slowly():
    flat = density(np.full(1001, 0.002), last_hz=500.0)
    factors = [
        float(
            (found := vibration_response(flat, frequencies_hz=[50.0], duration_s=seconds)).peak[0, 0]
            / found.rms[0, 0]
        )
        for seconds in (1.0, 60.0, 3600.0)
    ]
    # Poisson's law of independent crossings is an upper bound: sqrt(2 ln(nu T / ln 2)).
    bounds = np.sqrt(2 * np.log(100 * np.array([1.0, 60.0, 3600.0]) / np.log(2)))
    assert np.all(factors < bounds)
    np.testing.assert_allclose(factors[1:], bounds[1:], rtol=0.06)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"frequencies_hz": [0.0]}, "must rise, above 0 Hz"),
        ({"frequencies_hz": [20.0, 10.0]}, "must rise"),
        ({"frequencies_hz": [10.0], "q": 0.1}, "q is 0.1"),
        ({"frequencies_hz": [10.0], "duration_s": 0.0}, "a time above 0"),
        ({"frequencies_hz": [10.0], "probability": 1.0}, "a probability between 0 and 1"),
    ],
)
def test_what_has_no_response_is_refused(options, words):
    with pytest.raises(EstimateError, match=words):
        vibration_response(density(np.ones(100)), **options)
