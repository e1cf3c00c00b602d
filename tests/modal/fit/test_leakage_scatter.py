"""Moments of the errors of leakage against simulated averages of a single mode."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.fit.leakage_scatter import LAGS, leakage_scatter
from chladni.modal.fit.model_lines import model_lines
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from tests.modal.truth import ModalTruth, noisy_response, record

ONE = ModalTruth(frequency_hz=np.array([1.0]), damping_ratio=np.array([0.01]), shapes=np.ones((1, 1)))


@pytest.fixture(scope="module")
def errors():
    """Errors of H1 per unit residue ``[run, line]`` near the mode, and the moments that are expected of them."""
    values = []
    for run in range(120):
        series = record(ONE, cycles=700, rng=np.random.default_rng([1, run]))
        spectra = cross_spectra(series, resolution_hz=1 / 64)
        response = frequency_response(spectra, references="/force0.z")
        values.append(response.values[0, 0])
    stretches = leakage_scatter(model_lines(response, None), ONE.poles, response.provenance)
    scatter = next(stretch for stretch in stretches if stretch.modes.size)
    off = (np.array(values) - np.mean(values, axis=0))[:, 1:][:, scatter.near] * (2j * ONE.poles[0].imag)
    return off, scatter, round(64 * 1.0) - 1 - scatter.near.start


@pytest.mark.parametrize("lag", range(LAGS + 1))
@pytest.mark.parametrize("place", [-1, 0, 1])
def test_moments(errors, lag, place):
    off, scatter, peak = errors
    here, there = off[:, peak + place], off[:, peak + place + lag]
    power = scatter.hermitian[0, 0, 0, peak].real
    # 120 runs tell a moment within 9 % of the power; four of that.
    assert np.mean(here * there.conj()) / power == pytest.approx(
        scatter.hermitian[lag, 0, 0, peak + place] / power, abs=0.36
    )
    assert np.mean(here * there) / power == pytest.approx(scatter.plain[lag, 0, 0, peak + place] / power, abs=0.36)


def test_the_power_where_it_is_largest(errors):
    off, scatter, peak = errors
    found = np.mean(np.abs(off[:, peak - 2 : peak + 3]) ** 2)
    assert found == pytest.approx(scatter.hermitian[0, 0, 0, peak - 2 : peak + 3].real.mean(), rel=0.25)


def test_the_variance_of_a_sum_over_lines(errors):
    off, scatter, peak = errors
    # Opposite weights on both sides of the resonance, as a frequency has; equal ones, as a damping has.
    for sign in (1, -1):
        weights = np.zeros((1, 2, off.shape[1]), dtype=complex)
        weights[0, 0, peak - 2 : peak + 3] = [1, 1, 0, sign, sign]
        sums = (off @ weights[0, 0]).real
        expected = scatter.variance(weights, (weights, weights))
        # The variance of 120 numbers is known within 13 %; four of that.
        assert np.var(sums) == pytest.approx(expected, rel=0.55)


def test_nothing_where_nothing_leaks():
    response = noisy_response(ONE, np.linspace(0.5, 2, 200), (0,), noise=0.1, rng=np.random.default_rng(0))
    assert leakage_scatter(model_lines(response, None), ONE.poles, response.provenance) == ()


def test_missing_lines_part_stretches():
    series = record(ONE, cycles=300, rng=np.random.default_rng(2))
    response = frequency_response(cross_spectra(series, resolution_hz=1 / 32), references="/force0.z")
    values = response.values.copy()
    values[..., 33] = np.nan
    lines = model_lines(replace(response, values=values), None)
    stretches = leakage_scatter(lines, ONE.poles, response.provenance)
    # The line at 0 Hz isn't among the lines.
    assert 32 in [stretch.near.start for stretch in stretches]
    assert stretches[0].near.start == 0
    assert stretches[-1].near.stop == lines.frequency_hz.size
