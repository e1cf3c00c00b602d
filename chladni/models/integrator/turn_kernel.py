"""Kernel: what the laws do where a motion turns inside a step: a touch may begin and end between two stages."""

from math import copysign, sqrt

import numpy as np

from chladni.models.integrator.explicit_kernel import Stride
from chladni.models.integrator.judge_kernel import Judge
from chladni.models.integrator.machine_code import part_code
from chladni.models.integrator.port_kernel import Ports, law_force
from chladni.models.integrator.radau import LAGRANGE, NODES


@part_code
def explicit_error_at_turns(judge: Judge, ports: Ports, stride: Stride, t: float, step_s: float) -> float:
    """`missed_at_turns` of an explicit step, at all ports."""
    total = 0.0
    for port in range(ports.first.size - 1):
        total += missed_at_turns(judge, ports, stride, port, 0, t, step_s)
    return total


@part_code
def missed_at_turns(
    judge: Judge, ports: Ports, stride: Stride, port: int, hard: int, t: float, step_s: float
) -> float:
    """Relative error of the step just made by what its stages have missed of the laws at a port.

    `hard` is 1 for an implicit step. A delay line at the port is left out: what it gives there isn't known.
    """
    for delay in range(ports.delay_s.size):
        if ports.delay_port[delay] == port:
            return 0.0
    count, inner_at = ports.first.size - 1, NODES[1] if hard == 1 else 0.5
    motion = stride.here.size - 2 * count + port
    missed: float = 0.0
    d, s = stride.here[motion], stride.here[motion + count]
    begin, length = 0.0, inner_at
    # One loop, since each call is compiled in its own place.
    for part in range(2):
        end_d = stride.inner[port] if part == 0 else stride.there[motion]
        end_s = stride.inner[count + port] if part == 0 else stride.there[motion + count]
        if s * end_s < 0.0:
            x = _turn(d, s, end_d, end_s, length * step_s)
            turned = _cubic(d, s, end_d, end_s, length * step_s, x)
            missed += _missed(ports, stride, port, hard, turned, begin + length * x, t, step_s)
        d, s, begin, length = end_d, end_s, inner_at, 1.0 - inner_at
    missed *= judge.weight[port]
    return missed


@part_code
def _turn(start: float, first: float, end: float, last: float, length: float) -> float:
    """Where, from 0 to 1, the cubic through values and slopes at both ends has its only extremum."""
    mean = (end - start) / length
    # The slope is first + b x + a x^2.
    a, b = 3.0 * (first + last) - 6.0 * mean, 6.0 * mean - 4.0 * first - 2.0 * last
    total = -0.5 * (b + copysign(sqrt(max(b * b - 4.0 * a * first, 0.0)), b))
    x = first / total
    return x if 0.0 <= x <= 1.0 else min(max(total / a, 0.0), 1.0)


@part_code
def _cubic(start: float, first: float, end: float, last: float, length: float, x: float) -> float:
    """Cubic through values and slopes at both ends of a length, at a share of it."""
    rise, rate, final = end - start, length * first, length * last
    return start + x * (rate + x * (3.0 * rise - 2.0 * rate - final + x * (rate + final - 2.0 * rise)))


@part_code
def _missed(ports: Ports, stride: Stride, port: int, hard: int, d: float, x: float, t: float, step_s: float) -> float:
    """How far the laws at a turn, `x` of the step after its start, are from the polynomial through the stages."""
    q, count = ports.channels, ports.first.size - 1
    first = stride.here.size - 2 * count - ports.state.size
    for place in range(ports.state.size):
        row, rate = first + place, count + place
        ports.state[place] = _cubic(stride.here[row], q[0, rate], stride.there[row], q[4, rate], step_s, x)
    force: float = 0.0
    for law in range(ports.first[port], ports.first[port + 1]):
        force += law_force(ports, law, d, 0.0, t + x * step_s, np.int64(5))
    if hard == 1:
        for stage in range(3):
            force -= (LAGRANGE[0, stage] + x * (LAGRANGE[1, stage] + x * LAGRANGE[2, stage])) * q[1 + stage, port]
        return abs(force)
    start, middle, end = q[0, port], 0.5 * (q[1, port] + q[2, port]), q[4, port]
    force -= start + x * (4.0 * middle - 3.0 * start - end + 2.0 * x * (start + end - 2.0 * middle))
    return abs(force)
