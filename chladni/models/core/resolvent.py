"""Inverse of ``s I - A``, on which every frequency response rests."""

import numpy as np
from numpy.typing import NDArray


def resolvent(a: NDArray[np.float64], s: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Give ``(s I - A)^-1`` at points of the complex plane, ``[point, state, state]``.

    A is balanced first (Parlett and Reinsch 1969): beside strokes in m, pressures in Pa would cost seven digits at
    high frequency. The scales are powers of two, so that balancing itself rounds nothing.

    Raises
    ------
    LinAlgError
        At a point that is an eigenvalue of A.
    """
    # SciPy's linear algebra takes longer to load than most models take to answer.
    from scipy.linalg import matrix_balance

    if not a.size:
        return np.zeros((s.size, 0, 0), dtype=np.complex128)
    balanced, (scale, _) = matrix_balance(a, permute=False, separate=True)
    inverse = np.linalg.inv(s[:, None, None] * np.eye(len(a)) - balanced)
    return np.asarray(inverse * (scale[:, None] / scale), dtype=np.complex128)
