"""From seconds and hertz to segments."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.segmentation import SAMPLES_TO_CHOOSE_FROM, Segmentation, plan_segmentation


@given(
    samples=st.integers(4, 50),
    hop_share=st.floats(0.02, 1),
    available=st.integers(0, 400),
)
def test_count_is_that_of_whole_segments(samples, hop_share, available):
    plan = Segmentation(samples=samples, hop=max(1, round(samples * hop_share)))
    starts = [start for start in range(0, available, plan.hop) if start + samples <= available]
    assert plan.count(available) == len(starts)
    if starts:
        assert plan.length_of(len(starts)) <= available < plan.length_of(len(starts) + 1)


@pytest.mark.parametrize(
    ("rate_hz", "resolution_hz", "samples"), [(400.0, 400 / 8192, 8192), (1000.0, 0.3, 3333), (51200.0, 1.0, 51200)]
)
def test_a_resolution_asked_for_is_met(rate_hz, resolution_hz, samples):
    plan = plan_segmentation(rate_hz, samples_available=10**6, resolution_hz=resolution_hz)
    assert plan.samples == samples
    # The segment is whole samples, so its length is right to half of one.
    assert abs(rate_hz / resolution_hz - plan.samples) <= 0.5


@given(available=st.integers(64, 10**7))
def test_the_default_averages_at_least_31_segments(available):
    plan = plan_segmentation(100.0, samples_available=available)
    assert plan.count(available) >= 31
    assert plan.samples <= 8192
    assert plan.samples & (plan.samples - 1) == 0


def test_the_default_of_a_stream_is_that_of_a_long_record():
    stream = plan_segmentation(100.0, samples_available=None)
    assert stream == plan_segmentation(100.0, samples_available=SAMPLES_TO_CHOOSE_FROM)
    assert stream.samples == 8192


def test_a_short_record_still_has_several_segments():
    plan = plan_segmentation(100.0, samples_available=10)
    assert plan.count(10) >= 2


@pytest.mark.parametrize(("overlap", "hop"), [(0.0, 10), (0.3, 7), (0.5, 5), (0.7, 3), (0.95, 1)])
def test_overlap_is_met_to_a_sample(overlap, hop):
    assert plan_segmentation(10.0, samples_available=100, resolution_hz=1.0, overlap=overlap).hop == hop


def test_odd_segments_overlap_like_scipys():
    # scipy.signal.welch overlaps by nperseg // 2.
    assert plan_segmentation(11.0, samples_available=100, resolution_hz=1.0).hop == 11 - 11 // 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"resolution_hz": 0.0}, "above 0"),
        ({"resolution_hz": float("nan")}, "above 0"),
        ({"resolution_hz": 26.0}, "at most 25 Hz"),
        ({"resolution_hz": 0.5}, "needs segments of 2 s, but the record is 1 s long; ask for 1 Hz"),
        ({"overlap": 1.0}, "below 1"),
        ({"overlap": -0.1}, "at least 0"),
        ({"detrend": "quadratic"}, "none of none, constant, linear"),
    ],
)
def test_impossible_wishes_say_what_is_possible(options, words):
    with pytest.raises(SetupError, match=words):
        plan_segmentation(100.0, samples_available=100, **options)


def test_too_few_samples_and_bad_hops_are_refused():
    with pytest.raises(EstimateError, match="record of 7 samples is too short"):
        plan_segmentation(100.0, samples_available=7)
    with pytest.raises(SetupError, match="at least 4"):
        Segmentation(samples=3, hop=1)
    with pytest.raises(SetupError, match="hop 9"):
        Segmentation(samples=8, hop=9)


@pytest.mark.parametrize("runs", [[12] * 60, [8, 60, 31, 40] * 20, [3000, 40_000], [100] * 3 + [10] * 400])
def test_the_default_fits_into_the_runs_of_a_record_with_gaps(runs):
    plan = plan_segmentation(10.0, samples_available=sum(runs) + len(runs), runs=runs)
    whole = plan_segmentation(10.0, samples_available=sum(runs) + len(runs))
    inside = sum(plan.count(run) for run in runs)
    assert inside >= 16
    # No shorter than it has to be.
    twice = plan_segmentation(10.0, samples_available=None, resolution_hz=10.0 / (2 * plan.samples))
    assert plan == whole or sum(twice.count(run) for run in runs) < 16


def test_unbroken_records_and_wishes_are_left_alone():
    assert plan_segmentation(1.0, samples_available=5000, runs=[5000]) == plan_segmentation(
        1.0, samples_available=5000
    )
    assert plan_segmentation(1.0, samples_available=720, runs=[12] * 60, resolution_hz=0.01).samples == 100
    # Where no segments fit at all the shortest are tried, and what is missing is told by who averages.
    assert plan_segmentation(1.0, samples_available=900, runs=[3] * 300).samples == 4
