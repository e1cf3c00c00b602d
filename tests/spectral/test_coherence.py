"""Coherence in closed form and against SciPy."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import coherence as scipy_coherence

from chladni.signals.errors import EstimateError
from chladni.spectral.coherence import coherence, coherence_std, partial_coherence, share
from chladni.spectral.cross_spectra import cross_spectra
from tests.spectral.made_signals import noise, series

SAMPLES = 100_000


def spectra_of(values):
    return cross_spectra(series(np.asarray(values)), resolution_hz=10.0)


@cache
def two_sources():
    """References a, b share a source; c hears both, d only a, and e is alone."""
    u, v, w, n, e = noise(5, SAMPLES)
    a, b = u + v, u + w
    return spectra_of([a, b, a + 2 * b + n, 3 * a + n, e])


def test_ordinary_coherence_is_scipys():
    spectra = two_sources()
    values = noise(5, SAMPLES)
    result = coherence(spectra_of(values), references="a")
    for row in range(4):
        expected = scipy_coherence(values[0], values[row + 1], fs=1000.0, nperseg=100)[1]
        np.testing.assert_allclose(result.values[row, 1:], expected[1:], rtol=1e-9, atol=1e-13)
    assert coherence(spectra, references="a").kind == "ordinary"


@pytest.mark.parametrize(("signal", "share_of_power"), [(1.0, 0.5), (3.0, 0.9), (0.5, 0.2)])
def test_ordinary_coherence_is_the_share_of_signal_in_noise(signal, share_of_power):
    x, n = noise(2, SAMPLES)
    result = coherence(spectra_of([x, signal * x + n]), references="a")
    middle = slice(2, -2)
    # The mean over 46 half-independent lines, five sigma; the bias of (1 - c)^2/n is a tenth of that.
    tolerance = 5 * result.std[0, middle].mean() / np.sqrt(46 / 1.94)
    assert result.values[0, middle].mean() == pytest.approx(share_of_power, abs=tolerance)


def test_the_error_bar_is_the_scatter():
    values = []
    for seed in range(60):
        x, n = noise(2, 4000, seed=seed)
        result = coherence(spectra_of([x, x + n]), references="a")
        values.append(result.values[0, 2:-2])
    predicted = np.sqrt(2) * 0.5 * np.sqrt(0.5) / np.sqrt(result.provenance.effective_averages)
    # The formula is first order in 1/sqrt(75), good to a few per cent; the scatter is known to 2 %.
    assert np.std(values) == pytest.approx(predicted, rel=0.1)


def test_multiple_coherence_explains_what_both_bring():
    spectra = two_sources()
    result = coherence(spectra, references=["a", "b"])
    assert result.kind == "multiple"
    middle = result.values[:, 2:-2].mean(axis=1)
    # c = a + 2 b + n = 3 u + v + 2 w + n: 14 of 15; d = 3 a + n: 18 of 19; e: nothing but 2/n of bias.
    np.testing.assert_allclose(middle, [14 / 15, 18 / 19, 0.0], atol=2e-3)


def test_partial_coherence_takes_the_other_reference_out():
    spectra = two_sources()
    result = partial_coherence(spectra, references="b", conditioned_on=["a"])
    assert result.kind == "partial"
    assert [channel.name for channel in result.conditioned_on] == ["a"]
    assert [channel.name for channel in result.responses] == ["c", "d", "e"]
    # b without a has the power 1.5 (2 - 1/2); c - (what a tells of it) = 2 (b without a) + n: 6 of 7.
    np.testing.assert_allclose(result.values[:, 2:-2].mean(axis=1), [6 / 7, 0.0, 0.0], atol=5e-3)


def test_ordinary_coherence_is_fooled_where_partial_is_not():
    fooled = coherence(two_sources(), references="b", responses=["d"])
    # d hears a only, but b shares half of it.
    assert fooled.values[0, 2:-2].mean() == pytest.approx(0.25 * 18 / 19, abs=0.01)


def test_what_is_conditioned_on_leaves_nothing_of_itself():
    a, b, n = noise(3, SAMPLES)
    spectra = spectra_of([a, b, 5 * a, n])
    result = partial_coherence(spectra, references="b", conditioned_on="a")
    assert not result.values[0].any()


def test_dead_channels_are_not_coherent():
    x = noise(2, 5000)
    spectra = spectra_of([x[0], np.zeros(5000), x[1]])
    assert not coherence(spectra, references="a", responses=["b"]).values.any()
    assert not coherence(spectra, references="b").values.any()
    assert not partial_coherence(spectra, references="b", conditioned_on="a").values.any()


def test_a_share_stays_between_nothing_and_all():
    np.testing.assert_array_equal(
        share(np.array([0.5, 1.0 + 1e-15, 1.0]), np.array([1.0, 1.0, 0.0])), [0.5, 1.0, 0.0]
    )


def test_a_channel_named_twice_is_refused():
    with pytest.raises(EstimateError, match="named twice"):
        partial_coherence(two_sources(), references="a", conditioned_on=["a"])


def test_one_average_leaves_the_error_of_a_coherence_open():
    assert np.all(np.isinf(coherence_std(np.ones(3), 1.0)))


def test_a_coherence_of_one_has_no_error_and_a_middle_one_scatters_as_tabled():
    np.testing.assert_allclose(
        coherence_std(np.array([0.0, 0.5, 1.0]), 50.0), [0, np.sqrt(2) * 0.5 * np.sqrt(0.5 / 50), 0], rtol=1e-12
    )
