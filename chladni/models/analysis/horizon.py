"""How long to look at a response, and how finely, by the poles of what moves."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.signals.arrays import Complex

# exp(-7) = 0.1 %: what is left of the slowest decay at the end.
DECAYS = 7.0
# What grows is shown until it has grown by exp(5) = 150.
GROWTHS = 5.0
# A picture of more periods than this is a black band.
PERIODS = 60
# Points a period of an oscillation that still matters, and points altogether.
POINTS_A_PERIOD = 16
POINTS = 500
MOST_POINTS = 8000
# Oscillations damped more than this are over within a period.
LIGHT_DAMPING = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """Length and resolution of a response.

    Attributes
    ----------
    seconds
        How long.
    fastest_s
        Shortest time constant.
    longest_step_s
        No two points are further apart.
    note
        A sentence when the response isn't over at the end; else empty.
    """

    seconds: float
    fastest_s: float
    longest_step_s: float
    note: str = ""


def horizon(poles: Complex, *, periods: int = PERIODS) -> Horizon:
    """Choose how long to look at a response by its poles.

    Parameters
    ----------
    poles
        In rad/s; those at the origin (integrators) don't say anything about time and are passed over.
    periods
        Of the slowest decaying oscillation at most.
    """
    # An integrator has no time of its own.
    moving = poles[poles != 0]
    if not moving.size:
        return Horizon(seconds=1.0, fastest_s=1.0, longest_step_s=1.0 / POINTS)
    fastest_s = 1 / float(np.abs(moving).max())
    seconds, note = _length(moving, periods)
    step_s = min(seconds / POINTS, _period_s(moving, seconds) / POINTS_A_PERIOD)
    return Horizon(
        seconds=seconds,
        fastest_s=fastest_s,
        longest_step_s=max(step_s, seconds / MOST_POINTS),
        note=note,
    )


def _length(moving: Complex, periods: int) -> tuple[float, str]:
    rate = float(moving.real.max())
    slowest = moving[int(np.argmax(moving.real))]
    period_s = 2 * pi / abs(slowest.imag) if slowest.imag else np.inf
    if rate > 1e-9 * float(np.abs(moving).max()):
        return min(GROWTHS / rate, periods * period_s), "the response grows: a pole lies in the right half-plane"
    decay_s = -DECAYS / rate if rate < 0 else np.inf
    if decay_s > periods * period_s:
        return periods * period_s, f"the oscillation goes on after {periods} periods, where the picture ends"
    return min(decay_s, 1e12), ""


def _period_s(moving: Complex, seconds: float) -> float:
    """Shortest period of the oscillations that are alive for a good part of the picture."""
    light = (
        (moving.imag > 0) & (-moving.real < LIGHT_DAMPING * np.abs(moving)) & (-moving.real * seconds < 40 * DECAYS)
    )
    return float(2 * pi / moving[light].imag.max()) if light.any() else np.inf
