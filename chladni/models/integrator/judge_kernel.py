"""Kernel: how wrong a step is, and what counts as large.

Where a motion turns inside a step the laws are asked once more: a touch may begin and end between two stages.
"""

from math import copysign, sqrt
from typing import NamedTuple

import numpy as np

from chladni.models.integrator.explicit_kernel import Drive, Stride, advance_linear
from chladni.models.integrator.machine_code import inlined_code, part_code
from chladni.models.integrator.plane import Numbers1, Numbers2, Numbers3
from chladni.models.integrator.port_kernel import Ports, law_force, port_forces
from chladni.models.integrator.step_tables import DEEPEST, LAGRANGE, NODES
from chladni.signals.arrays import Real

# Samples that a beginning motion is followed ahead, to know its scale.
_AHEAD = 32
# A bend counts ten times and more as much as it may miss: behind it neighbouring motions part.
_BEND = 10.0


class Judge(NamedTuple):
    """How an error is weighed.

    Attributes
    ----------
    effect
        ``[level, port, state]``: what a unit force over the step adds to a state.
    weight
        ``[channel]`` effect of a channel on the state that it moves most, relative to its scale.
    difference
        ``[level change, 5]`` weights of the fourth difference, by how much longer the step before was.
    before
        ``[2, channel]`` forces and rates at the start and in the middle of the step before.
    tolerance
        ``[1]`` of one step, relative.
    """

    effect: Numbers3
    weight: Numbers1
    difference: Numbers2
    before: Numbers2
    tolerance: Numbers1


@inlined_code
def weigh(judge: Judge, stride: Stride, ports: Ports, level: int, step_s: float) -> None:
    """Renew the weight of each channel."""
    count, n = ports.first.size - 1, judge.effect.shape[2]
    for port in range(count):
        largest = 0.0
        for row in range(n):
            scale = max(stride.scale[row], abs(stride.there[row])) + 1e-250
            largest = max(largest, judge.effect[level, port, row] / scale)
        judge.weight[port] = largest
    for place in range(ports.state.size):
        scale = max(stride.scale[n + place], abs(stride.there[n + place])) + 1e-250
        judge.weight[count + place] = step_s / scale


@inlined_code
def look_ahead(advance: Real, drive: Drive, ports: Ports, stride: Stride, sample: int, step_s: float) -> None:
    """Renew the scales by what the coming samples would make of the states without forces.

    A motion that begins grows as a power of time: any step is wrong by a fixed share of it. Its scale is where it
    is about to go.
    """
    n = advance.shape[1] - stride.inputs.size
    count, states = ports.first.size - 1, ports.state.size
    for row in range(n):
        stride.ahead[row] = stride.here[row]
    for place in range(states):
        ports.state[place] = stride.here[n + place]
    for coming in range(sample, min(sample + _AHEAD, drive.rows.shape[0])):
        for place in range(stride.coming.size):
            stride.coming[place] = drive.rows[coming, place]
        advance_linear(advance, 0, stride.ahead, stride.coming, stride.lines)
        for row in range(n):
            stride.ahead[row] = stride.lines[row]
            stride.scale[row] = max(stride.scale[row], abs(stride.lines[row]))
        for row in range(2 * count):
            ports.motion[row] = stride.lines[n + 2 * count + row]
            stride.scale[n + states + row] = max(stride.scale[n + states + row], abs(ports.motion[row]))
        if states > 0:
            port_forces(ports, coming * step_s, np.int64(5), np.int64(1))
        for place in range(states):
            moved = step_s * abs(ports.channels[5, count + place])
            if moved > stride.scale[n + place] and np.isfinite(moved):
                stride.scale[n + place] = moved


@inlined_code
def explicit_error(judge: Judge, ports: Ports, level: int, previous: int) -> float:
    """Relative error of the explicit step just made."""
    total, q = 0.0, ports.channels
    for channel in range(q.shape[1]):
        # The embedded formula of order 3 takes the force at the new end in place of that of the last stage; for
        # classical weights see Hairer, Norsett & Wanner (1993), section II.4.
        error = abs(q[4, channel] - q[3, channel]) / 6
        if previous >= 0:
            error += _curvature_error(judge, q, channel, level - previous + DEEPEST)
        else:
            # Without a step before, a bend can't be told from a curve.
            error += abs(q[0, channel] - q[1, channel] - q[2, channel] + q[4, channel]) / 6
        total += judge.weight[channel] * error
    return total


@inlined_code
def _curvature_error(judge: Judge, q: Real, channel: int, change: int) -> float:
    """Error of the integral of a force over the step, by its fourth difference over this step and the one before.

    Of a smooth force Simpson's rule misses 1/180 of it. Of a force that bends sharply inside the step (contact
    begins) it misses up to 1/6 of the second difference, which is then as large as the fourth.
    """
    middle = 0.5 * (q[1, channel] + q[2, channel])
    fourth = abs(
        judge.difference[change, 0] * judge.before[0, channel]
        + judge.difference[change, 1] * judge.before[1, channel]
        + judge.difference[change, 2] * q[0, channel]
        + judge.difference[change, 3] * middle
        + judge.difference[change, 4] * q[4, channel]
    )
    second = abs(q[0, channel] - 2 * middle + q[4, channel]) + 1e-300
    missed: float = fourth * (1 / 45 + _BEND * min(1.0, 4 * fourth / second))
    return missed


@inlined_code
def is_stiff(judge: Judge, ports: Ports) -> bool:
    """Whether forces change nearly as much from the first to the second stage in the middle as they did before."""
    q = ports.channels
    again = first = 0.0
    for channel in range(q.shape[1]):
        again += judge.weight[channel] * abs(q[2, channel] - q[1, channel])
        first += judge.weight[channel] * abs(q[1, channel] - q[0, channel])
    return not again <= max(0.3 * first, judge.tolerance[0])


@inlined_code
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


@inlined_code
def _turn(start: float, first: float, end: float, last: float, length: float) -> float:
    """Where, from 0 to 1, the cubic through values and slopes at both ends has its only extremum."""
    mean = (end - start) / length
    # The slope is first + b x + a x^2.
    a, b = 3.0 * (first + last) - 6.0 * mean, 6.0 * mean - 4.0 * first - 2.0 * last
    total = -0.5 * (b + copysign(sqrt(max(b * b - 4.0 * a * first, 0.0)), b))
    x = first / total
    return x if 0.0 <= x <= 1.0 else min(max(total / a, 0.0), 1.0)


@inlined_code
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
