"""Kernel: history of the delay lines, and what they give at a time."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chladni.models.integrator.machine_code import machine_code, part_code
from chladni.models.integrator.port_kernel import Ports, Stage

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]


class History(NamedTuple):
    """Displacements at the ports of delay lines, step by step.

    Attributes
    ----------
    begin, length
        ``[step]`` seconds.
    value
        ``[step, delay, 5]`` at the start, the quarters and the end of the step.
    hint
        ``[delay + 1]`` step at which each line was last asked; the last is the number of steps kept.
    """

    begin: Matrix
    length: Matrix
    value: Matrix
    hint: Integers


@machine_code
def fill_lagged(history: History, ports: Ports, stage: Stage, t: float) -> None:
    """Displacement of each delay line at `t` less its dead time; 0 before the start."""
    for delay in range(ports.delay_s.size):
        ports.lagged[stage, delay] = _displacement(history, delay, t - ports.delay_s[delay])


@part_code
def _displacement(history: History, delay: int, t: float) -> float:
    count = history.hint[-1]
    if t < 0.0 or count == 0:
        return 0.0
    step = min(history.hint[delay], count - 1)
    while step > 0 and history.begin[step] > t:
        step -= 1
    while step + 1 < count and history.begin[step + 1] <= t:
        step += 1
    history.hint[delay] = step
    # Polynomial of degree 4 through the five values; never across the end of a step, where an input may have a kink.
    x = 4.0 * (t - history.begin[step]) / history.length[step]
    total = 0.0
    for node in range(5):
        factor = 1.0
        for other in range(5):
            if other != node:
                factor *= (x - other) / (node - other)
        total += factor * history.value[step, delay, node]
    return total
