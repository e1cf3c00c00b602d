"""Whether a compiled model is stable: poles that grow, those of loops with dead time included."""

from math import comb, factorial
from typing import cast

import numpy as np

from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Complex, Real

#: Order of what stands for a dead time. Even, so that it passes on at once what the dead time itself would: as much.
#: Its phase is right up to 12 rad; a loop whose gain is above one so far out is unstable whatever the phase.
PADE_ORDER = 10
# Of the precision with which an eigenvalue can be told at all.
_ROUNDINGS = 1e3


def growing_poles(compiled: CompiledModel) -> Complex:
    """Poles right of the imaginary axis by more than rounding, rad/s, those without a negative imaginary part.

    Laws and sample maps are left out. For a dead time in a loop stands its Padé approximant (Golub and Van Loan,
    Matrix Computations, section 9.3), whose magnitude is one as the dead time's is: poles are approximate, whether
    there are any isn't.
    """
    # SciPy's linear algebra takes longer to load than most models take to answer.
    from scipy.linalg import eig

    a = _with_dead_times(compiled)
    if not a.size:
        return np.empty(0, dtype=np.complex128)
    balanced, _ = balance(a)
    poles, left, right = cast("tuple[Complex, Complex, Complex]", eig(balanced, left=True))
    # Two integrators in a row have a double pole at 0, which rounding splits by far more than it moves others.
    certain = np.abs(np.sum(left.conj() * right, axis=0))
    moved = _ROUNDINGS * np.finfo(np.float64).eps * np.linalg.norm(balanced) / np.maximum(certain, 1e-300)
    return np.asarray(poles[(poles.real > moved) & (poles.imag >= 0)], dtype=np.complex128)


def _with_dead_times(compiled: CompiledModel) -> Real:
    """A with the states z of each line's approximant: ``z' = A_p z + b d``, ``f = d(t - tau) - d(t) = c z``."""
    from scipy.linalg import block_diag

    lines = compiled.delays
    if not lines:
        return compiled.a
    ports = [line.port for line in lines]
    parts = zip(*(_companion(line.delay_s) for line in lines), strict=True)
    own, entry, exit_ = (np.asarray(block_diag(*part), dtype=np.float64) for part in parts)
    seen = entry @ compiled.displacement_port[np.ix_(ports, ports)] @ exit_
    return np.block(
        [
            [compiled.a, compiled.g[:, ports] @ exit_],
            [entry @ compiled.displacement_state[ports], own + seen],
        ]
    )


def _companion(delay_s: float) -> tuple[Real, Real, Real]:
    """``e^(-s tau) - 1`` as ``c (s - A)^-1 b``, time counted in dead times: (A, b as a column, c as a row)."""
    n = PADE_ORDER
    below = np.array([comb(n, k) * factorial(2 * n - k) / factorial(2 * n) for k in range(n + 1)])
    # Numerator less denominator: even powers are the same in both.
    above = np.where(np.arange(n) % 2 == 0, 0.0, -2.0 * below[:n])
    a = np.eye(n, k=1)
    a[-1] = -below[:n] / below[n]
    b = np.zeros((n, 1))
    b[-1] = 1 / below[n]
    return a / delay_s, b / delay_s, above[None, :]
