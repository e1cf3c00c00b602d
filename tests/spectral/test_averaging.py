"""Sums over segments against explicit outer products."""

import numpy as np
import pytest

from chladni.spectral import averaging as module
from chladni.spectral.averaging import PeakHold, PowerHold, WeightedPowers, WeightedSum

LINES, SEGMENTS, CHANNELS = 5, 7, 3


@pytest.fixture
def spectra(monkeypatch):
    monkeypatch.setattr(module, "LINES_TOGETHER", 2)
    rng = np.random.default_rng(3)
    shape = (LINES, SEGMENTS, CHANNELS)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def products(spectra):
    """conj(X_i) X_j of each segment, ``[segment, channel, channel, frequency]``."""
    return np.einsum("fsi,fsj->sijf", spectra.conj(), spectra)


@pytest.mark.parametrize("decay", [1.0, 0.8])
def test_a_weighted_sum_weighs_the_newest_most(spectra, decay):
    average = WeightedSum(LINES, CHANNELS, decay)
    average.add(spectra[:, :3])
    average.add(spectra[:, 3:])
    expected = np.average(products(spectra), axis=0, weights=decay ** np.arange(SEGMENTS)[::-1])
    np.testing.assert_allclose(average.mean(), expected, rtol=1e-13, atol=1e-14)


def test_the_mean_is_exactly_hermitian_with_a_real_diagonal(spectra):
    average = WeightedSum(LINES, CHANNELS)
    average.add(spectra)
    mean = average.mean()
    np.testing.assert_array_equal(mean, mean.conj().swapaxes(0, 1))


def test_peak_hold_keeps_the_largest_of_each_pair_and_line(spectra):
    average = PeakHold(LINES, CHANNELS)
    average.add(spectra[:, :4])
    average.add(spectra[:, 4:])
    each = products(spectra)
    largest = np.take_along_axis(each, np.abs(each).argmax(axis=0)[np.newaxis], axis=0)[0]
    np.testing.assert_allclose(average.mean(), largest, rtol=1e-14)


@pytest.mark.parametrize("decay", [1.0, 0.8])
@pytest.mark.parametrize("channels", [1, 3, 4, 5, 8, 13])
def test_powers_alone_are_the_diagonal_to_the_last_bit(channels, decay):
    rng = np.random.default_rng(channels)
    spectra = rng.standard_normal((LINES, 60, channels)) + 1j * rng.standard_normal((LINES, 60, channels))
    for pairs, alone in (
        (WeightedSum(LINES, channels, decay), WeightedPowers(LINES, channels, decay)),
        (PeakHold(LINES, channels), PowerHold(LINES, channels)),
    ):
        for average in (pairs, alone):
            average.add(spectra[:, :37])
            average.add(spectra[:, 37:])
        np.testing.assert_array_equal(alone.mean(), np.einsum("iif->if", pairs.mean()).real)


ALL = [WeightedSum, PeakHold, WeightedPowers, PowerHold, lambda *size: WeightedSum(*size, 0.7)]


@pytest.mark.parametrize("make", ALL)
def test_merged_parts_are_the_whole_and_copies_are_independent(spectra, make):
    whole, early, late = make(LINES, CHANNELS), make(LINES, CHANNELS), make(LINES, CHANNELS)
    whole.add(spectra)
    early.add(spectra[:, :2])
    late.add(spectra[:, 2:])
    before = early.copy()
    early.merge(late)
    np.testing.assert_allclose(early.mean(), whole.mean(), rtol=1e-13, atol=1e-14)
    assert not np.allclose(before.mean(), early.mean())
