"""Inverse of ``s I - A``, on which every frequency response rests."""

import numpy as np

from chladni.models.core.balance import balance
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError


def resolvent(a: Real, s: Complex) -> Complex:
    """Give ``(s I - A)^-1`` at points of the complex plane, ``[point, state, state]``.

    A is balanced first (Parlett and Reinsch 1969): beside strokes in m, pressures in Pa would cost seven digits at
    high frequency. The scales are powers of two, so that balancing itself rounds nothing.

    Raises
    ------
    ModelError
        At a point that is an eigenvalue of A: an integrator has no response at 0 Hz.
    """
    if not a.size:
        return np.zeros((s.size, 0, 0), dtype=np.complex128)
    balanced, scale = balance(a)
    try:
        inverse = np.linalg.inv(s[:, None, None] * np.eye(len(a)) - balanced)
    except np.linalg.LinAlgError:
        raise ModelError(_at_a_pole(balanced, s)) from None
    return np.asarray(inverse * (scale[:, None] / scale), dtype=np.complex128)


def _at_a_pole(a: Real, s: Complex) -> str:
    distance = np.abs(s[:, None] - np.linalg.eigvals(a)).min(axis=1)
    frequency_hz = abs(s[np.argmin(distance)]) / (2 * np.pi)
    return f"the model has a pole at {frequency_hz:g} Hz and no finite response there; leave this frequency out"
