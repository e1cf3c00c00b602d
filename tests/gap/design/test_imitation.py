import numpy as np
import pytest
from scipy.optimize import least_squares

from chladni.gap.design.imitation import Part, imitated, sums_of
from chladni.gap.design.rival import Prediction
from tests.gap.made_log import white_floor


class Free:
    """What a refit needs of a candidate: bounds and what is believed."""

    def __init__(self, count, limit=100.0, sure=0.0):
        self.unknowns = count
        self.low, self.high = np.full(count, -limit), np.full(count, limit)
        self.believed, self.sure = np.zeros(count), np.full(count, sure)


def made(unknowns=3, states=2, outputs=2, samples=400, seed=0):
    rng = np.random.default_rng(seed)
    own, starts = rng.standard_normal((unknowns, outputs, samples)), rng.standard_normal((states, outputs, samples))
    own -= own.mean(axis=-1, keepdims=True)
    starts -= starts.mean(axis=-1, keepdims=True)
    return Prediction(np.zeros((outputs, samples)), own, starts, np.zeros(unknowns)), rng


def part(wanted, prediction, noise, windows=None, scale=1.3):
    windows = windows or [(0, wanted.shape[-1])]
    return Part(sums_of(wanted, prediction, noise, windows), np.full(len(wanted), scale), wanted.shape[-1])


def test_what_lies_along_the_slopes_is_imitated_to_nothing():
    prediction, rng = made()
    step, start, offset = rng.standard_normal(3), rng.standard_normal(2), np.array([[3.0], [-2.0]])
    wanted = np.tensordot(step, prediction.own, 1) + np.tensordot(start, prediction.starts, 1) + offset
    at, (left,) = imitated(Free(3), np.zeros(3), [part(wanted, prediction, white_floor([0.1, 0.2]))])
    # A ridge of 1e-9 keeps the equations of the initial states regular.
    np.testing.assert_allclose(at, step, rtol=1e-7)
    assert np.all(left < 1e-10)


def test_what_no_slope_has_stays_in_units_of_the_noise():
    prediction, rng = made(samples=4000)
    other = rng.standard_normal((2, 4000))
    columns = np.concatenate([prediction.own, prediction.starts]).reshape(5, -1)
    flat = other.ravel() - columns.T @ np.linalg.lstsq(columns.T, other.ravel(), rcond=None)[0]
    other = flat.reshape(2, 4000)
    _, (left,) = imitated(Free(3), np.zeros(3), [part(other, prediction, white_floor([0.5, 0.5]))])
    np.testing.assert_allclose(
        left, np.mean((other - other.mean(axis=1, keepdims=True)) ** 2, axis=1) / 0.25, rtol=0.01
    )


def test_the_step_makes_the_likelihood_largest():
    # Oracle: a general minimiser on the same likelihood, written out.
    prediction, rng = made()
    wanted = rng.standard_normal((2, 400)) * np.array([[3.0], [0.5]])
    wanted -= wanted.mean(axis=1, keepdims=True)
    at, (left,) = imitated(Free(3, sure=1.0), np.zeros(3), [part(wanted, prediction, white_floor([1.0, 1.0]))])

    def power(x):
        rest = wanted - np.tensordot(x[:3], prediction.own, 1) - np.tensordot(x[3:], prediction.starts, 1)
        return np.mean(rest**2, axis=1)

    def roots(x):
        return np.concatenate([np.sqrt(400 * np.log1p(power(x) / 1.3)), x[:3]])

    best = least_squares(roots, np.zeros(5), xtol=1e-12, ftol=1e-12, gtol=1e-12).x
    # Six rounds of reweighing.
    np.testing.assert_allclose(at, best[:3], atol=2e-4)
    np.testing.assert_allclose(left, power(best), rtol=1e-3)


def test_bounds_hold():
    prediction, _ = made()
    wanted = 5.0 * prediction.own[0]
    at, (left,) = imitated(Free(3, limit=1.0), np.zeros(3), [part(wanted, prediction, white_floor([1.0, 1.0]))])
    assert at[0] == pytest.approx(1.0)
    assert np.all(left > 10.0)


def test_windows_have_initial_states_of_their_own():
    prediction, _ = made(unknowns=1)
    half = np.arange(400) < 200
    wanted = np.where(half, prediction.starts[0], -2 * prediction.starts[0])
    floor = white_floor([1.0, 1.0])
    wanted[:, half] -= wanted[:, half].mean(axis=1, keepdims=True)
    _, (whole,) = imitated(Free(1), np.zeros(1), [part(wanted, prediction, floor)])
    _, (apart,) = imitated(Free(1), np.zeros(1), [part(wanted, prediction, floor, [(0, 200), (200, 400)])])
    assert np.all(apart < 0.05 * whole)


def test_two_records_pin_what_each_alone_leaves_free():
    # A stiffness that imitates a hardening spring at one level doesn't at twice the level.
    prediction, _ = made(unknowns=1, states=1)
    floor = white_floor([0.1, 0.1])
    once, twice = 1.0 * prediction.own[0], 4.0 * prediction.own[0]
    first, second = part(once, prediction, floor), part(twice, prediction, floor)
    for one in (first, second):
        assert np.all(imitated(Free(1), np.zeros(1), [one])[1][0] < 1e-10)
    _, left = imitated(Free(1), np.zeros(1), [first, second])
    assert max(one.max() for one in left) > 50.0


def test_states_that_print_nothing_harm_nothing():
    prediction, rng = made()
    blank = Prediction(prediction.outputs, prediction.own, np.zeros((2, 2, 400)), prediction.at)
    wanted = np.tensordot(rng.standard_normal(3), prediction.own, 1)
    _, (left,) = imitated(Free(3), np.zeros(3), [part(wanted, blank, white_floor([1.0, 1.0]))])
    assert np.all(left < 1e-10)
