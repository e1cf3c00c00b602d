"""Exact response of the linear part inside a step: matrix exponentials of the equations with their inputs."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from scipy.linalg import block_diag, expm

from chladni.models.core.balance import balance
from chladni.models.integrator.hold import Hold
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: Port forces run inside a step as polynomials of degree 2.
POWERS = 3
#: Terms of the exponential's series where the matrix has a norm of at most 1/2: the last one is below 1e-17.
_TERMS = 14


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

    state: Real
    column: Real
    force: Real


def responses(
    a: Real, b: Real, g: Real, hold: Hold, *, step_s: float, kink_at: Real, fractions: Real
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

    Raises
    ------
    ModelError
        When a number doesn't hold the response: the model is too unstable, or too fast, for the step.
    """
    matrix = _augmented(a, b, g, hold, step_s)
    since = np.concatenate([fractions[None], fractions[None] - kink_at[:, None]])
    found = _exponentials(matrix, np.maximum(since.ravel(), 0.0) * step_s).reshape(*since.shape, *matrix.shape)
    # Before its kink a delayed input has none.
    found[1:][since[1:] < 0] = 0.0
    return [_response(found[:, place], a.shape[0], g.shape[1], hold) for place in range(fractions.size)]


def response_slopes(
    a: Real,
    b: Real,
    g: Real,
    hold: Hold,
    changes: Sequence[tuple[Real, Real, Real]],
    *,
    step_s: float,
    kink_at: Real,
) -> list[Response]:
    """Derivatives of the response at the end of a step, while a, b and g move along some directions.

    Parameters
    ----------
    a, b, g, kink_at
        As in `responses`.
    changes
        Directions: what becomes of a, b and g with each unit of a parameter.
    """
    n, m = a.shape[0], hold.columns
    matrix = _augmented(a, b, g, hold, step_s)
    first = n + m + hold.straight.size
    ways = np.zeros((n, len(changes), matrix.shape[0]))
    for place, (by_a, by_b, by_g) in enumerate(changes):
        ways[:, place, :n], ways[:, place, n : n + m] = by_a, by_b
        ways[:, place, first : first + g.shape[1]] = by_g
    since = np.concatenate([[1.0], 1.0 - kink_at]) * step_s
    found = np.zeros((since.size, len(changes), *matrix.shape))
    for place, time_s in enumerate(since):
        found[place, :, :n] = _exponential_slopes(matrix * time_s, ways * time_s)
    return [_response(found[:, place], n, g.shape[1], hold) for place in range(len(changes))]


def _exponential_slopes(matrix: Real, ways: Real) -> Real:
    """``[way, row, column]``: derivatives of the exponential along ``ways [row, way, column]``.

    The series of the exponential and its derivative, scaled and squared (Al-Mohy and Higham 2009, section 4). Only
    the first rows may change: with the equations of the inputs below them held, so does the exponential.
    """
    rows, count, size = ways.shape
    balanced, scale = balance(matrix)
    squarings = max(0, ceil(log2(float(np.linalg.norm(balanced, 1)) + 1e-300)) + 1)
    matrix = balanced / 2.0**squarings
    ways = ways * (scale / scale[:rows, None, None]) / 2.0**squarings
    term, slope = np.eye(size), np.zeros((rows, count * size))
    total, found = term, slope
    for power in range(1, _TERMS + 1):
        slope = (
            (ways.reshape(rows * count, size) @ term).reshape(rows, count * size) + matrix[:rows, :rows] @ slope
        ) / power
        term = matrix @ term / power
        total, found = total + term, found + slope
    for _ in range(squarings):
        # E E, of which each factor moves.
        found = (found.reshape(rows * count, size) @ total).reshape(rows, count * size) + total[:rows, :rows] @ found
        total = total @ total
    slopes = found.reshape(ways.shape) * (scale[:rows, None, None] / scale)
    return np.asarray(slopes.transpose(1, 0, 2), dtype=np.float64)


def _augmented(a: Real, b: Real, g: Real, hold: Hold, step_s: float) -> Real:
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


def _exponentials(matrix: Real, times_s: Real) -> Real:
    # Balanced by powers of two (exact): stiffness over mass and one stand side by side in A, which would cost digits.
    balanced, scale = balance(matrix)
    distinct, places = np.unique(times_s, return_inverse=True)
    with np.errstate(over="ignore", invalid="ignore"):
        found = expm(balanced * distinct[:, None, None]) * (scale[:, None] / scale[None, :])
    if not np.isfinite(found).all():
        raise ModelError(
            f"the model leaves all numbers within a step of {float(distinct[-1]):.3g} s: it is unstable and far "
            "faster than the rate, or one of its numbers is wrong; check their units, or ask for a higher rate"
        )
    return np.asarray(found[places], dtype=np.float64)


def _response(found: Real, n: int, p: int, hold: Hold) -> Response:
    """From the exponentials at the instant itself and at its distance from each kink, ``[1 + kink, row, row]``."""
    m, end = hold.columns, n + hold.columns + hold.straight.size
    rises = n + m + np.searchsorted(hold.straight, hold.kinked)
    after = 1 + np.arange(hold.kinked.size)
    kinks = found[after, :, rises].T
    jumps = found[after, :, n + hold.kinked].T
    whole = np.hstack([found[0, :, :end], kinks, jumps])
    forces = found[0, :n, end:].reshape(n, POWERS, p)
    return Response(state=whole[:n], column=whole[n : n + m], force=np.moveaxis(forces, 1, 0))
