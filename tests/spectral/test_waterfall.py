"""Waterfall: Welch's numbers slice by slice, in bounded size, with holes where the log has them."""

import tracemalloc
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from chladni.spectral.segmentation import plan_segmentation
from chladni.spectral.waterfall import WaterfallAccumulator, waterfall

RATE_HZ = 500.0
# Single precision of the result.
RTOL = 4e-7


def noise(samples, channels=2, seed=1):
    values = np.random.default_rng(seed).standard_normal((channels, samples)) + 3.0
    names = tuple(Channel(name=f"c{row}", unit="m/s^2") for row in range(channels))
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=names, start_time_ns=10**18)


def blocks(series, cuts):
    edges = [0, *cuts, series.samples]
    for first, last in pairwise(edges):
        yield series.window(start_s=first / RATE_HZ, end_s=last / RATE_HZ)


@pytest.mark.parametrize("segment", [100, 101])
@pytest.mark.parametrize("window", ["hann", "boxcar", ("kaiser", 8.6)])
@pytest.mark.parametrize("detrend", ["constant", "linear"])
def test_slices_are_those_of_scipy(segment, window, detrend):
    series = noise(3000)
    result = waterfall(series, resolution_hz=RATE_HZ / segment, window=window, detrend=detrend)
    frequency_hz, time_s, power = signal.spectrogram(
        series.values, RATE_HZ, window=window, nperseg=segment, noverlap=segment // 2, detrend=detrend
    )
    np.testing.assert_allclose(result.frequency_hz, frequency_hz, rtol=1e-13)
    np.testing.assert_allclose(result.time_s, time_s, rtol=1e-13)
    np.testing.assert_allclose(result.values, power.transpose(0, 2, 1), rtol=RTOL, atol=1e-10)


def test_a_long_log_is_averaged_in_groups_and_says_so():
    series = noise(20_000)
    fine = waterfall(series, resolution_hz=5.0, max_slices=1000)
    coarse = waterfall(series, resolution_hz=5.0, max_slices=64)
    group = coarse.provenance.averages
    assert group == 8
    assert 32 < coarse.time_s.size <= 64
    whole = fine.time_s.size // group
    means = fine.values[:, : whole * group].reshape(2, whole, group, -1).mean(axis=2)
    np.testing.assert_allclose(coarse.values[:, :whole], means, rtol=4 * RTOL)
    rest = fine.values[:, whole * group :].mean(axis=1)
    np.testing.assert_allclose(coarse.values[:, whole], rest, rtol=4 * RTOL)
    np.testing.assert_allclose(coarse.time_s[0], fine.time_s[:group].mean(), rtol=1e-12)
    np.testing.assert_allclose(coarse.time_s[-1], fine.time_s[whole * group :].mean(), rtol=1e-12)
    assert "average of 8 segments of 0.2 s, one every 0.8 s" in coarse.provenance.notes[0]
    assert not fine.provenance.notes


def test_slices_reserved_from_the_first_hold_a_day_without_more_memory():
    series = noise(5000)
    plan = plan_segmentation(RATE_HZ, samples_available=None, resolution_hz=5.0, window="hann", overlap=0.5)
    reserved = WaterfallAccumulator(series.channels, RATE_HZ, plan, max_slices=32, reserved_slices=32)
    reserved.update(series.window(end_s=1.0))
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        reserved.update(series.window(start_s=1.0))
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # A slice of both channels takes 816 bytes, and 24 more were filled; what's allowed is small change.
    assert after - before < 10 * 816
    assert_close(reserved.result(), waterfall(series, resolution_hz=5.0, max_slices=32), rtol=0.0)


@pytest.mark.parametrize("cuts", [(), (1,), (333, 334, 2000), (50, 4999)])
def test_blocks_give_what_the_whole_gives(cuts):
    series = noise(5000)
    assert_close(waterfall(blocks(series, cuts)), waterfall(series), rtol=0.0)


def test_a_tone_that_starts_late_shows_late():
    t = np.arange(5000) / RATE_HZ
    tone = np.where(t > 5, np.sqrt(2) * np.sin(2 * np.pi * 50 * t), 0.0)[np.newaxis]
    series = TimeSeries(values=tone, sample_rate_hz=RATE_HZ, channels=(Channel(name="a", unit="V"),))
    result = waterfall(series, resolution_hz=5.0)
    power = result.values[0, :, 10] * result.bandwidth_hz
    assert np.all(power[result.time_s < 4.9] < 1e-12)
    np.testing.assert_allclose(power[result.time_s > 5.1], 1.0, rtol=1e-5)


def test_slices_on_invalid_samples_are_empty_for_that_channel_only():
    series = noise(1000)
    valid = np.ones(series.values.shape, dtype=bool)
    valid[0, 500] = False
    result = waterfall(replace(series, valid=valid), resolution_hz=5.0)
    touched = (result.time_s - 0.1 <= 1.0) & (result.time_s + 0.1 > 1.0)
    assert touched.sum() == 2
    np.testing.assert_array_equal(np.isnan(result.values[0]).all(axis=1), touched)
    assert np.isfinite(result.values[1]).all()
    assert np.isfinite(result.values[0, ~touched]).all()


def test_a_gap_between_blocks_is_a_hole_and_time_goes_on():
    series = noise(2000)
    parts = [series.window(end_s=1.0), series.window(start_s=3.0)]
    result = waterfall(iter(parts), resolution_hz=5.0)
    whole = waterfall(series, resolution_hz=5.0)
    np.testing.assert_array_equal(result.time_s, whole.time_s)
    inside = (result.time_s + 0.1 > 1.001) & (result.time_s - 0.1 < 2.999)
    assert np.isnan(result.values[:, inside]).all()
    np.testing.assert_array_equal(result.values[:, ~inside], whole.values[:, ~inside])


def test_long_blocks_are_taken_in_portions(monkeypatch):
    monkeypatch.setattr("chladni.spectral.waterfall.PORTION", 700)
    portioned = waterfall(noise(5000))
    monkeypatch.undo()
    assert_close(portioned, waterfall(noise(5000)), rtol=0.0)


def test_the_default_is_no_finer_than_a_screen():
    assert waterfall(noise(200_000, channels=1)).frequency_hz.size == 1025


def test_blocks_that_do_not_fit_are_refused():
    series = noise(2000)
    with pytest.raises(EstimateError, match="consecutive blocks"):
        waterfall(iter([series, series]), resolution_hz=5.0)
    with pytest.raises(EstimateError, match="same channels and rate"):
        waterfall(iter([series, series.select(["c0"])]), resolution_hz=5.0)
    far = replace(series, start_time_ns=series.start_time_ns + 10**18)
    with pytest.raises(EstimateError, match="one by one"):
        waterfall(iter([series, far]), resolution_hz=5.0)


def test_too_little_is_refused():
    with pytest.raises(EstimateError, match="at least 2"):
        waterfall(noise(2000), max_slices=1)
    with pytest.raises(EstimateError, match="no sample"):
        waterfall(iter(()))
    with pytest.raises(SetupError, match="needs segments of 10 s, but the record is 4 s long"):
        waterfall(noise(2000), resolution_hz=0.1)
