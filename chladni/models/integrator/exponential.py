"""Exact response of the linear part inside a step: matrix exponentials of the equations with their inputs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from chladni.models.core.balance import balance
from chladni.models.integrator.hold import Hold

Matrix = NDArray[np.float64]
#: Port forces run inside a step as polynomials of degree 2.
POWERS = 3


@dataclass(frozen=True, slots=True)
class Response:
    """State and columns at one instant of a step, as linear functions of what the step starts from.

    Attributes
    ----------
    state
        ``[state, state + width]``: of the state at the start and the step's row of inputs.
    column
        ``[column, state + width]``: u at that instant, likewise.
    force
        ``[power, state, port]``: of ``q0, q1, q2`` where the forces are ``q0 + q1 sigma + q2 sigma^2``, sigma from 0
        at the start of the step to 1 at its end.
    """

    state: Matrix
    column: Matrix
    force: Matrix


def responses(
    a: Matrix, b: Matrix, g: Matrix, hold: Hold, *, step_s: float, kink_at: Matrix, fractions: Matrix
) -> list[Response]:
    """Responses at some fractions of a step.

    Exponential of the equations augmented by those of their inputs (Van Loan 1978), so that a singular A is as good
    as any other.

    Parameters
    ----------
    a, b, g
        ``[state, state]``, ``[state, internal column]``, ``[state, port]``.
    kink_at
        ``[kink]`` where the kinks fall, as a fraction of this step.
    fractions
        ``[instant]`` from 0 to 1.
    """
    matrix = _augmented(a, b, g, hold, step_s)
    since = np.concatenate([fractions[None], fractions[None] - kink_at[:, None]])
    found = _exponentials(matrix, np.maximum(since.ravel(), 0.0) * step_s).reshape(*since.shape, *matrix.shape)
    # Before its kink a delayed input has none.
    found[1:][since[1:] < 0] = 0.0
    return [_response(found[:, place], a.shape[0], g.shape[1], hold) for place in range(fractions.size)]


def _augmented(a: Matrix, b: Matrix, g: Matrix, hold: Hold, step_s: float) -> Matrix:
    """Rates of ``[x, u, rise, f, f', f'']``."""
    n, p = g.shape
    inputs = hold.generator(step_s)
    matrix = block_diag(a, inputs, np.zeros((POWERS * p, POWERS * p)))
    matrix[:n, n : n + hold.columns] = b
    first = n + inputs.shape[0]
    matrix[:n, first : first + p] = g
    # With f = q0 + q1 sigma + q2 sigma^2:  f' = (q1 + 2 q2 sigma)/h,  its own rate is 2 q2/h.
    for power in range(1, POWERS):
        rows = np.arange(first + (power - 1) * p, first + power * p)
        matrix[rows, rows + p] = power / step_s
    return np.asarray(matrix, dtype=np.float64)


def _exponentials(matrix: Matrix, times_s: Matrix) -> Matrix:
    # Balanced by powers of two (exact): stiffness over mass and one stand side by side in A, which would cost digits.
    balanced, scale = balance(matrix)
    distinct, places = np.unique(times_s, return_inverse=True)
    found = expm(balanced * distinct[:, None, None]) * (scale[:, None] / scale[None, :])
    return np.asarray(found[places], dtype=np.float64)


def _response(found: Matrix, n: int, p: int, hold: Hold) -> Response:
    """From the exponentials at the instant itself and at its distance from each kink, ``[1 + kink, row, row]``."""
    m, end = hold.columns, n + hold.columns + hold.straight.size
    rises = n + m + np.searchsorted(hold.straight, hold.kinked)
    after = 1 + np.arange(hold.kinked.size)
    kinks = found[after, :, rises].T
    jumps = found[after, :, n + hold.kinked].T
    whole = np.hstack([found[0, :, :end], kinks, jumps])
    forces = found[0, :n, end:].reshape(n, POWERS, p)
    return Response(state=whole[:n], column=whole[n : n + m], force=np.moveaxis(forces, 1, 0))
