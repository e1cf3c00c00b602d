"""Step response of a transfer function, exact at any instant."""

from dataclasses import dataclass

import numpy as np

from chladni.models.elements.realization import realize
from chladni.models.elements.transfer_function import TransferFunction
from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepResponse(Value):
    """Answer to a unit step at t = 0 from rest.

    Attributes
    ----------
    values
        ``[instant]``; at the jump itself the value just after it.
    impulses
        ``[order]`` strength of the Dirac impulse and its derivatives at the jump (after the dead time): what an
        improper function adds there, and no sample shows. Empty for a proper one.
    """

    values: Real
    impulses: Real

    def __post_init__(self) -> None:
        self._freeze()


def step_response(transfer: TransferFunction, time_s: Real) -> StepResponse:
    """Give the response at each instant by the matrix exponential.

    Parameters
    ----------
    transfer
        Proper or not, with dead time or without.
    time_s
        ``[instant]`` in seconds; before the jump the response is zero.

    Notes
    -----
    With the input as a further state, ``exp([[A, b], [0, 0]] t)`` holds the integral of ``exp(A t) b`` in its last
    column (Van Loan 1978), so that integrators need no case of their own.

    Examples
    --------
    >>> step_response(TransferFunction(num=(2,), den=(1, 0)), np.array([0.0, 1.5])).values
    array([0., 3.])
    """
    from scipy.linalg import expm

    form = realize(transfer)
    # Time since the jump arrives; before it the state rests at its start.
    since = np.asarray(time_s, dtype=np.float64) - transfer.delay_s
    order = form.b.size
    augmented = np.zeros((order + 1, order + 1))
    augmented[:order, :order], augmented[:order, order] = form.a, form.b
    states = np.asarray(expm(augmented * np.maximum(since, 0.0)[:, None, None]))[:, :order, order]
    return StepResponse(values=np.where(since >= 0, states @ form.c + form.q[0], 0.0), impulses=form.q[1:])
