from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter, welch

from chladni.gap.comparison.noise_estimate import estimate_noise, smaller_floor
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from tests.gap.comparison import made_measurements as made
from tests.gap.made_log import white_floor

SAMPLES = 12000
COLOURS = ["white", "pink", "resonant"]
# Sizes of the noise, over each output's RMS.
SHARES = np.array([[0.003], [0.01], [0.02], [0.03]])


def noisy(y: np.ndarray, colour: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, 1])
    noise = SHARES[: len(y)] * y.std(axis=1, keepdims=True) * made.coloured(rng, y.shape, colour)
    return y + noise, noise.std(axis=1)


def random_run(colour: str, seed: int = 1) -> tuple[Measurement, np.ndarray]:
    force = np.random.default_rng(seed).standard_normal(SAMPLES)
    y, rms = noisy(made.machine(force, made.weights(4, seed)), colour, seed)
    return made.measurement(force, y), rms


def periodic_run(colour: str, seed: int = 1, drift: float = 0.0) -> tuple[Measurement, np.ndarray]:
    rng = np.random.default_rng(seed)
    force = np.tile(made.multisine(rng, 2000, np.arange(5, 400)), 7)
    clean = made.machine(force, made.weights(4, seed))
    y, rms = noisy(clean * (1 + drift * np.arange(force.size) / force.size), colour, seed)
    return with_period(made.measurement(force, y)), rms


@pytest.mark.parametrize("colour", COLOURS)
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_of_a_linear_machine_under_random_excitation(colour: str, seed: int) -> None:
    run, rms = random_run(colour, seed)
    floor = estimate_noise(run)
    # Its own standard deviation; four sigma of eight outputs, and the rms of the sample itself scatters as much.
    np.testing.assert_allclose(floor.rms, rms, rtol=float(4 * np.sqrt(2) * floor.std.max()))
    assert floor.std.max() < 0.1
    assert set(floor.method) == {"fit residual"}


@pytest.mark.parametrize("colour", COLOURS)
def test_noise_of_a_linear_machine_under_periodic_excitation(colour: str) -> None:
    run, rms = periodic_run(colour)
    assert run.period_samples == 2000
    floor = estimate_noise(run)
    np.testing.assert_allclose(floor.rms, rms, rtol=float(4 * np.sqrt(2) * floor.std.max()))
    assert set(floor.method) == {"periods"}
    assert not floor.upper_bound.any()


@pytest.mark.parametrize("colour", ["white", "resonant"])
def test_the_spectrum_of_the_noise_is_found_with_its_size(colour: str) -> None:
    run, _ = random_run(colour)
    cycles, expected = welch(made.coloured(np.random.default_rng(99), (1, 400000), colour)[0], 1.0, nperseg=256)
    density = estimate_noise(run).density(cycles[4:-4])
    sizes = (SHARES * run.outputs.std(axis=1, keepdims=True)) ** 2
    # An autoregressive fit of order 12 at 12 000 samples: sigma of a line about sqrt(2 12/12000), plus Welch's bias.
    np.testing.assert_allclose(np.log(density / sizes), np.log(expected[4:-4] / 2)[None].repeat(4, 0), atol=0.35)


def test_a_whitened_sensor_noise_is_white() -> None:
    for run, _ in (random_run("resonant"), periodic_run("resonant")):
        clean = made.machine(run.inputs[0], made.weights(4, 1))
        white = estimate_noise(run).whitened(run.outputs - clean)[:, 50:]
        np.testing.assert_allclose(white.std(axis=1), 1.0, rtol=0.1)
        lag = np.mean(white[:, 1:] * white[:, :-1], axis=1)
        assert np.all(np.abs(lag) < 0.1)


def distorted(force: np.ndarray, seed: int) -> np.ndarray:
    """Outputs of a machine whose joint answers with a cubic force of its own motion, in one pass."""
    linear = made.machine(force, made.weights(4, seed))
    motion = made.machine(force, made.weights(1, seed + 50))[0]
    joint = (motion / motion.std()) ** 3
    answer = made.machine(joint, made.weights(4, seed + 60))
    return np.asarray(linear + 0.1 * linear.std() / answer.std() * answer)


