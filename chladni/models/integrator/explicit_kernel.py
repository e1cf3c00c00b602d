"""Kernel: one explicit exponential Runge-Kutta step of order 4 (Krogstad 2005), and the inputs of a step."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.machine_code import inlined_code
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers2
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.step_tables import SchemeTables
from chladni.signals.arrays import Real

# How rates of law states add up at each stage: the classical scheme.
_WEIGHTS = np.array([[1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0], [1 / 6, 1 / 3, 1 / 3, 1 / 6]])


class Drive(NamedTuple):
    """Inputs: ``rows [sample, width]`` of the steps, and how they run inside, see `Hold`.

    ``line [column]`` is the place of each straight column among the straight ones.
    """

    rows: Numbers2
    rate: Integers1
    line: Integers1
    straight: Integers1
    kinked: Integers1
    kink_at: Numbers1


@inlined_code
def fill_inputs(drive: Drive, inputs: Real, sample: int, part: float, share: float, step_s: float) -> None:
    """Row of the step that begins at `part` of the interval after `sample` and takes a `share` of it."""
    for place in range(inputs.size):
        inputs[place] = drive.rows[sample, place]
    if share == 1.0:
        return
    m, lines = drive.rate.size, drive.straight.size
    for column in range(m):
        # Taylor's series along the rates up to a straight line: for a plain input it's the line itself.
        factor, power, place, value = 1.0, 0.0, column, drive.rows[sample, column]
        while drive.rate[place] >= 0:
            place = drive.rate[place]
            power += 1.0
            factor *= part * step_s / power
            value += factor * drive.rows[sample, place]
        inputs[column] = value + factor * part / (power + 1.0) * drive.rows[sample, m + drive.line[place]]
    for line in range(lines):
        inputs[m + line] *= share
    _fill_kinks(drive, inputs, sample, part, share)


@inlined_code
def _fill_kinks(drive: Drive, inputs: Real, sample: int, part: float, share: float) -> None:
    m, kinks = drive.rate.size, drive.kinked.size
    first = m + drive.straight.size
    for kink in range(kinks):
        change, jump = drive.rows[sample, first + kink], drive.rows[sample, first + kinks + kink]
        since = part - drive.kink_at[kink]
        inside = since <= 0.0 < since + share
        inputs[first + kink] = share * change if inside else 0.0
        inputs[first + kinks + kink] = jump if inside else 0.0
        if since > 0.0:
            inputs[drive.kinked[kink]] += since * change + jump
            inputs[m + drive.line[drive.kinked[kink]]] += share * change


class Stride(NamedTuple):
    """What a step starts from and ends in.

    Attributes
    ----------
    here, there
        ``[state + law state + 2 port]``: states, states of laws, motion at the ports; at the start and at the end.
    scale
        Likewise: largest magnitude so far.
    inputs
        ``[width]`` row of inputs of this step.
    coming
        ``[width]`` that of a step looked ahead at.
    lines
        ``[state + stages of motion]`` rows of `SchemeTables.advance`: all that is linear.
    ahead
        ``[state]`` working memory.
    inner
        ``[2 port]`` motion at the ports at an inner stage: the middle, or the second of Radau's nodes.
    grown
        ``[1]`` whether a state is about to leave its scale.
    """

    here: Numbers1
    there: Numbers1
    scale: Numbers1
    inputs: Numbers1
    coming: Numbers1
    lines: Numbers1
    ahead: Numbers1
    inner: Numbers1
    grown: Integers1


@inlined_code
def advance_linear(advance: Real, level: int, state: Real, inputs: Real, lines: Real) -> None:
    """``lines = [state, inputs] @ advance[level]``: everything but the forces of this step."""
    rows, n = advance.shape[2], advance.shape[1] - inputs.size
    for row in range(rows):
        lines[row] = 0.0
    # By columns: the sum of products along a row can't be vectorised without changing its rounding.
    for column in range(advance.shape[1]):
        value = state[column] if column < n else inputs[column - n]
        for row in range(rows):
            lines[row] += advance[level, column, row] * value


@inlined_code
def note_scale(stride: Stride, n: int) -> None:
    """What a state would do without the forces counts too: where friction holds a body, its rest is no scale."""
    stride.grown[0] = 0
    for row in range(n):
        size = abs(stride.lines[row])
        if size > stride.scale[row]:
            if size > 2 * stride.scale[row]:
                stride.grown[0] = 1
            stride.scale[row] = size


@inlined_code
def place_stage(
    tables: SchemeTables, ports: Ports, stride: Stride, value: Real, weights: Real,
    level: int, stage: int, row: int, step_s: float,
) -> None:  # fmt: skip
    """Put motion and law states of a stage where the laws are asked.

    `value` ``[other stage, channel]`` are forces and rates, `weights` ``[stage, other stage]`` integrate the rates,
    the motion without forces begins at `row` of the lines.
    """
    count, n = ports.first.size - 1, tables.gain.shape[3]
    for place in range(2 * count):
        ports.motion[place] = stride.lines[row + place]
    for place in range(ports.state.size):
        ports.state[place] = stride.here[n + place]
    for other in range(weights.shape[1]):
        for port in range(count):
            force = value[other, port]
            for place in range(2 * count):
                ports.motion[place] += tables.couple[level, stage, other, port, place] * force
        for place in range(ports.state.size):
            ports.state[place] += step_s * weights[stage, other] * value[other, count + place]


@inlined_code
def add_forces(tables: SchemeTables, ports: Ports, stride: Stride, value: Real, level: int) -> None:
    """State at the end, with what the forces ``value [stage, channel]`` make of it."""
    n = tables.gain.shape[3]
    for row in range(n):
        stride.there[row] = stride.lines[row]
    for stage in range(tables.gain.shape[1]):
        for port in range(ports.first.size - 1):
            force = value[stage, port]
            for row in range(n):
                stride.there[row] += tables.gain[level, stage, port, row] * force


@inlined_code
def explicit_step(tables: SchemeTables, ports: Ports, stride: Stride, level: int, t: float, step_s: float) -> None:
    """Step from ``channels[0]``, the forces and rates at the start, to ``channels[4]``, those at the end."""
    count, n = ports.first.size - 1, tables.gain.shape[3]
    advance_linear(tables.advance, level, stride.here, stride.inputs, stride.lines)
    note_scale(stride, n)
    # Two stages in the middle, one at the end, and the end itself: classical Runge-Kutta when A = 0.
    for stage in range(4):
        row = n + 2 * count * (stage // 2)
        place_stage(tables, ports, stride, ports.channels, _WEIGHTS, level, stage, row, step_s)
        port_forces(ports, t + (0.5 if stage < 2 else 1.0) * step_s, stage + 1, np.int64(1))
        if stage == 1:
            for place in range(2 * count):
                stride.inner[place] = ports.motion[place]
    add_forces(tables, ports, stride, ports.channels, level)
    keep_end(ports, stride, n)


@inlined_code
def keep_end(ports: Ports, stride: Stride, n: int) -> None:
    """Law states and motion at the end are those at which the laws were asked last."""
    states = ports.state.size
    for place in range(states):
        stride.there[n + place] = ports.state[place]
    for row in range(ports.motion.size):
        stride.there[n + states + row] = ports.motion[row]
