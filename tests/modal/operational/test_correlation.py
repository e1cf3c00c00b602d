"""Correlation functions against sums written out, streams against the whole, breaks, and the scatter of blocks."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.operational.anti_alias import power_transfer
from chladni.modal.operational.correlation import CorrelationAccumulator, correlation_functions
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.time_series import TimeSeries

RATE_HZ = 100.0


def series(values, *, valid=None, start_s=0.0):
    channels = tuple(Channel(name=f"/a{row}", unit="m/s^2") for row in range(len(values)))
    return TimeSeries(
        values=values, sample_rate_hz=RATE_HZ, channels=channels, valid=valid, start_time_ns=round(start_s * 1e9)
    )


def coloured(samples, channels=3, seed=0):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((channels, samples + 8))
    return sum(noise[:, lag : lag + samples] * (0.7**lag) for lag in range(8)) + rng.standard_normal((channels, 1))


def products(values, lags, references):
    """Covariances of samples with those that follow them, block by block, as they are defined."""
    used = values.shape[1] - lags
    late = [values[:, lag : lag + used] for lag in range(lags + 1)]
    early = values[references, :used]
    return np.stack([part @ early.T / used - np.outer(part.mean(axis=1), early.mean(axis=1)) for part in late])


def test_the_functions_are_the_covariances_of_each_block():
    values = coloured(4000)
    accumulator = CorrelationAccumulator(series(values).channels, RATE_HZ, lags=12, blocks=2, samples=4000)
    accumulator.update(series(values))
    found = accumulator.result()
    assert found.samples == 4000 - 12
    # Deviations are scaled by the share of their block: scaled back they give its own functions.
    length = found.samples // (2 * accumulator.plan.hop) * accumulator.plan.hop
    share = length / found.samples
    first = found.values + found.deviations[0] / (share * np.sqrt(found.blocks / (found.blocks - 1)))
    np.testing.assert_allclose(first, products(values[:, : length + 12], 12, [0, 1, 2]), rtol=0, atol=1e-12)


def test_white_noise_correlates_at_lag_0_only_and_each_function_scatters_as_its_error_bar_says():
    noise = np.random.default_rng(3).standard_normal((4, 40_000))
    found = correlation_functions(series(noise), lags=30)
    std = np.sqrt(np.sum(found.deviations**2, axis=0))
    expected = np.zeros_like(found.values)
    expected[0] = np.eye(4)
    z = (found.values - expected) / std
    # 496 numbers, of which one sigma is known to 1/sqrt(2 * 50): their RMS is 1 within 4 of its own sigmas.
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=4 * np.hypot(1 / np.sqrt(2 * 496), 0.1 / np.sqrt(20)))
    np.testing.assert_allclose(np.median(std[1:]), 1 / np.sqrt(40_000), rtol=0.05)


@given(cuts=st.lists(st.integers(1, 2999), max_size=6))
def test_a_stream_gives_what_the_whole_gives(cuts):
    values = coloured(3000)
    channels = series(values).channels
    edges = [0, *sorted(set(cuts)), 3000]
    accumulator = CorrelationAccumulator(channels, RATE_HZ, lags=10, references=[0, 2], samples=3000)
    for first, last in pairwise(edges):
        accumulator.update(series(values[:, first:last], start_s=first / RATE_HZ))
    streamed, whole = accumulator.result(), correlation_functions(series(values), lags=10, references=[0, 2])
    np.testing.assert_allclose(streamed.values, whole.values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(streamed.deviations, whole.deviations, rtol=0, atol=1e-12)
    np.testing.assert_allclose(streamed.variance, whole.variance, rtol=1e-12)


def test_memory_stays_as_the_stream_goes_on():
    values = coloured(60_000, channels=2)
    accumulator = CorrelationAccumulator(series(values).channels, RATE_HZ, lags=5, blocks=10)
    for first in range(0, 60_000, 500):
        accumulator.update(series(values[:, first : first + 500], start_s=first / RATE_HZ))
    found = accumulator.result()
    assert 10 <= found.blocks <= 20
    np.testing.assert_allclose(found.values, products(values, 5, [0, 1]), rtol=0, atol=0.02)


def test_asking_for_a_result_changes_nothing():
    values = coloured(3000)
    channels = series(values).channels
    asked = CorrelationAccumulator(channels, RATE_HZ, lags=10, samples=3000)
    for first in range(0, 3000, 1000):
        asked.update(series(values[:, first : first + 1000], start_s=first / RATE_HZ))
        asked.result()
    np.testing.assert_allclose(
        asked.result().values, correlation_functions(series(values), lags=10).values, rtol=0, atol=1e-12
    )


def test_no_product_crosses_invalid_samples_or_a_break_in_time():
    one, other = coloured(2000, seed=1), coloured(1500, seed=2)
    joined = np.concatenate([one, np.full((3, 40), np.nan), other], axis=1)
    valid = np.ones(joined.shape, dtype=bool)
    valid[1, 2000:2040] = False
    gap = correlation_functions(series(np.where(valid.all(axis=0), joined, 1e6), valid=valid), lags=10)
    apart = [series(one), series(other, start_s=20.4)]
    late = correlation_functions(apart, lags=10)
    np.testing.assert_allclose(gap.values, late.values, rtol=0, atol=0.03)
    assert gap.samples == 2000 - 10 + 1500 - 10
    assert late.samples == gap.samples
    assert gap.skipped == 60
    assert late.skipped == 20
    # A million squared would show at once if a product had touched what isn't valid.
    assert np.abs(gap.values).max() < 10


def test_an_offset_such_as_gravity_is_no_signal():
    values = coloured(5000)
    plain = correlation_functions(series(values), lags=8)
    lifted = correlation_functions(series(values + 1e6), lags=8)
    np.testing.assert_allclose(lifted.values, plain.values, rtol=0, atol=1e-7)
    np.testing.assert_allclose(lifted.variance, plain.variance, rtol=1e-6)


def test_decimated_functions_are_those_of_the_filtered_record():
    values, every = coloured(20_000, channels=2), 4
    found = correlation_functions(series(values), lags=15, decimation=every, blocks=10)
    # The same filter applied to the whole record at once; the record's ends, which wrap around there, are left out.
    lines = np.fft.rfft(values - values.mean(axis=1, keepdims=True))
    kept = (lines.shape[1] - 1) // every + 1
    lines[:, :kept] *= np.sqrt(power_transfer(kept, every))
    lines[:, kept:] = 0
    filtered = np.fft.irfft(lines, n=20_000)
    early = filtered[:, :-60]
    expected = (
        np.stack([filtered[:, every * lag : 20_000 - 60 + every * lag] @ early.T for lag in range(16)]) / 19_940
    )
    scale = np.sqrt(np.outer(np.diag(expected[0]), np.diag(expected[0])))
    # Both take 256 samples at either end for something else: 512 of 20 000.
    np.testing.assert_allclose(found.values / scale, expected / scale, rtol=0, atol=0.03)
    np.testing.assert_allclose(found.variance, np.diag(found.values[0]), rtol=0.03)
    assert found.sample_rate_hz == RATE_HZ / every
    assert found.decimation == every


def test_decimation_keeps_a_tone_below_the_new_half_rate_and_drops_one_above():
    time_s = np.arange(20_000) / RATE_HZ
    low, high = (np.sin(2 * np.pi * hz * time_s)[None] for hz in (3.0, 17.0))
    kept = correlation_functions(series(low), lags=20, decimation=4, blocks=10)
    np.testing.assert_allclose(kept.values[:, 0, 0], 0.5 * np.cos(2 * np.pi * 3.0 * np.arange(21) * 0.04), atol=2e-3)
    dropped = correlation_functions(series(high), lags=20, decimation=4, blocks=10)
    assert np.abs(dropped.values).max() < 1e-4


def test_selecting_channels_is_computing_them_alone():
    values = coloured(5000)
    chosen = correlation_functions(series(values), lags=6).select([2, 0])
    alone = correlation_functions(series(values).select(["/a2", "/a0"]), lags=6)
    order = np.argsort(chosen.references)
    np.testing.assert_allclose(chosen.values[:, :, order], alone.values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(chosen.deviations[..., order], alone.deviations, rtol=0, atol=1e-12)
    assert chosen.channels == alone.channels


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"lags": 0}, "lags 0 must be at least 1"),
        ({"decimation": 0}, "decimation 0"),
        ({"blocks": 1}, "blocks 1"),
        ({"references": [3]}, "rows of the 3 channels"),
        ({"references": []}, "one or more"),
        ({"references": [1, 1]}, "different"),
        ({"lags": 10**8}, "GB"),
    ],
)
def test_impossible_plans_are_refused(change, word):
    options = {"lags": 5} | change
    with pytest.raises(SetupError, match=word):
        CorrelationAccumulator(series(coloured(10)).channels, RATE_HZ, **options)


def test_what_can_not_be_averaged_is_told():
    values = coloured(400)
    with pytest.raises(EstimateError, match=r"400 samples \(4 s\) are too few for correlations over 200 samples"):
        correlation_functions(series(values), lags=200)
    broken = values.copy()
    broken[1, 7] = np.nan
    with pytest.raises(EstimateError, match="/a1"):
        correlation_functions(series(broken), lags=5)
    accumulator = CorrelationAccumulator(series(values).channels, RATE_HZ, lags=5)
    with pytest.raises(EstimateError, match="consecutive blocks of one series"):
        accumulator.update(replace(series(values), sample_rate_hz=50.0))
    accumulator.update(series(values))
    with pytest.raises(EstimateError, match="time order"):
        accumulator.update(series(values))
