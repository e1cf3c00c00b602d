"""Free runs of a model with laws in steps of the log's own rate: quick, for fits that ask a hundred times."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import responses
from chladni.models.integrator.hold import hold_of
from chladni.models.integrator.plane import book
from chladni.models.integrator.port_kernel import Ports, ports_of
from chladni.models.integrator.port_plan import LawTable, PortPlan, law_table, port_plan
from chladni.models.integrator.trapezoid_kernel import DeadTimes, March, Room, law_march
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError

Windows = Sequence[tuple[int, int]]
#: Share of steps whose forces may miss their laws.
_MAY_FAIL = 1e-3
#: Displacements that the cubic of a dead time goes through.
_NODES = 4


@dataclass(frozen=True, slots=True)
class Equations:
    """A compiled model with laws as a recursion of steps between samples.

    Attributes
    ----------
    step, ends, start, through
        See `March`; `start` with the columns of the forces too: ``[2 port, state + width + port]``.
    output
        ``[output, state + width + port]``.
    rows
        ``[step, width]`` inputs of all steps of the record.
    laws
        Addresses, parameters and first states.
    delays
        Dead times in loops.
    parts
        Steps between samples.
    """

    step: Real
    ends: Real
    start: Real
    through: Real
    output: Real
    rows: Real
    laws: LawTable
    delays: DeadTimes
    plan: PortPlan
    parts: int


def equations(compiled: CompiledModel, inputs: Real, rows: Whole, sample_rate_hz: float, parts: int) -> Equations:
    """Make the tables of a compiled model.

    Parameters
    ----------
    inputs
        ``[step, width]`` of the whole record, see `Hold`.
    rows
        Outputs that are wanted.
    parts
        Steps between samples.
    """
    hold = hold_of(compiled, sample_rate_hz)
    plan = port_plan(compiled, hold)
    p, m = len(plan.ports), hold.columns
    response = responses(
        plan.a, plan.b, plan.g, hold,
        step_s=1.0 / (sample_rate_hz * parts), kink_at=hold.kink_at, fractions=np.ones(1),
    )[0]  # fmt: skip
    early, late = response.force[0] - response.force[1], response.force[1]
    at_once = plan.through.reshape(2 * p, p)
    moved = plan.motion_state @ response.state + plan.motion_column @ response.column
    ends = plan.motion_state @ late + at_once
    padding = np.zeros((2 * p, hold.width - m))
    none = np.zeros((rows.size, hold.width - m))
    return Equations(
        step=np.block([[response.state, early, late], [moved, plan.motion_state @ early, ends]]),
        ends=np.ascontiguousarray(ends),
        start=np.hstack([plan.motion_state, plan.motion_column, padding, at_once]),
        through=np.ascontiguousarray(at_once),
        output=np.hstack([plan.c[rows], plan.d[rows], none, plan.h[rows]]),
        rows=inputs,
        laws=law_table(compiled, plan),
        delays=_dead_times(plan, sample_rate_hz * parts),
        plan=plan,
        parts=parts,
    )


def _dead_times(plan: PortPlan, step_rate_hz: float) -> DeadTimes:
    """Lay out the dead times of a model for steps at a rate, two displacements on either side where there are two."""
    steps = plan.delay_s * step_rate_hz
    ago = np.maximum(np.floor(steps).astype(np.int64) - 1, 0)
    nodes = np.arange(float(_NODES))
    share = np.ones((steps.size, _NODES))
    for place, node in enumerate(nodes):
        others = nodes[nodes != node]
        share[:, place] = np.prod((steps - ago)[:, None] - others, axis=1) / np.prod(node - others)
    return DeadTimes(plan.delay_port.astype(np.int64), ago, share)


@dataclass(frozen=True, slots=True)
class Marched:
    """What a march gives: the records of each window, and outputs ``[output, sample]``."""

    records: tuple[March, ...]
    outputs: Real


def run_laws(equation: Equations, windows: Windows, initial: Real, sample_rate_hz: float) -> Marched:
    """March through all windows.

    Raises
    ------
    ModelError
        When the model diverges, or laws can't be met by these steps.
    """
    room = kernel_room(equation)
    ports = kernel_ports(equation)
    h = 1.0 / (sample_rate_hz * equation.parts)
    records, failed = [], 0
    for (start, stop), first in zip(windows, initial, strict=True):
        record = new_record(equation, start, stop, first)
        words = book(record, ports, equation.delays, room)
        failed += law_march(words.ctypes.data, h, start / sample_rate_hz)
        if not np.all(np.isfinite(record.x[-1])):
            raise ModelError(f"the model diverges between {start / sample_rate_hz:g} and {stop / sample_rate_hz:g} s")
        records.append(record)
    if failed > _MAY_FAIL * len(equation.rows):
        raise ModelError(f"laws are missed by {failed} of {len(equation.rows)} steps")
    # A law's force may leave all numbers where the states didn't yet.
    with np.errstate(over="ignore", invalid="ignore"):
        parts = [_outputs(equation, record) for record in records]
    if not all(np.all(np.isfinite(part)) for part in parts):
        raise ModelError("the model diverges: a law's force leaves all numbers")
    return Marched(tuple(records), parts[0] if len(parts) == 1 else np.hstack(parts))


def _outputs(equation: Equations, record: March) -> Real:
    every = slice(None, None, equation.parts)
    n, width = record.x.shape[1], record.rows.shape[1]
    output = equation.output
    found = output[:, :n] @ record.x[every].T + output[:, n : n + width] @ record.rows[every].T
    return np.asarray(found + output[:, n + width :] @ record.force[every].T)


def new_record(equation: Equations, start: int, stop: int, first: Real) -> March:
    """Room for the march through one window from its first state."""
    steps = (stop - start - 1) * equation.parts + 1
    rows = equation.rows[start * equation.parts :][:steps]
    n, p, count = first.size, len(equation.plan.ports), equation.laws.state.size
    x, state = np.zeros((steps, n)), np.zeros((steps, count))
    x[0], state[0] = first, equation.laws.state
    width = n + equation.rows.shape[1]
    return March(
        equation.step, equation.ends, np.ascontiguousarray(equation.start[:, :width]), equation.through, rows,
        x, np.zeros((steps, 2 * p)), np.zeros((steps, p)), state,
    )  # fmt: skip


def kernel_ports(equation: Equations) -> Ports:
    """Laws for the kernels; slopes exchange the parameters of one."""
    ports = ports_of(equation.plan, equation.laws)
    return ports._replace(table=ports.table.copy())


def kernel_room(equation: Equations) -> Room:
    """Room for one step."""
    p, count = len(equation.plan.ports), equation.laws.state.size
    return Room(
        np.zeros(4 * p + count), np.zeros(count), np.zeros(p), np.zeros(2 * p),
        np.zeros(p), np.zeros(p), np.zeros(2 * p), np.zeros((p, p)), np.zeros((p, p)),
        np.concatenate([np.full(4 * p, 1e-300), np.full(count, 1e-3)]), np.zeros(p), np.zeros(p),
    )  # fmt: skip
