"""Balance of a matrix whose rows have very different units."""

import numpy as np

from chladni.signals.arrays import Real


def balance(matrix: Real) -> tuple[Real, Real]:
    """Scale states so that rows and columns are of one size (Parlett and Reinsch 1969).

    Parameters
    ----------
    matrix
        ``[state, state]``, at least one.

    Returns
    -------
    balanced, scale
        ``balanced = matrix * scale[None, :] / scale[:, None]``; scales are powers of two, so that nothing is rounded.
    """
    # SciPy's linear algebra takes longer to load than most models take to answer.
    from scipy.linalg import matrix_balance

    # SciPy casts the scales to integers too, for a permutation that wasn't asked for: beyond 2^63 that warns.
    with np.errstate(invalid="ignore"):
        found, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
    return np.asarray(found, dtype=np.float64), np.asarray(scale, dtype=np.float64)
