"""Effective averages in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.spectral.effective_averages import EffectiveAverages, window_correlation
from chladni.spectral.windows import window_samples

HANN = window_samples("hann", 512)


def by_definition(runs, hop, decay, window=HANN):
    """(sum w)^2 / sum over all pairs of w w rho, each pair for itself."""
    total = sum(runs)
    weights = decay ** np.arange(total)[::-1]
    run = np.repeat(np.arange(len(runs)), runs)
    start = np.concatenate([np.arange(count) * hop for count in runs])
    variance = 0.0
    for k in range(total):
        for m in range(total):
            lag = abs(start[k] - start[m])
            if run[k] == run[m] and lag < window.size:
                overlap = window[lag:] @ window[: window.size - lag] / (window @ window)
                variance += weights[k] * weights[m] * overlap**2
    return weights.sum() ** 2 / variance


@given(
    runs=st.lists(st.integers(1, 9), min_size=1, max_size=4),
    hop=st.integers(64, 512),
    decay=st.sampled_from([1.0, 0.9, 0.5]),
)
def test_the_count_is_the_double_sum(runs, hop, decay):
    count = EffectiveAverages(HANN, hop, decay)
    for run in runs:
        count.add(0, run // 2)
        count.add(run // 2, run - run // 2)
    assert count.value == pytest.approx(by_definition(runs, hop, decay), rel=1e-12)


def test_welchs_example():
    # Hann at 50 %: rho(1) = 1/36, so K segments count as K / (1 + (K - 1)/(18 K)) (Welch 1967).
    np.testing.assert_allclose(window_correlation(HANN, 256), [1, 1 / 36], rtol=1e-9)
    count = EffectiveAverages(HANN, 256)
    count.add(0, 10)
    assert count.value == pytest.approx(10 / (1 + 9 / 180), rel=1e-9)


@given(early=st.integers(1, 6), late=st.integers(1, 6), decay=st.sampled_from([1.0, 0.8]))
def test_merged_counts_are_those_of_separate_stretches(early, late, decay):
    first, second = EffectiveAverages(HANN, 128, decay), EffectiveAverages(HANN, 128, decay)
    first.add(0, early)
    second.add(0, late)
    alone = first.copy()
    first.merge(second)
    assert first.value == pytest.approx(by_definition([early, late], 128, decay), rel=1e-12)
    assert alone.segments == early


def test_nothing_counted_is_zero():
    assert EffectiveAverages(HANN, 128).value == 0.0
