"""Frequency responses against closed forms, pyFRF, and the scatter of many records."""

import functools

import numpy as np
import pytest
from pyFRF import FRF

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.coherence import coherence
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response
from chladni.spectral.periodic import find_period, periodic_cross_spectra
from tests.spectral.made_signals import multisine, noise, series
from tests.spectral.mass_chain import MassChain

RATE_HZ = 512.0
ESTIMATORS = ["H1", "H2", "Hv"]


def two_references(samples=40_960, *, seed=1, level=0.1):
    """Two partly coherent references a, b and two responses c, d with the known gains below."""
    x = noise(2, samples, seed=seed)
    x[1] += 0.6 * x[0]
    y = GAINS @ x + level * noise(2, samples, seed=seed + 1000)
    return series(np.concatenate([x, y]), units=["N", "N", "m/s^2", "m/s^2"])


GAINS = np.array([[2.0, -0.5], [0.3, 1.5]])


@functools.cache
def under_a_multisine(masses):
    chain = MassChain(masses, damping=30.0)
    # Of the slowest mode, a period of 4 s leaves at most e^-2.4.
    force = np.tile(multisine(2048, np.arange(1, 1024)), 40)
    values = np.concatenate([force[np.newaxis], chain.respond(force, RATE_HZ)])[:, 36 * 2048 :]
    source = series(values, rate_hz=RATE_HZ, units=["N"] + ["m/s^2"] * masses)
    return chain, periodic_cross_spectra(source, find_period(source, channel="a"))


