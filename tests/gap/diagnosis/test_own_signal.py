"""A sensor's distortion is told from noise by the signal that it follows."""

import numpy as np
import pytest

from chladni.gap.diagnosis.own_signal import share_of_own_signal, without_own_signal


def test_curves_and_steps_are_seen_and_a_gain_and_noise_are_not() -> None:
    rng = np.random.default_rng(7)
    signal, noise = rng.standard_normal((4, 20_000)), 0.1 * rng.standard_normal((4, 20_000))
    residual = noise.copy()
    # As much power as the noise: half of what is left.
    residual[0] += 0.1 / np.sqrt(2) * (signal[0] ** 2 - 1.0)
    residual[1] = 0.5 * np.floor(signal[1] / 0.5) - signal[1] + 0.01 * noise[1]
    residual[2] += 0.3 * signal[2]
    found = share_of_own_signal(5.0 + signal, residual)
    assert found[0] == pytest.approx(0.5, abs=0.03)
    assert found[1] > 0.7
    assert np.all(found[2:] < 0.01)


def test_a_sensor_that_shows_nothing_follows_nothing() -> None:
    assert share_of_own_signal(np.zeros((1, 50)), np.zeros((1, 50)))[0] == 0.0


def test_what_a_clipped_sensor_leaves_is_taken_away_and_noise_is_not() -> None:
    rng = np.random.default_rng(8)
    signal, noise = rng.standard_normal((2, 20_000)), 0.05 * rng.standard_normal((2, 20_000))
    left = noise.copy()
    left[0] += np.clip(signal[0], -1.2, 1.2) - signal[0]
    found = without_own_signal(signal, left)
    assert np.std(found[0]) == pytest.approx(0.05, rel=0.03)
    np.testing.assert_array_equal(found[1], noise[1])
