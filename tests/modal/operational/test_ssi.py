"""Subspace models against correlations in closed form, and each order against a model of that order alone."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov

from chladni.modal.operational.correlation import CorrelationFunctions, correlation_functions
from chladni.modal.operational.ssi import block_hankel, decompose, order_models, shapes_of, subspace_poles
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from tests.modal.truth import ambient_record, chain, mac

TRUTH = chain(first_hz=2.0)
RATE_HZ = 8 * TRUTH.frequency_hz.max()


def exact_functions(lags, *, rate_hz=RATE_HZ, references=range(5), noise=0.0, scales=1.0):
    """Correlation functions of the chain's displacements under white forces, from the Lyapunov equation."""
    phi, omega = TRUTH.shapes.T, 2 * np.pi * TRUTH.frequency_hz
    damper = np.diag(2 * TRUTH.damping_ratio * omega)
    state = np.block([[np.zeros((5, 5)), np.eye(5)], [-np.diag(omega**2), -damper]])
    force = np.zeros((10, 10))
    force[5:, 5:] = np.eye(5)
    # Van Loan: transition matrix and covariance of the white force's effect over one sample.
    block = expm(np.block([[-state, force], [np.zeros((10, 10)), state.T]]) / rate_hz)
    step = block[10:, 10:].T
    covariance = solve_discrete_lyapunov(step, step @ block[:10, 10:])
    output = np.hstack([phi, np.zeros((5, 5))]) * np.broadcast_to(scales, 5)[:, None]
    rows = np.array(references)
    values = np.stack(
        [output @ np.linalg.matrix_power(step, lag) @ covariance @ output[rows].T for lag in range(lags + 1)]
    )
    variance = np.diag(output @ covariance @ output.T) * (1 + noise)
    values[0] += noise * np.diag(variance)[:, rows]
    return CorrelationFunctions(
        values=values,
        deviations=np.zeros((2, *values.shape)),
        variance=variance,
        sample_rate_hz=rate_hz,
        channels=tuple(Channel(name=f"/m{row}") for row in range(5)),
        references=rows,
        samples=10_000,
    )


@pytest.mark.parametrize("references", [range(5), (0, 3), (4,)])
def test_exact_correlations_give_exact_modes(references):
    table = subspace_poles(exact_functions(40, references=references), block_rows=20, orders=[10])
    order = np.argsort(table.frequency_hz)
    # The Hankel matrix has a condition of some 1e5 here, which costs as many digits of 1e-16.
    np.testing.assert_allclose(table.pole[order], TRUTH.poles, rtol=1e-8)
    for found, true in zip(table.vector[order], TRUTH.shapes, strict=True):
        assert mac(found, true) == pytest.approx(1.0, abs=1e-12)
        assert np.linalg.norm(found) == pytest.approx(1.0)


def test_noise_of_the_sensors_does_no_harm_to_exact_correlations():
    table = subspace_poles(exact_functions(40, noise=1.0), block_rows=20, orders=[10])
    np.testing.assert_allclose(np.sort_complex(table.pole), np.sort_complex(TRUTH.poles), rtol=1e-8)


def test_channels_of_other_units_give_shapes_in_their_units():
    scales = np.array([1.0, 1e3, 1e-3, 57.3, 1.0])
    table = subspace_poles(exact_functions(40, scales=scales), block_rows=20, orders=[10])
    order = np.argsort(table.frequency_hz)
    np.testing.assert_allclose(table.pole[order], TRUTH.poles, rtol=1e-8)
    for found, true in zip(table.vector[order], TRUTH.shapes * scales, strict=True):
        assert mac(found, true) == pytest.approx(1.0, abs=1e-10)


def test_orders_beyond_the_rank_say_nothing():
    table = subspace_poles(exact_functions(40), block_rows=20, orders=range(2, 31, 2))
    assert table.orders.tolist() == list(range(2, 31, 2))
    # Rounding leaves a few singular values above the floor; what they give is no fifth digit of anything.
    assert np.count_nonzero(table.order == 10) == 5
    assert table.order.max() < 30
    assert np.all(table.pole.real < 0)
    assert np.all(table.pole.imag > 0)


def test_all_orders_from_one_factorisation_are_each_order_on_its_own():
    record = ambient_record(TRUTH, cycles=300, rng=np.random.default_rng(0), noise=0.05)
    correlations = correlation_functions(record, lags=30)
    decomposition = decompose(correlations, block_rows=15, max_order=40)
    seen = 0
    for model in order_models(decomposition, range(1, 41)):
        whole = decomposition.left[:, : model.order]
        alone = np.linalg.eigvals(np.linalg.pinv(whole[:-5]) @ whole[5:])
        alone = alone[(alone.imag > 0) & (np.abs(alone) < 1)]
        np.testing.assert_allclose(np.sort_complex(model.eigenvalue), np.sort_complex(alone), rtol=1e-8)
        seen += alone.size
    table = subspace_poles(correlations, block_rows=15, orders=range(1, 41))
    assert table.order.size == seen > 100
    assert np.all(np.diff(table.order) >= 0)
    assert np.all(table.damping_ratio > 0)


def test_the_hankel_matrix_begins_at_lag_1():
    functions = np.arange(8.0)[:, None, None] * np.ones((1, 2, 1))
    assert block_hankel(functions, 3)[::2].tolist() == [[1, 2, 3], [2, 3, 4], [3, 4, 5]]
    assert block_hankel(functions, 3).shape == (6, 3)


def test_orders_are_chosen_as_the_matrix_allows():
    table = subspace_poles(exact_functions(11, references=(0,)), block_rows=6)
    assert table.orders.tolist() == [2, 4, 6]
    assert shapes_of(decompose(exact_functions(11), block_rows=6), next(models())).shape[1] == 5


def models():
    return order_models(decompose(exact_functions(11), block_rows=6), [10])


def test_what_the_correlations_do_not_hold_is_told():
    short = exact_functions(10)
    with pytest.raises(EstimateError, match="need correlations up to lag 39, but they end at lag 10"):
        decompose(short, block_rows=20)
    with pytest.raises(SetupError, match="max_order 99 must be from 1 to 20"):
        decompose(short, block_rows=5, max_order=99)
    with pytest.raises(SetupError, match="block_rows 1"):
        decompose(short, block_rows=1)
    still = CorrelationFunctions(
        values=short.values,
        deviations=short.deviations,
        variance=np.array([1.0, 0.0, 1.0, 1.0, 1.0]),
        sample_rate_hz=short.sample_rate_hz,
        channels=short.channels,
        references=short.references,
        samples=short.samples,
    )
    with pytest.raises(EstimateError, match="/m1 doesn't vary"):
        decompose(still, block_rows=5)
