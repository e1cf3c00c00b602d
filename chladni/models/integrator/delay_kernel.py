"""Kernel: history of the delay lines, and what they give at a time."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.machine_code import ASK, kernel, part_code
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers3, opener
from chladni.models.integrator.port_kernel import Ports, Stage


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

    begin: Numbers1
    length: Numbers1
    value: Numbers3
    hint: Integers1


@part_code
def fill_lagged(history: History, ports: Ports, stage: Stage, t: float) -> None:
    """Displacement of each delay line at `t` less its dead time; 0 before the start."""
    for delay in range(ports.delay_s.size):
        ports.lagged[stage, delay] = _displacement(history, delay, t - ports.delay_s[delay])


@part_code
def _displacement(history: History, delay: int, t: float) -> float:
    count = history.hint[history.hint.size - 1]
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


_OPEN = opener(History, Ports)


@kernel(ASK)
def ask_delays(book: int, t: float, _: int) -> int:
    """`fill_lagged` at the start of a step, from outside of the kernels."""
    history, ports = _OPEN(book)
    fill_lagged(history, ports, np.int64(0), t)
    return 0
