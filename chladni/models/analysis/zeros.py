"""Zeros of the way from one input to one output."""

import numpy as np

from chladni.models.analysis.linear_path import LinearPath, poles_of
from chladni.signals.arrays import Complex

# A Markov parameter this much smaller than the sum of its terms' sizes is rounding.
ROUNDING = 1e-11


def zeros(path: LinearPath) -> Complex:
    """Find where the transfer function of a path to one output is zero.

    With r the relative degree (the first Markov parameter ``c A^(r-1) b`` that isn't zero), zeros are the eigenvalues
    of ``A - b c A^r / (c A^(r-1) b)`` on the states that ``c, c A, ... c A^(r-1)`` don't see (Isidori 1995, section
    4.1: zero dynamics). Unlike the eigenvalues of the system's pencil, none lies at infinity, where rounding would
    bring it back.

    Returns
    -------
    ``[zero]`` in rad/s, those of slowest decay first; empty for an output that the input doesn't reach.
    """
    degree, first = relative_degree(path)
    if degree is None:
        return np.empty(0, np.complex128)
    if degree == 0:
        return poles_of(path.a - np.outer(path.b, path.c[0]) / first)
    rows = [path.c[0]]
    for _ in range(degree):
        rows.append(rows[-1] @ path.a)
    # Each row alone counts, whatever its size: lengths grow with the powers of A.
    seen = np.array([row / np.linalg.norm(row) for row in rows[:-1]])
    # The last right singular vectors span what no row sees.
    basis = np.linalg.svd(seen)[2][degree:].T
    return poles_of(basis.T @ (path.a - np.outer(path.b, rows[-1]) / first) @ basis)


def relative_degree(path: LinearPath) -> tuple[int | None, float]:
    """Count the poles in excess of zeros, and give the first Markov parameter that isn't zero.

    None, when all are zero: the output doesn't answer.
    """
    if path.d[0]:
        return 0, float(path.d[0])
    row, size = path.c[0], np.abs(path.c[0])
    for degree in range(1, path.b.size + 1):
        markov = float(row @ path.b)
        if abs(markov) > ROUNDING * float(size @ np.abs(path.b)):
            return degree, markov
        row, size = row @ path.a, size @ np.abs(path.a)
    return None, 0.0
