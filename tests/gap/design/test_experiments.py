from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.design.experiments import Reach, excited_band_hz
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies


@pytest.fixture
def reach():
    log, _ = measured(three_bodies(), band_noise(4096))
    return Reach(model=three_bodies(), measurement=log, begins_with_log=True, seed=4)


def rms(signals):
    return np.sqrt(np.mean(signals**2))


def test_levels_scale_the_inputs_and_the_start(reach):
    levels = [one for one in reach.levels() if one.change == "level"]
    assert {one.start for one in levels} == {0.25, 0.5, 2.0, 4.0}
    for one in levels:
        np.testing.assert_array_equal(one.inputs, one.start * reach.measurement.inputs)
        assert f"at {one.start:g} times the level (RMS {rms(one.inputs):.3g} N)" in one.words


def test_four_times_the_level_is_more_to_ask_for_than_twice(reach):
    effort = {one.start: one.effort for one in reach.levels() if one.change == "level"}
    assert effort[4.0] == effort[0.25] > effort[2.0] == effort[0.5]


def test_no_course_is_louder_than_four_times_the_log(reach):
    loudest = np.max(np.abs(reach.measurement.inputs))
    for one in (*reach.levels(), *reach.courses(), *reach.positions()):
        assert np.max(np.abs(one.inputs)) <= 4 * loudest * (1 + 1e-12)
        assert rms(one.inputs) <= 4 * rms(reach.measurement.inputs) * (1 + 1e-12)


def test_bands_hold_the_logs_rms_and_nothing_outside(reach):
    bands = [one for one in reach.courses() if one.change == "band"]
    # Two halves and three modes.
    assert len(bands) == 5
    frequency_hz = np.fft.rfftfreq(4096, 1 / RATE_HZ)
    for one in bands:
        assert rms(one.inputs) == pytest.approx(rms(reach.measurement.inputs), rel=1e-9)
        low, high = (float(word) for word in one.words.split("noise of ")[1].split(" Hz")[0].split(" to "))
        power = np.abs(np.fft.rfft(one.inputs[0])) ** 2
        # The words round to three digits.
        inside = (frequency_hz > 0.99 * low - 0.3) & (frequency_hz < 1.01 * high + 0.3)
        assert power[~inside].sum() < 1e-12 * power.sum()


def test_bands_lie_around_the_modes(reach):
    modes = three_bodies().modes().frequency_hz
    words = " ".join(one.words for one in reach.courses())
    assert all(f"noise of {0.8 * mode:.3g} to {1.2 * mode:.3g} Hz" in words for mode in modes)


def test_a_slow_sine_has_the_logs_peak_below_the_lowest_mode(reach):
    (slow,) = [one for one in reach.courses() if one.change == "slow"]
    peak = np.max(np.abs(reach.measurement.inputs))
    assert np.max(np.abs(slow.inputs)) == pytest.approx(peak, rel=1e-2)
    line = np.argmax(np.abs(np.fft.rfft(slow.inputs[0]))) * RATE_HZ / 4096
    assert line < 0.2 * three_bodies().modes().frequency_hz.min()


def test_sweeps_go_both_ways(reach):
    up, down = (one for one in reach.courses() if one.change == "sweep")
    # Crossings of zero are closer together where the frequency is higher.
    crossings = [np.count_nonzero(np.diff(np.sign(one.inputs[0, :1024]))) for one in (up, down)]
    assert crossings[0] < crossings[1] / 5


def test_the_input_is_moved_to_the_other_bodies(reach):
    moved = list(reach.positions())
    assert [one.model.inputs[0].at for one in moved] == ["b0", "b1"]
    assert moved[0].words == "Repeat with hammer at b0 instead of b2"
    assert moved[0].effort > max(one.effort for one in reach.levels())


def test_the_same_seed_gives_the_same_noise(reach):
    for one, again in zip(reach.courses(), reach.courses(), strict=True):
        np.testing.assert_array_equal(one.inputs, again.inputs)
    other = next(iter(replace(reach, seed=5).courses()))
    assert not np.array_equal(other.inputs, next(iter(reach.courses())).inputs)


def test_a_stretch_from_the_middle_of_a_log_begins_at_rest(reach):
    assert replace(reach, begins_with_log=False).as_logged().start == 0.0
    assert reach.as_logged().start == 1.0


def test_the_excited_band_holds_the_inputs_power(reach):
    # A band of noise with sharp ends: 99 % of its power lies 0.5 % inside of them.
    flat = next(one for one in reach.courses() if one.change == "sweep").inputs
    rng = np.random.default_rng(0)
    spectrum = np.zeros(2049, dtype=complex)
    spectrum[400:1200] = np.exp(2j * np.pi * rng.random(800))
    log = replace(reach.measurement, inputs=np.fft.irfft(spectrum)[None])
    assert flat.shape == log.inputs.shape
    low, high = excited_band_hz(log)
    step = RATE_HZ / 4096
    assert (low, high) == (pytest.approx(404 * step, abs=2 * step), pytest.approx(1195 * step, abs=2 * step))
