"""Which excitations repeat, and from when on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import chirp, lfilter

from chladni.io.log import open_log
from chladni.signals.errors import EstimateError
from chladni.spectral.period import find_period
from tests.spectral.aircraft import ACCELEROMETERS, SHAKER, aircraft
from tests.spectral.made_signals import multisine, noise, series
from tests.spectral.measured_logs import hammer

BAND = np.arange(5, 60)


def found(values, **options):
    return find_period(series(values), channel="a", **options)


@given(
    samples=st.integers(200, 700),
    periods=st.floats(3, 9),
    level=st.sampled_from([0.0, 0.01, 0.1]),
    seed=st.integers(0, 100),
)
def test_a_repeating_multisine_is_found_to_the_sample(samples, periods, level, seed):
    signal = np.tile(multisine(samples, BAND, seed=seed), 9)[: int(samples * periods)]
    period = found(signal + level * noise(1, signal.size, seed=seed))
    assert period.samples == samples
    assert period.whole
    assert (period.first_sample, period.count, period.dropped) == (0, int(samples * periods) // samples, 0)
    # The scatter of noise of this level; its own scatter is 1/sqrt(samples), and then some for few periods.
    assert period.noise_share == pytest.approx(level**2, rel=0.5, abs=1e-12)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("offset", [0.0, 9.81])
def test_scale_and_offset_do_not_matter(scale, offset):
    assert found(scale * (np.tile(multisine(300, BAND), 6) + offset)).samples == 300


@pytest.mark.parametrize("samples", [64, 500])
def test_other_broadband_periods_are_found(samples):
    rng = np.random.default_rng(4)
    random_bits = np.where(rng.random(samples) < 0.5, -1.0, 1.0)
    assert found(np.tile(random_bits, 8)).samples == samples
    assert found(np.tile(chirp(np.arange(500), 0.01, 500, 0.2), 8)).samples == 500


@pytest.mark.parametrize(
    "signal",
    [
        noise(1, 20_000)[0],
        np.cumsum(noise(1, 20_000)[0]),
        lfilter([1.0], [1.0, -1.99, 0.9999], noise(1, 20_000)[0]),
        chirp(np.arange(20_000) / 1000, 1, 20, 200),
        np.sin(2 * np.pi * 13.7 * np.arange(20_000) / 1000),
        np.sign(np.sin(2 * np.pi * 5 * np.arange(20_000) / 1000 + 0.1)),
        np.sin(np.arange(20_000) / 50) ** 3,
        np.zeros(20_000),
        np.full(20_000, 3.0),
        np.arange(20_000.0),
        np.where(np.arange(20_000) % 2000 == 100, 50.0, 0.0),
        np.concatenate([multisine(2000, BAND, seed=seed) for seed in range(10)]),
        noise(1, 40)[0],
    ],
    ids=[
        "white noise",
        "random walk",
        "narrow-band noise",
        "sweep",
        "sine",
        "square wave",
        "stroke",
        "silence",
        "constant",
        "ramp",
        "hits",
        "multisines of fresh phases",
        "too short",
    ],
)
def test_what_does_not_repeat_or_is_a_tone_is_none(signal):
    assert found(signal) is None


def test_two_periods_are_too_few():
    assert found(np.tile(multisine(500, BAND), 3)[:1499]) is None


def test_lead_in_and_run_out_are_left_out():
    quiet = 1e-3 * noise(1, 6000)[0]
    quiet[1500:4500] += np.tile(multisine(500, BAND), 6)
    period = found(quiet)
    assert period.samples == 500
    # The first period cut has some of the quiet in it, and is dropped for that.
    assert 1480 <= period.first_sample - 500 * period.dropped <= 1520
    assert period.first_sample + period.count * 500 <= 4520
    assert period.count >= 4


def test_a_transient_in_the_response_is_dropped():
    force = np.tile(multisine(500, BAND), 10)
    # A slow pole: e^-2 of its transient is left after one period, e^-4 after two.
    response = lfilter([1.0], [1.0, -np.exp(-2 / 500)], force) + 0.01 * noise(1, 5000)[0]
    period = find_period(series(np.stack([force, response])), channel="a")
    assert 1 <= period.dropped <= 3
    assert period.first_sample == 500 * period.dropped
    assert period.count == 10 - period.dropped
    assert found(force).dropped == 0


def test_a_transient_that_never_ends_leaves_two_periods():
    force = np.tile(multisine(500, BAND), 6)
    decay = np.exp(-np.arange(3000) / 250)
    period = find_period(series(np.stack([force, decay])), channel="a")
    assert (period.dropped, period.count) == (4, 2)


def test_a_period_between_samples_is_told_not_rounded():
    # 500.3 samples: made by sampling the band-limited signal on a stretched clock.
    rng = np.random.default_rng(1)
    phases = 2 * np.pi * rng.random(BAND.size)
    time = np.arange(5000) / 500.3
    signal = np.sum(np.cos(2 * np.pi * np.outer(BAND, time) + phases[:, np.newaxis]), axis=0)
    period = found(signal + 0.01 * noise(1, 5000)[0])
    assert not period.whole
    assert period.period_s * 1000 == pytest.approx(500.3, abs=0.01)
    assert period.drift_samples == pytest.approx(0.3 * period.count, rel=0.1)


def test_of_a_record_with_gaps_the_longest_stretch_is_looked_at():
    source = series(np.tile(multisine(300, BAND), 12))
    valid = np.ones((1, 3600), dtype=bool)
    valid[0, 1000] = False
    period = find_period(replace(source, valid=valid), channel="a")
    assert (period.samples, period.first_sample, period.count) == (300, 1001, 8)
    assert find_period(replace(source, valid=np.zeros((1, 3600), dtype=bool)), channel="a") is None


def test_a_channel_that_is_not_there_is_named():
    with pytest.raises(EstimateError, match="no channel 'x'"):
        find_period(series(noise(1, 1000)), channel="x")


@pytest.mark.parametrize("level", [1, 3, 5, 7])
def test_the_aircraft_repeats_every_8192_samples_and_the_first_is_transient(shared_data, level):
    source = aircraft(shared_data, level)
    period = find_period(source, channel=SHAKER)
    assert (period.samples, period.first_sample, period.count, period.dropped) == (8192, 8192, 8, 1)
    assert period.whole
    assert period.noise_share < 1e-4
    for name in ACCELEROMETERS:
        assert find_period(source, channel=name) is None or find_period(source, channel=name).samples == 8192


@pytest.mark.parametrize("name", ["silverbox", "emps", "mr_1A", "palisaden"])
def test_measured_logs_that_do_not_repeat_are_not_mistaken(shared_data, name):
    source = open_log(shared_data / f"{name}.mcap").read()
    # Strokes and growing noise, tones, ten different multisines, a building in the wind.
    assert all(find_period(source, channel=channel.name) is None for channel in source.channels)


def test_hammer_hits_in_records_of_equal_length_are_no_period(shared_data):
    source = hammer(shared_data)
    assert all(find_period(source, channel=channel.name) is None for channel in source.channels)


def test_ten_multisines_alone_are_no_period(shared_data):
    source = open_log(shared_data / "silverbox.mcap").read()
    assert find_period(source.window(start_s=40_700 / source.sample_rate_hz), channel="/input.value") is None


def test_a_period_of_half_a_sample_too_much_is_taken_twice():
    phases = 2 * np.pi * np.random.default_rng(1).random(BAND.size)
    time = np.arange(5000) / 500.5
    period = found(np.sum(np.cos(2 * np.pi * np.outer(BAND, time) + phases[:, np.newaxis]), axis=0))
    assert period.whole
    assert (period.samples, period.count) == (1001, 4)
