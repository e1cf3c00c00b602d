"""Streams band-passed and integrated, against closed forms and SciPy's analogue filter."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.band_filter import ORDER, BandFilter
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 1000.0


def passed(whole, band_hz, *, lengths=(), **options):
    return list(BandFilter(whole.sample_rate_hz, band_hz, **options).blocks(blocks(whole, lengths)))


def tone(frequency_hz, *, samples=20_000, unit="m/s^2"):
    angle = 2 * np.pi * frequency_hz * np.arange(samples) / RATE_HZ
    return series(np.sin(angle) + 9.81, rate_hz=RATE_HZ, units=[unit])


@pytest.mark.parametrize("band_hz", [(20.0, 100.0), (20.0, RATE_HZ / 2), (0.0, 100.0), (95.0, 105.0)])
@pytest.mark.parametrize("frequency_hz", [10.0, 20.0, 45.0, 100.0, 300.0])
def test_a_tone_passes_as_by_the_analogue_butterworth_filter(band_hz, frequency_hz):
    edges = [edge for edge in band_hz if 0 < edge < RATE_HZ / 2]
    kind = "bandpass" if len(edges) == 2 else "highpass" if band_hz[0] else "lowpass"
    system = signal.butter(ORDER, edges if len(edges) == 2 else edges[0], kind, analog=True)
    _, response = signal.freqs(*system, worN=[frequency_hz])
    (found,) = passed(tone(frequency_hz), band_hz)
    assert np.std(found.values) * np.sqrt(2) == pytest.approx(abs(response[0]), abs=6e-4)


@pytest.mark.parametrize("frequency_hz", [24.9, 180.0, 390.0])
def test_integration_is_exact_at_every_frequency_and_has_the_right_phase(frequency_hz):
    omega = 2 * np.pi * frequency_hz
    (found,) = passed(tone(frequency_hz), (2.0, RATE_HZ / 2), integrations=1)
    assert found.channels[0].unit == "m/s"
    time_s = found.start_time_ns / 1e9 + found.times_s()
    np.testing.assert_allclose(found.values[0], -np.cos(omega * time_s) / omega, atol=1e-3 / omega)


def test_the_envelope_of_a_modulated_tone_is_its_modulation():
    time_s = np.arange(20_000) / RATE_HZ
    modulation = 1 + 0.5 * np.cos(2 * np.pi * 3 * time_s)
    whole = series(modulation * np.sin(2 * np.pi * 200 * time_s), rate_hz=RATE_HZ)
    (found,) = passed(whole, (100.0, 300.0), envelope=True)
    assert found.channels[0].unit == "(m/s^2)^2"
    at = found.start_time_ns / 1e9 + found.times_s()
    np.testing.assert_allclose(found.values[0], (1 + 0.5 * np.cos(2 * np.pi * 3 * at)) ** 2, atol=2e-3)


def test_what_comes_out_does_not_depend_on_where_blocks_are_cut():
    whole = series(noise(2, 30_000), rate_hz=RATE_HZ)
    (expected,) = passed(whole, (20.0, 100.0))
    found = passed(whole, (20.0, 100.0), lengths=[1, 7, 900, 3000, 12_000, 50])
    assert len(found) > 1
    for one, other in pairwise(found):
        assert other.start_time_ns == one.start_time_ns + one.samples * 1_000_000
    np.testing.assert_allclose(np.concatenate([one.values for one in found], axis=1), expected.values, atol=1e-12)


def test_nothing_is_carried_over_a_gap_and_ends_are_left_out():
    whole = noise(1, 20_000)
    valid = np.ones(whole.shape, dtype=bool)
    valid[0, 8000:8100] = False
    whole[0, 8000:8100] = np.nan
    first, second = passed(series(whole, rate_hz=RATE_HZ, valid=valid), (20.0, 100.0))
    reach = round(BandFilter(RATE_HZ, (20.0, 100.0)).reach_s * RATE_HZ)
    assert (first.samples, second.samples) == (8000 - 2 * reach, 11_900 - 2 * reach)
    assert second.start_time_ns == (8100 + reach) * 1_000_000


def test_what_can_not_be_filtered_is_refused():
    with pytest.raises(EstimateError, match="must rise and end at half the sample rate, 500 Hz"):
        BandFilter(RATE_HZ, (10.0, 600.0))
    with pytest.raises(EstimateError, match="begins above 0 Hz"):
        BandFilter(RATE_HZ, (0.0, 100.0), integrations=1)
    with pytest.raises(EstimateError, match="resample to a lower rate"):
        BandFilter(1e6, (0.01, 1e5))
    with pytest.raises(EstimateError, match=r"unbroken run of 1\.02 s, and the longest has 0\.9 s"):
        passed(tone(20.0, samples=900), (10.0, 100.0))
    with pytest.raises(SetupError, match="can't be integrated"):
        passed(tone(20.0, unit="N"), (10.0, 100.0), integrations=1)
