"""Derivatives of one step along its equations, against SciPy's derivative of the exponential and differences."""

import numpy as np
import pytest
from scipy.linalg import expm_frechet

from chladni.models.integrator.exponential import response_slopes, responses
from chladni.models.integrator.hold import Hold

STEP_S = 2e-3


def hold_of(kinks=()):
    """Three straight columns, some of which are late by a fraction of a step."""
    return Hold(
        source=np.arange(3), rate=np.full(3, -1), straight=np.arange(3),
        kinked=np.arange(len(kinks)), kink_at=np.array(kinks, dtype=np.float64),
    )  # fmt: skip


def drawn(seed, stiffness):
    """Bodies on springs: rates of very different sizes beside one another, as displacements and velocities have."""
    rng = np.random.default_rng(seed)
    spring = rng.standard_normal((3, 3))
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness * spring @ spring.T, -20.0 * np.eye(3)]])
    b, g = (np.vstack([np.zeros((3, count)), rng.standard_normal((3, count))]) for count in (3, 2))
    ways = [tuple(one * rng.standard_normal(one.shape) for one in (a, b, g)) for _ in range(4)]
    return a, b, g, ways


def response(a, b, g, hold):
    return responses(a, b, g, hold, step_s=STEP_S, kink_at=hold.kink_at, fractions=np.ones(1))[0]


@pytest.mark.parametrize("stiffness", [0.0, 1e3, 1e6, 1e8])
def test_states_move_as_the_derivative_of_the_exponential(stiffness):
    a, b, g, ways = drawn(1, stiffness)
    hold = hold_of()
    found = response_slopes(a, b, g, hold, ways, step_s=STEP_S, kink_at=hold.kink_at)
    for way, one in zip(ways, found, strict=True):
        wanted = expm_frechet(a * STEP_S, way[0] * STEP_S, compute_expm=False)
        # In units in which displacements and velocities are of one size.
        scale = np.repeat([max(stiffness, 1.0) ** 0.5, 1.0], 3)
        error = np.abs((one.state[:, :6] - wanted) * scale[:, None] / scale)
        # SciPy squares the stiffest 18 times, each of which may double what was rounded.
        assert error.max() < 2e-8 * np.abs(wanted * scale[:, None] / scale).max() + 1e-15


@pytest.mark.parametrize("kinks", [(), (0.3,), (0.25, 0.9)])
def test_all_of_a_step_moves_as_differences_say(kinks):
    a, b, g, ways = drawn(2, 1e5)
    hold = hold_of(kinks)
    found = response_slopes(a, b, g, hold, ways, step_s=STEP_S, kink_at=hold.kink_at)
    size = 1e-4
    for (by_a, by_b, by_g), one in zip(ways, found, strict=True):
        ahead, behind = (
            response(a + sign * size * by_a, b + sign * size * by_b, g + sign * size * by_g, hold) for sign in (1, -1)
        )
        for name in ("state", "force", "column"):
            wanted = (getattr(ahead, name) - getattr(behind, name)) / (2 * size)
            # Central differences: the square of the size, and rounding over it.
            largest = np.abs(getattr(ahead, name)).max()
            assert np.abs(getattr(one, name) - wanted).max() <= 1e-6 * np.abs(wanted).max() + 1e-11 * largest


def test_no_changes_have_no_slopes():
    a, b, g, _ = drawn(3, 1e3)
    hold = hold_of()
    assert response_slopes(a, b, g, hold, [], step_s=STEP_S, kink_at=hold.kink_at) == []
    (still,) = response_slopes(
        a, b, g, hold, [(0 * a, 0 * b, 0 * g)], step_s=STEP_S, kink_at=hold.kink_at
    )  # fmt: skip
    assert not np.any(still.state)
