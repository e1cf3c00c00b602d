import numpy as np
import pytest

from chladni.modal.fit.lag_window import lag_window
from chladni.modal.operational import spectral_bell
from chladni.modal.operational.spectral_bell import BellData, fit_bell, own_half_width
from chladni.modal.operational.spectral_decomposition import decompose
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.made_spectra import expected_spectra
from tests.modal.truth import ModalTruth, ambient_record

ONE_CHANNEL = np.ones(1)


def bell_data(spectra, *, around_hz, reach_hz, derivatives=2):
    found = decompose(spectra)
    lines = np.abs(found.frequency_hz - around_hz) <= reach_hz
    return BellData(
        frequency_hz=found.frequency_hz[lines],
        power=found.values[lines, 0],
        lag_window=lag_window(spectra.provenance),
        window="hann",
        record_s=found.record_s,
        derivatives=derivatives,
    )


@pytest.mark.parametrize(
    ("damping", "spacing_hz", "tolerance"),
    # From bells of 20 lines to a quarter of a line, where the slope of omega^4 within a line is left over.
    [(0.01, 0.01, 1e-4), (0.01, 0.1, 2e-3), (0.003, 0.1, 3e-3), (0.05, 0.1, 1e-3), (0.01, 0.4, 2e-2)],
)
def test_the_window_biases_neither_frequency_nor_damping(damping, spacing_hz, tolerance):
    natural_hz = 10.0 + 0.3 * spacing_hz
    modes = [(natural_hz, damping, ONE_CHANNEL)]
    spectra = expected_spectra(modes, spacing_hz=spacing_hz, lines=int(20 / spacing_hz))
    reach_hz = max(10 * damping * 10, 6 * spacing_hz)
    data = bell_data(spectra, around_hz=10.0, reach_hz=reach_hz)
    bell = fit_bell(data, frequency_hz=10.0, half_width_hz=0.02 * 10)
    assert bell.damping_ratio == pytest.approx(damping, rel=tolerance)
    # In widths of the resonance, which is what frequency errors are made of.
    assert abs(bell.frequency_hz - natural_hz) < tolerance * damping * natural_hz
    assert bell.power > 100 * bell.power_std / np.sqrt(1000)


def test_error_bars_cover_the_truth_nineteen_times_of_twenty():
    rng = np.random.default_rng(2)
    truth = ModalTruth(frequency_hz=np.ones(1), damping_ratio=np.full(1, 0.01), shapes=np.ones((1, 1)))
    inside = np.zeros(2)
    for _ in range(60):
        record = ambient_record(truth, cycles=1500, rng=rng, noise=0.01)
        # Lines as wide as the mode: segments and lines are both alike there.
        data = bell_data(cross_spectra(record, resolution_hz=0.02), around_hz=1.0, reach_hz=0.15)
        bell = fit_bell(data, frequency_hz=1.0, half_width_hz=0.01)
        error = np.array([bell.frequency_hz - 1.0, bell.damping_ratio - 0.01])
        inside += np.abs(error) <= 1.96 * np.sqrt(np.diag(bell.covariance))
    # 57 expected; four sigma of a binomial count are 7.
    assert np.all(inside >= 50)


def test_more_record_and_not_more_lines_makes_error_bars_smaller():
    modes = [(10.0, 0.01, ONE_CHANNEL)]
    stds = []
    for spacing_hz, averages in ((0.02, 100.0), (0.01, 50.0), (0.01, 200.0)):
        spectra = expected_spectra(modes, spacing_hz=spacing_hz, lines=int(20 / spacing_hz), averages=averages)
        bell = fit_bell(bell_data(spectra, around_hz=10.0, reach_hz=1.0), frequency_hz=10.0, half_width_hz=0.1)
        stds.append(np.sqrt(np.diag(bell.covariance)))
    # The same record cut into longer segments tells no less, and hardly more.
    np.testing.assert_allclose(stds[1], stds[0], rtol=0.1)
    np.testing.assert_allclose(stds[2], stds[1] / 2, rtol=1e-6)


def test_error_bars_come_near_what_any_estimator_can_reach():
    # Au (2014) for long records without noise: std of f is f sqrt(zeta/(2 pi N)), of zeta sqrt(zeta/(2 pi N)), with N
    # cycles of the mode.
    spectra = expected_spectra([(10.0, 0.01, ONE_CHANNEL)], spacing_hz=0.02, lines=1000, averages=400.0)
    data = bell_data(spectra, around_hz=10.0, reach_hz=1.0)
    bell = fit_bell(data, frequency_hz=10.0, half_width_hz=0.1)
    least = np.sqrt(0.01 / (2 * np.pi * data.record_s * 10.0))
    relative = np.sqrt(np.diag(bell.covariance)) / least / [10.0, 1.0]
    assert np.all((relative > 0.95) & (relative < 1.6))


@pytest.mark.parametrize(
    "half_width", [0.1, 3.0, *(pytest.param(one, marks=pytest.mark.nightly) for one in (0.5, 20.0))]
)
def test_the_half_power_width_is_freed_of_the_window(half_width):
    # A dense look at one bell: offsets of the mode move the lines over it.
    shifts = np.arange(0.0, 1.0, 1 / 16)
    seen = [
        expected_spectra([(400.0 + shift, half_width / 400, ONE_CHANNEL)], spacing_hz=1.0, lines=600)
        for shift in shifts
    ]
    offsets = np.concatenate([np.arange(600) - 400.0 - shift for shift in shifts])
    order = np.argsort(offsets)
    power = np.concatenate([spectra.density[0, 0].real for spectra in seen])[order]
    above = offsets[order][power >= power.max() / 2]
    # Half of a 16th of a line is missing on either side; the slope of omega^4 tilts the widest.
    shown = (above[-1] - above[0]) / 2 + 1 / 32
    found = own_half_width(shown, lag_window(seen[0].provenance))
    assert found == pytest.approx(half_width, abs=0.06, rel=0.03)


def test_too_few_lines_and_lines_without_a_bell_are_refused(monkeypatch):
    spectra = expected_spectra([(10.0, 0.01, ONE_CHANNEL)], spacing_hz=0.1, lines=256)
    with pytest.raises(EstimateError, match="5 lines are too few for a mode"):
        fit_bell(bell_data(spectra, around_hz=10.0, reach_hz=0.21), frequency_hz=10.0, half_width_hz=0.1)
    data = bell_data(spectra, around_hz=10.0, reach_hz=1.0)
    monkeypatch.setattr(spectral_bell, "MOST_STEPS", 1)
    with pytest.raises(EstimateError, match="no mode fits the spectrum near 10 Hz"):
        fit_bell(data, frequency_hz=10.0, half_width_hz=0.02)


def test_segments_may_have_another_window():
    assert own_half_width(0.3, lag_window(Provenance(window="boxcar", segment_s=1.0, averages=8))) < 0.2
