"""Kernel: marches through the samples, choosing scheme and step length."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chladni.models.integrator.delay_kernel import History, fill_lagged
from chladni.models.integrator.dense_kernel import Dense, fill_powers, keep_history, keep_outputs
from chladni.models.integrator.explicit_kernel import Stride, embedded_difference, explicit_step
from chladni.models.integrator.implicit_kernel import Newton, collocation_difference, implicit_step
from chladni.models.integrator.machine_code import machine_code, part_code
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.radau import NODES
from chladni.models.integrator.step_tables import DEEPEST, DenseTables, SchemeTables

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Finest steps in a sample interval.
UNIT = 1 << DEEPEST
#: How a march ends.
DONE, DEEPER, MORE_HISTORY, FAILED, TOO_MANY = range(5)
AUTOMATIC, EXPLICIT, IMPLICIT = range(3)
# What the finest step may still be wrong by, relative: a jump inside it can't be met better.
_LAST_RESORT = 1e-4
_GROW = 1 / 40
# Samples that a beginning motion is followed ahead, to know its scale.
_AHEAD = 32


class Course(NamedTuple):
    """Where the march stands, and what it has recorded.

    Attributes
    ----------
    sample, position, level, implicit, previous, accepted, attempts, refined
        In `cursor`: where the march stands (`position` in finest steps), length of the next step, whether it is
        implicit, length of the one before (-1: none), counts of steps, and of intervals between samples that were
        halved.
    state, motion, force
        ``[sample, ...]`` recorded at each sample.
    motion_start
        ``[2 port]`` at the start of the step.
    before
        ``[2, channel]`` forces and rates at the start and in the middle of the step before.
    """

    cursor: Integers
    state: Matrix
    motion: Matrix
    force: Matrix
    motion_start: Matrix
    before: Matrix


class Judge(NamedTuple):
    """How an error is weighed.

    Attributes
    ----------
    effect
        ``[level, port, state]``: what a unit force over the step adds to a state.
    law_scale
        ``[law state]`` largest magnitude so far.
    weight
        ``[channel]`` effect of a channel on the state that it moves most, relative.
    difference
        ``[level change, 5]`` weights of the fourth difference, by how much longer the step before was.
    tolerance
        Of one step, relative.
    """

    effect: Matrix
    law_scale: Matrix
    weight: Matrix
    difference: Matrix
    tolerance: float


class Drive(NamedTuple):
    """Inputs: `rows` of the steps, and how they run inside, see `Hold`."""

    rows: Matrix
    rate: Integers
    straight: Integers
    kinked: Integers
    kink_at: Matrix


@part_code
def fill_start(drive: Drive, stride: Stride, sample: int, position: int, level: int) -> None:
    """Row of inputs of the step that begins at `position` between two samples."""
    n = stride.start.size - drive.rows.shape[1]
    width = drive.rows.shape[1]
    for column in range(width):
        stride.start[n + column] = drive.rows[sample, column]
    if level == 0:
        return
    m, lines, kinks = drive.rate.size, drive.straight.size, drive.kinked.size
    part, share = position / UNIT, 1.0 / (1 << level)
    for line in range(lines):
        rise = drive.rows[sample, m + line]
        stride.start[n + drive.straight[line]] += part * rise
        stride.start[n + m + line] = share * rise
    for kink in range(kinks):
        change, jump = drive.rows[sample, m + lines + kink], drive.rows[sample, m + lines + kinks + kink]
        at = drive.kink_at[kink]
        inside = part <= at < part + share
        stride.start[n + m + lines + kink] = share * change if inside else 0.0
        stride.start[n + m + lines + kinks + kink] = jump if inside else 0.0
        if part > at:
            stride.start[n + drive.kinked[kink]] += (part - at) * change + jump
            line = np.searchsorted(drive.straight, drive.kinked[kink])
            stride.start[n + m + line] += share * change


@part_code
def fill_motions(drive: Drive, stride: Stride, sample: int, tau: float, step_s: float) -> None:
    """Prescribed motions and their rates `tau` seconds into the sample interval: Taylor's series, which ends."""
    m = drive.rate.size
    n = stride.start.size - drive.rows.shape[1]
    for column in range(m):
        if drive.rate[column] >= 0:
            factor, power, place = 1.0, 0, column
            value = drive.rows[sample, place]
            while drive.rate[place] >= 0:
                place = drive.rate[place]
                power += 1
                factor *= tau / power
                value += factor * drive.rows[sample, place]
            line = np.searchsorted(drive.straight, place)
            rise = factor * tau / (power + 1) * drive.rows[sample, m + line] / step_s
            stride.start[n + column] = value + rise


