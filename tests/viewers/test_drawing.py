"""Preparation of numbers for drawing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from chladni.viewers.drawing import (
    block_maximum,
    decibels_of_amplitude,
    decibels_of_power,
    level_limits,
    line_breaks,
    phase_wraps,
    thin,
    ticks,
    with_breaks,
    without_repeated_gaps,
)


def test_decibels_of_known_ratios() -> None:
    np.testing.assert_allclose(decibels_of_power(np.array([1.0, 100.0])), [0.0, 20.0], rtol=1e-15)
    np.testing.assert_allclose(decibels_of_amplitude(np.array([1.0, 100.0])), [0.0, 40.0], rtol=1e-15)


def test_decibels_of_nothing_are_a_gap_and_no_warning() -> None:
    assert np.isnan(decibels_of_power(np.array([0.0, -1.0, np.nan]))).all()


@given(values=arrays(np.float64, st.integers(1, 2000), elements=st.floats(-1e6, 1e6)), limit=st.integers(3, 300))
def test_thinning_keeps_both_extremes_and_the_order(values: np.ndarray, limit: int) -> None:
    chosen, stretch = thin(values, limit=limit)
    assert values[chosen].max() == values.max()
    assert values[chosen].min() == values.min()
    assert np.all(np.diff(chosen) > 0)
    # Two a stretch and a rest shorter than a stretch.
    assert chosen.size <= max(limit, 2 * (values.size // stretch) + stretch)
    assert (stretch == 1) == (values.size <= limit)


def test_thinning_keeps_every_gap() -> None:
    values = np.sin(np.arange(100_000) / 10)
    values[50_000:50_003] = np.nan
    chosen, _ = thin(values, limit=1000)
    assert np.isnan(values[chosen]).any()
    assert chosen.size <= 1000


def test_thinning_of_nothing_but_gaps_is_a_gap() -> None:
    chosen, _ = thin(np.full(1000, np.nan), limit=30)
    assert chosen.size > 0


def test_one_nan_is_left_of_each_gap() -> None:
    values = np.array([1, np.nan, np.nan, 2, np.nan, 3])
    np.testing.assert_array_equal(without_repeated_gaps(values), [True, True, False, True, True, True])


def test_block_maximum_keeps_peaks_and_tells_the_run() -> None:
    values = np.arange(10.0).reshape(1, 10)
    shortened, run = block_maximum(values, axis=1, limit=4)
    assert run == 3
    np.testing.assert_array_equal(shortened, [[2, 5, 8, 9]])
    same, one = block_maximum(values, axis=1, limit=10)
    assert one == 1
    assert same is values


def test_block_maximum_of_missing_values() -> None:
    values = np.array([np.nan, 1.0, np.nan, np.nan])
    shortened, _ = block_maximum(values, axis=0, limit=2)
    np.testing.assert_array_equal(shortened, [1.0, np.nan])


def test_a_comb_of_lines_is_joined_and_a_missing_band_is_not() -> None:
    comb = np.arange(1.0, 20.0, 2.0)
    assert line_breaks(comb).size == 0
    np.testing.assert_array_equal(line_breaks(np.concatenate([comb, comb + 100])), [comb.size])
    assert line_breaks(np.array([1.0, 50.0])).size == 0


def test_a_break_is_a_nan_half_way() -> None:
    x, y = with_breaks(np.array([1.0, 2.0, 9.0]), np.array([[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]), np.array([2]))
    np.testing.assert_array_equal(x, [1.0, 2.0, 5.5, 9.0])
    assert np.isnan(y[2]).all()
    np.testing.assert_array_equal(y[[0, 1, 3]], [[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]])


def test_a_phase_that_wraps_is_found() -> None:
    np.testing.assert_array_equal(phase_wraps(np.array([170.0, 179.0, -179.0, -170.0, 5.0])), [2])


@pytest.mark.parametrize(
    ("level", "low", "high"),
    [
        # The upper hundred, and a twentieth of room.
        (np.array([-300.0, 0.0]), -105.0, 5.0),
        # Never less than twenty in all.
        (np.array([6.0, 6.0]), -4.0, 16.0),
        (np.array([np.nan]), -100.0, 0.0),
    ],
)
def test_limits_of_a_level_plot(level: np.ndarray, low: float, high: float) -> None:
    assert level_limits(level) == (low, high)


@given(low=st.floats(-1e9, 1e9), span=st.floats(1e-3, 1e9))
def test_ticks_are_few_round_and_inside(low: float, span: float) -> None:
    numbers = ticks(low, low + span)
    step = np.diff(numbers)
    assert 1 <= numbers.size <= 7
    # Half a billionth of a step is what floating point may be off.
    room = 1e-6 * span + 1e-9 * abs(low)
    assert numbers[0] >= low - room
    assert numbers[-1] <= low + span + room
    assert np.ptp(step) <= room if step.size else True


def test_ticks_of_a_point() -> None:
    np.testing.assert_array_equal(ticks(2.0, 2.0), [2.0])
