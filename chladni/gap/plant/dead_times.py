"""Dead times in loops, in steps of a march: cubics through the displacements that it has made."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.machine_code import inlined_code, part_code
from chladni.models.integrator.port_plan import PortPlan
from chladni.signals.arrays import Real, Whole

#: Displacements that a cubic goes through.
_NODES = 4


class DeadTimes(NamedTuple):
    """Dead times at ports, ``f(t) = d(t - delay) - d(t)``.

    Attributes
    ----------
    port
        ``[delay]``.
    ago
        ``[delay]`` steps back to the latest of four displacements.
    share
        ``[delay, 4]`` of each, the latest first.
    """

    port: Whole
    ago: Whole
    share: Real


def dead_times(plan: PortPlan, step_rate_hz: float) -> DeadTimes:
    """Lay out the dead times of a model for steps at a rate, two displacements on either side where there are two."""
    steps = plan.delay_s * step_rate_hz
    ago = np.maximum(np.floor(steps).astype(np.int64) - 1, 0)
    nodes = np.arange(float(_NODES))
    share = np.ones((steps.size, _NODES))
    for place, node in enumerate(nodes):
        others = nodes[nodes != node]
        share[:, place] = np.prod((steps - ago)[:, None] - others, axis=1) / np.prod(node - others)
    return DeadTimes(plan.delay_port.astype(np.int64), ago, share)


@part_code
def begin_dead_times(delays: DeadTimes, lagged: Real, now: Real) -> None:
    """At the start of a window nothing is behind: all that acts ``[port]`` is the displacement that is missing."""
    for port in range(now.size):
        lagged[port] = now[port] = 0.0
    for delay in range(delays.port.size):
        now[delays.port[delay]] -= 1.0


@part_code
def see_own_step(delays: DeadTimes, now: Real) -> None:
    """After the start, a dead time below two steps sees the displacement ``[port]`` at the end of its own."""
    for delay in range(delays.port.size):
        if delays.ago[delay] == 0:
            now[delays.port[delay]] += delays.share[delay, 0]


@inlined_code
def look_back(delays: DeadTimes, delay: int, motion: Real, step: int, latest: int) -> float:
    """Displacement that comes at a step, of those up to the latest in ``motion [step, port]``; 0 before the start."""
    total = 0.0
    for node in range(delays.share.shape[1]):
        past = step - delays.ago[delay] - node
        if 0 <= past <= latest:
            total += delays.share[delay, node] * motion[past, delays.port[delay]]
    return total
