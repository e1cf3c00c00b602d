from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.plant.linear_run import decay
from chladni.gap.tuning.residual import Whitening, likelihood_cost, weights
from chladni.models.integrator.integrator import Integrator
from chladni.signals.errors import EstimateError
from tests.gap.made_log import RATE_HZ, three_bodies, white_floor

SAMPLES = 4000


def coloured():
    floor = white_floor([2.0, 3.0])
    return replace(
        floor, whitening=np.array([[1.0, -0.9, 0.2], [1.0, 0.0, 0.0]]), innovation_rms=np.array([0.8, 3.0])
    )


def test_coloured_noise_becomes_white_of_unit_variance():
    white = np.random.default_rng(0).standard_normal((2, SAMPLES))
    noise = np.array([lfilter([0.8], [1.0, -0.9, 0.2], white[0]), 3.0 * white[1]])
    found = Whitening(coloured(), np.ones(SAMPLES, dtype=bool), offsets=False).residual(noise)
    np.testing.assert_allclose(found.white, white, atol=1e-12)
    np.testing.assert_allclose(
        Whitening(coloured(), np.ones(SAMPLES, bool), offsets=False).whitened(noise), white, atol=1e-12
    )
    np.testing.assert_allclose(coloured().whitened(noise), white, atol=1e-12)


def test_an_offset_is_found_on_the_training_samples():
    training = np.arange(SAMPLES) % 3 == 0
    noise = np.random.default_rng(1).standard_normal((2, SAMPLES)) * [[2.0], [3.0]]
    shift = np.array([5.0, -7.0])
    found = Whitening(white_floor([2.0, 3.0]), training, offsets=True).residual(noise + shift[:, None])
    np.testing.assert_allclose(found.offsets, noise[:, training].mean(axis=1) + shift, rtol=1e-12)
    assert found.white.shape == (2, training.sum())
    without = Whitening(white_floor([2.0, 3.0]), training, offsets=False).residual(noise + 5.0)
    assert not without.offsets.any()
    assert without.power[0] > 5


def test_cost_grows_with_the_power_and_is_smooth_where_noise_ends():
    powers = np.array([0.5, 1.0 - 1e-6, 1.0 + 1e-6, 4.0])
    costs = [likelihood_cost(np.array([power]), 100) for power in powers]
    assert costs == sorted(costs)
    assert costs[0] == pytest.approx(25.0)
    assert costs[3] == pytest.approx(50 * (1 + np.log(4.0)))
    # The slope over N v/2 is the weight.
    for power in (0.5, 2.0, 9.0):
        slope = (likelihood_cost(np.array([power + 1e-6]), 2) - likelihood_cost(np.array([power - 1e-6]), 2)) / 2e-6
        assert weights(np.array([power]))[0] == pytest.approx(slope, rel=1e-6)


def test_nothing_to_fit_on_is_refused():
    with pytest.raises(EstimateError, match="no sample is left"):
        Whitening(white_floor([1.0]), np.zeros(10, dtype=bool), offsets=True)


@pytest.mark.parametrize("count", [1, 2, 257])
def test_decay_is_the_response_to_a_start(count):
    compiled = three_bodies().compile()
    found = decay(compiled, np.array([2, 0]), RATE_HZ, count)
    assert found.shape == (6, 2, count)
    for state in range(6):
        initial = np.eye(6)[state]
        run = Integrator(compiled, RATE_HZ).run(np.zeros((1, count)), initial=initial)
        np.testing.assert_allclose(found[state], run.outputs[[2, 0]], rtol=0, atol=1e-10 * np.abs(run.outputs).max())
