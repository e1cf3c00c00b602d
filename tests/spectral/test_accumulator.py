"""The running average: the same whatever the blocks, mergeable, honest about gaps."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import csd

from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.testing import assert_close
from chladni.spectral import accumulator as module
from chladni.spectral.accumulator import CrossSpectraAccumulator, one_sided_weights
from chladni.spectral.segmentation import Segmentation
from tests.spectral.made_signals import blocks, noise, part, series

PLAN = Segmentation(samples=16, hop=8)
WHOLE = series(noise(3, 400), start_time_ns=1_700_000_000_000_000_000)
AVERAGINGS = [
    {},
    {"averaging": "exponential", "time_constant_s": 0.05},
    {"averaging": "peak-hold"},
]


def accumulate(source, plan=PLAN, **options):
    average = CrossSpectraAccumulator(WHOLE.channels, WHOLE.sample_rate_hz, plan, **options)
    for block in source:
        average.update(block)
    return average


def with_gaps(whole, *gaps):
    valid = np.ones(whole.values.shape, dtype=bool)
    values = whole.values.copy()
    for row, first, last in gaps:
        valid[row, first:last] = False
        values[row, first:last] = np.nan
    return replace(whole, values=values, valid=valid)


@given(
    lengths=st.lists(st.integers(1, 120), max_size=12),
    hop=st.integers(1, 16),
    together=st.integers(1, 9),
    options=st.sampled_from(AVERAGINGS),
    gap=st.none() | st.tuples(st.integers(0, 2), st.integers(0, 399), st.integers(1, 60)),
)
def test_any_cut_into_blocks_gives_the_whole_to_the_last_bit(lengths, hop, together, options, gap):
    plan = Segmentation(samples=16, hop=hop)
    source = WHOLE if gap is None else with_gaps(WHOLE, (gap[0], gap[1], gap[1] + gap[2]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MOST_SEGMENTS_TOGETHER", together)
        whole = accumulate([source], plan, **options).result()
        cut = accumulate(blocks(source, lengths), plan, **options).result()
    assert_close(cut, whole, rtol=0)
    assert cut.provenance == whole.provenance


@given(segments=st.integers(1, 48), options=st.sampled_from(AVERAGINGS))
def test_merged_parts_that_hold_their_last_segment_are_the_whole(segments, options):
    # 49 segments in all; the first part ends with its last segment, the second starts with the next one.
    first = accumulate([part(WHOLE, 0, PLAN.length_of(segments))], **options)
    rest = replace(part(WHOLE, segments * 8, 400), start_time_ns=first.stretch.end_ns or 0)
    second = accumulate([rest], **options)
    whole = accumulate([WHOLE], **options).result()
    first.merge(second)
    assert_close(first.result(), whole, rtol=1e-12, atol=1e-16)
    assert first.averages == whole.provenance.averages


def test_a_merge_leaves_the_other_as_it_is_and_both_go_on():
    first, second = accumulate([part(WHOLE, 0, 100)]), accumulate([part(WHOLE, 200, 300)])
    before = second.result()
    first.merge(second)
    assert_close(second.result(), before, rtol=0)
    second.update(part(WHOLE, 300, 400))
    assert second.averages > before.provenance.averages
    first.update(part(WHOLE, 100, 200))
    # Segments before, behind and across the cut at 100: what the merge flushed goes on without a seam.
    together = PLAN.count(200) + PLAN.count(100)
    assert first.averages == together


def test_the_result_may_be_asked_for_at_any_time():
    average = accumulate([part(WHOLE, 0, 150)])
    average.result()
    average.update(part(WHOLE, 150, 400))
    assert_close(average.result(), accumulate([WHOLE]).result(), rtol=0)


def test_segments_that_touch_an_invalid_sample_of_any_channel_are_left_out():
    gapped = with_gaps(WHOLE, (1, 100, 103), (2, 250, 251))
    runs = [(0, 100), (103, 250), (251, 400)]
    each = [accumulate([part(WHOLE, *run)]).result() for run in runs]
    averages = np.array([spectra.provenance.averages for spectra in each])
    expected = np.average([spectra.density for spectra in each], axis=0, weights=averages)
    result = accumulate([gapped]).result()
    np.testing.assert_allclose(result.density, expected, rtol=1e-12, atol=1e-16)
    assert result.provenance.averages == averages.sum()
    assert result.provenance.skipped == PLAN.count(400) - averages.sum()


def test_a_break_in_time_is_not_bridged_and_costs_nothing_that_was_measured():
    late = replace(part(WHOLE, 200, 400), start_time_ns=part(WHOLE, 203, 400).start_time_ns)
    result = accumulate([part(WHOLE, 0, 200), late]).result()
    each = [accumulate([part(WHOLE, 0, 200)]).result(), accumulate([part(WHOLE, 200, 400)]).result()]
    np.testing.assert_allclose(result.density, (each[0].density + each[1].density) / 2, rtol=1e-12, atol=1e-16)
    assert result.provenance.averages == 2 * PLAN.count(200)
    assert result.provenance.skipped == 0


def test_less_than_half_a_sample_of_time_error_is_no_break():
    late = replace(part(WHOLE, 200, 400), start_time_ns=part(WHOLE, 200, 400).start_time_ns + 400_000)
    assert accumulate([part(WHOLE, 0, 200), late]).averages == PLAN.count(400)


def test_blocks_against_the_order_of_time_are_refused():
    average = accumulate([part(WHOLE, 0, 200)])
    with pytest.raises(EstimateError, match=r"starts 0.1 s before the last one ended"):
        average.update(part(WHOLE, 100, 300))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_sample_that_is_not_finite_is_named(bad):
    values = WHOLE.values.copy()
    values[1, [250, 300]] = bad
    with pytest.raises(EstimateError, match=r"channel 'b' is (nan|inf) at 1700000000.25\d* s and 1 more times"):
        accumulate([replace(WHOLE, values=values)])


def test_only_gaps_is_an_error_that_says_how_long_the_longest_stretch_is():
    gapped = with_gaps(WHOLE, *((0, first, first + 1) for first in range(10, 400, 11)))
    average = accumulate([gapped])
    with pytest.raises(EstimateError, match=r"no segment of 0.016 s \(16 samples\) fits .* has 10 samples"):
        average.result()
    assert average.stretch.skipped == PLAN.count(400)


def test_a_channel_without_any_number_is_told_as_such():
    missing = with_gaps(series(noise(1, 200)), (0, 0, 200))
    average = CrossSpectraAccumulator(missing.channels, missing.sample_rate_hz, PLAN)
    average.update(missing)
    with pytest.raises(EstimateError, match="a: not one sample is a number; leave it out"):
        average.result()


def test_an_empty_block_and_a_wholly_invalid_one_change_nothing_but_the_count():
    average = accumulate([part(WHOLE, 0, 100), part(WHOLE, 100, 100), with_gaps(part(WHOLE, 100, 200), (0, 0, 100))])
    assert average.result().provenance.averages == PLAN.count(100)
    assert average.result().provenance.skipped == PLAN.count(200) - PLAN.count(100)


def test_other_channels_rates_and_settings_are_refused():
    average = accumulate([WHOLE])
    with pytest.raises(EstimateError, match="same channels"):
        average.update(WHOLE.select(["a", "c", "b"]))
    with pytest.raises(EstimateError, match="999"):
        average.update(replace(WHOLE, sample_rate_hz=999.0))
    with pytest.raises(EstimateError, match="can't be merged: segmentation"):
        average.merge(accumulate([WHOLE], Segmentation(samples=16, hop=7)))
    with pytest.raises(EstimateError, match="can't be merged: averaging"):
        average.merge(accumulate([WHOLE], averaging="peak-hold"))


def test_exponential_averages_merge_in_time_order_only():
    options = {"averaging": "exponential", "time_constant_s": 0.1}
    early, late = accumulate([part(WHOLE, 0, 200)], **options), accumulate([part(WHOLE, 200, 400)], **options)
    with pytest.raises(EstimateError, match="time order only"):
        late.merge(early)
    early.merge(late)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"averaging": "median"}, "none of linear, exponential, peak-hold"),
        ({"averaging": "exponential"}, "time_constant_s"),
        ({"time_constant_s": 1.0}, "time_constant_s"),
        ({"averaging": "exponential", "time_constant_s": 0.0}, "finite and above 0"),
        ({"averaging": "exponential", "time_constant_s": float("inf")}, "finite and above 0"),
    ],
)
def test_impossible_averaging_is_refused(options, words):
    with pytest.raises(SetupError, match=words):
        accumulate([], **options)


def test_a_matrix_beyond_memory_is_refused_before_anything_is_allocated():
    with pytest.raises(EstimateError, match=r"3 channels x 500000001 lines would take 67.1 GB"):
        accumulate([], Segmentation(samples=10**9, hop=10**9))


def test_exponential_average_of_a_step_follows_the_time_constant():
    # Segments side by side, power 0 then 1: after one time constant the average is 1 - 1/e of it.
    plan = Segmentation(samples=10, hop=10, window="boxcar", detrend="none")
    step = series(np.concatenate([np.zeros(20_000), np.ones(2000)])[np.newaxis])
    average = CrossSpectraAccumulator(step.channels, 1000.0, plan, averaging="exponential", time_constant_s=2.0)
    average.update(step)
    spectra = average.result()
    reached = spectra.density[0, 0, 0].real * spectra.bandwidth_hz
    assert reached == pytest.approx((1 - np.exp(-1)) / (1 - np.exp(-11)), rel=1e-12)


def test_an_accumulator_travels_by_pickle():
    average = accumulate([part(WHOLE, 0, 170)])
    twin = pickle.loads(pickle.dumps(average))  # noqa: S301  # made a line above
    for one in (average, twin):
        one.update(part(WHOLE, 170, 400))
    assert_close(twin.result(), average.result(), rtol=0)


def test_a_block_may_be_overwritten_after_it_was_given():
    buffer = WHOLE.values[:, :100].copy()
    average = accumulate([replace(part(WHOLE, 0, 100), values=buffer)])
    buffer[:] = 7
    assert_close(average.result(), accumulate([part(WHOLE, 0, 100)]).result(), rtol=0)


def test_many_batches_are_scipys():
    whole = series(noise(2, 60_000), rate_hz=500.0)
    plan = Segmentation(samples=100, hop=50)
    average = CrossSpectraAccumulator(whole.channels, 500.0, plan)
    average.update(whole)
    expected = csd(whole.values[0], whole.values[1], fs=500.0, nperseg=100)[1]
    # Cross-spectra of independent noise are small by cancellation; rounding scales with the autos, which are 1/250.
    np.testing.assert_allclose(average.result().density[0, 1], expected, rtol=1e-12, atol=1e-15)


def test_one_sided_weights_double_all_but_zero_and_nyquist():
    np.testing.assert_array_equal(one_sided_weights(6), [1, 2, 2, 1])
    np.testing.assert_array_equal(one_sided_weights(5), [1, 2, 2])


def test_values_whose_squares_overflow_are_refused_by_name():
    values = WHOLE.values.copy()
    values[1] *= 1e200
    name = WHOLE.channels[1].name
    with pytest.raises(EstimateError, match=rf"'{name}' holds values up to \d\.\d+e\+200.*leave the channel out"):
        accumulate([replace(WHOLE, values=values)])


def test_a_stream_may_begin_quietly_but_not_stay_so():
    # A tone that fades in from nothing: its first block alone is too small to be squared.
    quiet, loud = 1e-300 * noise(1, 400), noise(1, 400)
    both = series(np.concatenate([quiet, loud], axis=1), rate_hz=100.0)
    early, late = both.window(end_s=4.0), both.window(start_s=4.0)
    average = CrossSpectraAccumulator(both.channels, 100.0, Segmentation(samples=100, hop=100))
    average.update(early)
    with pytest.raises(EstimateError, match=r"holds \d\.\d+e-300 at most"):
        average.result()
    average.update(late)
    # Half of the segments hold next to nothing.
    alone = CrossSpectraAccumulator(both.channels, 100.0, Segmentation(samples=100, hop=100))
    alone.update(late)
    np.testing.assert_allclose(average.result().density, alone.result().density / 2, rtol=1e-12)
