"""Exponential of a small matrix."""

from math import ceil, log2

import numpy as np

from chladni.signals.arrays import Real

# Coefficients of the diagonal Padé approximant of order 13, and the norm up to which it is exact to rounding
# (Higham 2005, table 2.3 and equation 2.7).
_PADE = (
    64764752532480000.0, 32382376266240000.0, 7771770303897600.0, 1187353796428800.0, 129060195264000.0,
    10559470521600.0, 670442572800.0, 33522128640.0, 1323241920.0, 40840800.0, 960960.0, 16380.0, 182.0, 1.0,
)  # fmt: skip
_REACH = 5.371920351148152
# Norm up to which the series is short, and what is left of it when it ends.
SHORT, NEGLIGIBLE = 1.0, 1e-18


def exponential(matrix: Real) -> Real:
    """Give e^matrix by scaling and squaring (Higham 2005, algorithm 2.3).

    Written out in NumPy's products: `scipy.linalg.expm` hands even matrices of four rows to waiting BLAS threads, and
    on a busy computer then takes milliseconds in place of 20 microseconds, of which a page has 20 for everything.

    Parameters
    ----------
    matrix
        ``[row, row]``, finite.

    Examples
    --------
    >>> exponential(np.array([[0.0, 1.0], [0.0, 0.0]]))
    array([[1., 1.],
           [0., 1.]])
    """
    norm = float(np.abs(matrix).sum(axis=0).max()) if matrix.size else 0.0
    halvings = max(ceil(log2(norm / _REACH)), 0) if norm > 0 else 0
    a1 = matrix / 2.0**halvings
    a2 = a1 @ a1
    a4 = a2 @ a2
    a6 = a4 @ a2
    one, b = np.eye(len(matrix)), _PADE
    high = a6 @ (b[13] * a6 + b[11] * a4 + b[9] * a2)
    odd = a1 @ (high + b[7] * a6 + b[5] * a4 + b[3] * a2 + b[1] * one)
    even = a6 @ (b[12] * a6 + b[10] * a4 + b[8] * a2) + b[6] * a6 + b[4] * a4 + b[2] * a2 + b[0] * one
    result = np.linalg.solve(even - odd, even + odd)
    for _ in range(halvings):
        result = result @ result
    return np.asarray(result)


def moved(matrix: Real, state: Real) -> Real:
    """Give e^matrix times a state; for a small matrix by its series, which takes a fraction of the time.

    Examples
    --------
    >>> moved(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 2.0]))
    array([2., 2.])
    """
    norm = float(np.abs(matrix).sum(axis=0).max()) if matrix.size else 0.0
    if norm > SHORT:
        return exponential(matrix) @ state
    total, term, left, power = state, state, 1.0, 0
    # The rest of the series is at most twice the first term left out.
    while left > NEGLIGIBLE:
        power += 1
        left *= norm / power
        term = matrix @ term / power
        total = total + term
    return np.asarray(total)
