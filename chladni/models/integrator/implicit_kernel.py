"""Kernel: one implicit exponential step, collocation of forces and law states at Radau's nodes by damped Newton."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.explicit_kernel import (
    Stride,
    add_forces,
    advance_linear,
    keep_end,
    note_scale,
    place_stage,
)  # fmt: skip
from chladni.models.integrator.judge_kernel import Judge
from chladni.models.integrator.machine_code import STEP, caller, kernel, part_code
from chladni.models.integrator.march import EXPLICIT_RECORDS
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers2, Numbers3, opener
from chladni.models.integrator.port_kernel import Ports, law_force, port_forces
from chladni.models.integrator.step_tables import GAMMA, LAGRANGE, NODES, WEIGHTS, SchemeTables
from chladni.signals.arrays import Real

STAGES = 3
_ITERATIONS = 30
_HALVINGS = 12
# Newton ends when its last correction, which the next would square, is this small beside the forces.
_CLOSE = 1e-9
_UNFELT = 1e-4


class Newton(NamedTuple):
    """Working memory of the implicit step; channels are forces, then rates of law states.

    Attributes
    ----------
    value, trial
        ``[stage, channel]``.
    change, residual
        ``[stage * channel]``.
    slope
        ``[stage, channel, 2 port + law state]``: derivatives of the laws.
    matrix
        ``[stage * channel, stage * channel]``.
    channel_scale
        ``[2, channel]`` largest magnitude at ends of steps so far, and with the first guess.
    stiffness
        ``[3, channel]``: how strongly a channel acts back on itself within a step: at the start, the least at
        the stages, at the end.
    address
        ``[1]`` of `implicit_step`.
    """

    value: Numbers2
    trial: Numbers2
    change: Numbers1
    residual: Numbers1
    slope: Numbers3
    matrix: Numbers2
    channel_scale: Numbers2
    stiffness: Numbers2
    address: Integers1


#: What both marches keep in their book.
IMPLICIT_RECORDS = (*EXPLICIT_RECORDS, SchemeTables, Newton)
_OPEN = opener(*IMPLICIT_RECORDS)
CALL_STEP = caller(STEP)


@kernel(STEP)
def implicit_step(book: int, level: int, t: float, step_s: float) -> int:
    """Step from ``channels[0]`` to ``channels[4]``; the stages are in ``channels[1:4]``. 0 without a solution."""
    _, ports, stride, _, _, judge, tables, newton = _OPEN(book)
    n = tables.gain.shape[3]
    advance_linear(tables.advance, level, stride.here, stride.inputs, stride.lines)
    note_scale(stride, n)
    channels = ports.channels.shape[1]
    for stage in range(STAGES):
        for channel in range(channels):
            newton.value[stage, channel] = ports.channels[0, channel]
    _first_residual(tables, ports, stride, newton, judge, level, t, step_s)
    for _ in range(_ITERATIONS):
        _linearise(tables, ports, stride, newton, level, t, step_s)
        if not solve_in_place(newton.matrix, newton.residual, newton.change):
            return 0
        _scale_silent(newton)
        size = _residual_size(newton)
        largest = 0.0
        for place in range(STAGES * channels):
            scale = newton.channel_scale[1, place % channels] + 1e-300
            largest = max(largest, abs(newton.change[place]) / scale)
        if not np.isfinite(largest):
            return 0
        if largest <= _CLOSE:
            for place in range(STAGES * channels):
                newton.value[place // channels, place % channels] += newton.change[place]
            _finish(tables, ports, stride, newton, level, step_s)
            return 1
        size = _damped(tables, ports, stride, newton, level, t, step_s, size)
        if size < 0:
            return 0
    return 0


@part_code
def _scale_silent(newton: Newton) -> None:
    """A channel without any scale (a law state at rest, whose force is 0) takes that of its first correction."""
    channels = newton.channel_scale.shape[1]
    for channel in range(channels):
        if newton.channel_scale[1, channel] == 0.0:
            for stage in range(STAGES):
                size = abs(newton.change[stage * channels + channel])
                newton.channel_scale[1, channel] = max(newton.channel_scale[1, channel], size)


@part_code
def _first_residual(
    tables: SchemeTables, ports: Ports, stride: Stride, newton: Newton, judge: Judge,
    level: int, t: float, step_s: float,
) -> None:  # fmt: skip
    """Residual of the first guess, whose forces count for the scale of this step only: they may be far off."""
    channels = ports.channels.shape[1]
    for channel in range(channels):
        scale = max(newton.channel_scale[0, channel], abs(ports.channels[0, channel]))
        # A force that moves no state by a share of the tolerance worth naming need not be found more closely.
        if judge.weight[channel] > 0.0:
            scale = max(scale, _UNFELT * min(judge.tolerance[0], 1e-7) / (_CLOSE * judge.weight[channel]))
        newton.channel_scale[1, channel] = scale
    _residual(tables, ports, stride, newton, newton.value, level, t, step_s)
    for place in range(STAGES * channels):
        found = abs(newton.residual[place] + newton.value[place // channels, place % channels])
        newton.channel_scale[1, place % channels] = max(newton.channel_scale[1, place % channels], found)


@part_code
def _damped(
    tables: SchemeTables,
    ports: Ports,
    stride: Stride,
    newton: Newton,
    level: int,
    t: float,
    step_s: float,
    size: float,
) -> float:
    """Move along Newton's direction as far as the residual falls; gives its new size, negative when it doesn't."""
    channels = ports.channels.shape[1]
    factor = 1.0
    for _ in range(_HALVINGS):
        for place in range(STAGES * channels):
            newton.trial[place // channels, place % channels] = (
                newton.value[place // channels, place % channels] + factor * newton.change[place]
            )
        new = _residual(tables, ports, stride, newton, newton.trial, level, t, step_s)
        # At rounding the residual can't fall any further.
        if new <= (1 - 0.1 * factor) * size or new <= _CLOSE:
            for place in range(STAGES * channels):
                newton.value[place // channels, place % channels] = newton.trial[place // channels, place % channels]
            return new
        factor *= 0.5
    return -1.0


@part_code
def _ask_at(
    tables: SchemeTables, ports: Ports, stride: Stride, value: Real, level: int, stage: int, step_s: float
) -> None:
    """Put motion and law states of a stage where the laws are asked, as the forces and rates in `value` make them."""
    count = ports.first.size - 1
    row = tables.gain.shape[3] + 2 * count * stage
    place_stage(tables, ports, stride, value, WEIGHTS, level, stage, row, step_s)
    for moved in range(2 * count):
        for port in range(count):
            ports.motion[moved] += ports.through[moved // count, moved % count, port] * value[stage, port]


@part_code
def _residual(
    tables: SchemeTables,
    ports: Ports,
    stride: Stride,
    newton: Newton,
    value: Real,
    level: int,
    t: float,
    step_s: float,
) -> float:
    """Laws at the stages less `value`; gives the largest, each beside the scale of its channel."""
    channels = ports.channels.shape[1]
    for stage in range(STAGES):
        _ask_at(tables, ports, stride, value, level, stage, step_s)
        port_forces(ports, t + NODES[stage] * step_s, 1 + stage, np.int64(0))
        for channel in range(channels):
            found = ports.channels[1 + stage, channel]
            newton.residual[stage * channels + channel] = found - value[stage, channel]
    return _residual_size(newton)


@part_code
def _residual_size(newton: Newton) -> float:
    largest = 0.0
    channels = newton.channel_scale.shape[1]
    for place in range(newton.residual.size):
        size = abs(newton.residual[place]) / (newton.channel_scale[1, place % channels] + 1e-300)
        # A law that gave no number must not pass as a small residual.
        largest = size if not size <= largest else largest
    return largest


@part_code
def _linearise(
    tables: SchemeTables, ports: Ports, stride: Stride, newton: Newton, level: int, t: float, step_s: float
) -> None:
    for stage in range(STAGES):
        _ask_at(tables, ports, stride, newton.value, level, stage, step_s)
        if stage == 1:
            for place in range(ports.motion.size):
                stride.inner[place] = ports.motion[place]
        _law_slopes(ports, stride, newton, stage, t + NODES[stage] * step_s)
    _fill_matrix(tables, ports, newton, level, step_s)


@part_code
def _law_slopes(ports: Ports, stride: Stride, newton: Newton, stage: int, t: float) -> None:
    """Derivatives of forces and rates with respect to displacement, velocity and law states, by differences."""
    count, channels = ports.first.size - 1, ports.channels.shape[1]
    for row in range(channels):
        for column in range(2 * count + ports.state.size):
            newton.slope[stage, row, column] = 0.0
    for delay in range(ports.delay_s.size):
        newton.slope[stage, ports.delay_port[delay], ports.delay_port[delay]] -= 1.0
    for port in range(count):
        for law in range(ports.first[port], ports.first[port + 1]):
            begin = ports.table[law, 2]
            end = ports.table[law + 1, 2] if law + 1 < ports.table.shape[0] else channels - count
            d, s = ports.motion[port], ports.motion[count + port]
            force = law_force(ports, law, d, s, t, np.int64(5))
            for argument in range(2 + end - begin):
                place = (port, count + port)[argument] if argument < 2 else 2 * count + begin + argument - 2
                here = ports.motion[place] if argument < 2 else ports.state[place - 2 * count]
                by = 1e-8 * max(abs(here), stride.scale[_scale_place(ports, stride, place)]) + 1e-200
                if argument == 0:
                    moved = law_force(ports, law, d + by, s, t, np.int64(6))
                elif argument == 1:
                    moved = law_force(ports, law, d, s + by, t, np.int64(6))
                else:
                    ports.state[place - 2 * count] = here + by
                    moved = law_force(ports, law, d, s, t, np.int64(6))
                    ports.state[place - 2 * count] = here
                newton.slope[stage, port, place] += (moved - force) / by
                for row in range(count + begin, count + end):
                    newton.slope[stage, row, place] = (ports.channels[6, row] - ports.channels[5, row]) / by


@part_code
def _scale_place(ports: Ports, stride: Stride, place: int) -> int:
    """Where the scale of an argument of the laws is kept: motions come after law states there."""
    motions, states = ports.motion.size, ports.state.size
    first = stride.scale.size - motions - states
    return first + states + place if place < motions else first + place - motions


@part_code
def _fill_matrix(tables: SchemeTables, ports: Ports, newton: Newton, level: int, step_s: float) -> None:
    """One less the derivative of the laws at the stages with respect to the forces and rates at the stages."""
    count, channels = ports.first.size - 1, ports.channels.shape[1]
    for stage in range(STAGES):
        for row in range(channels):
            for other in range(STAGES):
                for channel in range(channels):
                    value = 0.0
                    if channel < count:
                        for moved in range(2 * count):
                            by = tables.couple[level, stage, other, channel, moved]
                            if stage == other:
                                by += ports.through[moved // count, moved % count, channel]
                            value += newton.slope[stage, row, moved] * by
                    else:
                        place = 2 * count + channel - count
                        value = newton.slope[stage, row, place] * step_s * WEIGHTS[stage, other]
                    diagonal = 1.0 if stage == other and row == channel else 0.0
                    newton.matrix[stage * channels + row, other * channels + channel] = diagonal - value


@part_code
def solve_in_place(matrix: Real, right: Real, result: Real) -> bool:
    """Gaussian elimination with row exchange; `matrix` is overwritten. False when it's singular."""
    size = right.size
    for row in range(size):
        result[row] = right[row]
    for step in range(size):
        if not _exchange(matrix, result, step):
            return False
        for row in range(step + 1, size):
            factor = matrix[row, step] / matrix[step, step]
            if factor != 0.0:
                for column in range(step + 1, size):
                    matrix[row, column] -= factor * matrix[step, column]
                result[row] -= factor * result[step]
    for row in range(size - 1, -1, -1):
        for column in range(row + 1, size):
            result[row] -= matrix[row, column] * result[column]
        result[row] /= matrix[row, row]
    return True


