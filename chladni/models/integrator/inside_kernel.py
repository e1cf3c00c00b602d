"""Kernel: what delay lines and outputs between the samples need before, in and after a step, and motion inside it."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.explicit_kernel import Stride
from chladni.models.integrator.implicit_kernel import IMPLICIT_RECORDS
from chladni.models.integrator.machine_code import INSIDE as INSIDE_SIGNATURE
from chladni.models.integrator.machine_code import inlined_code, kernel, part_code
from chladni.models.integrator.march import BEFORE, INSIDE, LEVEL, POSITION, SAMPLE, UNIT, Course
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers2, Numbers3, opener
from chladni.models.integrator.port_kernel import History, Ports, fill_lagged, port_forces
from chladni.models.integrator.step_tables import LAGRANGE, NODES, DenseTables


class Dense(NamedTuple):
    """Working memory and results inside steps.

    Attributes
    ----------
    row
        ``[2 port + output]``.
    power
        ``[3, channel]``: forces and rates as polynomials of the fraction of the step.
    place
        ``[instant]`` where each wanted instant falls, in units of the finest step.
    force_output
        ``[output, port]``: what forces add to outputs at once.
    output
        ``[instant, output, sample]`` result.
    """

    row: Numbers1
    power: Numbers2
    place: Integers1
    force_output: Numbers2
    output: Numbers3


@inlined_code
def fill_powers(dense: Dense, ports: Ports, implicit: bool) -> None:
    """Polynomials through the forces and rates of the stages of the step just made."""
    q = ports.channels
    for channel in range(q.shape[1]):
        if implicit:
            for power in range(3):
                total = 0.0
                for stage in range(3):
                    total += LAGRANGE[power, stage] * q[1 + stage, channel]
                dense.power[power, channel] = total
        else:
            start, middle, end = q[0, channel], 0.5 * (q[1, channel] + q[2, channel]), q[4, channel]
            dense.power[0, channel] = start
            dense.power[1, channel] = 4 * middle - 3 * start - end
            dense.power[2, channel] = 2 * (start + end) - 4 * middle


@part_code
def fill_row(tables: DenseTables, dense: Dense, ports: Ports, stride: Stride, level: int, instant: int) -> None:
    """Motion at the ports and outputs at one instant, without what forces add at once."""
    rows, count = dense.row.size, ports.first.size - 1
    for row in range(rows):
        dense.row[row] = 0.0
    n = tables.advance.shape[2] - stride.inputs.size
    for column in range(tables.advance.shape[2]):
        value = stride.here[column] if column < n else stride.inputs[column - n]
        for row in range(rows):
            dense.row[row] += tables.advance[level, instant, column, row] * value
    for power in range(3):
        for port in range(count):
            value = dense.power[power, port]
            for row in range(rows):
                dense.row[row] += tables.couple[level, instant, power, port, row] * value


@inlined_code
def keep_history(
    tables: DenseTables, dense: Dense, ports: Ports, stride: Stride, history: History,
    level: int, t: float, step_s: float,
) -> None:  # fmt: skip
    """Add the step just made to the history of the delay lines."""
    step, count = history.hint[history.hint.size - 1], ports.first.size - 1
    motion = stride.here.size - 2 * count
    history.begin[step], history.length[step] = t, step_s
    for delay in range(ports.delay_s.size):
        history.value[step, delay, 0] = stride.here[motion + ports.delay_port[delay]]
        history.value[step, delay, 4] = stride.there[motion + ports.delay_port[delay]]
    for node in range(3):
        instant = tables.fraction.shape[1] - 3 + node
        fill_row(tables, dense, ports, stride, level, instant)
        x = tables.fraction[level, instant]
        for delay in range(ports.delay_s.size):
            port = ports.delay_port[delay]
            value = dense.row[port]
            for other in range(count):
                force = dense.power[0, other] + x * (dense.power[1, other] + x * dense.power[2, other])
                value += ports.through[0, port, other] * force
            history.value[step, delay, 1 + node] = value
    history.hint[history.hint.size - 1] = step + 1


@inlined_code
def keep_outputs(
    tables: DenseTables, dense: Dense, ports: Ports, stride: Stride, history: History,
    level: int, instant: int, sample: int, t: float, step_s: float,
) -> None:  # fmt: skip
    """Outputs at a wanted instant inside the step just made, from the laws at the motion there."""
    fill_row(tables, dense, ports, stride, level, instant)
    count = ports.first.size - 1
    x = tables.fraction[level, instant]
    for row in range(2 * count):
        ports.motion[row] = dense.row[row]
    n = tables.advance.shape[2] - stride.inputs.size
    for place in range(ports.state.size):
        rate = dense.power[0, count + place]
        rate += x * (dense.power[1, count + place] / 2 + x * dense.power[2, count + place] / 3)
        ports.state[place] = stride.here[n + place] + step_s * x * rate
    fill_lagged(history, ports, np.int64(5), t + x * step_s)
    if ports.looped[0] == 0:
        port_forces(ports, t + x * step_s, np.int64(5), np.int64(1))
    for output in range(dense.force_output.shape[0]):
        value = dense.row[2 * count + output]
        for port in range(count):
            # In a loop of laws no order of evaluation exists: there the polynomial of the step is taken.
            force = dense.power[0, port] + x * (dense.power[1, port] + x * dense.power[2, port])
            value += dense.force_output[output, port] * (force if ports.looped[0] == 1 else ports.channels[5, port])
        dense.output[instant, output, sample] = value


#: What a march with everything keeps in its book.
ALL_RECORDS = (*IMPLICIT_RECORDS, DenseTables, History, Dense)
_OPEN = opener(*ALL_RECORDS)


@kernel(INSIDE_SIGNATURE)
def inside(book: int, moment: int, hard: int, t: float, length_s: float) -> int:
    """Do what is due at a moment of a step from `t`; 1 when the history has no room for the step."""
    _, ports, stride, _, course, _, _, _, tables, history, dense = _OPEN(book)
    if moment == BEFORE:
        if history.hint[history.hint.size - 1] >= history.begin.size:
            return 1
        _fill_stage_lags(history, ports, hard, t, length_s)
    elif moment == INSIDE:
        _keep(tables, ports, stride, history, dense, course, hard, length_s, t)
    else:
        _pass_jump(history, ports, stride, t + length_s, length_s)
    return 0


@inlined_code
def _fill_stage_lags(history: History, ports: Ports, hard: int, t: float, step_s: float) -> None:
    """What delay lines give at the stages of a step."""
    if ports.delay_s.size == 0:
        return
    for stage in range(1, 5):
        if hard == 1:
            fraction = NODES[min(stage, 3) - 1]
        else:
            fraction = 0.5 if stage <= 2 else 1.0
        # Of a jump that falls on the very end, this step sees nothing.
        fill_lagged(history, ports, stage, t + fraction * step_s * (1 - 1e-9))


@inlined_code
def _pass_jump(history: History, ports: Ports, stride: Stride, t: float, step_s: float) -> None:
    """Renew the forces at the start of the next step: a delayed jump may fall on this very instant."""
    if ports.delay_s.size == 0:
        return
    fill_lagged(history, ports, np.int64(0), t + step_s * 1e-9)
    motion = stride.here.size - ports.motion.size
    for row in range(ports.motion.size):
        ports.motion[row] = stride.here[motion + row]
    for place in range(ports.state.size):
        ports.state[place] = stride.here[motion - ports.state.size + place]
    port_forces(ports, t, np.int64(0), np.int64(0))


@inlined_code
def _keep(
    tables: DenseTables, ports: Ports, stride: Stride, history: History, dense: Dense, course: Course,
    hard: int, length_s: float, t: float,
) -> None:  # fmt: skip
    """Keep what is wanted of the inside of the step just made."""
    cursor = course.cursor
    level = cursor[LEVEL]
    fill_powers(dense, ports, hard == 1)
    if ports.delay_s.size > 0:
        keep_history(tables, dense, ports, stride, history, level, t, length_s)
    for instant in range(dense.place.size):
        if cursor[POSITION] <= dense.place[instant] < cursor[POSITION] + (UNIT >> level):
            keep_outputs(tables, dense, ports, stride, history, level, instant, cursor[SAMPLE], t, length_s)