def test_distortion_that_all_sensors_share_is_kept_out_and_bounds_are_called_bounds() -> None:
    force = np.random.default_rng(5).standard_normal(SAMPLES)
    clean = distorted(force, 5)
    y, rms = noisy(clean, "white", 5)
    floor = estimate_noise(made.measurement(force, y))
    assert floor.upper_bound.all()
    assert set(floor.method) == {"incoherent residual"}
    assert np.all(floor.rms > 0.97 * rms)
    # What a linear system leaves is far louder.
    alone = [estimate_noise(made.measurement(force, y[[row]])) for row in range(4)]
    whole = np.array([one.rms[0] for one in alone])
    assert np.all(whole > 1.3 * rms)
    assert all(one.upper_bound.all() and one.method == ("fit residual",) for one in alone)
    assert np.all((floor.rms / rms) ** 2 - 1 < 0.2 * ((whole / rms) ** 2 - 1))


def test_periodic_distortion_is_no_noise_between_periods() -> None:
    rng = np.random.default_rng(6)
    force = np.tile(made.multisine(rng, 2000, np.arange(5, 400)), 8)
    y, rms = noisy(distorted(force, 6), "white", 6)
    floor = estimate_noise(with_period(made.measurement(force, y)))
    np.testing.assert_allclose(floor.rms, rms, rtol=float(6 * floor.std.max()))
    assert set(floor.method) == {"periods"}


def test_a_machine_that_drifts_slowly_is_judged_from_period_to_period() -> None:
    run, rms = periodic_run("white", drift=0.1)
    about_mean = run.outputs[:, -5 * 2000 :].reshape(4, 5, 2000).std(axis=1, ddof=1).mean(axis=1)
    floor = estimate_noise(run)
    assert np.all(floor.rms[:2] < 0.7 * about_mean[:2])
    # Of a drift of 10 % in 7 periods a step of 1.4 %/sqrt(2) is left, shared by all outputs and so mostly removed.
    assert np.all(floor.rms < np.sqrt(rms**2 + (0.011 * run.outputs.std(axis=1)) ** 2))


def test_a_disturbance_that_is_not_in_step_with_the_periods_is_no_noise_of_one_sensor() -> None:
    run, rms = periodic_run("white")
    # A hum that only one sensor hears: no other output shares it, but within a block of lines it is one line.
    hum = np.zeros_like(run.outputs)
    hum[0] = 0.1 * run.outputs[0].std() * np.sin(0.7 * np.arange(run.samples))
    floor = estimate_noise(replace(run, outputs=run.outputs + hum))
    assert floor.rms[0] < np.hypot(rms[0], hum[0].std())
    np.testing.assert_allclose(floor.rms[1:], rms[1:], rtol=0.05)


def test_a_machine_that_changes_out_of_step_with_the_periods_is_judged_by_the_fit() -> None:
    rng = np.random.default_rng(21)
    force = np.tile(made.multisine(rng, 2000, np.arange(5, 400)), 8)
    # 28.6 cycles of change a period: every period differs, in what all sensors share.
    change = np.sin(2 * np.pi * 0.0143 * np.arange(force.size))
    clean = made.machine(force, made.weights(4, 21)) + 0.3 * made.machine(force * change, made.weights(4, 22))
    y, rms = noisy(clean, "white", 21)
    floor = estimate_noise(with_period(made.measurement(force, y)))
    # Scatter between so few periods leaves 3.6 and 2.1 times the noise of these.
    assert np.all(floor.rms[1:3] < 1.3 * rms[1:3])
    assert np.all(floor.rms > 0.97 * rms)
    assert floor.upper_bound.all()


def test_a_disturbance_that_shakes_all_sensors_is_no_noise_of_theirs() -> None:
    rng = np.random.default_rng(8)
    force, floor_motion = rng.standard_normal((2, SAMPLES))
    clean = made.machine(force, made.weights(4, 8)) + 0.2 * made.machine(floor_motion, made.weights(4, 9))
    y, rms = noisy(clean, "white", 8)
    floor = estimate_noise(made.measurement(force, y))
    assert np.all(floor.rms < 0.5 * 0.2 * y.std(axis=1))
    assert np.all(floor.rms[2:] < 1.5 * rms[2:])
    assert floor.upper_bound.all()