@part_code
def weigh(judge: Judge, stride: Stride, ports: Ports, level: int, step_s: float) -> None:
    """Renew the weight of each channel."""
    count = ports.first.size - 1
    for port in range(count):
        largest = 0.0
        for row in range(stride.scale.size):
            scale = max(stride.scale[row], abs(stride.end[row])) + 1e-250
            largest = max(largest, judge.effect[level, port, row] / scale)
        judge.weight[port] = largest
    for place in range(stride.law_start.size):
        scale = max(judge.law_scale[place], abs(stride.law_end[place])) + 1e-250
        judge.weight[count + place] = step_s / scale


@part_code
def look_ahead(
    advance: Matrix, drive: Drive, ports: Ports, stride: Stride, newton: Newton, judge: Judge,
    sample: int, step_s: float, through: bool,
) -> None:  # fmt: skip
    """Renew the scales by what the coming samples would make of the states without forces.

    A motion that begins grows as a power of time: any step is wrong by a fixed share of it. Its scale is where it
    is about to go.
    """
    n, count, total, rows = stride.scale.size, ports.first.size - 1, stride.start.size, advance.shape[2]
    for row in range(n):
        stride.ahead[row] = stride.start[row]
    for place in range(stride.law_start.size):
        ports.state[place] = stride.law_start[place]
    for coming in range(sample, min(sample + _AHEAD, drive.rows.shape[0])):
        for row in range(rows):
            stride.ahead[total + row] = 0.0
        for column in range(total):
            value = stride.ahead[column] if column < n else drive.rows[coming, column - n]
            for row in range(rows):
                stride.ahead[total + row] += advance[0, column, row] * value
        for row in range(n):
            stride.ahead[row] = stride.ahead[total + row]
            stride.scale[row] = max(stride.scale[row], abs(stride.ahead[row]))
        for row in range(2 * count):
            ports.motion[row] = stride.ahead[total + n + 2 * count + row]
            newton.motion_scale[row] = max(newton.motion_scale[row], abs(ports.motion[row]))
        if stride.law_start.size > 0:
            port_forces(ports, coming * step_s, np.int64(5), through)
        for place in range(stride.law_start.size):
            rate = abs(ports.channels[5, count + place])
            if np.isfinite(rate):
                judge.law_scale[place] = max(judge.law_scale[place], step_s * rate)
                newton.motion_scale[2 * count + place] = judge.law_scale[place]


@part_code
def error_of(course: Course, judge: Judge, ports: Ports, newton: Newton, level: int, implicit: bool) -> float:
    """Relative error of the step just made."""
    q = ports.channels
    total = 0.0
    for channel in range(q.shape[1]):
        if implicit:
            error = collocation_difference(ports, newton, channel)
        else:
            error = embedded_difference(ports, channel) + curvature_error(course, judge, ports, channel, level)
        total += judge.weight[channel] * error
    return total


@part_code
def curvature_error(course: Course, judge: Judge, ports: Ports, channel: int, level: int) -> float:
    """Error of the integral of a force over the step, by its fourth difference over this step and the one before.

    Of a smooth force Simpson's rule misses 1/180 of it. Of a force that bends sharply inside the step (contact
    begins) it misses up to 1/6 of the second difference, which is then as large as the fourth.
    """
    if course.cursor[4] < 0:
        return 0.0
    q, weights = ports.channels, judge.difference
    change = level - course.cursor[4] + DEEPEST
    middle = 0.5 * (q[1, channel] + q[2, channel])
    fourth = abs(
        weights[change, 0] * course.before[0, channel]
        + weights[change, 1] * course.before[1, channel]
        + weights[change, 2] * q[0, channel]
        + weights[change, 3] * middle
        + weights[change, 4] * q[4, channel]
    )
    second = abs(q[0, channel] - 2 * middle + q[4, channel]) + 1e-300
    missed: float = fourth * (1 / 45 + 2 / 3 * min(1.0, 4 * fourth / second))
    return missed