@pytest.mark.parametrize("masses", [1, 3, 5])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_mass_chain_under_a_multisine_is_exact(masses, estimator):
    chain, spectra = under_a_multisine(masses)
    response = frequency_response(spectra, references="a", estimator=estimator)
    lines = response.excited
    assert lines[1:1024].all()
    expected = chain.discrete_response(response.frequency_hz[lines], RATE_HZ)
    # 36 periods leave nothing of the start; rounding of the state space grows with its 40 periods.
    np.testing.assert_allclose(response.values[:, 0, lines], expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(response.coherence[:, lines], 1, rtol=1e-9)


@pytest.mark.parametrize("masses", [1, 3])
def test_a_mass_chain_under_noise_agrees_within_its_error_bars(masses):
    chain = MassChain(masses, damping=40.0)
    force = noise(1, 60_000)[0]
    values = np.concatenate([force[np.newaxis], chain.respond(force, RATE_HZ)])
    values[1:] += 0.02 * noise(masses, force.size, seed=9)
    response = frequency_response(
        cross_spectra(series(values, rate_hz=RATE_HZ), resolution_hz=0.25), references=["a"]
    )
    lines = slice(8, 200)
    expected = chain.discrete_response(response.frequency_hz[lines], RATE_HZ)
    deviation = np.abs(response.values[:, 0, lines]) - np.abs(expected)
    # Hann correlates neighbouring lines, so 192 of them are about 100 values: their RMS in sigmas is 1 +- 0.07, and
    # what leakage leaves in is part of the incoherent power and so of sigma: within 5 x 0.07.
    assert np.sqrt(np.mean((deviation / response.std[:, 0, lines]) ** 2)) == pytest.approx(1.0, abs=0.35)


def test_the_sampled_chain_is_the_continuous_one_but_for_the_hold():
    chain, rate_hz = MassChain(2), 51_200.0
    frequency_hz = np.array([0.5, 5.0, 20.0, 40.0])
    difference = np.abs(chain.discrete_response(frequency_hz, rate_hz) - chain.accelerance(frequency_hz))
    # The force held over a sample acts half a sample late on the motion, at most |H| and the direct 1/m together.
    bound = np.pi * frequency_hz / rate_hz * (np.abs(chain.accelerance(frequency_hz)) + 1 / chain.mass[0, 0])
    assert np.all(difference < 1.1 * bound)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_pure_delay_tau_has_the_phase_minus_omega_tau(estimator):
    x = noise(1, 60_000)[0]
    source = series(np.stack([x[8:], x[:-8]]), rate_hz=RATE_HZ)
    response = frequency_response(cross_spectra(source, resolution_hz=0.25), references="a", estimator=estimator)
    phase = np.unwrap(np.angle(response.values[0, 0, 1:-1]))
    # 8 samples of a segment of 2048: coherence 0.99, phase error about 0.01.
    np.testing.assert_allclose(phase, -2 * np.pi * response.frequency_hz[1:-1] * 8 / RATE_HZ, atol=0.06)


@pytest.mark.parametrize("overlap", [0, 512])
def test_single_reference_is_pyfrfs(overlap):
    source = two_references()
    x, y = source.values[0], source.values[2:]
    peer = FRF(
        1000,
        exc=x[np.newaxis, np.newaxis],
        resp=y[np.newaxis],
        exc_type="f",
        resp_type="a",
        window="none",  # its others are symmetric, ours periodic
        fft_len=1024,
        nperseg=1024,
        noverlap=overlap,
    )
    spectra = cross_spectra(source, resolution_hz=1000 / 1024, window="boxcar", overlap=overlap / 1024)
    lines = slice(1, None)
    for estimator in ("H1", "H2"):
        ours = frequency_response(spectra, references="a", responses=["c", "d"], estimator=estimator)
        theirs = peer.get_FRF(estimator, "accelerance")
        # Both divide rounded averages of some 80 segments.
        np.testing.assert_allclose(ours.values[:, :, lines], theirs[:, :, lines], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        ours.coherence[:, lines], peer.get_coherence().reshape(2, -1)[:, lines], rtol=1e-9, atol=1e-12
    )


def test_two_references_are_pyfrfs():
    source = two_references()
    peer = FRF(
        1000,
        exc=source.values[np.newaxis, :2],
        resp=source.values[np.newaxis, 2:],
        exc_type="f",
        resp_type="a",
        window="none",
        fft_len=1024,
        nperseg=1024,
        noverlap=512,
    )
    spectra = cross_spectra(source, resolution_hz=1000 / 1024, window="boxcar")
    ours = frequency_response(spectra, references=["a", "b"])
    theirs = peer.get_FRF("H1", "accelerance")
    np.testing.assert_allclose(ours.values[..., 1:], theirs[..., 1:], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_two_references_are_parted_though_they_are_coherent(estimator):
    source = two_references(level=0.01)
    response = frequency_response(
        cross_spectra(source, resolution_hz=10.0), references=["a", "b"], estimator=estimator
    )
    assert response.values.shape == (2, 2, 51)
    error = np.abs(response.values[..., 1:-1] - GAINS[:, :, np.newaxis])
    assert np.sqrt(np.mean(error**2)) < 3 * np.sqrt(2 * np.mean(response.std[..., 1:-1] ** 2))
    assert response.unit(0, 1) == "(m/s^2)/N"
    assert response.provenance.estimator == estimator


@pytest.mark.parametrize(
    ("input_noise", "output_noise", "unbiased"), [(0.0, 0.7, "H1"), (0.7, 0.0, "H2"), (0.7, 0.7, "Hv")]
)
def test_each_estimator_is_right_for_its_noise(input_noise, output_noise, unbiased):
    x = noise(1, 400_000)[0]
    measured = np.stack([x, 3.0 * x]) + noise(2, x.size, seed=2) * np.array([[input_noise], [3.0 * output_noise]])
    spectra = cross_spectra(series(measured), resolution_hz=10.0)
    means = {
        name: np.abs(frequency_response(spectra, references="a", estimator=name).values[0, 0, 1:-1]).mean()
        for name in ESTIMATORS
    }
    # 4000 effective averages x 49 lines: to 0.3 %, and the others are off by a fifth and more.
    assert means[unbiased] == pytest.approx(3.0, rel=0.01)
    for name in {"H1", "H2"} - {unbiased}:
        assert abs(means[name] - 3.0) > 0.5
    assert means["Hv"] == pytest.approx(np.sqrt(means["H1"] * means["H2"]), rel=0.01)


def test_hv_of_one_reference_is_the_geometric_mean_line_by_line():
    spectra = cross_spectra(two_references(), resolution_hz=10.0)
    h1, h2, hv = (frequency_response(spectra, references="a", estimator=name).values for name in ESTIMATORS)
    np.testing.assert_allclose(np.abs(hv), np.sqrt(np.abs(h1) * np.abs(h2)), rtol=1e-9)
    np.testing.assert_allclose(np.angle(hv / h1), 0, atol=1e-6)


def test_hv_does_not_depend_on_units():
    source = two_references()
    scale = np.array([1.0, 1e3, 1e-2, 5.0])
    plain, scaled = (
        frequency_response(cross_spectra(series(values), resolution_hz=10.0), references=["a", "b"], estimator="Hv")
        for values in (source.values, source.values * scale[:, np.newaxis])
    )
    ratio = scale[2:, np.newaxis, np.newaxis] / scale[np.newaxis, :2, np.newaxis]
    np.testing.assert_allclose(scaled.values[..., 1:], (plain.values * ratio)[..., 1:], rtol=1e-9)


@pytest.mark.parametrize(("references", "resolution_hz"), [(["a"], 20.0), (["a", "b"], 20.0), (["a", "b"], 200.0)])
def test_the_error_bar_is_the_scatter_of_many_records(references, resolution_hz):
    squares, predicted = [], []
    truth = np.abs(GAINS) if len(references) == 2 else np.abs(GAINS @ [[1.0], [0.6]])
    for record in range(100):
        spectra = cross_spectra(two_references(1000, seed=record, level=0.5), resolution_hz=resolution_hz)
        response = frequency_response(spectra, references=references, responses=["c", "d"])
        inner = slice(2, -2) if response.frequency_hz.size > 6 else slice(1, -1)
        squares.append((np.abs(response.values) - truth[:, :, np.newaxis])[..., inner] ** 2)
        predicted.append(response.std[..., inner] ** 2)
    ratio = np.sqrt(np.mean(squares) / np.mean(predicted))
    # Some 20 independent lines (2 at 200 Hz), 2 to 4 functions, 100 records: known to 1.5 % (5 %), five sigma.
    assert ratio == pytest.approx(1.0, abs=0.25 if resolution_hz == 200.0 else 0.08)


@pytest.mark.parametrize(("input_noise", "common_noise"), [(0.0, 0.0), (0.1, 0.0), (0.02, 0.1)])
def test_the_error_bar_of_periods_is_the_scatter_of_many_records(input_noise, common_noise):
    period, periods = multisine(256, np.arange(5, 100)), 8
    values, predicted = [], []
    for record in range(150):
        disturbance = noise(3, 256 * periods, seed=record)
        x = np.tile(period, periods) + common_noise * disturbance[2]
        measured = np.stack([x + input_noise * disturbance[0], 2 * x + 0.2 * disturbance[1]])
        source = series(measured)
        spectra = periodic_cross_spectra(source, find_period(source, channel="a"))
        response = frequency_response(spectra, references="a")
        values.append(np.abs(response.values[0, 0, 5:100]))
        predicted.append(response.std[0, 0, 5:100])
    ratio = np.sqrt(np.mean(np.var(values, axis=0)) / np.mean(np.square(predicted)))
    # 95 lines x 150 records: 0.6 %; five sigma. Noise common to both doesn't scatter H, and isn't counted.
    assert ratio == pytest.approx(1.0, abs=0.03)


def test_too_few_averages_leave_the_error_open_and_say_so():
    spectra = cross_spectra(two_references(512), resolution_hz=1000 / 512, overlap=0.0)
    response = frequency_response(spectra, references="a", responses=["c"])
    assert np.all(np.isinf(response.std))
    np.testing.assert_allclose(response.coherence[:, 1:], 1, rtol=1e-12)
    assert any("effective averages" in note for note in response.provenance.notes)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_references_that_are_one_signal_are_masked_not_solved(estimator):
    source = two_references()
    values = source.values.copy()
    values[1] = -2 * values[0]
    response = frequency_response(
        cross_spectra(series(values), resolution_hz=10.0), references=["a", "b"], estimator=estimator
    )
    assert not response.excited.any()
    assert np.all(np.isinf(response.std))
    if estimator != "H2":
        assert np.isnan(response.values).all()
    assert any("a, b can't be told apart; masked: excite them independently" in n for n in response.provenance.notes)


def test_references_that_repeat_together_are_masked_with_advice():
    x = np.tile(np.stack([multisine(256, np.arange(5, 100), seed=s) for s in (1, 2)]), 8)
    source = series(np.concatenate([x, GAINS @ x + 0.01 * noise(2, 2048)]))
    spectra = periodic_cross_spectra(source, find_period(source, channel="a"))
    response = frequency_response(spectra, references=["a", "b"])
    assert not response.excited.any()
    assert any("as many different experiments" in note for note in response.provenance.notes)


def test_a_dead_reference_gives_no_numbers_and_no_warning():
    values = two_references().values.copy()
    values[0] = 0
    response = frequency_response(cross_spectra(series(values), resolution_hz=10.0), references="a")
    assert np.isnan(response.values).all()
    assert np.all(np.isinf(response.std))
    assert not response.coherence.any()
    assert not response.excited.any()


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_dead_response_is_zero_or_nan_and_never_coherent(estimator):
    values = two_references().values.copy()
    values[2] = 0
    spectra = cross_spectra(series(values), resolution_hz=10.0)
    response = frequency_response(spectra, references="a", responses=["c"], estimator=estimator)
    assert not np.nan_to_num(response.values).any()
    assert not response.coherence.any()


def test_coherence_is_the_same_as_by_itself():
    spectra = cross_spectra(two_references(), resolution_hz=10.0)
    response = frequency_response(spectra, references=["a", "b"])
    np.testing.assert_array_equal(response.coherence, coherence(spectra, references=["a", "b"]).values)


def test_what_cannot_be_asked_for_is_refused():
    spectra = cross_spectra(two_references(), resolution_hz=10.0)
    with pytest.raises(SetupError, match="none of H1, H2, Hv"):
        frequency_response(spectra, references="a", estimator="H3")
    with pytest.raises(EstimateError, match="H2 with 2 references needs as many responses, got 1"):
        frequency_response(spectra, references=["a", "b"], responses=["c"], estimator="H2")
