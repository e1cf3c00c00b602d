"""Averages that run: channels that give nothing don't stop the others."""

import pickle
import tracemalloc

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.accumulator import AutoSpectraAccumulator
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.running import RunningAverages, running_segmentation
from chladni.spectral.waterfall import WaterfallAccumulator
from tests.spectral.made_signals import blocks, noise, series

RATE_HZ = 500.0
PLAN = running_segmentation(RATE_HZ)


def test_channels_left_out_keep_their_average_and_the_others_go_on() -> None:
    values = noise(3, 40_000)
    values[1, 20_000:] = np.nan
    whole = series(values, rate_hz=RATE_HZ, valid=np.isfinite(values))
    averages = RunningAverages(whole.channels, RATE_HZ, PLAN)
    for number, block in enumerate(blocks(whole, [1000] * 40)):
        if number == 20:
            averages.leave_out(["b"])
        averages.update(block)
    alive, dead = averages.densities()
    assert [channel.name for channel in alive.channels] == ["a", "c"]
    assert [channel.name for channel in dead.channels] == ["b"]
    resolution_hz = RATE_HZ / PLAN.samples
    # Segments went on across the moment at which the third fell silent.
    others = cross_spectra(whole.select(["a", "c"]), resolution_hz=resolution_hz)
    first_half = cross_spectra(series(values[:, :20_000], rate_hz=RATE_HZ), resolution_hz=resolution_hz)
    np.testing.assert_allclose(alive.values, np.einsum("iif->if", others.density).real, rtol=1e-12)
    np.testing.assert_allclose(dead.values[0], first_half.density[1, 1].real, rtol=1e-12)
    assert averages.spectra().channels == alive.channels


def test_a_channel_that_is_back_is_averaged_with_all_again() -> None:
    values = noise(2, 30_000)
    values[1, 10_000:20_000] = np.nan
    whole = series(values, rate_hz=RATE_HZ, valid=np.isfinite(values))
    averages = RunningAverages(whole.channels, RATE_HZ, PLAN)
    for number, block in enumerate(blocks(whole, [1000] * 30)):
        averages.leave_out(["b"] if 10 <= number < 20 else [])
        averages.update(block)
    (found,) = averages.densities()
    reference = cross_spectra(whole, resolution_hz=RATE_HZ / PLAN.samples)
    np.testing.assert_allclose(found.values, np.einsum("iif->if", reference.density).real, rtol=1e-12)


def test_a_rate_that_is_told_later_scales_the_average() -> None:
    whole = series(noise(2, 20_000), rate_hz=RATE_HZ)
    averages = RunningAverages(whole.channels, RATE_HZ, PLAN)
    averages.update(whole)
    true_hz = 499.9
    (found,) = averages.densities(sample_rate_hz=true_hz)
    reference = cross_spectra(series(whole.values, rate_hz=true_hz), resolution_hz=true_hz / PLAN.samples)
    np.testing.assert_allclose(found.frequency_hz, reference.frequency_hz, rtol=1e-15)
    np.testing.assert_allclose(found.values, np.einsum("iif->if", reference.density).real, rtol=1e-12)


def test_averages_of_a_long_time_are_no_larger_than_those_of_a_short_one() -> None:
    """All that is joined where there's too much of it has been joined at least once by the end of the short time."""
    short, step = 1 << 19, 1 << 15
    averages = RunningAverages(series(noise(2, 1), rate_hz=RATE_HZ).channels, RATE_HZ, PLAN, fading_pairs_s=60.0)
    sizes = []
    for first in range(0, 2 * short, step):
        start_ns = round(first / RATE_HZ * 1e9)
        averages.update(series(noise(2, step, seed=first), rate_hz=RATE_HZ, start_time_ns=start_ns))
        sizes.append(len(pickle.dumps(averages)))
    # Between two joins it's half of the most, and all of it: the most of each doubling counts.
    assert max(sizes[short // step :]) < 1.001 * max(sizes[: short // step])


def test_a_waterfall_holds_its_slices_and_not_the_segments_that_they_are_made_of() -> None:
    whole = series(noise(1, 1 << 17), rate_hz=128.0)
    falling = WaterfallAccumulator(whole.channels, 128.0, running_segmentation(128.0), max_slices=4)
    held = []
    tracemalloc.start()
    try:
        for block in blocks(whole, [2048] * 64):
            falling.update(block)
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # 16 times as many segments to a slice; what the test itself holds is a few kB.
    assert max(held[32:]) < 2 * max(held[2:4])


def test_a_result_asked_for_again_is_the_same() -> None:
    """Powers of one channel lie in memory as the result does: what the result is scaled by must not reach them."""
    whole = series(noise(1, 20_000), rate_hz=RATE_HZ)
    averages = RunningAverages(whole.channels, RATE_HZ, PLAN, pairs=False)
    averages.update(whole)
    for kind in ("linear", "exponential", "peak-hold"):
        first = averages.densities(kind)[0].values.copy()
        np.testing.assert_array_equal(averages.densities(kind)[0].values, first)


def test_averages_of_other_segments_cant_go_along() -> None:
    channels = series(noise(1, 1), rate_hz=RATE_HZ).channels
    lead = AutoSpectraAccumulator(channels, RATE_HZ, PLAN)
    with pytest.raises(EstimateError, match=r"sample_rate_hz 500\.0 here, 250\.0 there"):
        lead.accompany(AutoSpectraAccumulator(channels, RATE_HZ / 2, PLAN))
