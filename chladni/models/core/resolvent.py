"""Inverse of ``s I - A``, on which every frequency response rests."""

import numpy as np
from numpy.typing import NDArray

from chladni.signals.errors import ModelError


def resolvent(a: NDArray[np.float64], s: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Give ``(s I - A)^-1`` at points of the complex plane, ``[point, state, state]``.

    A is balanced first (Parlett and Reinsch 1969): beside strokes in m, pressures in Pa would cost seven digits at
    high frequency. The scales are powers of two, so that balancing itself rounds nothing.

    Raises
    ------
    ModelError
        At a point that is an eigenvalue of A: an integrator has no response at 0 Hz.
    """
    # SciPy's linear algebra takes longer to load than most models take to answer.
    from scipy.linalg import matrix_balance

    if not a.size:
        return np.zeros((s.size, 0, 0), dtype=np.complex128)
    # SciPy casts the scales to integers too, for a permutation that wasn't asked for: beyond 2^63 that warns.
    with np.errstate(invalid="ignore"):
        found, (scale, _) = matrix_balance(a, permute=False, separate=True)
    balanced = np.asarray(found, dtype=np.float64)
    try:
        inverse = np.linalg.inv(s[:, None, None] * np.eye(len(a)) - balanced)
    except np.linalg.LinAlgError:
        raise ModelError(_at_a_pole(balanced, s)) from None
    return np.asarray(inverse * (scale[:, None] / scale), dtype=np.complex128)


def _at_a_pole(a: NDArray[np.float64], s: NDArray[np.complex128]) -> str:
    distance = np.abs(s[:, None] - np.linalg.eigvals(a)).min(axis=1)
    frequency_hz = abs(s[np.argmin(distance)]) / (2 * np.pi)
    return f"the model has a pole at {frequency_hz:g} Hz and no finite response there; leave this frequency out"