@part_code
def is_stiff(judge: Judge, ports: Ports) -> bool:
    """Whether forces change nearly as much from the first to the second stage in the middle as they did before."""
    q = ports.channels
    again = first = 0.0
    for channel in range(q.shape[1]):
        again += judge.weight[channel] * abs(q[2, channel] - q[1, channel])
        first += judge.weight[channel] * abs(q[1, channel] - q[0, channel])
    return not again <= max(0.3 * first, judge.tolerance)


@part_code
def is_soft(newton: Newton) -> bool:
    """Whether no channel acts back on itself so strongly that an explicit step would be short."""
    for channel in range(newton.stiffness.shape[1]):
        if not abs(newton.stiffness[1, channel]) + abs(newton.stiffness[2, channel]) < 0.2:
            return False
    return True


@part_code
def fill_stage_lags(history: History, ports: Ports, implicit: bool, t: float, step_s: float) -> None:
    """What delay lines give at the stages of a step."""
    if ports.delay_s.size == 0:
        return
    for stage in range(1, 5):
        if implicit:
            fraction = NODES[min(stage, 3) - 1]
        else:
            fraction = 0.5 if stage <= 2 else 1.0
        fill_lagged(history, ports, stage, t + fraction * step_s * (1 - 1e-9))


@part_code
def record(course: Course, ports: Ports, stride: Stride, sample: int) -> None:
    """Keep what is at a sample."""
    for row in range(course.state.shape[1]):
        course.state[sample, row] = stride.start[row]
    for row in range(course.motion.shape[1]):
        course.motion[sample, row] = course.motion_start[row]
    for port in range(course.force.shape[1]):
        course.force[sample, port] = ports.channels[0, port]


@part_code
def accept(
    course: Course, judge: Judge, ports: Ports, stride: Stride, newton: Newton, implicit: bool, level: int
) -> None:
    """Make the end of the step the start of the next."""
    q = ports.channels
    for row in range(course.state.shape[1]):
        stride.start[row] = stride.end[row]
        stride.scale[row] = max(stride.scale[row], abs(stride.end[row]))
    for place in range(stride.law_start.size):
        stride.law_start[place] = stride.law_end[place]
        judge.law_scale[place] = max(judge.law_scale[place], abs(stride.law_end[place]))
    for row in range(course.motion_start.size):
        course.motion_start[row] = stride.motion_end[row]
        newton.motion_scale[row] = max(newton.motion_scale[row], abs(stride.motion_end[row]))
    for place in range(stride.law_start.size):
        newton.motion_scale[course.motion_start.size + place] = judge.law_scale[place]
    for channel in range(q.shape[1]):
        if not implicit:
            course.before[0, channel] = q[0, channel]
            course.before[1, channel] = 0.5 * (q[1, channel] + q[2, channel])
        newton.stiffness[0, channel] = newton.stiffness[2, channel] if implicit else 0.0
        newton.channel_scale[0, channel] = max(newton.channel_scale[0, channel], abs(q[4, channel]))
        q[0, channel] = q[4, channel]
    course.cursor[4] = -1 if implicit else level
    course.cursor[5] += 1


