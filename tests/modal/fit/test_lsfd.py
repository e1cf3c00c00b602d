"""Shapes and residuals for given poles: exact data, a dense oracle, residuals of modes outside."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.modal.fit import normal_equations
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.modal_model import ModalModel
from chladni.signals.errors import EstimateError
from chladni.spectral.forms import convert_form
from tests.modal.truth import chain, noisy_response

FREQUENCY_HZ = np.linspace(0.2, 8, 500)
RNG = np.random.default_rng


def exact(at=(0,), frequency_hz=FREQUENCY_HZ, noise=1e-4):
    """Exact values with the weights of a noise that isn't there."""
    truth = chain()
    response = noisy_response(truth, frequency_hz, at, noise=noise, rng=RNG(0))
    return truth, replace(response, values=truth.accelerance(frequency_hz, at))


def residues(truth, at):
    vectors = truth.shapes[:, None, list(at)] / (2j * truth.poles.imag[:, None, None])
    return truth.shapes[:, :, None] * vectors


@pytest.mark.parametrize("at", [(0,), (0, 3)])
@pytest.mark.parametrize("form", ["receptance", "mobility", "accelerance"])
def test_exact_data_give_exact_residues(at, form):
    truth, response = exact(at)
    participation = None if len(at) == 1 else truth.shapes[:, list(at)]
    model = least_squares_frequency_domain(convert_form(response, form), truth.poles, participation)
    expected = residues(truth, at)
    np.testing.assert_allclose(model.residues, expected, atol=1e-10 * np.abs(expected).max())
    assert np.abs(model.upper).max() < 1e-10 * np.abs(response.values).max()
    assert np.abs(model.lower).max() < 1e-9


def dense_oracle(response, poles, vectors, row):
    """Weighted least squares with one column for every real unknown, by scipy-free brute force."""
    s = 2j * np.pi * response.frequency_hz
    columns = []
    for pole, vector in zip(poles, vectors, strict=True):
        for factor in (1, 1j):
            direct = (factor * vector)[:, None] / (s - pole)
            partner = np.conj(factor * vector)[:, None] / (s - np.conj(pole))
            columns.append(s**2 * (direct + partner))
    for j in range(len(response.references)):
        for factor in (1, 1j):
            for power in (0, 2):
                column = np.zeros((len(response.references), s.size), dtype=complex)
                column[j] = factor * s**power
                columns.append(column)
    weights = 1 / response.std[row].ravel()
    matrix = np.array([column.ravel() * weights for column in columns]).T
    target = response.values[row].ravel() * weights
    scale = np.linalg.norm(matrix, axis=0)
    stacked = np.concatenate([matrix.real, matrix.imag]) / scale
    answer = np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=None)[0] / scale
    return answer[: 2 * len(poles)].view(complex)


def test_noisy_data_give_the_weighted_least_squares():
    truth = chain()
    response = noisy_response(truth, FREQUENCY_HZ, (0, 1), noise=0.1, rng=RNG(3))
    poles = truth.poles * (1 + 1e-3)
    model = least_squares_frequency_domain(response, poles, truth.shapes[:, :2])
    for row in range(5):
        expected = dense_oracle(response, poles, truth.shapes[:, :2].astype(complex), row)
        np.testing.assert_allclose(model.shapes[:, row], expected, atol=1e-9 * np.abs(expected).max())


