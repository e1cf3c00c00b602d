"""Transmissibility against the closed form of a mass on a vibrating base."""

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.transmissibility import transmissibility, transmissibility_along

RATE_HZ = 400.0


def closed_form(frequency_hz, natural_hz, damping=0.05):
    ratio = frequency_hz / natural_hz
    return (1 + 2j * damping * ratio) / (1 - ratio**2 + 2j * damping * ratio)


@pytest.fixture(scope="module")
def motions():
    random = np.random.default_rng(8)
    base = random.standard_normal(400_000)
    frequency_hz = np.fft.rfftfreq(base.size, 1 / RATE_HZ)
    column = np.fft.irfft(np.fft.rfft(base) * closed_form(frequency_hz, 20.0), base.size)
    wrist = np.fft.irfft(np.fft.rfft(column) * closed_form(frequency_hz, 50.0), base.size)
    wrist += 0.05 * random.standard_normal(base.size)
    names = ("/base", "/column", "/wrist")
    channels = (*(Channel(name=name, unit="m/s^2") for name in names), Channel(name="/force", unit="N"))
    values = np.vstack([base, column, wrist, base])
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)


@pytest.fixture(scope="module")
def spectra(motions):
    return cross_spectra(motions, resolution_hz=0.25)


def test_the_closed_form_is_met_within_the_stated_error(spectra):
    response = transmissibility(spectra, references="/base")
    assert [channel.name for channel in response.responses] == ["/column", "/wrist"]
    assert response.unit(0, 0) == "1"
    assert response.provenance.estimator == "T1"
    inside = (response.frequency_hz > 5) & (response.frequency_hz < 100)
    truth = closed_form(response.frequency_hz, 20.0) * closed_form(response.frequency_hz, 50.0)
    error = np.abs(np.abs(response.values[1, 0]) - np.abs(truth)) / response.std[1, 0]
    # 380 lines: their RMS error is one sigma, within the part that leakage adds at the resonances.
    assert 0.8 < np.sqrt(np.median(error[inside] ** 2) / 0.455) < 1.3
    assert np.all(response.coherence[0, inside] > 0.98)


def test_a_series_is_averaged_first(motions, spectra):
    of_series = transmissibility(motions, references="/base", resolution_hz=0.25)
    np.testing.assert_array_equal(of_series.values, transmissibility(spectra, references="/base").values)


def test_steps_of_a_path_multiply_to_the_whole(spectra):
    steps = transmissibility_along(spectra, path=["/base", "/column", "/wrist"])
    assert [(step.references[0].name, step.responses[0].name) for step in steps] == [
        ("/base", "/column"),
        ("/column", "/wrist"),
    ]
    frequency_hz = steps[1].frequency_hz
    inside = (frequency_hz > 5) & (frequency_hz < 80)
    truth = closed_form(frequency_hz, 50.0)
    np.testing.assert_allclose(steps[1].values[0, 0, inside], truth[inside], rtol=0.15)
    whole = transmissibility(spectra, references="/base", responses="/wrist")
    product = steps[0].values * steps[1].values
    np.testing.assert_allclose(product[0, 0, inside], whole.values[0, 0, inside], rtol=0.1)


def test_other_units_are_refused_with_both_sides_named(spectra):
    with pytest.raises(EstimateError, match="'/force' is in N, '/base' in m/s\\^2"):
        transmissibility(spectra, references="/base", responses=["/column", "/force"])
    with pytest.raises(EstimateError, match="no channel but '/force' is in N"):
        transmissibility(spectra, references="/force")
    with pytest.raises(EstimateError, match="no channel '/elbow'"):
        transmissibility(spectra, references="/elbow")
    with pytest.raises(EstimateError, match="two channels or more, got 1"):
        transmissibility_along(spectra, path=["/base"])