def test_logs_too_short_for_a_fit_are_judged_by_the_top_of_the_band() -> None:
    rng = np.random.default_rng(9)
    slow = np.sin(2 * np.pi * 0.02 * np.arange(45))
    floor = estimate_noise(made.measurement(slow, slow + 0.01 * rng.standard_normal(45)))
    assert floor.method == ("quiet band",)
    assert floor.upper_bound.all()
    assert 0.003 < floor.rms[0] < 0.05
    assert floor.std[0] > 0.1


def test_two_steady_periods_are_enough_and_one_falls_back() -> None:
    run, rms = periodic_run("white")
    two = replace(run, transient_periods=5)
    np.testing.assert_allclose(estimate_noise(two).rms, rms, rtol=float(6 * estimate_noise(two).std.max()))
    assert set(estimate_noise(two).method) == {"periods"}
    one = replace(run, transient_periods=6)
    assert "periods" not in estimate_noise(one).method


def test_a_floor_made_of_coarse_steps_or_held_samples_is_a_bound() -> None:
    # Excited up to an eighth of the rate, so that there is a quiet band.
    force = lfilter(*butter(6, 0.25), np.random.default_rng(23).standard_normal(SAMPLES))
    y, rms = noisy(made.machine(force, made.weights(4, 23)), "white", 23)
    run = made.measurement(force, y)
    assert not estimate_noise(run).upper_bound.any()
    outputs = run.outputs.copy()
    step = 10 * rms[1]
    outputs[1] = step * np.round(outputs[1] / step)
    outputs[2] = np.repeat(outputs[2, ::2], 2)
    # A converter with steps below the noise is an ordinary sensor.
    outputs[3] = rms[3] / 2 * np.round(outputs[3] / (rms[3] / 2))
    floor = estimate_noise(replace(run, outputs=outputs))
    np.testing.assert_array_equal(floor.upper_bound, [False, True, True, False])
    # Rounding errors are uniform over a step.
    assert floor.rms[1] == pytest.approx(np.hypot(step / np.sqrt(12), rms[1]), rel=0.1)


def test_a_noise_free_measurement_has_a_tiny_floor() -> None:
    force = np.random.default_rng(10).standard_normal(SAMPLES)
    run = made.measurement(force, made.machine(force, made.weights(2, 10)))
    floor = estimate_noise(run)
    assert np.all(floor.rms < 1e-4 * run.outputs.std(axis=1))
    assert np.all(floor.innovation_rms > 0)


def test_the_smaller_floor_is_taken_output_by_output() -> None:
    white = np.random.default_rng(14).standard_normal((2, 5000))
    first = replace(white_floor(np.array([1.0, 2.3])), method=("a", "a"))
    tinted = np.array([[1.0, -0.9], [1.0, 0.0]])
    second = replace(white_floor(np.array([2.3, 1.0])), whitening=tinted, method=("b", "b"))
    both = smaller_floor(first, second)
    assert both.method == ("a", "b")
    np.testing.assert_array_equal(both.rms, [first.rms[0], second.rms[1]])
    np.testing.assert_array_equal(both.innovation_rms, [first.innovation_rms[0], second.innovation_rms[1]])
    np.testing.assert_array_equal(both.whitened(white)[0], first.whitened(white)[0])
    np.testing.assert_array_equal(both.whitened(white)[1], second.whitened(white)[1])
    np.testing.assert_array_equal(both.rms, smaller_floor(second, first).rms)


@pytest.mark.parametrize("level", [1, 7])
def test_measured_multisine(shared_data: Path, level: int) -> None:
    run = made.aircraft(shared_data, level)
    floor = estimate_noise(run)
    steady = run.outputs[:, 8192:].reshape(3, 8, 8192)
    steps = np.sqrt(np.mean(np.diff(steady, axis=1) ** 2, axis=(1, 2)) / 2)
    # No more than what differs from one period to the next, which holds a drift that the sensors share.
    assert np.all(floor.rms <= steps)
    assert np.all(floor.rms > 0.001 * run.outputs.std(axis=1))
