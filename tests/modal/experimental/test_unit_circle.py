"""Lines on the unit circle, their moments, and the way back."""

import numpy as np
import pytest

from chladni.modal.experimental.unit_circle import unit_circle


@pytest.mark.parametrize("count", [100, 101])
@pytest.mark.parametrize("first_hz", [0.0, 37.3])
def test_even_lines_take_nine_tenths_of_the_circle(count, first_hz):
    circle = unit_circle(first_hz + 0.1 * np.arange(count))
    assert circle.gridded
    assert circle.position[-1] == count - 1
    assert 0.85 < (count - 1) / circle.length <= 0.9
    assert circle.step_hz == pytest.approx(0.1, rel=1e-12)


def test_gaps_leave_places_empty():
    circle = unit_circle(5 + 0.25 * np.array([0, 1, 4, 5, 20, 29, 30]))
    assert circle.gridded
    assert circle.position.tolist() == [0, 1, 4, 5, 20, 29, 30]


@pytest.mark.parametrize("frequency_hz", [np.geomspace(1, 100, 50), np.array([1.0, 1.001, 2.0, 90.0])])
def test_lines_off_a_grid_keep_their_places(frequency_hz):
    circle = unit_circle(frequency_hz)
    assert not circle.gridded
    np.testing.assert_allclose(circle.origin_hz + circle.position * circle.step_hz, frequency_hz)


def test_lines_rounded_in_their_file_are_on_the_grid():
    # Ten digits, as a text file gives them.
    frequency_hz = np.round(np.arange(1, 4097) * (400 / 8192), 10)
    assert unit_circle(frequency_hz).gridded


@pytest.mark.parametrize("frequency_hz", [3 + np.arange(64.0), 3 + np.arange(64.0) ** 1.1], ids=["grid", "none"])
def test_moments_are_sums_over_the_lines(frequency_hz):
    circle = unit_circle(frequency_hz)
    random = np.random.default_rng(0)
    terms = random.standard_normal((2, 3, 64)) + 1j * random.standard_normal((2, 3, 64))
    z = np.exp(2j * np.pi * circle.position / circle.length)
    expected = np.stack([np.sum(terms * z**-lag, axis=-1) for lag in range(-5, 6)], axis=-1)
    np.testing.assert_allclose(circle.moments(terms, 5), expected, atol=1e-12)


def test_poles_come_back_from_the_circle():
    circle = unit_circle(20 + 0.5 * np.arange(161))
    poles = 2 * np.pi * (-np.array([0.1, 1.0, 5.0]) + 1j * np.array([20.0, 61.3, 100.0]))
    # z = exp((lambda - j omega_0) T) with the time T of one place, 1/(length step).
    z = np.exp((poles - 2j * np.pi * circle.origin_hz) / (circle.length * circle.step_hz))
    np.testing.assert_allclose(circle.pole(z), poles, rtol=1e-12)
