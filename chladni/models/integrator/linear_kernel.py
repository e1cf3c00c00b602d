"""Kernel: the exact recursion of a model on which nothing but its inputs acts."""

from chladni.models.integrator.machine_code import machine_code
from chladni.signals.arrays import Real


@machine_code
def linear_march(advance: Real, rows: Real, state: Real) -> None:
    """``x[k + 1] = Phi x[k] + Gamma row[k]``, exact for inputs that run between samples as `Hold` says.

    Parameters
    ----------
    advance
        ``[state + width, state]``.
    rows
        ``[sample, width]``.
    state
        ``[sample, state]``, the first row given.
    """
    n = state.shape[1]
    for sample in range(state.shape[0] - 1):
        for column in range(advance.shape[0]):
            value = state[sample, column] if column < n else rows[sample, column - n]
            for row in range(n):
                state[sample + 1, row] += advance[column, row] * value
