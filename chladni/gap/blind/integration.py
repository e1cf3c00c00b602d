"""Simulates assembled equations at as many steps a sample as they need."""

from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from chladni.gap.blind.assembly import Assembly, fastest
from chladni.signals.errors import EstimateError

Matrix = NDArray[np.float64]

LEAST_STEPS, MOST_STEPS = 16, 1024
#: Angle that the fastest state turns in a step: at 0.25 a step's error is below 1e-5 of it.
_LARGEST_ANGLE = 0.25


def steps_for(assembly: Assembly, interval: float) -> int:
    """Give a number of steps a sample at which the linear part is exact to a few parts in a million."""
    wanted = max(LEAST_STEPS, ceil(fastest(assembly, interval) * interval / _LARGEST_ANGLE))
    # Powers of two, so that halving and shifts by parts of a sample stay whole.
    return min(1 << (wanted - 1).bit_length(), MOST_STEPS)


def integrate(assembly: Assembly, signals: Matrix, interval: float, *, start_s: float = 0.0, steps: int) -> Matrix:
    """Give ``[output, sample]``, from rest at the first sample.

    Parameters
    ----------
    signals
        ``[input, sample]``, in the order of ``assembly.inputs``; straight lines join the samples.
    interval
        Seconds between samples.
    start_s
        Time of the first sample, for laws that know the time.
    steps
        Runge-Kutta steps a sample.

    Raises
    ------
    EstimateError
        When the motion leaves all bounds.
    """
    from chladni.gap.blind.kernel import march

    arrays = assembly.arrays(interval, steps)
    y = np.full((len(assembly.outputs), signals.shape[1]), np.nan)
    driven = np.ascontiguousarray(signals, dtype=np.float64)
    fine = march(
        driven, interval, steps, np.zeros(arrays.states), arrays.system, arrays.law, arrays.observed, start_s, y
    )
    if not fine:
        raise EstimateError("the hidden motion grows without bound; draw the case again")
    return y


def respond(assembly: Assembly, signals: Matrix, interval: float) -> Matrix:
    """Give what `integrate` gives for a machine without laws and shifts, exactly and many times faster.

    Inputs that run along straight lines make the step from sample to sample a matrix (G. F. Franklin, J. D. Powell,
    M. Workman, Digital Control of Dynamic Systems, section 4.3: the triangle hold).
    """
    from chladni.gap.blind.kernel import recur

    arrays = assembly.arrays(interval, 1)
    a, b, inputs = arrays.system
    n = a.shape[0]
    block = np.zeros((n + 2 * inputs, n + 2 * inputs))
    block[:n, :n], block[:n, n : n + inputs] = a * interval, b * interval
    block[n : n + inputs, n + inputs :] = np.eye(inputs)
    powers = expm(block)
    now, slope = powers[:n, n : n + inputs], powers[:n, n + inputs :]
    states = np.zeros((signals.shape[1], n))
    driven = np.ascontiguousarray(signals, dtype=np.float64)
    recur(np.ascontiguousarray(powers[:n, :n]), now - slope, np.ascontiguousarray(slope), driven, states)
    c, d, _ = arrays.observed
    return np.asarray(c @ states.T + d @ driven)