def test_blocks_of_lines_change_nothing(monkeypatch):
    truth = chain()
    response = noisy_response(truth, FREQUENCY_HZ, (0, 1), noise=0.1, rng=RNG(3))
    whole = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, :2])
    monkeypatch.setattr(normal_equations, "LARGEST_WORK", 10 * 500 * 24 * 25 // (2 * 4))
    monkeypatch.setattr(normal_equations, "LARGEST_TABLE", 14**2 * 60)
    monkeypatch.setattr(normal_equations, "LARGEST_BATCH", 14**2 * 5)
    blocks = least_squares_frequency_domain(response, truth.poles, truth.shapes[:, :2])
    np.testing.assert_allclose(blocks.shapes, whole.shapes, atol=1e-8 * np.abs(whole.shapes).max())


def test_residuals_are_recovered():
    truth, response = exact((0, 1), np.linspace(2.2, 5.2, 400))
    rng = RNG(2)
    model = ModalModel(
        poles=truth.poles[1:3],
        shapes=truth.shapes[1:3].astype(complex),
        participation=truth.shapes[1:3, :2].astype(complex),
        lower=rng.standard_normal((5, 2)) + 1j * rng.standard_normal((5, 2)),
        upper=(rng.standard_normal((5, 2)) + 1j * rng.standard_normal((5, 2))) * 1e-3,
    )
    made = replace(response, values=model.synthesise(response.frequency_hz, "accelerance"))
    found = least_squares_frequency_domain(made, model.poles, model.participation)
    np.testing.assert_allclose(found.shapes, model.shapes, atol=1e-9)
    np.testing.assert_allclose(found.lower, model.lower, atol=1e-8)
    np.testing.assert_allclose(found.upper, model.upper, atol=1e-11)


def test_residuals_take_the_modes_outside():
    truth, response = exact((0,), np.linspace(2.2, 5.2, 400))
    inside = slice(1, 3)
    model = least_squares_frequency_domain(response, truth.poles[inside], band_hz=(2.3, 5.0))
    expected = residues(truth, (0,))[inside]
    # A mode only 18 % above the band is no constant over it: a few per cent of the residues are left over.
    np.testing.assert_allclose(model.residues, expected, atol=0.05 * np.abs(expected).max())


@settings(max_examples=10, deadline=None)
@given(order=st.permutations(range(5)), factor=st.floats(1e-6, 1e6))
def test_order_and_units_follow_the_data(order, factor):
    truth = chain()
    response = noisy_response(truth, FREQUENCY_HZ[::5], (1,), noise=0.05, rng=RNG(5))
    model = least_squares_frequency_domain(response, truth.poles)
    rows = list(order)
    other = replace(
        response,
        values=response.values[rows] * factor,
        std=response.std[rows] * factor,
        responses=tuple(response.responses[row] for row in rows),
    )
    moved = least_squares_frequency_domain(other, truth.poles[rows])
    expected = model.shapes[rows][:, rows] * factor
    np.testing.assert_allclose(moved.shapes, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_lines_without_value_do_not_count():
    truth, response = exact()
    values = response.values.copy()
    values[:, :, 40] = np.nan
    values[2, :, 100:140] = np.nan
    values[:, :, 200] = 1e9
    excited = response.excited.copy()
    excited[200] = False
    model = least_squares_frequency_domain(replace(response, values=values, excited=excited), truth.poles)
    expected = residues(truth, (0,))
    np.testing.assert_allclose(model.residues, expected, atol=1e-10 * np.abs(expected).max())


def test_a_mode_that_no_line_shows_is_zero_and_not_noise():
    truth, response = exact()
    std = np.full_like(response.std, np.inf)
    std[1:] = response.std[1:]
    model = least_squares_frequency_domain(replace(response, std=std), truth.poles)
    assert np.all(model.shapes[:, 0] == 0)
    np.testing.assert_allclose(model.residues[:, 1:], residues(truth, (0,))[:, 1:], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"poles": np.array([1 + 2j])}, "no decaying oscillation"),
        ({"poles": np.array([-1 - 2j])}, "no decaying oscillation"),
        ({"poles": np.array([np.nan + 2j])}, "no decaying oscillation"),
        ({"participation": np.zeros((5, 1))}, "none of them zero"),
        ({"participation": np.ones((5, 3))}, "participation has shape"),
        ({"band_hz": (5.0, 2.0)}, "give the lower end first"),
        ({"band_hz": (20.0, 30.0)}, "no excited line with a value between 20 and 30 Hz"),
    ],
)
def test_bad_input_gets_a_clear_line(change, message):
    truth, response = exact()
    call = {"poles": truth.poles, "participation": None, "band_hz": None} | change
    with pytest.raises(EstimateError, match=message):
        least_squares_frequency_domain(response, call["poles"], call["participation"], band_hz=call["band_hz"])


def test_several_references_need_participation():
    truth, response = exact((0, 1))
    with pytest.raises(EstimateError, match="2 references need participation vectors"):
        least_squares_frequency_domain(response, truth.poles)


@pytest.mark.parametrize("form", ["receptance", "accelerance"])
def test_sdypy_finds_the_same_constants(form):
    """An independent program on noisy functions that all lines of which count alike, as they do for it."""
    from sdypy.EMA.EMA import LSFD

    truth = chain()
    response = convert_form(noisy_response(truth, FREQUENCY_HZ, (0,), noise=0.1, rng=RNG(4)), form)
    flat = replace(response, std=np.ones_like(response.std))
    poles = truth.poles[1:4] * (1 + 1e-3)
    last = FREQUENCY_HZ.size
    expected, *_ = LSFD(poles, response.values[:, 0], FREQUENCY_HZ, True, True, 0, last, form)
    model = least_squares_frequency_domain(flat, poles)
    np.testing.assert_allclose(model.residues[..., 0].T, expected, atol=1e-8 * np.abs(expected).max())


def test_an_inverse_of_what_rounding_made_indefinite_has_no_negative_variance():
    direction = np.array([1.0, 1.0]) / np.sqrt(2)
    indefinite = np.eye(2) - 1.0001 * np.outer(direction, direction)
    inverse = normal_equations.symmetric_inverse(indefinite[np.newaxis])[0]
    assert np.all(np.diag(inverse) >= 0)
