"""What a band-limited signal does between its samples, as a polynomial for each step.

Oversampling and straight lines would take more steps, and weaken each line by sinc^2. A polynomial of degree 5
through the signal itself is within 4e-4 of a sine at 0.4 of the rate (2e-6 at 0.1), and goes through the same
exponentials as a spline does. The signal is interpolated by a windowed sinc (Kaiser): Oppenheim and Schafer,
*Discrete-Time Signal Processing*, 3rd ed., sections 4.6 and 7.5.3; one polynomial a step is Farrow's structure (IEEE
ISCAS 1988).
"""

from functools import lru_cache
from math import ceil, factorial
from typing import TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from chladni.signals.arrays import Complex, Real

Numbers = TypeVar("Numbers", Real, Complex)
#: Samples on either side that tell what is between two, and Kaiser's beta: 6e-5 is missed up to 0.45 of the rate.
REACH, BETA = 32, 9.0
#: Samples from which the signal beyond its ends is predicted, and the load on their products.
_NEAR, _LOAD = 16 * REACH, 1e-10


def nodes(degree: int) -> Real:
    """``[degree + 1]`` instants of a step, its ends among them, that leave a polynomial little to miss (Lobatto)."""
    return np.asarray((1.0 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2.0)


def through_nodes(degree: int) -> Real:
    """``[power, node]``: coefficients of the polynomial through values at the `nodes`."""
    return np.asarray(np.linalg.inv(np.vander(nodes(degree), increasing=True)))


def rates(coefficients: Numbers, sample_rate_hz: float) -> Numbers:
    """``[power, ...]``: value and rates at the start of a step, and the rise of the last rate, of polynomials."""
    degree = len(coefficients) - 1
    powers = np.arange(degree + 1)
    scale = np.array([factorial(power) for power in powers]) * sample_rate_hz ** np.minimum(powers, degree - 1.0)
    return coefficients * scale.reshape(-1, *[1] * (coefficients.ndim - 1))


def polynomials(samples: Real, degree: int, late: float, count: int) -> Real:
    """``[power, count]`` coefficients, in shares of a step, of the signal in each step.

    Parameters
    ----------
    samples
        ``[sample]``. Before the first and after the last the signal goes on as its own samples predict it.
    late
        How late the signal comes, in samples, 0 or more. In steps that begin before, nothing comes.
    count
        Steps; those that begin after the last sample keep its value.
    """
    whole = ceil(late)
    filters = _filters(degree, whole - late)
    padded = np.concatenate([_predicted(samples[::-1])[-2::-1], samples, _predicted(samples)])
    found = np.zeros((degree + 1, count))
    steps = np.arange(count) - whole
    inside = (steps >= 0) & (steps < samples.size)
    made = np.array([np.convolve(padded, each[::-1], mode="valid") for each in filters])
    found[:, inside] = made[:, steps[inside]]
    found[0, steps >= samples.size] = samples[-1]
    return found


@lru_cache(maxsize=32)
def _filters(degree: int, ahead: float) -> Real:
    """``[power, tap]``: coefficients of a step that begins `ahead` of a sample, from the samples around that."""
    apart = np.arange(-REACH, REACH + 2) - (nodes(degree) + ahead)[:, None]
    window = np.i0(BETA * np.sqrt(np.clip(1.0 - (apart / REACH) ** 2, 0.0, None))) / np.i0(BETA)
    taps = np.sinc(apart) * np.where(np.abs(apart) > REACH, 0.0, window)
    # A constant stays one.
    found: Real = through_nodes(degree) @ (taps / taps.sum(axis=1, keepdims=True))
    found.flags.writeable = False
    return found


def _predicted(samples: Real) -> Real:
    """``[REACH + 1]``: how a signal goes on, by the best linear prediction from its last `_NEAR` samples.

    Forward and backward least squares (the modified covariance method: Marple, *Digital Spectral Analysis*, 8.5).
    A reflection would be wrong by a tenth at 0.4 of the rate, and a machine that is hardly damped remembers it.
    """
    order = min(REACH, samples.size // 4)
    known = sliding_window_view(samples[-_NEAR:], order + 1)
    products = known.T @ known
    products += products[::-1, ::-1]
    # What is predicted without error (a constant, a few sines) has no unique predictor: the smallest is taken.
    loaded = products[:order, :order] + (_LOAD * np.trace(products) + 1e-300) * np.eye(order)
    weights = np.linalg.solve(loaded, products[:order, order]) if order else np.ones(1)
    course = np.concatenate([samples[-max(order, 1) :], np.zeros(REACH + 1)])
    for place in range(max(order, 1), course.size):
        course[place] = weights @ course[place - weights.size : place]
    return course[-(REACH + 1) :]
