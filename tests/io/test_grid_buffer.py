"""Samples laid onto a stretch of a grid, in any order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.grid_buffer import GridBuffer
from chladni.io.shared_grid import Group
from chladni.signals.channel import Channel

CHANNELS = tuple(Channel(name=name, unit="m/s^2") for name in "abc")
FIRST, COUNT = 5, 30


def buffer(dtype: type = np.float64) -> GridBuffer:
    group = Group(rate_hz=100.0, start_ns=0, placements=(), first=0, last=0, messages=0)
    return GridBuffer(group, CHANNELS, FIRST, FIRST + COUNT, np.dtype(dtype))


places = st.lists(st.integers(0, FIRST + COUNT + 10), unique=True, max_size=20)
runs = st.tuples(st.integers(0, FIRST + COUNT + 10), st.integers(0, 40)).map(lambda run: [*range(run[0], sum(run))])
puts = st.lists(st.tuples(st.permutations(range(3)), st.integers(1, 3), runs | places), max_size=6)


@given(puts=puts)
def test_what_nothing_was_laid_on_is_missing(puts: list[tuple[list[int], int, list[int]]]) -> None:
    """Against the plain way: everything NaN first, then one sample after another."""
    expected = np.full((3, COUNT), np.nan)
    laid = buffer()
    for number, (rows, used, index) in enumerate(puts):
        values = 1000.0 * number + np.arange(used * len(index), dtype=float).reshape(used, -1)
        laid.put(rows[:used], np.array(index, np.int64), values)
        for row, samples in zip(rows[:used], values, strict=True):
            for place, sample in zip(index, samples, strict=True):
                if FIRST <= place < FIRST + COUNT:
                    expected[row, place - FIRST] = sample
    series = laid.series()
    np.testing.assert_array_equal(series.values, expected)
    missing = np.isnan(expected)
    assert (series.valid is None) == (not missing.any())
    if series.valid is not None:
        np.testing.assert_array_equal(series.valid, ~missing)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_no_finite_number_is_missing(wrong: float) -> None:
    values = np.ones((3, COUNT))
    values[1, 4] = values[2, 5] = wrong
    values[2, 6] = -wrong
    laid = buffer()
    laid.put([0, 1, 2], np.arange(FIRST, FIRST + COUNT), values)
    series = laid.series()
    assert series.valid is not None
    np.testing.assert_array_equal(np.argwhere(~series.valid), [[1, 4], [2, 5], [2, 6]])
    assert np.isnan(series.values[~series.valid]).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_too_large_to_add_are_finite(dtype: type) -> None:
    laid = buffer(dtype)
    laid.put([0, 1, 2], np.arange(FIRST, FIRST + COUNT), np.full((3, COUNT), np.finfo(dtype).max, dtype))
    series = laid.series()
    assert series.valid is None
    assert (series.values == np.finfo(dtype).max).all()