@part_code
def _exchange(matrix: Real, result: Real, step: int) -> bool:
    """Bring the row with the largest pivot into its place."""
    best = step
    for row in range(step + 1, result.size):
        if abs(matrix[row, step]) > abs(matrix[best, step]):
            best = row
    if not abs(matrix[best, step]) > 0.0:
        return False
    if best != step:
        for column in range(step, result.size):
            matrix[step, column], matrix[best, column] = matrix[best, column], matrix[step, column]
        result[step], result[best] = result[best], result[step]
    return True


@part_code
def _finish(tables: SchemeTables, ports: Ports, stride: Stride, newton: Newton, level: int, step_s: float) -> None:
    """State at the end, and how strongly each channel acted back on itself at the least."""
    channels = ports.channels.shape[1]
    _ask_at(tables, ports, stride, newton.value, level, STAGES - 1, step_s)
    keep_end(ports, stride, tables.gain.shape[3])
    add_forces(tables, ports, stride, newton.value, level)
    for stage in range(STAGES):
        for channel in range(channels):
            ports.channels[1 + stage, channel] = newton.value[stage, channel]
    for channel in range(channels):
        ports.channels[4, channel] = newton.value[STAGES - 1, channel]
        for stage in range(STAGES):
            back = _acts_back(tables, ports, newton, level, stage, channel, step_s)
            newton.stiffness[1, channel] = back if stage == 0 else min(newton.stiffness[1, channel], back)
        newton.stiffness[2, channel] = back


