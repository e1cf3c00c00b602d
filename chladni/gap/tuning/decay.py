"""How a linear model's outputs follow from where it starts."""

import numpy as np

from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Real, Whole


def decay(compiled: CompiledModel, rows: Whole, sample_rate_hz: float, count: int) -> Real:
    """Give ``[state, output, sample]``: outputs `rows` of the linear part from a unit of each state, ``C e^(A t)``.

    By doubling: what follows after the first samples is the same from the state that is reached there.
    """
    from scipy.linalg import expm

    n = len(compiled.states)
    found = np.zeros((count, rows.size, n))
    if not n or not count:
        return np.ascontiguousarray(found.T)
    balanced, scale = balance(compiled.a)
    power = np.asarray(expm(balanced / sample_rate_hz) * (scale[:, None] / scale), dtype=np.float64)
    found[0], done = compiled.c[rows], 1
    # A free run of an unstable model leaves the numbers; whoever asks for it gets infinity, and refuses the step.
    with np.errstate(over="ignore", invalid="ignore"):
        while done < count:
            more = min(done, count - done)
            found[done : done + more] = found[:more] @ power
            power, done = power @ power, done + more
    return np.ascontiguousarray(found.T)
