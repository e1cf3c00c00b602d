"""Operating deflection shapes against tones of known amplitude and phase, and their error bars against scatter."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.adaptive import adaptive_cross_spectra
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.ods import deflection_shapes
from tests.spectral.made_signals import noise, series

RATE_HZ = 1000.0
# [tone, channel] peak amplitude and phase.
TONES_HZ = (20.0, 85.0)
SHAPES = np.array([[1.0, 2.0 * np.exp(0.4j), 0.5 * np.exp(-2j)], [0.2, 0.7 * np.exp(3j), 1.5]])


def running(samples=20_000):
    t = np.arange(samples) / RATE_HZ
    turning = np.exp(2j * np.pi * np.outer(TONES_HZ, t) + 1j * np.array([[0.3], [1.1]]))
    return (SHAPES.T @ turning).real + 1e-3 * noise(3, samples)


@pytest.mark.parametrize("frequencies_hz", [TONES_HZ, None])
def test_tones_have_their_amplitudes_and_phases(frequencies_hz):
    found = deflection_shapes(
        series(running(), rate_hz=RATE_HZ), references="a", frequencies_hz=frequencies_hz, resolution_hz=1.0
    )
    np.testing.assert_allclose(found.frequency_hz, TONES_HZ)
    np.testing.assert_allclose(np.sqrt(2) * found.values, SHAPES, rtol=1e-3)
    np.testing.assert_allclose(found.coherence, 1.0, atol=1e-4)
    assert found.reference == "a"


def test_what_is_not_coherent_is_no_part_of_the_shape():
    x = running()
    x[1] += noise(1, x.shape[1], seed=5)[0] * 3
    spectra = cross_spectra(series(x, rate_hz=RATE_HZ), resolution_hz=1.0)
    found = deflection_shapes(spectra, references="a", frequencies_hz=[200.0])
    assert found.coherence[0, 1] < 0.3
    alone = np.sqrt(spectra.density[1, 1, 200].real * spectra.bandwidth_hz)
    assert abs(found.values[0, 1]) == pytest.approx(alone * np.sqrt(found.coherence[0, 1]), rel=1e-9)


def test_the_error_bar_is_the_scatter():
    # 400 lines of noise as many trials; coherence 1/(1 + 0.25).
    x = noise(2, 64_000, seed=3)
    x[1] = x[0] + 0.5 * x[1]
    spectra = cross_spectra(series(x, rate_hz=RATE_HZ), resolution_hz=1.0, window="boxcar", overlap=0.0)
    found = deflection_shapes(spectra, references="a", frequencies_hz=np.arange(50.0, 450.0))
    scatter = np.std(np.abs(found.values), axis=0)
    # A standard deviation of 400 trials scatters by 1/sqrt(800): three of them.
    np.testing.assert_allclose(scatter, np.sqrt(np.mean(found.std**2, axis=0)), rtol=3 / np.sqrt(800))


def test_of_whole_periods_the_error_bar_is_the_scatter_between_them():
    period = noise(1, 500, seed=1)[0]
    trials = [np.tile(period, 16) + 0.1 * noise(1, 8000, seed=10 + trial)[0] for trial in range(60)]
    x = series(
        np.stack([np.tile(period, 16), *trials]),
        rate_hz=RATE_HZ,
        names=[f"c{row}" for row in range(61)],
        units=["m/s^2"] * 61,
    )
    spectra = adaptive_cross_spectra(x, references="c0")
    assert spectra.noise_density is not None
    found = deflection_shapes(spectra, references="c0", frequencies_hz=[40.0, 200.0, 333.0])
    scatter = np.std(np.abs(found.values[:, 1:]), axis=1)
    # Of 3 x 60 trials: three standard deviations, 1/sqrt(360) each.
    assert scatter.mean() / found.std[:, 1:].mean() == pytest.approx(1, abs=3 / np.sqrt(360) + 0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"references": "z"}, "no channel 'z'"),
        ({"references": "a", "frequencies_hz": [700.0]}, "700 Hz lies outside the spectrum, 0 to 500 Hz"),
        ({"references": "a", "frequencies_hz": []}, "no frequency is named"),
        ({"references": "b", "frequencies_hz": [20.0]}, "b doesn't move at 20 Hz"),
        ({"references": "a", "frequencies_hz": [0.3]}, "0.3 Hz lies nearer to 0 than to the first line, 1 Hz"),
    ],
)
def test_what_has_no_shape_is_refused(options, words):
    x = np.stack([running(4000)[0], np.zeros(4000)])
    with pytest.raises(EstimateError, match=words):
        deflection_shapes(series(x, rate_hz=RATE_HZ), resolution_hz=1.0, **options)


def test_noise_has_no_peak_to_take():
    with pytest.raises(EstimateError, match="name the frequencies"):
        deflection_shapes(series(noise(2, 20_000), rate_hz=RATE_HZ), references="a")


@pytest.mark.parametrize("tone_hz", [50.0, 50.3, 50.45, 49.6])
def test_a_tone_between_two_lines_loses_nothing(tone_hz: float) -> None:
    """Lines 1 Hz apart: a Hann window alone takes up to 15 % from a tone midway."""
    turn = 2 * np.pi * tone_hz * np.arange(60_000) / 1000
    noise = 1e-3 * np.random.default_rng(4).standard_normal((2, turn.size))
    series = {"base": np.cos(turn) + noise[0], "tip": 3 * np.cos(turn - 1.0) + noise[1]}
    found = deflection_shapes(
        series, references="base", frequencies_hz=[tone_hz], resolution_hz=1.0, sample_rate_hz=1000.0
    )
    assert np.abs(found.values[0]) == pytest.approx([0.5**0.5, 3 * 0.5**0.5], rel=2e-3)
    assert found.std[0, 1] >= abs(abs(found.values[0, 1]) - 3 * 0.5**0.5)


def test_a_broad_spectrum_is_as_it_was() -> None:
    noise = np.random.default_rng(5).standard_normal(200_000)
    on, off = (
        deflection_shapes({"a": noise, "b": 2 * noise}, references="a", frequencies_hz=[hz], resolution_hz=1.0,
                          sample_rate_hz=1000.0)
        for hz in (100.0, 100.4)
    )  # fmt: skip
    assert np.abs(off.values[0]) == pytest.approx(np.abs(on.values[0]), rel=0.03)
