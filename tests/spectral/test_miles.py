"""Oscillators on flat densities, against closed forms and against oscillators on noise."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.miles import vibration_response
from chladni.spectral.srs import srs
from tests.spectral.made_signals import made_density, noise, series


@pytest.mark.parametrize("q", [5.0, 10.0, 50.0])
def test_on_a_flat_density_the_level_is_the_closed_form(q):
    found = vibration_response(
        made_density(np.full(20_001, 0.3), last_hz=20_000.0), frequencies_hz=[50.0, 200.0], q=q
    )
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
    flat = made_density(np.full(1001, 2 / rate_hz), last_hz=500.0)
    found = vibration_response(flat, frequencies_hz=[12.0, 30.0], duration_s=seconds)
    # Highest peaks scatter by 13 % here, so their median by 1.25 times that over the root of the trials.
    np.testing.assert_allclose(np.median(peaks, axis=0), found.peak[0], rtol=3 * 0.13 * 1.25 / np.sqrt(trials))
    assert 3 < found.peak[0, 1] / found.rms[0, 1] < 4.5
    surer = vibration_response(flat, frequencies_hz=[12.0, 30.0], duration_s=seconds, probability=0.95)
    share = np.mean(peaks < surer.peak[0][None], axis=0)
    assert np.all(share > 0.8)


def test_of_many_peaks_the_highest_grows_slowly():
    flat = made_density(np.full(1001, 0.002), last_hz=500.0)
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
        vibration_response(made_density(np.ones(100)), **options)
