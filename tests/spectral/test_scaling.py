"""Estimates of a signal in another unit: every one scales exactly, or is refused by name; none is 0, inf or NaN."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.modal.operational.correlation import correlation_functions
from chladni.modal.operational.narrow_band_kurtosis import narrow_bands
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.adaptive import adaptive_cross_spectra
from chladni.spectral.coherence import coherence
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from chladni.spectral.impact import find_impacts, impact_cross_spectra
from chladni.spectral.period import find_period
from chladni.spectral.periodic import periodic_cross_spectra
from chladni.spectral.waterfall import waterfall

RATE_HZ = 500.0
RNG = np.random.default_rng(11)


def made(values):
    channels = (Channel(name="force", unit="N", role="reference"), Channel(name="acc", unit="m/s^2"))
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)


def answering(force):
    answer = np.convolve(force, np.exp(-np.arange(60) / 9) * np.sin(np.arange(60)))[: force.size]
    return made(np.stack([force, answer + 0.01 * RNG.standard_normal(force.size)]))


def hits():
    force = 1e-3 * RNG.standard_normal(4000)
    for start in range(300, 4000, 800):
        force[start : start + 9] += np.hanning(9)
    return answering(force)


NOISE = answering(RNG.standard_normal(6000))
PERIODIC = answering(np.tile(RNG.standard_normal(500), 12))
HITS = hits()


def scaled(series, exponent):
    return replace(series, values=np.ldexp(series.values, exponent))


#: Signal, estimate, and the power of the scale that its numbers go with.
ESTIMATES = {
    "Welch": (NOISE, lambda one: cross_spectra(one, resolution_hz=5.0).density, 2),
    "peak hold": (NOISE, lambda one: cross_spectra(one, resolution_hz=5.0, averaging="peak-hold").density, 2),
    "as it comes": (NOISE, lambda one: adaptive_cross_spectra(one).density, 2),
    "whole periods": (PERIODIC, lambda one: adaptive_cross_spectra(one).density, 2),
    "hits": (HITS, lambda one: adaptive_cross_spectra(one).density, 2),
    "scatter of periods": (
        PERIODIC,
        lambda one: periodic_cross_spectra(one, find_period(PERIODIC, channel="force")).noise_density,
        2,
    ),
    "accepted hits": (HITS, lambda one: impact_cross_spectra(one, find_impacts(HITS, force="force")).density, 2),
    "coherence": (NOISE, lambda one: coherence(cross_spectra(one), references="force").values, 0),
    "H1": (NOISE, lambda one: frequency_response(cross_spectra(one), references="force").values, 0),
    "error of H1": (NOISE, lambda one: frequency_response(cross_spectra(one), references="force").std, 0),
    "correlation": (NOISE, lambda one: correlation_functions(one, lags=20).values, 2),
    "power of narrow bands": (NOISE, lambda one: narrow_bands(one, 100).power, 2),
    "kurtosis": (NOISE, lambda one: narrow_bands(one, 100).kurtosis, 0),
    "waterfall": (NOISE, lambda one: waterfall(one, resolution_hz=5.0).values.astype(np.float64), 2),
}
EACH = pytest.mark.parametrize("name", ESTIMATES)


@EACH
@settings(max_examples=6, deadline=None)
@given(exponent=st.integers(-190, 190))
def test_estimates_scale_with_a_power_of_two(name, exponent):
    signal, estimate, power = ESTIMATES[name]
    # Single precision, where a waterfall keeps to it, rounds once more; all else is exact.
    tolerance = 1e-6 if name == "waterfall" else 0.0
    expected, found = estimate(signal), estimate(scaled(signal, exponent))
    np.testing.assert_allclose(found, np.ldexp(1.0, power * exponent) * expected, rtol=tolerance)


@EACH
def test_what_cannot_be_squared_is_refused_with_channel_size_and_remedy(name):
    signal, estimate, _ = ESTIMATES[name]
    for exponent in (-1073, -1022, -700, -530, -350, -210, 210, 350, 510, 700, 1018):
        with pytest.raises(EstimateError, match=r"'force' holds .*e[+-]\d+.*; leave the channel out, or scale it"):
            estimate(scaled(signal, exponent))


@EACH
def test_one_channel_out_of_range_is_the_one_that_is_named(name):
    signal, estimate, _ = ESTIMATES[name]
    for exponent in (-1000, -300, 300, 1000):
        values = signal.values.copy()
        values[1] = np.ldexp(values[1], exponent)
        with pytest.raises(EstimateError, match="channel 'acc' holds"):
            estimate(replace(signal, values=values))


@EACH
def test_channels_of_very_different_sizes_stand_side_by_side(name):
    signal, estimate, power = ESTIMATES[name]
    values = np.stack([np.ldexp(signal.values[0], -190), np.ldexp(signal.values[1], 190)])
    found = estimate(replace(signal, values=values))
    assert np.isfinite(found).all()
    if power:
        np.testing.assert_array_equal(found == 0, estimate(signal) == 0)


def test_a_waterfall_leaves_single_precision_where_that_holds_too_little():
    assert waterfall(NOISE).values.dtype == np.float32
    assert waterfall(scaled(NOISE, 80)).values.dtype == np.float64
    assert waterfall(scaled(NOISE, -80)).values.dtype == np.float64