@machine_code
def march(
    explicit: SchemeTables, implicit: SchemeTables, tables: DenseTables, ports: Ports, stride: Stride,
    newton: Newton, history: History, dense: Dense, drive: Drive, course: Course, judge: Judge,
    step_s: float, stop: int, scheme: int, through: bool, most: int,
) -> int:  # fmt: skip
    """March up to sample `stop`; gives why it ended. What it left behind is enough to go on."""
    cursor = course.cursor
    while cursor[0] < stop:
        if history.hint[-1] >= history.begin.size:
            return MORE_HISTORY
        sample, position, level, hard = cursor[0], cursor[1], cursor[2], cursor[3] == 1
        if level >= explicit.advance.shape[0]:
            return DEEPER
        length_s = step_s / (1 << level)
        t = (sample + position / UNIT) * step_s
        if position == 0:
            record(course, ports, stride, sample)
        fill_start(drive, stride, sample, position, level)
        if level > 0:
            fill_motions(drive, stride, sample, t - sample * step_s, step_s)
        fill_stage_lags(history, ports, hard, t, length_s)
        if hard:
            solved = implicit_step(implicit, ports, stride, newton, level, t, length_s)
        else:
            solved = True
            explicit_step(explicit, ports, stride, level, t, length_s, through)
        if stride.grown[0] and cursor[10] != sample:
            cursor[10] = sample
            look_ahead(explicit.advance, drive, ports, stride, newton, judge, sample, step_s, through)
        weigh(judge, stride, ports, level, length_s)
        error = error_of(course, judge, ports, newton, level, hard) if solved else np.inf
        cursor[6] += 1
        if error <= judge.tolerance or (level == DEEPEST and error <= _LAST_RESORT):
            _go_on(tables, ports, stride, newton, history, dense, course, judge, length_s, t, error, through)
            if scheme == AUTOMATIC and hard and is_soft(newton):
                cursor[3] = 0
        elif level == DEEPEST:
            return FAILED
        elif cursor[6] > most:
            return TOO_MANY
        else:
            _retry(course, judge, ports, newton, scheme, hard, solved)
    return DONE


@part_code
def _go_on(
    tables: DenseTables, ports: Ports, stride: Stride, newton: Newton, history: History, dense: Dense,
    course: Course, judge: Judge, length_s: float, t: float, error: float, through: bool,
) -> None:  # fmt: skip
    """Keep what is wanted of the step just made, and go to its end."""
    cursor = course.cursor
    sample, level, hard = cursor[0], cursor[2], cursor[3] == 1
    size = UNIT >> level
    if dense.place.size > 0 or ports.delay_s.size > 0:
        fill_powers(dense, ports, hard)
        if ports.delay_s.size > 0:
            keep_history(tables, dense, ports, stride, history, course.motion_start, level, t, length_s)
        for instant in range(dense.place.size):
            if cursor[1] <= dense.place[instant] < cursor[1] + size:
                keep_outputs(tables, dense, ports, stride, history, level, instant, sample, t, length_s, through)
    accept(course, judge, ports, stride, newton, hard, level)
    if level > 0:
        cursor[7] = 1
    cursor[1] += size
    if cursor[1] == UNIT:
        cursor[0], cursor[1] = sample + 1, 0
        cursor[8] += cursor[7]
        cursor[7] = 0
    if level > cursor[9] and error <= judge.tolerance * _GROW and cursor[1] % (2 * size) == 0:
        cursor[2] = level - 1
    if ports.delay_s.size > 0 and through:
        # A delayed jump may fall on this very instant: the next step starts behind it.
        fill_lagged(history, ports, np.int64(0), t + length_s * (1 + 1e-9))
        for row in range(course.motion_start.size):
            ports.motion[row] = course.motion_start[row]
        for place in range(stride.law_start.size):
            ports.state[place] = stride.law_start[place]
        port_forces(ports, t + length_s, np.int64(0), not through)


@part_code
def _retry(course: Course, judge: Judge, ports: Ports, newton: Newton, scheme: int, hard: bool, solved: bool) -> None:
    """After a step that was too wrong: the other scheme where a law is stiff, else half the length."""
    cursor = course.cursor
    if scheme == AUTOMATIC and not hard and is_stiff(judge, ports):
        cursor[3] = 1
        return
    cursor[2] += 1
    if scheme == AUTOMATIC and hard and solved and is_soft(newton):
        cursor[3] = 0
