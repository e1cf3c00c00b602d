"""The book of what a stream's gaps cost."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import EstimateError
from chladni.spectral.segmentation import Segmentation
from chladni.spectral.stretches import Stretch, run_lengths, valid_runs
from tests.spectral.made_signals import blocks, noise, part, series

PLAN = Segmentation(samples=8, hop=4)


def with_valid(good):
    return series(noise(2, good.size), valid=np.stack([np.ones_like(good), good]))


@given(st.lists(st.booleans(), max_size=60))
def test_runs_cover_what_is_valid_in_all_channels_and_nothing_else(good):
    source = with_valid(np.array(good, dtype=bool))
    covered = np.zeros(len(good), dtype=bool)
    runs = valid_runs(source)
    for first, last in runs:
        assert not covered[first:last].any()
        covered[first:last] = True
    np.testing.assert_array_equal(covered, good)
    assert all(before[1] < after[0] for before, after in pairwise(runs))


@given(st.lists(st.booleans(), min_size=1, max_size=80), st.lists(st.integers(1, 20), max_size=5))
def test_skipped_segments_do_not_depend_on_the_blocks(good, lengths):
    source = with_valid(np.array(good, dtype=bool))
    book = Stretch(PLAN)
    for block in blocks(source, lengths):
        book.extend(block, valid_runs(block))
    runs = valid_runs(source)
    assert book.skipped == PLAN.count(len(good)) - sum(PLAN.count(last - first) for first, last in runs)
    assert book.longest_run == max((last - first for first, last in runs), default=0)


def test_a_break_closes_the_stretch_and_merging_adds_what_was_lost():
    good = np.ones(40, dtype=bool)
    good[20] = False
    source = with_valid(good)
    first, second = Stretch(PLAN), Stretch(PLAN)
    first.extend(source, valid_runs(source))
    lost = first.skipped
    assert lost > 0
    later = part(with_valid(np.concatenate([good, good, good])), 80, 120)
    assert first.breaks_at(later.start_time_ns, 1000.0)
    second.extend(later, valid_runs(later))
    twin = first.copy()
    twin.extend(later, valid_runs(later))
    assert twin.skipped == 2 * lost
    first.require_before(second)
    first.merge(second)
    assert first.skipped == 2 * lost
    with pytest.raises(EstimateError, match="time order only"):
        second.require_before(first)


@given(st.lists(st.booleans(), min_size=1, max_size=200), st.lists(st.integers(1, 50), min_size=1, max_size=20))
def test_runs_go_on_over_the_seams_of_blocks(good, lengths):
    whole = with_valid(np.array(good, dtype=bool))
    expected = [last - first for first, last in valid_runs(whole)]
    assert run_lengths(list(blocks(whole, lengths))) == expected


def test_a_break_in_time_ends_a_run():
    whole = series(noise(1, 30))
    assert run_lengths([part(whole, 0, 10), part(whole, 10, 20)]) == [20]
    assert run_lengths([part(whole, 0, 10), part(whole, 15, 30)]) == [10, 15]
    assert run_lengths([]) == []
