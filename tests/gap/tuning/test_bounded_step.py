import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from chladni.gap.tuning.bounded_step import bounded_step
from chladni.signals.errors import EstimateError


def problem(seed, size=5):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size + 3, size)) * 10.0 ** rng.uniform(-3, 3, size)
    return root.T @ root, root.T @ rng.standard_normal(size + 3)


def test_without_bounds_it_is_newtons_step():
    curvature, gradient = problem(0)
    wide = np.full(5, 1e9)
    found = bounded_step(curvature, gradient, -wide, wide, damping=0.0)
    size = np.sqrt(np.diag(curvature))
    np.testing.assert_allclose(found * size, -np.linalg.solve(curvature, gradient) * size, rtol=1e-6)


@given(st.integers(0, 10_000))
def test_inside_bounds_it_is_the_best(seed):
    curvature, gradient = problem(seed)
    size = np.sqrt(np.diag(curvature))
    low, high = -0.3 / size, 0.2 / size
    found = bounded_step(curvature, gradient, low, high, damping=0.0)
    assert np.all(found >= low)
    assert np.all(found <= high)
    scaled, slope = curvature / np.multiply.outer(size, size), gradient / size
    best = minimize(
        lambda p: slope @ p + 0.5 * p @ scaled @ p, np.zeros(5), jac=lambda p: slope + scaled @ p,
        bounds=[(-0.3, 0.2)] * 5, method="L-BFGS-B", options={"ftol": 1e-14, "gtol": 1e-10, "maxiter": 10_000},
    )  # fmt: skip
    p = found * size
    # The solver's own tolerance, on a problem whose numbers are near 1.
    assert slope @ p + 0.5 * p @ scaled @ p <= best.fun + 1e-7 * max(1.0, abs(best.fun))


def test_damping_shortens():
    curvature, gradient = problem(1)
    wide = np.full(5, 1e9)
    size = np.sqrt(np.diag(curvature))
    steps = [bounded_step(curvature, gradient, -wide, wide, damping=d) * size for d in (0.0, 1.0, 100.0)]
    assert np.linalg.norm(steps[0]) > np.linalg.norm(steps[1]) > np.linalg.norm(steps[2])
    # Strongly damped it's steepest descent on scaled unknowns.
    direction = -gradient / size
    assert steps[2] @ direction > 0.99 * np.linalg.norm(steps[2]) * np.linalg.norm(direction)


def test_what_does_nothing_stays():
    curvature, gradient = np.diag([2.0, 0.0]), np.array([-2.0, 0.0])
    np.testing.assert_allclose(
        bounded_step(curvature, gradient, -np.ones(2) * 9, np.ones(2) * 9, damping=0.0), [1, 0]
    )
    np.testing.assert_array_equal(
        bounded_step(np.zeros((1, 1)), np.zeros(1), -np.ones(1), np.ones(1), damping=0.0), [0]
    )


def test_numbers_that_are_none_are_refused():
    with pytest.raises(EstimateError, match="not finite"):
        bounded_step(np.array([[np.nan]]), np.zeros(1), -np.ones(1), np.ones(1), damping=0.0)
