"""Amplitudes of tones."""

import numpy as np
import pytest

from chladni.signals.errors import SetupError
from chladni.spectral.amplitude_spectrum import amplitude_spectrum
from chladni.spectral.cross_spectra import cross_spectra
from tests.spectral.made_signals import noise, series

TIME_S = np.arange(8000) / 1000.0
TONE = 5.0 + 3.0 * np.sin(2 * np.pi * 40 * TIME_S)


def spectra(signal, **options):
    return cross_spectra(series(signal, units=["V"]), resolution_hz=1.0, **options)


@pytest.mark.parametrize(("quantity", "tone"), [("rms", 3 / np.sqrt(2)), ("peak", 3.0)])
@pytest.mark.parametrize("window", ["boxcar", "hann", "flattop"])
def test_tone_and_offset_are_read_right(quantity, tone, window):
    spectrum = amplitude_spectrum(spectra(TONE, window=window, detrend="none"), quantity=quantity)
    assert spectrum.values[0, 40] == pytest.approx(tone, rel=1e-12)
    assert spectrum.values[0, 0] == pytest.approx(5.0, rel=1e-12)
    assert spectrum.quantity == quantity
    assert spectrum.provenance.estimator == f"amplitude spectrum, {quantity}"


def test_flattop_reads_between_lines():
    between = np.sin(2 * np.pi * 40.5 * TIME_S)
    assert amplitude_spectrum(spectra(between, window="flattop"), quantity="peak").values[0, 40] == pytest.approx(
        1.0, rel=2e-3
    )
    assert amplitude_spectrum(spectra(between), quantity="peak").values[0, 40] == pytest.approx(0.85, abs=0.01)


def test_the_error_is_half_that_of_the_power():
    averaged = spectra(noise(1, 8000))
    spectrum = amplitude_spectrum(averaged)
    relative = spectrum.std[0, 1:] / spectrum.values[0, 1:]
    np.testing.assert_allclose(relative, 0.5 / np.sqrt(averaged.provenance.effective_averages), rtol=1e-12)


def test_silence_is_zero_without_a_warning():
    spectrum = amplitude_spectrum(spectra(np.zeros(8000)))
    assert not spectrum.values.any()
    assert not spectrum.std.any()


def test_other_quantities_are_refused():
    with pytest.raises(SetupError, match="none of rms, peak"):
        amplitude_spectrum(spectra(TONE), quantity="mean")
