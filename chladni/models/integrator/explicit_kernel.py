"""Kernel: one explicit exponential Runge-Kutta step of order 4 (Krogstad 2005)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chladni.models.integrator.machine_code import part_code
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.step_tables import SchemeTables

Matrix = NDArray[np.float64]
# How rates of law states add up at each stage: the classical scheme.
_WEIGHTS = np.array([[1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0], [1 / 6, 1 / 3, 1 / 3, 1 / 6]])


class Stride(NamedTuple):
    """What a step starts from and ends in.

    Attributes
    ----------
    start
        ``[state + width]``: state at the start, row of inputs of this step.
    end
        ``[state + stages of motion]``, the rows of `SchemeTables.advance`: state at the end first.
    law_start, law_end
        ``[law state]``.
    motion_end
        ``[2 port]``.
    scale
        ``[state]`` largest magnitude so far.
    ahead
        ``[state + width + rows]`` working memory of a look ahead.
    grown
        ``[1]`` whether a state is about to leave its scale.
    """

    start: Matrix
    end: Matrix
    law_start: Matrix
    law_end: Matrix
    motion_end: Matrix
    scale: Matrix
    ahead: Matrix
    grown: NDArray[np.int64]


@part_code
def advance_linear(advance: Matrix, level: int, stride: Stride) -> None:
    """``end = start @ advance[level]``: everything but the forces of this step."""
    rows = advance.shape[2]
    for row in range(rows):
        stride.end[row] = 0.0
    # By columns: the sum of products along a row can't be vectorised without changing its rounding.
    for column in range(stride.start.size):
        value = stride.start[column]
        for row in range(rows):
            stride.end[row] += advance[level, column, row] * value
    # What a state would do without the forces counts too: where friction holds a body, its rest is no scale.
    grown = False
    for row in range(stride.scale.size):
        size = abs(stride.end[row])
        grown = grown or size > 2 * stride.scale[row]
        stride.scale[row] = max(stride.scale[row], size)
    stride.grown[0] = grown


@part_code
def place_stage(
    tables: SchemeTables, ports: Ports, stride: Stride, value: Matrix, weights: Matrix,
    level: int, stage: int, row: int, step_s: float,
) -> None:  # fmt: skip
    """Put motion and law states of a stage where the laws are asked.

    `value` ``[other stage, channel]`` are forces and rates, `weights` ``[stage, other stage]`` integrate the rates,
    the motion without forces begins at `row` of the end of the stride.
    """
    count = ports.first.size - 1
    for place in range(2 * count):
        ports.motion[place] = stride.end[row + place]
    for place in range(stride.law_start.size):
        ports.state[place] = stride.law_start[place]
    for other in range(weights.shape[1]):
        for port in range(count):
            force = value[other, port]
            for place in range(2 * count):
                ports.motion[place] += tables.couple[level, stage, other, port, place] * force
        for place in range(stride.law_start.size):
            ports.state[place] += step_s * weights[stage, other] * value[other, count + place]


@part_code
def add_forces(tables: SchemeTables, ports: Ports, stride: Stride, value: Matrix, level: int) -> None:
    """Add what the forces ``value [stage, channel]`` make of the state at the end."""
    for stage in range(tables.gain.shape[1]):
        for port in range(ports.first.size - 1):
            force = value[stage, port]
            for row in range(stride.scale.size):
                stride.end[row] += tables.gain[level, stage, port, row] * force


@part_code
def explicit_step(
    tables: SchemeTables, ports: Ports, stride: Stride, level: int, t: float, step_s: float, through: bool
) -> None:
    """Step from ``channels[0]``, the forces and rates at the start, to ``channels[4]``, those at the end."""
    advance_linear(tables.advance, level, stride)
    count, n = ports.first.size - 1, stride.scale.size
    # Two stages in the middle, one at the end, and the end itself: classical Runge-Kutta when A = 0.
    for stage in range(4):
        row = n + 2 * count * (stage // 2)
        place_stage(tables, ports, stride, ports.channels, _WEIGHTS, level, stage, row, step_s)
        port_forces(ports, t + (0.5 if stage < 2 else 1.0) * step_s, stage + 1, through)
    add_forces(tables, ports, stride, ports.channels, level)
    for row in range(2 * count):
        stride.motion_end[row] = ports.motion[row]
    for place in range(stride.law_start.size):
        stride.law_end[place] = ports.state[place]


@part_code
def embedded_difference(ports: Ports, channel: int) -> float:
    """Error of a force or rate, by the embedded formula of order 3 that ends in the new value in place of the last.

    For classical weights 1/6, 2/6, 2/6, 1/6 the pair is in Hairer, Norsett & Wanner (1993), section II.4.
    """
    difference: float = abs(ports.channels[4, channel] - ports.channels[3, channel])
    return difference / 6
