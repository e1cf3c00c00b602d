"""Excitations, actuators, recorders, sensors: each against what defines it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from chladni_withheld.networks import at_inputs, at_outputs
from chladni_withheld.networks.draft import Draft
from chladni_withheld.networks.excitation import SMOOTH, Band, Grid, Signal, draw_signal
from chladni_withheld.networks.machine import Addition, Recorder, converted, record
from chladni_withheld.networks.scene import draw_scene
from tests.withheld.networks.machines import grid, signal_of, two_bodies

BAND = Band(low_hz=6.0, high_hz=80.0)
AT = grid(samples=2000, before=500)


@pytest.mark.parametrize("word", SMOOTH)
@pytest.mark.parametrize("from_rest", [False, True])
def test_a_band_limited_signal_has_nothing_above_half_the_rate(word, from_rest):
    fine = SMOOTH[word](np.random.default_rng(1), AT, BAND)
    if from_rest:
        signal, words = _drawn(word)
        fine = signal.values
        assert "band_limited" in words
        assert not fine[: 2 * AT.over * AT.before].any()
    # A window for the ends, where a log is cut off.
    spectrum = np.abs(np.fft.rfft(fine * np.hanning(len(fine)))) ** 2
    frequency_hz = np.fft.rfftfreq(len(fine), 0.5 * AT.step_s)
    assert spectrum[frequency_hz > 0.45 * AT.rate_hz].sum() < 1e-6 * spectrum.sum()
    assert spectrum[frequency_hz < 1.3 * BAND.high_hz].sum() > 0.99 * spectrum.sum()


def _drawn(word):
    """A signal from rest of that word."""
    for seed in range(60):
        signal, words = draw_signal(np.random.default_rng(seed), AT, BAND, "band_limited", from_rest=True)
        if words.startswith(word):
            return signal, words
    raise AssertionError(word)


@pytest.mark.parametrize("seed", range(6))
def test_a_held_command_changes_at_samples_alone_and_has_unit_size(seed):
    signal, words = draw_signal(np.random.default_rng(seed), AT, BAND, "zoh", from_rest=seed % 2 == 0)
    assert "zoh" in words
    assert signal.jumps
    steps = signal.values[:-1].reshape(-1, 2 * AT.over)
    assert_array_equal(steps, np.repeat(steps[:, :1], 2 * AT.over, axis=1))
    assert np.sqrt(np.mean(steps[AT.before :] ** 2)) == pytest.approx(1.0, rel=1e-3)
    assert steps[: AT.before].any() == (seed % 2 == 1)


@pytest.fixture(scope="module")
def scene():
    """A scene that has an input that is a force."""
    for seed in range(40):
        found = draw_scene(np.random.default_rng(seed), hold="band_limited")
        if found.network.drives[0].where != "ground" and len(found.network.drives) == 1:
            return found
    raise AssertionError


def acts(scene, draft: Draft, size, function):
    """What an input's draft makes of a signal of the time, at the half steps of the scene's grid."""
    signal = Signal(values=function(scene.grid.half_times_s()))
    change = draft.build(size).addition.actuators[draft.site]
    return change(signal).values, draft.build(size)


def sine(scene, per_sample):
    omega = 2 * np.pi * per_sample * scene.grid.rate_hz
    return omega, lambda t: np.sin(omega * t)


def test_a_delay_is_a_delay_of_any_part_of_a_sample(scene):
    draft = at_inputs.delay(np.random.default_rng(0), scene)
    omega, function = sine(scene, 0.05)
    late, made = acts(scene, draft, 1.37, function)
    tail = scene.grid.half_times_s()[1000:]
    assert_allclose(late[1000:], function(tail - made.parameters["delay"]), atol=1e-9)
    assert made.parameters["delay"] * scene.grid.rate_hz == pytest.approx(1.37, abs=0.5 / (2 * scene.grid.over))
    assert made.response(np.array([omega]))[0] == pytest.approx(np.exp(-1j * omega * made.parameters["delay"]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("per_sample", [0.02, 0.1])
def test_a_lag_turns_a_sine_as_its_response_says(scene, seed, per_sample):
    draft = at_inputs.lag(np.random.default_rng(seed), scene)
    omega, function = sine(scene, per_sample)
    slow, made = acts(scene, draft, 3.0, function)
    times_s = scene.grid.half_times_s()
    half = len(times_s) // 2
    exact = np.imag(made.response(np.array([omega]))[0] * np.exp(1j * omega * times_s))
    assert_allclose(slow[half:], exact[half:], atol=3e-4)


def test_a_lag_of_a_held_command_is_exact():
    at = grid(samples=20, before=10)
    step = Signal(values=(at.half_times_s() >= -1e-12).astype(float), jumps=True)
    slow = at_inputs.filtered(step, np.array([1.0]), np.array([0.01, 1.0]), 0.5 * at.step_s)
    times_s = at.half_times_s()
    assert_allclose(slow.values, np.where(times_s > 0, 1 - np.exp(-times_s.clip(0) / 0.01), 0), atol=1e-12)


def test_a_soft_amplifier_ends_at_its_limit_and_a_dead_zone_lets_nothing_small_pass(scene):
    rng = np.random.default_rng(0)
    clipped, made = acts(scene, at_inputs.saturation(rng, scene), 0.5, lambda t: 1e6 * t)
    assert np.abs(clipped).max() == pytest.approx(made.parameters["limit"], rel=1e-3)
    small, made = acts(scene, at_inputs.saturation(rng, scene), 0.5, lambda t: 1e-9 * t)
    assert_allclose(small, 1e-9 * scene.grid.half_times_s(), rtol=1e-6)
    draft = at_inputs.dead_zone(rng, scene)
    width = draft.build(0.3).parameters["width"]
    dead, _ = acts(scene, draft, 0.3, lambda t: 0.5 * width * np.sin(9 * t))
    assert np.abs(dead).max() < 0.02 * width
    passed, _ = acts(scene, draft, 0.3, lambda t: np.full_like(t, 5 * width))
    assert passed[0] == pytest.approx(4 * width, rel=1e-3)


def test_a_spool_follows_no_faster_than_it_can_and_else_exactly():
    values = np.array([0.0, 5.0, 5.0, 5.0, 5.0, 5.0, 4.5, -9.0, -9.0])
    assert_array_equal(at_inputs.follow(values, 2.0), [0.0, 2.0, 4.0, 5.0, 5.0, 5.0, 4.5, 2.5, 0.5])


def test_harmonics_are_those_of_a_square_and_a_cube(scene):
    draft = at_inputs.harmonics(np.random.default_rng(3), scene)
    times_s, periods = scene.grid.half_times_s()[:-1], 8
    omega = 2 * np.pi * periods / (times_s[-1] - times_s[0] + times_s[1] - times_s[0])
    distorted, made = acts(scene, draft, 0.1, lambda t: 2.0 * np.cos(omega * (t - times_s[0])))
    lines = np.fft.rfft(distorted[:-1]) / len(times_s) * 2
    assert lines[2 * periods].real == pytest.approx(made.parameters["second"] * 2.0, rel=1e-6)
    assert lines[3 * periods].real == pytest.approx(made.parameters["third"] * 2.0, rel=1e-6)


@pytest.mark.parametrize("family", ["Butterworth", "Bessel", "Chebyshev"])
def test_a_low_pass_is_3_db_down_at_its_corner_and_much_more_beyond(family):
    from scipy.signal import sosfreqz

    sections = at_inputs.low_pass(5, family, 40.0, 8000.0)
    size = np.abs(sosfreqz(sections, 2 * np.pi * np.array([0.001, 40.0, 400.0]) / 8000)[1])
    assert size[0] == pytest.approx(1.0)
    assert size[1] == pytest.approx(10 ** (-0.5 / 20) if family == "Chebyshev" else 0.5**0.5, rel=2e-3)
    assert size[2] < 1e-3


WIRED = [at_outputs.mounting_resonance, at_outputs.ac_coupling, at_outputs.anti_alias]


@pytest.mark.parametrize("draw", WIRED)
def test_a_sensors_filter_is_what_its_response_says(scene, draw):
    draft = draw(np.random.default_rng(1), scene)
    made = draft.build(0.8)
    rate_hz = 1 / scene.grid.step_s
    omega = 2 * np.pi * 0.7 * scene.band.high_hz
    times_s = np.arange(scene.grid.steps) / rate_hz
    rows = {draft.site: np.sin(omega * times_s), "other": np.zeros(3)}
    changed = made.addition.wiring(rows, rate_hz)
    exact = np.imag(made.response(np.array([omega]))[0] * np.exp(1j * omega * times_s))
    half = len(times_s) // 2
    assert_allclose(changed[draft.site][half:], exact[half:], atol=5e-3)
    assert changed["other"] is rows["other"]


def test_a_late_clock_shows_what_was_before_and_a_drifting_one_ever_more():
    at = grid(samples=1000, before=200)
    network = two_bodies(sensors=two_bodies().sensors[1:2])
    signal = signal_of(lambda t: np.sin(2 * np.pi * 11 * t) + np.sin(2 * np.pi * 23 * t), at)
    late_s = 0.7 / at.rate_hz
    late = Addition(clocks={"pos_head": lambda times_s: times_s - late_s})
    drift = Addition(clocks={"pos_head": lambda times_s: times_s * (1 - 5e-4)})
    fine = Grid(rate_hz=at.rate_hz * 10, samples=10 * at.samples, before=10 * at.before, over=4)
    every = record(network, (), [signal_of(lambda t: np.sin(2 * np.pi * 11 * t) + np.sin(2 * np.pi * 23 * t), fine)],
                   Recorder(grid=fine)).outputs[0]  # fmt: skip
    shown = record(network, (late,), [signal], Recorder(grid=at)).outputs[0]
    assert_allclose(shown[1:], every[3::10][: at.samples - 1], atol=2e-4 * np.abs(every).max())
    drifted = record(network, (drift,), [signal], Recorder(grid=at)).outputs[0]
    # After 800 samples the clock is 0.4 samples behind.
    assert drifted[800] == pytest.approx(every[8000 - 4], abs=2e-4 * np.abs(every).max())


def test_the_filter_of_all_channels_leaves_their_relation(scene):
    """A machine driven by the filtered input shows the filtered output: filters and linear machines commute."""
    at = grid(samples=600, before=600)
    rng = np.random.default_rng(0)
    fine = SMOOTH["random"](rng, at, Band(low_hz=8.0, high_hz=100.0))
    sections = at_inputs.low_pass(6, "Butterworth", 90.0, 1 / at.step_s)
    network = two_bodies()
    filtered = record(network, (), [Signal(values=fine)], Recorder(grid=at, anti_alias=sections))
    coarse = np.interp(at.half_times_s()[::2], at.half_times_s(), fine)
    from scipy.signal import sosfilt

    steps = sosfilt(sections, coarse)
    halves = np.interp(at.half_times_s(), at.half_times_s()[::2], steps)
    driven = record(network, (), [Signal(values=halves)], Recorder(grid=at))
    assert_allclose(filtered.inputs, driven.inputs, atol=1e-9)
    assert_allclose(filtered.outputs[0], driven.outputs[0], atol=2e-3 * np.abs(driven.outputs[0]).max())


@pytest.mark.parametrize(
    ("draw", "size"), [(at_outputs.clipping, 0.5), (at_outputs.quantization, 0.4), (at_outputs.offset, 0.2)]
)
def test_a_converter_does_what_its_word_says(scene, draw, size):
    draft = draw(np.random.default_rng(2), scene)
    made = draft.build(size)
    outputs = scene.recorded().outputs
    row = [sensor.name for sensor in scene.network.sensors].index(draft.site)
    changed = converted(scene.network, (made.addition,), outputs)
    difference = changed[row] - outputs[row]
    if draft.word == "clipping":
        assert np.ptp(changed[row]) == pytest.approx(2 * made.parameters["limit"])
    elif draft.word == "quantization":
        assert 0.4 < np.abs(difference).max() / made.parameters["step"] <= 0.5 + 1e-9
    else:
        assert_allclose(difference, made.parameters["value"])
    others = np.arange(len(outputs)) != row
    assert_array_equal(changed[others], outputs[others])


def test_quantized_samples_have_few_values(scene):
    draft = at_outputs.quantization(np.random.default_rng(2), scene)
    row = [sensor.name for sensor in scene.network.sensors].index(draft.site)
    changed = converted(scene.network, (draft.build(0.4).addition,), scene.recorded().outputs)[row]
    assert len(np.unique(np.round(changed / draft.build(0.4).parameters["step"], 6))) < 40
