"""Bristles along a motion that is known, exactly: however little they bend between two samples."""

from math import copysign, exp

import numpy as np

from chladni.models.integrator.machine_code import machine_code, part_code
from chladni.signals.arrays import Real


def bristles_along(velocity: Real, sample_rate_hz: float, presliding: float) -> Real:
    """Share of its sliding force that Dahl's friction resists with, ``[sample]`` between -1 and 1.

    Of ``w' = (s - abs(s) w)/presliding`` while the motion keeps its direction the solution is known: over a way x
    ``w`` goes to the sign of x but for ``exp(-abs(x)/presliding)`` of what it was away from it. Between samples the
    velocity runs along a straight line, and turns where that crosses zero.

    Parameters
    ----------
    velocity
        ``[sample]``, m/s.
    presliding
        m, above 0.
    """
    share = np.zeros_like(velocity)
    _march(np.ascontiguousarray(velocity), 1.0 / sample_rate_hz, presliding, share)
    return share


@machine_code
def _march(velocity: Real, interval: float, presliding: float, share: Real) -> None:
    for sample in range(1, velocity.size):
        before, after, w = velocity[sample - 1], velocity[sample], share[sample - 1]
        if before * after < 0.0:
            turn = before / (before - after)
            w = _bent(w, 0.5 * before * turn * interval / presliding)
            share[sample] = _bent(w, 0.5 * after * (1.0 - turn) * interval / presliding)
        else:
            share[sample] = _bent(w, 0.5 * (before + after) * interval / presliding)


@part_code
def _bent(w: float, way: float) -> float:
    """Share after a way in one direction, over the presliding."""
    goal = copysign(1.0, way)
    return goal + (w - goal) * exp(-abs(way))
