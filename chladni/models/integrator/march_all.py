"""Kernel: marches with everything: stiff laws, delay lines, outputs between the samples.

Apart from the plain march, which most models need alone and which compiles in a third of the time.
"""

import numpy as np
from numpy.typing import NDArray

from chladni.models.integrator.delay_kernel import History, fill_lagged
from chladni.models.integrator.dense_kernel import Dense, fill_powers, keep_history, keep_outputs
from chladni.models.integrator.drive_kernel import Drive, fill_inputs
from chladni.models.integrator.explicit_kernel import Stride, explicit_step
from chladni.models.integrator.implicit_kernel import Newton, implicit_error, implicit_step, is_soft
from chladni.models.integrator.judge_kernel import Judge, explicit_error, is_stiff, look_ahead, weigh
from chladni.models.integrator.machine_code import machine_code, part_code
from chladni.models.integrator.march import (
    AUTOMATIC,
    DEEPER,
    DONE,
    FAILED,
    HARD,
    LAST_RESORT,
    LEVEL,
    LOOKED,
    MORE_HISTORY,
    POSITION,
    PREVIOUS,
    SAMPLE,
    TOO_MANY,
    TRIED,
    UNIT,
    Course,
    accept,
    move_on,
    record,
)  # fmt: skip
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.radau import LAGRANGE, NODES
from chladni.models.integrator.step_tables import DEEPEST, DenseTables, SchemeTables

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]


@machine_code
def march_all(
    explicit: SchemeTables, implicit: SchemeTables, tables: DenseTables, ports: Ports, stride: Stride,
    newton: Newton, history: History, dense: Dense, drive: Drive, course: Course, judge: Judge,
    step_s: float, stop: int, scheme: int, most: int,
) -> int:  # fmt: skip
    """March up to sample `stop`; gives why it ended. What it left behind is enough to go on."""
    cursor = course.cursor
    while cursor[SAMPLE] < stop:
        if history.hint[-1] >= history.begin.size:
            return MORE_HISTORY
        level, share, hard = cursor[LEVEL], 1.0 / (1 << cursor[LEVEL]), cursor[HARD] == 1
        if level >= explicit.advance.shape[0]:
            return DEEPER
        part, length_s = cursor[POSITION] / UNIT, step_s * share
        t = (cursor[SAMPLE] + part) * step_s
        if cursor[POSITION] == 0:
            record(course, ports, stride)
        fill_inputs(drive, stride.inputs, cursor[SAMPLE], part, share, step_s)
        _fill_stage_lags(history, ports, hard, t, length_s)
        error = _attempt(explicit, implicit, ports, stride, newton, drive, course, judge, t, step_s)
        cursor[TRIED] += 1
        if error <= judge.tolerance or (level == DEEPEST and error <= LAST_RESORT):
            _keep(tables, ports, stride, history, dense, course, length_s, t)
            _renew_stiffness(ports, newton, hard)
            accept(ports, stride, judge)
            move_on(cursor, error, judge.tolerance)
            if hard:
                _keep_middle(judge, ports)
                cursor[HARD] = 0 if scheme == AUTOMATIC and is_soft(newton) else 1
            _pass_jump(history, ports, stride, t + length_s, length_s)
        elif level == DEEPEST:
            return FAILED
        elif cursor[TRIED] > most:
            return TOO_MANY
        else:
            _retry(cursor, judge, ports, newton, error, scheme == AUTOMATIC)
    return DONE


@part_code
def _attempt(
    explicit: SchemeTables, implicit: SchemeTables, ports: Ports, stride: Stride, newton: Newton, drive: Drive,
    course: Course, judge: Judge, t: float, step_s: float,
) -> float:  # fmt: skip
    """Make a step by the scheme chosen; gives its relative error, infinite when it has no solution."""
    cursor = course.cursor
    level, hard = cursor[LEVEL], cursor[HARD] == 1
    length_s = step_s / (1 << level)
    solved = True
    if hard:
        solved = implicit_step(implicit, ports, stride, newton, judge, level, t, length_s)
    else:
        explicit_step(explicit, ports, stride, level, t, length_s)
    if stride.grown[0] > 0 and cursor[LOOKED] != cursor[SAMPLE]:
        cursor[LOOKED] = cursor[SAMPLE]
        look_ahead(explicit.advance, drive, ports, stride, cursor[SAMPLE], step_s)
    weigh(judge, stride, ports, level, length_s)
    if not solved:
        return np.inf
    if hard:
        return implicit_error(judge, ports, newton)
    return explicit_error(judge, ports, level, cursor[PREVIOUS])


@part_code
def _retry(cursor: Integers, judge: Judge, ports: Ports, newton: Newton, error: float, automatic: bool) -> None:
    """After a step that was too wrong: the other scheme where a law is stiff, else half the length."""
    if automatic and cursor[HARD] == 0 and is_stiff(judge, ports):
        cursor[HARD] = 1
        return
    cursor[LEVEL] += 1
    # Short steps near a kink are cheaper without Newton; a step without a solution says nothing of stiffness.
    if automatic and cursor[HARD] == 1 and error < np.inf and is_soft(newton):
        cursor[HARD] = 0


@part_code
def _fill_stage_lags(history: History, ports: Ports, hard: bool, t: float, step_s: float) -> None:
    """What delay lines give at the stages of a step."""
    if ports.delay_s.size == 0:
        return
    for stage in range(1, 5):
        if hard:
            fraction = NODES[min(stage, 3) - 1]
        else:
            fraction = 0.5 if stage <= 2 else 1.0
        # Of a jump that falls on the very end, this step sees nothing.
        fill_lagged(history, ports, stage, t + fraction * step_s * (1 - 1e-9))


@part_code
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
    port_forces(ports, t, np.int64(0), False)


@part_code
def _keep(
    tables: DenseTables, ports: Ports, stride: Stride, history: History, dense: Dense, course: Course,
    length_s: float, t: float,
) -> None:  # fmt: skip
    """Keep what is wanted of the inside of the step just made."""
    if dense.place.size == 0 and ports.delay_s.size == 0:
        return
    cursor = course.cursor
    level = cursor[LEVEL]
    fill_powers(dense, ports, cursor[HARD] == 1)
    if ports.delay_s.size > 0:
        keep_history(tables, dense, ports, stride, history, level, t, length_s)
    for instant in range(dense.place.size):
        if cursor[POSITION] <= dense.place[instant] < cursor[POSITION] + (UNIT >> level):
            keep_outputs(tables, dense, ports, stride, history, level, instant, cursor[SAMPLE], t, length_s)


@part_code
def _keep_middle(judge: Judge, ports: Ports) -> None:
    """Forces in the middle of an implicit step, for the error estimate of the next."""
    for channel in range(ports.channels.shape[1]):
        middle = 0.0
        for stage in range(3):
            share = LAGRANGE[0, stage] + 0.5 * LAGRANGE[1, stage] + 0.25 * LAGRANGE[2, stage]
            middle += share * ports.channels[1 + stage, channel]
        judge.before[1, channel] = middle


@part_code
def _renew_stiffness(ports: Ports, newton: Newton, hard: bool) -> None:
    for channel in range(ports.channels.shape[1]):
        newton.stiffness[0, channel] = newton.stiffness[2, channel] if hard else 0.0
        size = abs(ports.channels[4, channel])
        newton.channel_scale[0, channel] = max(newton.channel_scale[0, channel], size)
