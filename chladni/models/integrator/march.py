"""Kernel: marches through the samples by explicit steps, halved where the laws ask for it."""

from typing import NamedTuple

from chladni.models.integrator.explicit_kernel import Drive, Stride, explicit_step, fill_inputs
from chladni.models.integrator.judge_kernel import (
    Judge,
    explicit_error,
    explicit_error_at_turns,
    is_stiff,
    look_ahead,
    weigh,
)
from chladni.models.integrator.machine_code import INSIDE as INSIDE_SIGNATURE
from chladni.models.integrator.machine_code import MARCH, caller, inlined_code, kernel, machine_code
from chladni.models.integrator.plane import Integers1, Numbers2, opener
from chladni.models.integrator.port_kernel import Ports
from chladni.models.integrator.step_tables import DEEPEST, SchemeTables
from chladni.signals.arrays import Real, Whole

#: Finest steps in a sample interval.
UNIT = 1 << DEEPEST
#: How a march ends.
DONE, DEEPER, MORE_HISTORY, FAILED, TOO_MANY, STIFF, SOFT = range(7)
AUTOMATIC, EXPLICIT, IMPLICIT = range(3)
#: What the finest step may still be wrong by, relative: a jump inside it can't be met better.
LAST_RESORT = 1e-4
_GROW = 1 / 40
#: Places in the cursor: where the march stands (the position between samples in finest steps), length of the next
#: step and of the one before (-1: none), whether the next is implicit, counts of steps, of tried steps and of sample
#: intervals that were divided, whether this one was, the longest step allowed, the sample last looked ahead from.
SAMPLE, POSITION, LEVEL, PREVIOUS, HARD, STEPS, TRIED, REFINED, DIVIDED, COARSEST, LOOKED = range(11)


class Course(NamedTuple):
    """Where the march stands, and what it has recorded.

    Attributes
    ----------
    cursor
        Integers, see above.
    point
        ``[sample, state + law state + 2 port]``.
    force
        ``[sample, port]``.
    """

    cursor: Integers1
    point: Numbers2
    force: Numbers2


@inlined_code
def record(course: Course, ports: Ports, stride: Stride) -> None:
    """Keep what is at a sample."""
    sample = course.cursor[SAMPLE]
    for row in range(stride.here.size):
        course.point[sample, row] = stride.here[row]
    for port in range(course.force.shape[1]):
        course.force[sample, port] = ports.channels[0, port]


@inlined_code
def accept(ports: Ports, stride: Stride, judge: Judge) -> None:
    """Make the end of the step the start of the next."""
    for row in range(stride.here.size):
        stride.here[row] = stride.there[row]
        stride.scale[row] = max(stride.scale[row], abs(stride.there[row]))
    q = ports.channels
    for channel in range(q.shape[1]):
        judge.before[0, channel] = q[0, channel]
        judge.before[1, channel] = 0.5 * (q[1, channel] + q[2, channel])
        q[0, channel] = q[4, channel]


@inlined_code
def move_on(cursor: Whole, error: float, tolerance: float) -> None:
    """Go to the end of an accepted step; the next is longer when this was much better than asked for."""
    level = cursor[LEVEL]
    size = UNIT >> level
    cursor[STEPS] += 1
    cursor[PREVIOUS] = level
    if level > 0:
        cursor[DIVIDED] = 1
    cursor[POSITION] += size
    if cursor[POSITION] == UNIT:
        cursor[SAMPLE] += 1
        cursor[POSITION] = 0
        cursor[REFINED] += cursor[DIVIDED]
        cursor[DIVIDED] = 0
    if level > cursor[COARSEST] and error <= tolerance * _GROW and cursor[POSITION] % (2 * size) == 0:
        cursor[LEVEL] = level - 1


#: What a march keeps in its book.
EXPLICIT_RECORDS = (SchemeTables, Ports, Stride, Drive, Course, Judge)
_OPEN = opener(*EXPLICIT_RECORDS)
CALL_MARCH, CALL_INSIDE = caller(MARCH), caller(INSIDE_SIGNATURE)
#: Moments of a step.
BEFORE, INSIDE, AFTER = range(3)


@kernel(MARCH)
def march(book: int, step_s: float, stop: int, automatic: int, most: int, inside: int) -> int:
    """March up to sample `stop`; gives why it ended. What it left behind is enough to go on.

    Parameters
    ----------
    book
        Address of a book that begins with `EXPLICIT_RECORDS`.
    automatic
        1 to end where laws are stiff.
    most
        Steps that may be tried.
    inside
        Address of the kernel `inside`; 0 for a model without delay lines and without outputs between the samples.
    """
    tables, ports, stride, drive, course, judge = _OPEN(book)
    cursor = course.cursor
    while cursor[SAMPLE] < stop:
        level, share = cursor[LEVEL], 1.0 / (1 << cursor[LEVEL])
        if level >= tables.advance.shape[0]:
            return DEEPER
        part, length_s = cursor[POSITION] / UNIT, step_s * share
        t = (cursor[SAMPLE] + part) * step_s
        if cursor[POSITION] == 0:
            record(course, ports, stride)
        fill_inputs(drive, stride.inputs, cursor[SAMPLE], part, share, step_s)
        if inside != 0 and CALL_INSIDE(inside, (book, BEFORE, 0, t, length_s)) == 1:
            return MORE_HISTORY
        explicit_step(tables, ports, stride, level, t, length_s)
        if stride.grown[0] > 0 and cursor[LOOKED] != cursor[SAMPLE]:
            cursor[LOOKED] = cursor[SAMPLE]
            look_ahead(tables.advance, drive, ports, stride, cursor[SAMPLE], step_s)
        weigh(judge, stride, ports, level, length_s)
        error = explicit_error(judge, ports, level, cursor[PREVIOUS])
        error += explicit_error_at_turns(judge, ports, stride, t, length_s)
        cursor[TRIED] += 1
        if error <= judge.tolerance[0] or (level == DEEPEST and error <= LAST_RESORT):
            if inside != 0:
                CALL_INSIDE(inside, (book, INSIDE, 0, t, length_s))
            accept(ports, stride, judge)
            move_on(cursor, error, judge.tolerance[0])
            if inside != 0:
                CALL_INSIDE(inside, (book, AFTER, 0, t, length_s))
        elif level == DEEPEST:
            return FAILED
        elif cursor[TRIED] > most:
            return TOO_MANY
        elif automatic == 1 and is_stiff(judge, ports):
            return STIFF
        else:
            cursor[LEVEL] += 1
    return DONE


@machine_code
def linear_march(advance: Real, rows: Real, state: Real) -> None:
    """``x[k + 1] = Phi x[k] + Gamma row[k]``, exact for inputs that run between samples as `Hold` says.

    Parameters
    ----------
    advance
        ``[state + width, state]``.
    rows
        ``[sample, width]``.
    state
        ``[sample, state]``, the first row given.
    """
    n = state.shape[1]
    for sample in range(state.shape[0] - 1):
        for column in range(advance.shape[0]):
            value = state[sample, column] if column < n else rows[sample, column - n]
            for row in range(n):
                state[sample + 1, row] += advance[column, row] * value
