"""Kernel: how wrong a step is, and what counts as large."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.drive_kernel import Drive
from chladni.models.integrator.explicit_kernel import Stride, advance_linear
from chladni.models.integrator.machine_code import inlined_code
from chladni.models.integrator.plane import Numbers1, Numbers2, Numbers3
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.step_tables import DEEPEST
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
