"""Kernel: marches by implicit steps where laws are stiff, until they are soft again."""

from chladni.models.integrator.explicit_kernel import Drive, Stride, fill_inputs
from chladni.models.integrator.implicit_kernel import (
    CALL_STEP,
    IMPLICIT_RECORDS,
    Newton,
    implicit_error,
    is_soft,
    least_stiffness,
)
from chladni.models.integrator.judge_kernel import Judge, look_ahead, missed_at_turns, weigh
from chladni.models.integrator.machine_code import ALTERNATE, MARCH, kernel, part_code
from chladni.models.integrator.march import (
    AFTER,
    BEFORE,
    CALL_INSIDE,
    CALL_MARCH,
    DEEPER,
    DONE,
    FAILED,
    HARD,
    INSIDE,
    LAST_RESORT,
    LEVEL,
    LOOKED,
    MORE_HISTORY,
    POSITION,
    SAMPLE,
    SOFT,
    STIFF,
    TOO_MANY,
    TRIED,
    UNIT,
    Course,
    accept,
    move_on,
    record,
)  # fmt: skip
from chladni.models.integrator.plane import opener
from chladni.models.integrator.port_kernel import Ports
from chladni.models.integrator.step_tables import DEEPEST, GAMMA, LAGRANGE, SchemeTables

_OPEN = opener(*IMPLICIT_RECORDS)


@kernel(MARCH)
def march_implicit(book: int, step_s: float, stop: int, automatic: int, most: int, inside: int) -> int:
    """March up to sample `stop`; gives why it ended, see `march`."""
    explicit, ports, stride, drive, course, judge, tables, newton = _OPEN(book)
    cursor = course.cursor
    _begin(course, newton)
    while cursor[SAMPLE] < stop:
        level, share = cursor[LEVEL], 1.0 / (1 << cursor[LEVEL])
        if level >= tables.advance.shape[0]:
            return DEEPER
        part, length_s = cursor[POSITION] / UNIT, step_s * share
        t = (cursor[SAMPLE] + part) * step_s
        if cursor[POSITION] == 0:
            record(course, ports, stride)
        fill_inputs(drive, stride.inputs, cursor[SAMPLE], part, share, step_s)
        if inside != 0 and CALL_INSIDE(inside, (book, BEFORE, 1, t, length_s)) == 1:
            return MORE_HISTORY
        solved = CALL_STEP(newton.address[0], (book, level, t, length_s)) == 1
        _weigh_ahead(explicit, ports, stride, drive, course, judge, step_s)
        cursor[TRIED] += 1
        error = implicit_error(judge, ports, newton)
        error += _error_at_turns(judge, ports, stride, newton, t, length_s)
        if solved and (error <= judge.tolerance[0] or (level == DEEPEST and error <= LAST_RESORT)):
            if inside != 0:
                CALL_INSIDE(inside, (book, INSIDE, 1, t, length_s))
            _renew_stiffness(ports, newton)
            accept(ports, stride, judge)
            move_on(cursor, error, judge.tolerance[0])
            _keep_middle(judge, ports)
            if inside != 0:
                CALL_INSIDE(inside, (book, AFTER, 1, t, length_s))
        elif level == DEEPEST:
            return FAILED
        elif cursor[TRIED] > most:
            return TOO_MANY
        else:
            cursor[LEVEL] += 1
        # Short steps near a kink are cheaper without Newton; a step without a solution says nothing of stiffness.
        if automatic == 1 and solved and is_soft(newton):
            cursor[HARD] = 0
            return SOFT
    return DONE


@kernel(ALTERNATE)
def alternate(
    book: int, soft: int, stiff: int, hard: int, step_s: float, stop: int, automatic: int, most: int, inside: int
) -> int:
    """March by whichever scheme the laws ask for: `soft` and `stiff` are addresses of the marches."""
    while True:
        status = CALL_MARCH(stiff if hard == 1 else soft, (book, step_s, stop, automatic, most, inside))
        if status not in (SOFT, STIFF):
            return status
        hard = 1 if status == STIFF else 0


@part_code
def _begin(course: Course, newton: Newton) -> None:
    """Come from explicit steps: how stiff the last one ended isn't known."""
    if course.cursor[HARD] == 1:
        return
    course.cursor[HARD] = 1
    for channel in range(newton.stiffness.shape[1]):
        newton.stiffness[0, channel] = 0.0


@part_code
def _weigh_ahead(
    explicit: SchemeTables, ports: Ports, stride: Stride, drive: Drive, course: Course, judge: Judge, step_s: float
) -> None:
    cursor = course.cursor
    if stride.grown[0] > 0 and cursor[LOOKED] != cursor[SAMPLE]:
        cursor[LOOKED] = cursor[SAMPLE]
        look_ahead(explicit.advance, drive, ports, stride, cursor[SAMPLE], step_s)
    weigh(judge, stride, ports, cursor[LEVEL], step_s / (1 << cursor[LEVEL]))


@part_code
def _error_at_turns(judge: Judge, ports: Ports, stride: Stride, newton: Newton, t: float, step_s: float) -> float:
    """What the stages missed at turns, damped as the error of the step is."""
    total = 0.0
    for port in range(ports.first.size - 1):
        missed = missed_at_turns(judge, ports, stride, port, 1, t, step_s)
        total += GAMMA * missed / (1 + GAMMA * least_stiffness(newton, port))
    return total


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
def _renew_stiffness(ports: Ports, newton: Newton) -> None:
    for channel in range(ports.channels.shape[1]):
        newton.stiffness[0, channel] = newton.stiffness[2, channel]
        size = abs(ports.channels[4, channel])
        newton.channel_scale[0, channel] = max(newton.channel_scale[0, channel], size)