@part_code
def _acts_back(
    tables: SchemeTables, ports: Ports, newton: Newton, level: int, stage: int, channel: int, step_s: float
) -> float:
    """What a constant force or rate over the step takes away from itself through the motion that it makes."""
    count = ports.first.size - 1
    if channel >= count:
        back: float = -newton.slope[stage, channel, count + channel] * step_s
        return back
    total = 0.0
    for moved in range(2 * count):
        for other in range(STAGES):
            total -= newton.slope[stage, channel, moved] * tables.couple[level, STAGES - 1, other, channel, moved]
    return max(total, 0.0)


@part_code
def implicit_error(judge: Judge, ports: Ports, newton: Newton) -> float:
    """Relative error: what the polynomials miss at the start of the step (Hairer & Wanner 1996, section IV.8).

    Damped as the law itself damps, where it is stiff at the start and at every stage: a transient that has died
    out is no error. Where it's stiff at some of them only, something switched.
    """
    total = 0.0
    for channel in range(ports.channels.shape[1]):
        missed = ports.channels[0, channel]
        for stage in range(STAGES):
            missed -= LAGRANGE[0, stage] * ports.channels[1 + stage, channel]
        total += judge.weight[channel] * GAMMA * abs(missed) / (1 + GAMMA * least_stiffness(newton, channel))
    return total


@part_code
def least_stiffness(newton: Newton, channel: int) -> float:
    """How strongly a channel acts back on itself at the start and at every stage, at the least."""
    least: float = max(0.0, min(newton.stiffness[0, channel], newton.stiffness[1, channel]))
    return least


@part_code
def is_soft(newton: Newton) -> bool:
    """Whether no channel acts back on itself so strongly that an explicit step would be short."""
    for channel in range(newton.stiffness.shape[1]):
        if not abs(newton.stiffness[1, channel]) + abs(newton.stiffness[2, channel]) < 0.2:
            return False
    return True
