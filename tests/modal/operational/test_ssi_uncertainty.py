"""First-order covariance of subspace models against derivatives by differences and against the scatter of records."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.operational.correlation import correlation_functions
from chladni.modal.operational.ssi import continuous, decompose, order_models, shapes_of
from chladni.modal.operational.ssi_uncertainty import (
    ErrorPropagation,
    all_pole_deviations,
    pole_deviations,
    shape_std,
    student_factor,
)
from chladni.signals.errors import EstimateError
from tests.modal.operational.test_ssi import TRUTH, exact_functions
from tests.modal.truth import ambient_record, chain


def model_of(correlations, *, rows=20, order=10):
    decomposition = decompose(correlations, block_rows=rows, max_order=order)
    return decomposition, next(order_models(decomposition, [order]))


def by_frequency(decomposition, model):
    return np.argsort(np.abs(continuous(model.eigenvalue, decomposition.sample_rate_hz)))


def unit_shape(decomposition, model, pole, component):
    shape = shapes_of(decomposition, model)[pole]
    return shape / shape[component]


@pytest.fixture(scope="module", name="moved")
def _moved():
    """Exact correlations with a random deviation, which as a sequence is no sum of ten decays."""
    exact = exact_functions(40)
    scale = np.sqrt(exact.variance)
    random = np.random.default_rng(1).standard_normal((2, *exact.values.shape)) * scale[:, None] * scale
    return replace(exact, deviations=random)


STEP = 1e-8


def displaced(correlations, block):
    return replace(correlations, values=correlations.values + STEP * correlations.deviations[block])


def test_poles_move_as_differences_say(moved):
    decomposition, model = model_of(moved)
    order = by_frequency(decomposition, model)
    found = ErrorPropagation(moved, decomposition).poles(model)[order]
    for block in range(2):
        other, beside = model_of(displaced(moved, block))
        apart = continuous(beside.eigenvalue, other.sample_rate_hz)[by_frequency(other, beside)] - TRUTH.poles
        # The second order of a step of 1e-8, amplified by the smallest singular values, is a thousandth of the first.
        np.testing.assert_allclose(apart / STEP, found[:, block], rtol=5e-3, atol=5e-3 * np.abs(found).max())


def test_shapes_move_as_differences_say(moved):
    decomposition, model = model_of(moved)
    order = by_frequency(decomposition, model)
    propagation = ErrorPropagation(moved, decomposition)
    for mode in range(5):
        largest = int(np.argmax(np.abs(TRUTH.shapes[mode])))
        found = propagation.shape(model, order[mode])
        before = unit_shape(decomposition, model, order[mode], largest)
        assert not found[largest].any()
        for block in range(2):
            other, beside = model_of(displaced(moved, block))
            after = unit_shape(other, beside, by_frequency(other, beside)[mode], largest)
            change = (after - before) / STEP
            np.testing.assert_allclose(change, found[:, block], rtol=0, atol=1e-2 * np.abs(found).max())


def test_frequency_and_damping_move_as_the_pole_does():
    pole, step = np.array([-0.3 + 12.0j, -2.0 + 5.0j]), np.array([[1e-7 - 2e-7j], [3e-7 + 1e-7j]])
    moved = pole_deviations(pole, step)
    after = pole + step[:, 0]
    np.testing.assert_allclose(moved.frequency_hz[:, 0], (np.abs(after) - np.abs(pole)) / (2 * np.pi), rtol=1e-5)
    damping = -after.real / np.abs(after) + pole.real / np.abs(pole)
    np.testing.assert_allclose(moved.damping_ratio[:, 0], damping, rtol=1e-5)


@pytest.mark.nightly
def test_the_scatter_of_records_is_what_the_error_bars_say():
    truth = chain()
    results, bars = [], []
    for run in range(30):
        record = ambient_record(truth, cycles=400, rng=np.random.default_rng([1, run]), noise=0.01)
        correlations = correlation_functions(record, lags=60)
        decomposition, model = model_of(correlations, rows=30)
        order = by_frequency(decomposition, model)
        deviations = all_pole_deviations(correlations, decomposition, [model])
        poles = continuous(model.eigenvalue, decomposition.sample_rate_hz)[order]
        shapes = [unit_shape(decomposition, model, order[mode], 0)[-1].real for mode in (3, 4)]
        results.append([*(np.abs(poles) / (2 * np.pi)), *(-poles.real / np.abs(poles)), *shapes])
        bars.append([*deviations.frequency_std_hz[order], *deviations.damping_std[order]])
    scatter = np.std(np.array(results)[:, 1:10], axis=0)[[0, 1, 2, 3, 5, 6, 7, 8]]
    said = np.median(bars, axis=0)[[1, 2, 3, 4, 6, 7, 8, 9]]
    # 30 runs know a sigma to 13 %, and blocks of 8 cycles of the lowest mode aren't quite independent.
    np.testing.assert_allclose(said / scatter, 1.0, atol=0.5)
    assert np.mean(said / scatter) == pytest.approx(1.0, abs=0.25)


def test_more_record_gives_smaller_error_bars():
    bars = []
    for cycles in (500, 2000):
        correlations = correlation_functions(
            ambient_record(chain(), cycles=cycles, rng=np.random.default_rng(4), noise=0.01), lags=60
        )
        decomposition, model = model_of(correlations, rows=30)
        bars.append(np.sort(all_pole_deviations(correlations, decomposition, [model]).frequency_std_hz))
    # Twice as sure with four times the record; each sigma is known to a tenth.
    np.testing.assert_allclose(bars[0] / bars[1], 2.0, rtol=0.5)


def test_an_estimated_sigma_is_widened_as_student_says():
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((20_000, 8))
    z = samples.mean(axis=1) / (samples.std(axis=1, ddof=1) / np.sqrt(8))
    # One sigma of the share of 20 000 is 0.15 %.
    assert np.mean(np.abs(z) < 1.96 * student_factor(8)) == pytest.approx(0.95, abs=0.006)
    assert student_factor(10_000) == pytest.approx(1.0, abs=1e-3)


def test_sigmas_of_real_and_imaginary_parts_are_packed():
    deviations = np.array([[3.0 + 1.0j, 4.0 - 1.0j], [0.0, 0.0]])
    np.testing.assert_allclose(shape_std(deviations), [5.0 + np.sqrt(2) * 1j, 0.0])


def test_functions_without_scatter_give_no_error_bars():
    exact = exact_functions(40)
    alone = replace(exact, deviations=exact.deviations[:1])
    decomposition, model = model_of(alone)
    with pytest.raises(EstimateError, match="at least 2"):
        all_pole_deviations(alone, decomposition, [model])
