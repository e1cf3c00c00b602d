"""Kernel: what delay lines and outputs between the samples need before, in and after a step."""

import numpy as np

from chladni.models.integrator.delay_kernel import History, fill_lagged
from chladni.models.integrator.dense_kernel import Dense, fill_powers, keep_history, keep_outputs
from chladni.models.integrator.explicit_kernel import Stride
from chladni.models.integrator.implicit_kernel import IMPLICIT_RECORDS
from chladni.models.integrator.machine_code import INSIDE as INSIDE_SIGNATURE
from chladni.models.integrator.machine_code import kernel, part_code
from chladni.models.integrator.march import BEFORE, INSIDE, LEVEL, POSITION, SAMPLE, UNIT, Course
from chladni.models.integrator.plane import opener
from chladni.models.integrator.port_kernel import Ports, port_forces
from chladni.models.integrator.radau import NODES
from chladni.models.integrator.step_tables import DenseTables

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


@part_code
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
    port_forces(ports, t, np.int64(0), np.int64(0))


@part_code
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
