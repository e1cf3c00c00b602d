import numpy as np
import pytest

from chladni.gap.comparison.linear_approximation import best_linear_approximation, moving_inputs, period_spectra
from chladni.gap.comparison.periodicity import with_period
from chladni.signals.errors import EstimateError
from tests.gap.comparison import made_measurements as made

PERIOD, LINES = 1000, np.arange(7, 200, 3)


def true_response(cycles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    impulse = np.zeros(40000)
    impulse[0] = 1.0
    spectrum = np.fft.rfft(made.machine(impulse, weights), axis=1)
    return np.asarray(spectrum[:, np.rint(cycles * 40000).astype(int)])


def test_periods_give_the_response_on_excited_lines_with_its_scatter() -> None:
    rng = np.random.default_rng(1)
    force = np.tile(made.multisine(rng, PERIOD, LINES), 20)
    y = made.machine(force, made.weights(2, 1))
    noise = 0.02 * y.std(axis=1, keepdims=True)
    run = with_period(made.measurement(force, y + noise * rng.standard_normal(y.shape)))
    found = best_linear_approximation(run)
    np.testing.assert_array_equal(np.flatnonzero(found.excited), LINES)
    expected = true_response(LINES / PERIOD, made.weights(2, 1))
    off = np.abs(found.values[:, 0, LINES] - expected) / found.std[:, 0, LINES]
    # |error|^2 / (2 std^2) is exponential with mean 1, its std from few periods; over 130 numbers.
    assert np.mean(off**2) / 2 == pytest.approx(1.0, abs=0.5)


def test_without_periods_it_is_welchs() -> None:
    rng = np.random.default_rng(2)
    force = rng.standard_normal(40000)
    run = made.measurement(force, made.machine(force, made.weights(2, 1)))
    assert period_spectra(run) is None
    found = best_linear_approximation(run)
    inside = (found.frequency_hz > 30) & (found.frequency_hz < 200)
    expected = true_response(found.frequency_hz[inside] / made.RATE_HZ, made.weights(2, 1))
    # Off the resonances (10, 27, 46 Hz) leakage of Hann segments is what's left.
    far = (found.frequency_hz[inside] > 60) | (np.abs(found.frequency_hz[inside] - 36) < 4)
    np.testing.assert_allclose(np.abs(found.values[:, 0, inside][:, far]), np.abs(expected[:, far]), rtol=0.05)


def test_inputs_that_stand_still_are_left_out() -> None:
    rng = np.random.default_rng(3)
    force = np.array([np.zeros(5000), rng.standard_normal(5000)])
    run = made.measurement(force, made.machine(force[1], made.weights(1, 1)))
    assert moving_inputs(run) == ["force2"]
    assert [channel.name for channel in best_linear_approximation(run).references] == ["force2"]
    still = made.measurement(np.zeros(500), rng.standard_normal(500))
    with pytest.raises(EstimateError, match="no input moves"):
        best_linear_approximation(still)
