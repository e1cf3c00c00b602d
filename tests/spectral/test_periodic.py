"""Whole periods averaged: exact numbers, streams, gaps, and the aircraft's published peaks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import EstimateError
from chladni.signals.testing import assert_close
from chladni.spectral.frf import frequency_response
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from tests.spectral.aircraft import PAYLOAD, SHAKER, aircraft
from tests.spectral.made_signals import blocks, multisine, noise, part, series

SAMPLES, PERIODS = 250, 7


def repeating(samples=SAMPLES, *, periods=PERIODS, level=0.1):
    x = np.tile(multisine(samples, np.arange(3, 90)), periods)
    return series(np.stack([x, 2 * np.roll(x, 4)]) + level * noise(2, x.size) + np.array([[0.0], [9.81]]))


WHOLE = repeating()
PERIOD = find_period(WHOLE, channel="a")


@pytest.mark.parametrize("samples", [250, 251])
def test_mean_and_scatter_are_those_of_the_periods(samples):
    whole = repeating(samples)
    spectra = periodic_cross_spectra(whole, find_period(whole, channel="a"))
    periods = whole.values.reshape(2, PERIODS, samples)
    lines = np.fft.rfft(periods - periods.mean(axis=-1, keepdims=True))
    weight = np.full(samples // 2 + 1, 2.0)
    weight[0] = 1
    weight[-1] = 1 if samples % 2 == 0 else 2
    scale = weight / (1000.0 * samples)
    about = lines - lines.mean(axis=1, keepdims=True)
    density = np.einsum("imf,jmf->ijf", lines.conj(), lines) * scale / PERIODS
    scatter = np.einsum("imf,jmf->ijf", about.conj(), about) * scale / (PERIODS - 1)
    np.testing.assert_allclose(spectra.density, density, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(spectra.noise_density, scatter, rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(spectra.density, spectra.density.conj().swapaxes(0, 1))
    # Parseval, for even and odd periods.
    power = spectra.density.sum(axis=-1).real * spectra.bandwidth_hz
    np.testing.assert_allclose(power.diagonal(), periods.var(axis=-1).mean(axis=1), rtol=1e-12)


def test_the_account_tells_of_periods():
    account = periodic_cross_spectra(WHOLE, PERIOD).provenance
    assert (account.averaging, account.window, account.segment_s) == ("periodic", "boxcar", 0.25)
    assert (account.averages, account.effective_averages, account.skipped) == (PERIODS, float(PERIODS), 0)
    assert account.notes == ("a repeats every 0.25 s: 7 whole periods averaged without window",)


@given(lengths=st.lists(st.integers(1, 700), max_size=10), first=st.integers(0, 300))
def test_any_cut_into_blocks_gives_the_same_periods(lengths, first):
    period = replace(PERIOD, first_sample=first)
    whole = periodic_cross_spectra(WHOLE, period)
    assert_close(periodic_cross_spectra(blocks(WHOLE, lengths), period), whole, rtol=0)
    assert whole.provenance.averages == (WHOLE.samples - first) // SAMPLES


def test_noise_free_periods_have_no_scatter():
    spectra = periodic_cross_spectra(repeating(level=0.0), PERIOD)
    autos = np.einsum("iif->if", spectra.noise_density).real
    assert np.all(autos >= 0)
    # Rounding only: far below what subtracting averages of squares would leave.
    assert autos.max() < 1e-28


def test_periods_with_missing_samples_are_skipped_and_the_grid_stays():
    valid = np.ones(WHOLE.values.shape, dtype=bool)
    valid[1, 600] = False
    values = WHOLE.values.copy()
    values[1, 600] = np.nan
    spectra = periodic_cross_spectra(replace(WHOLE, values=values, valid=valid), PERIOD)
    kept = np.delete(np.arange(PERIODS), 2)
    expected = WHOLE.values.reshape(2, PERIODS, SAMPLES)[:, kept].reshape(2, -1)
    assert_close(spectra, periodic_cross_spectra(series(expected), PERIOD), rtol=1e-9, atol=1e-15)
    assert spectra.provenance.skipped == 1
    assert any("1 periods skipped" in note for note in spectra.provenance.notes)


def test_after_a_break_in_time_the_grid_of_periods_goes_on():
    stream = [part(WHOLE, 0, 600), part(WHOLE, 1100, WHOLE.samples)]
    spectra = periodic_cross_spectra(stream, PERIOD)
    # Periods 0, 1 before the break, 5 and 6 behind it.
    kept = WHOLE.values.reshape(2, PERIODS, SAMPLES)[:, [0, 1, 5, 6]].reshape(2, -1)
    assert_close(spectra, periodic_cross_spectra(series(kept), PERIOD), rtol=1e-9, atol=1e-15)
    assert spectra.provenance.skipped == 1


def test_periods_in_which_the_excitation_stopped_are_skipped():
    silent = 0.01 * noise(2, 1000)
    spectra = periodic_cross_spectra(series(np.concatenate([WHOLE.values, silent], axis=1)), PERIOD)
    assert_close(spectra, periodic_cross_spectra(WHOLE, PERIOD), rtol=0)
    assert spectra.provenance.skipped == 4


def test_what_cannot_be_averaged_is_refused():
    with pytest.raises(EstimateError, match="drifts by 2 samples"):
        periodic_cross_spectra(WHOLE, replace(PERIOD, whole=False, drift_samples=2.0))
    with pytest.raises(EstimateError, match=r"1 whole periods of 0\.25 s repeat"):
        periodic_cross_spectra(part(WHOLE, 0, 400), PERIOD)
    with pytest.raises(EstimateError, match="0 whole periods"):
        periodic_cross_spectra(part(WHOLE, 0, 100), PERIOD)
    with pytest.raises(EstimateError, match="before the last one ended"):
        periodic_cross_spectra([WHOLE, WHOLE], PERIOD)
    with pytest.raises(EstimateError, match="would take"):
        periodic_cross_spectra(WHOLE, replace(PERIOD, samples=10**9))
    bad = WHOLE.values.copy()
    bad[0, 300] = np.nan
    with pytest.raises(EstimateError, match="channel 'a' is nan"):
        periodic_cross_spectra(replace(WHOLE, values=bad), PERIOD)


@pytest.mark.parametrize(
    ("level", "peak_hz", "height"), [(1, 7.324, 0.258), (3, 7.275, 0.233), (5, 7.227, 0.097), (7, 7.227, 0.075)]
)
def test_the_aircrafts_torsion_peak_is_the_published_one(shared_data, level, peak_hz, height):
    source = aircraft(shared_data, level)
    spectra = periodic_cross_spectra(source, find_period(source, channel=SHAKER))
    response = frequency_response(spectra, references=SHAKER, responses=[PAYLOAD])
    magnitude = np.where(response.excited & (response.frequency_hz > 6.8), np.abs(response.values[0, 0]), 0)
    peak = int(np.argmax(magnitude))
    assert response.frequency_hz[peak] == pytest.approx(peak_hz, abs=0.001)
    assert magnitude[peak] == pytest.approx(height, abs=0.0005)
    assert response.std[0, 0, peak] < 0.01 * height
    assert response.unit(0, 0) == "(m/s^2)/N"
