"""Design of a PD2 correction for an oscillating drive whose flow is bounded."""

from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Final

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize

from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

# Of the normalised response, whose drive swings with 1 rad/s: long enough for the slowest answer worth having, at
# steps that place a peak within 1e-4 of its height.
_LENGTH: Final = 40.0
_DOUBLINGS: Final = 12
# Share of the band that the search stays in: the soonest of all lets a later swing touch the band's edge, where the
# least error would double the settling time.
_INNER: Final = 0.9
# What a design that breaks its bound costs, against settling times below `_LENGTH`.
_PENALTY: Final = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class Pd2Design:
    """Numbers of a correction ``(1 + T_1 s + T_2 s^2)/(1 + T_f s)^2``, and what it does to a step.

    Attributes
    ----------
    derivative_s, second_derivative_s2, filter_s
        T_1, T_2, T_f.
    settling_s
        Until the velocity stays in the band about its final value.
    largest_flow
        Over the step.
    """

    derivative_s: float
    second_derivative_s2: float
    filter_s: float
    settling_s: float
    largest_flow: float

    def parameters(self) -> dict[str, float]:
        """By the names of the hydraulic motor's parameters."""
        return {
            "pd2_gain": 1.0,
            "pd2_derivative": self.derivative_s,
            "pd2_second_derivative": self.second_derivative_s2,
            "pd2_filter": self.filter_s,
        }


def cancelling_pd2(*, omega: float, damping_ratio: float, flow_ratio: float = 2.0, band: float = 0.05) -> Pd2Design:
    """Give the correction whose zeros cancel the drive's pair, filtered so that the flow just keeps its bound.

    ::

        T_1 = 2 zeta/omega    T_2 = 1/omega^2    T_f = 1/(omega sqrt(flow_ratio))

    The velocity then follows two lags of T_f and can't swing; the flow is largest at once, T_2/T_f^2 steps.
    Arguments and errors as of `best_pd2`.
    """
    _require(omega, damping_ratio, flow_ratio, band)
    return _design((2 * damping_ratio, 1 / sqrt(flow_ratio)), omega, damping_ratio, flow_ratio, band)


def best_pd2(*, omega: float, damping_ratio: float, flow_ratio: float = 2.0, band: float = 0.05) -> Pd2Design:
    """Find the correction with which the velocity settles soonest after a step, the flow bounded.

    To nine tenths of the band, so that no later swing comes near its edge.

    The first peak of the flow is put at its bound, ``T_2 = flow_ratio T_f^2``; T_1 and T_f are searched (Nelder and
    Mead's simplex, from the cancelling correction), with a penalty where a later peak breaks the bound.

    Parameters
    ----------
    omega
        Natural frequency of the drive's oscillating pair, rad/s.
    damping_ratio
        Of the pair, at most 1.
    flow_ratio
        Largest flow over the step, above 1.
    band
        Of the final velocity.

    Raises
    ------
    ModelError
        When a number is outside of these ranges.

    Examples
    --------
    >>> best = best_pd2(omega=200.0, damping_ratio=0.1)
    >>> best.settling_s < cancelling_pd2(omega=200.0, damping_ratio=0.1).settling_s
    True
    """
    _require(omega, damping_ratio, flow_ratio, band)

    def cost(numbers: Real) -> float:
        # The simplex doesn't know bounds; a filter that runs backwards would grow.
        if numbers[1] <= 0:
            return _PENALTY
        settling, largest = _judged(numbers[0], numbers[1], damping_ratio, flow_ratio, _INNER * band)
        return settling + _PENALTY * max(0.0, largest - flow_ratio * (1 + 1e-9))

    start = np.array([2 * damping_ratio, 1 / sqrt(flow_ratio)])
    # The settling time jumps where a swing enters the band: several starts find the lowest of its steps.
    found = [
        minimize(cost, start * scale, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-7, "maxiter": 400})
        for scale in ((1.0, 1.0), (2.0, 1.1), (4.0, 1.3))
    ]
    best = min(found, key=lambda one: float(one.fun))
    return _design((float(best.x[0]), float(best.x[1])), omega, damping_ratio, flow_ratio, band)


def _require(omega: float, damping_ratio: float, flow_ratio: float, band: float) -> None:
    if not (isfinite(omega) and omega > 0):
        raise ModelError(f"omega = {omega} rad/s must be finite and positive")
    if not 0 <= damping_ratio <= 1:
        raise ModelError(f"damping_ratio = {damping_ratio}: a pair that oscillates has one from 0 to 1")
    if not (isfinite(flow_ratio) and flow_ratio > 1):
        raise ModelError(f"flow_ratio = {flow_ratio} must be above 1: a correction needs more flow than the step")
    # Exponentials never end: a band of nothing is never reached, and the whole step is no band.
    if not 0 < band < 1:
        raise ModelError(f"band = {band} must lie between 0 and 1, a share of the final velocity")


def _design(
    numbers: tuple[float, float], omega: float, damping_ratio: float, flow_ratio: float, band: float
) -> Pd2Design:
    first, lag = float(numbers[0]), float(numbers[1])
    settling, largest = _judged(first, lag, damping_ratio, flow_ratio, band)
    return Pd2Design(
        derivative_s=first / omega,
        second_derivative_s2=flow_ratio * (lag / omega) ** 2,
        filter_s=lag / omega,
        settling_s=settling / omega,
        largest_flow=largest,
    )


def _judged(first: float, lag: float, damping_ratio: float, flow_ratio: float, band: float) -> tuple[float, float]:
    """Settling time and largest flow of the normalised drive."""
    # Only the damping ratio shapes the answer: frequency scales time.
    time, flow, velocity = _step_response(first, lag, damping_ratio, flow_ratio)
    outside = np.abs(velocity - 1.0) - band
    last = np.flatnonzero(outside > 0)
    largest = float(np.abs(flow).max())
    if not last.size or last[-1] + 1 == time.size:
        return (0.0 if not last.size else float(time[-1])), largest
    here = int(last[-1])
    # Straight between two points: a smooth cost for the search.
    share = outside[here] / (outside[here] - outside[here + 1])
    return float(time[here] + share * (time[here + 1] - time[here])), largest


def _step_response(first: float, lag: float, damping_ratio: float, flow_ratio: float) -> tuple[Real, Real, Real]:
    """Time, flow and velocity, exact at each point.

    States: the filter's output before its zeros and its rate, velocity and its rate, the step. With T_1 = `first`,
    T_f = `lag`, T_2 = flow_ratio lag^2 and w the filter's first state, ``flow = w + T_1 w' + T_2 w''``.
    """
    rate, square = -2 / lag, -1 / lag**2
    second = flow_ratio * lag**2
    flow = np.array([1 + second * square, first + second * rate, 0.0, 0.0, -second * square])
    generator = np.zeros((5, 5))
    generator[0, 1] = generator[2, 3] = 1.0
    generator[1, [0, 1, 4]] = square, rate, -square
    generator[3] = flow
    generator[3, [2, 3]] = -1.0, -2 * damping_ratio
    # Each doubling of the points takes one product; a march through all would take thousands.
    count = 2**_DOUBLINGS
    step = np.asarray(expm(generator * (_LENGTH / count)))
    states = np.array([[0.0], [0.0], [0.0], [0.0], [1.0]])
    for _ in range(_DOUBLINGS):
        states, step = np.hstack([states, step @ states]), step @ step
    time = np.linspace(0.0, _LENGTH, count, endpoint=False)
    return time, np.asarray(flow @ states), np.asarray(states[2])
