"""Matrix algebra that keeps zeros zero: rounding must not link signals that nothing links."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ModelError

# What is left of numbers that cancel, relative to them.
_ROUNDING = 1e-13


def total(*terms: Real | tuple[Real, Real]) -> Real:
    """Sum of matrices and of products; what only rounding leaves of numbers that cancel is zero."""
    parts = [term if isinstance(term, tuple) else (None, term) for term in terms]
    whole = sum(right if left is None else left @ right for left, right in parts)
    size = sum(np.abs(right) if left is None else np.abs(left) @ np.abs(right) for left, right in parts)
    return np.asarray(np.where(np.abs(whole) > _ROUNDING * size, whole, 0.0))


def structural_inverse(matrix: Real) -> Real:
    """Inverse whose entries are exactly zero wherever the pattern of `matrix` makes them so.

    With rows in an order that puts an entry on each place of the diagonal, entry [i, j] of the inverse can only
    differ from zero where a chain of entries leads from j to i (Gilbert & Peierls 1988, theorem 1).

    Raises
    ------
    ModelError
        When the matrix is singular.
    """
    row, reached = _structure((matrix != 0).tobytes(), matrix.shape[0])
    try:
        inverse = np.linalg.inv(matrix[row])
    except np.linalg.LinAlgError:
        raise ModelError("the equations do not determine every signal") from None
    back = np.empty_like(row)
    back[row] = np.arange(row.size)
    return np.asarray(np.where(reached, inverse, 0.0)[:, back], dtype=np.float64)


# A pattern stays as it is while a knob turns.
@lru_cache(maxsize=64)
def _structure(pattern: bytes, count: int) -> tuple[NDArray[np.int32], Mask]:
    """Row that gives each column its entry on the diagonal, and which entries of the inverse may not be zero."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_bipartite_matching

    entries = np.frombuffer(pattern, dtype=bool).reshape(count, count)
    row = np.asarray(maximum_bipartite_matching(csr_array(entries), perm_type="row"), dtype=np.int32)
    if np.any(row < 0):
        raise ModelError("the equations do not determine every signal")
    links = entries[row] | np.eye(count, dtype=bool)
    reached = np.zeros_like(links)
    # Squaring the pattern doubles the length of the chains in it; it's done when nothing new is reached.
    while not np.array_equal(links, reached):
        reached = links
        links = (reached.astype(np.float32) @ reached.astype(np.float32)) > 0
    return row, reached
