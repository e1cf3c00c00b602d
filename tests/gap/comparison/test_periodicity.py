from pathlib import Path

import numpy as np
import pytest
from scipy.signal import chirp

from chladni.gap.comparison.periodicity import periods_of, transient_periods, with_period
from tests.gap.comparison import made_measurements as made

PERIOD = 600


def lines(count: int = 80) -> np.ndarray:
    return np.arange(3, 3 + count)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.03])
def test_a_multisine_is_found_under_noise_of_its_sensor(noise: float) -> None:
    rng = np.random.default_rng(1)
    u = np.tile(made.multisine(rng, PERIOD, lines()), 6)[: 6 * PERIOD - 50]
    y = made.machine(u, made.weights(2, 1))
    found = with_period(made.measurement(u + noise * rng.standard_normal(u.size), y))
    assert found.period_samples == PERIOD


def test_noise_far_above_a_sensors_is_no_repetition() -> None:
    rng = np.random.default_rng(1)
    u = np.tile(made.multisine(rng, PERIOD, lines()), 6)
    assert with_period(made.measurement(u + 0.08 * rng.standard_normal(u.size), u)).period_samples is None


def test_a_sine_repeats_after_its_period_or_the_least_whole_multiple() -> None:
    time = np.arange(4000)
    for period, whole in ((400.0, 400), (66.5, 133), (30.25, 121)):
        u = np.sin(2 * np.pi * time / period)
        found = with_period(made.measurement(u, u))
        assert found.period_samples == whole


def test_one_strong_line_does_not_hide_the_period_of_all() -> None:
    time = np.arange(6 * PERIOD)
    rng = np.random.default_rng(2)
    u = np.sin(2 * np.pi * 10 * time / PERIOD) + 0.03 * np.tile(made.multisine(rng, PERIOD, lines()), 6)
    found = with_period(made.measurement(u, u))
    assert found.period_samples == PERIOD


def test_several_inputs_repeat_together_and_one_that_does_not_spoils_it() -> None:
    rng = np.random.default_rng(3)
    first = np.tile(made.multisine(rng, 300, lines(40)), 8)
    second = np.tile(made.multisine(rng, 200, lines(40)), 12)
    found = with_period(made.measurement(np.array([first, second]), first))
    assert found.period_samples == 600
    assert with_period(made.measurement(np.array([first, rng.standard_normal(2400)]), first)).period_samples is None


def test_an_input_that_stands_still_does_not_matter() -> None:
    u = np.tile(made.multisine(np.random.default_rng(4), PERIOD, lines()), 4)
    found = with_period(made.measurement(np.array([u, np.full(u.size, 2.0)]), u))
    assert found.period_samples == PERIOD
    assert with_period(made.measurement(np.zeros(1000), u[:1000])).period_samples is None


@pytest.mark.parametrize("samples", [PERIOD, PERIOD + PERIOD // 2, 2 * PERIOD - 1])
def test_less_than_two_periods_are_none(samples: int) -> None:
    u = np.tile(made.multisine(np.random.default_rng(5), PERIOD, lines()), 2)[:samples]
    assert with_period(made.measurement(u, u)).period_samples is None


def test_two_periods_are_enough() -> None:
    u = np.tile(made.multisine(np.random.default_rng(5), PERIOD, lines()), 2)
    found = with_period(made.measurement(u, u))
    assert found.period_samples == PERIOD


def test_excitations_that_do_not_repeat() -> None:
    rng = np.random.default_rng(6)
    time = np.arange(5000) / 500
    hit = np.zeros(5000)
    hit[700:720] = np.hanning(20)
    step = (np.arange(5000) > 300).astype(float)
    walk = np.cumsum(rng.standard_normal(5000))
    for u in (rng.standard_normal(5000), chirp(time, 1, 10, 100), hit, step, walk):
        assert with_period(made.measurement(u, u)).period_samples is None


def test_periods_in_which_the_response_settles_are_counted() -> None:
    # The slowest mode decays by exp(-2 pi 0.021 0.01 600) = 0.45 a period.
    rng = np.random.default_rng(7)
    u = np.tile(made.multisine(rng, PERIOD, lines()), 12)
    y = made.machine(u, made.weights(3, 2))
    noisy = y + 0.02 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    found = with_period(made.measurement(u, noisy))
    steady = made.machine(np.tile(u, 3), made.weights(3, 2))[:, -PERIOD:]
    transient = periods_of(y, PERIOD) - steady[:, None]
    left = np.sqrt(np.mean(transient**2, axis=2)).max(axis=0) / y.std(axis=1).max()
    # What's left of the transient is below the noise from there on, and wasn't yet before.
    assert 1 <= found.transient_periods <= 5
    assert left[found.transient_periods] < 0.02
    assert left[0] > 0.05


def test_a_response_that_is_steady_from_the_first_sample_has_no_transient() -> None:
    rng = np.random.default_rng(8)
    u = np.tile(made.multisine(rng, PERIOD, lines()), 10)
    # Two runs before leave 0.45^20 of the transient.
    y = made.machine(np.tile(u, 3), made.weights(2, 3))[:, -u.size :]
    noisy = y + 0.01 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    assert transient_periods(noisy, PERIOD) == 0
    assert transient_periods(y, PERIOD) == 0


def test_of_two_periods_the_first_may_not_have_settled() -> None:
    rng = np.random.default_rng(9)
    u = np.tile(made.multisine(rng, 4000, np.arange(20, 500)), 2)
    y = made.machine(u, made.weights(2, 4))
    assert transient_periods(y, 4000) == 1
    steady = made.machine(np.tile(u, 2), made.weights(2, 4))[:, -8000:] + 0.01 * rng.standard_normal((2, 8000))
    assert transient_periods(steady, 4000) == 0


def test_the_measurement_carries_what_was_found() -> None:
    rng = np.random.default_rng(10)
    u = np.tile(made.multisine(rng, PERIOD, lines()), 8)
    found = with_period(made.measurement(u, made.machine(u, made.weights(1, 5))))
    assert found.period_samples == PERIOD
    assert found.transient_periods >= 1
    lost = with_period(made.measurement(rng.standard_normal(3000), rng.standard_normal(3000)))
    assert (lost.period_samples, lost.transient_periods) == (None, 0)


@pytest.mark.parametrize("level", [1, 3, 5, 7])
def test_measured_multisine_has_nine_periods_of_which_the_first_is_transient(shared_data: Path, level: int) -> None:
    found = with_period(made.aircraft(shared_data, level))
    assert (found.period_samples, found.samples // 8192, found.transient_periods) == (8192, 9, 1)
