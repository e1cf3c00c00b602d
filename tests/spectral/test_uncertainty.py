"""Effective averages and random errors in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.errors import EstimateError
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.uncertainty import (
    EffectiveAverages,
    coherence_std,
    line_scatter,
    periodic_response_std,
    response_std,
    std_or_scatter,
    window_correlation,
)
from chladni.spectral.windows import window_samples
from tests.spectral.made_signals import noise, series

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


def test_one_reference_is_bendat_and_piersols_error():
    # eps = sqrt(1 - c) / (sqrt(c) sqrt(2 n)) of |H|, with n - 1 for n.
    c, g_xx, g_yy, averages = 0.8, 2.0, 5.0, 21.0
    magnitude = np.sqrt(c * g_yy / g_xx)
    std = response_std(np.array((1 - c) * g_yy), np.array(1 / g_xx), averages=averages, references=1)
    assert float(std) / magnitude == pytest.approx(np.sqrt(1 - c) / np.sqrt(c * 2 * 20), rel=1e-12)


def test_too_few_averages_leave_the_error_open():
    one = np.ones(3)
    assert np.all(np.isinf(response_std(one, one, averages=2.0, references=2)))
    assert np.all(np.isinf(coherence_std(one, 1.0)))


def test_a_coherence_of_one_has_no_error_and_a_middle_one_scatters_as_tabled():
    np.testing.assert_allclose(
        coherence_std(np.array([0.0, 0.5, 1.0]), 50.0), [0, np.sqrt(2) * 0.5 * np.sqrt(0.5 / 50), 0], rtol=1e-12
    )


def test_the_scatter_of_periods_needs_periods():
    spectra = cross_spectra(series(noise(2, 1000)), resolution_hz=10.0)
    with pytest.raises(EstimateError, match="periodic averages only"):
        periodic_response_std(spectra, np.ones((1, 51), dtype=complex), 0, [1])


def resonance(line, width):
    return 1 / (line - 100.3 - 1j * width)


@pytest.mark.parametrize("width", [0.01, 1.0, 30.0])
def test_scatter_from_line_to_line_is_that_of_the_noise(width):
    line = np.arange(400.0)
    rng = np.random.default_rng(1)
    made = rng.standard_normal((5, 400)) + 1j * rng.standard_normal((5, 400))
    found = line_scatter(1e-4 * made + resonance(line, width))
    assert found.shape == (5, 400)
    # The median of 64 squares scatters by 1/sqrt(64) of itself, more for neighbours that repeat each other; a root
    # halves it. Near the peak what curves may add.
    far = np.abs(line - 100) > 64
    assert np.median(found[:, far]) == pytest.approx(1e-4, rel=0.1)
    assert np.all((found[:, far] > 0.5e-4) & (found[:, far] < 2e-4))


def test_scatter_is_that_of_the_neighbours():
    line = np.arange(1000.0)
    rng = np.random.default_rng(2)
    made = rng.standard_normal(1000) + 1j * rng.standard_normal(1000)
    found = line_scatter(made * np.where(line < 500, 1.0, 100.0))
    assert np.median(found[:400]) == pytest.approx(1.0, rel=0.1)
    assert np.median(found[600:]) == pytest.approx(100.0, rel=0.1)


def test_exact_functions_scatter_by_no_more_than_they_curve():
    line = np.arange(400.0)
    curve = resonance(line, 0.01)
    scatter = line_scatter(curve)
    # 64 lines and more from a peak the second difference is less than 2/64^2 of the function, those of higher order
    # are less yet.
    far = np.abs(line - 100) > 2 * 64
    assert np.all(scatter[far] < 2 / 64**2 * np.abs(curve[far]))
    # The peak itself stands out of it a hundredfold.
    assert scatter[100] < 0.01 * np.abs(curve[100])
    assert np.all(np.isinf(line_scatter(curve[:2])))


def test_only_functions_without_any_std_get_that_of_their_scatter():
    line = np.arange(50.0)
    values = np.stack([resonance(line, 3.0), resonance(line, 3.0)])
    std = np.full(values.shape, np.inf)
    std[0, 10] = 0.5
    filled = std_or_scatter(values, std)
    np.testing.assert_array_equal(filled[0], std[0])
    np.testing.assert_array_equal(filled[1], line_scatter(values)[1])
