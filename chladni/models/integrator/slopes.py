"""How the outputs of a run with laws change with parameters and with where it starts."""

from collections.abc import Sequence

import numpy as np

from chladni.models.core.balance import balance
from chladni.models.integrator.integrator import Integration
from chladni.models.integrator.plane import book
from chladni.models.integrator.slope_kernel import Change, Unknowns, law_slopes
from chladni.models.integrator.trapezoid_kernel import DeadTimes, March
from chladni.models.integrator.trapezoid_march import Equations, Windows, kernel_ports, kernel_room, new_record
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError

#: Modal coordinates worse conditioned than this (a double integrator has none) are not taken.
_CONDITION = 1e7


def recorded(equation: Equations, windows: Windows, runs: Sequence[Integration]) -> tuple[March, ...]:
    """Records of runs that were made by an `Integrator`; `equation` has one step a sample."""
    records = []
    for (start, stop), run in zip(windows, runs, strict=True):
        record = new_record(equation, start, stop, run.states[:, 0])
        motion = np.vstack([run.displacement, run.velocity])
        records.append(
            record._replace(
                # Copies: a kernel would be compiled again for arrays that can't be written to.
                x=np.array(run.states.T, order="C"),
                motion=np.array(motion.T, order="C"),
                force=np.array(run.force.T, order="C"),
            )
        )
    return tuple(records)


def sensitivities(
    equation: Equations, records: Sequence[March], windows: Windows, changed: Sequence[tuple[Equations, float]],
    sample_rate_hz: float,
) -> tuple[Real, Real]:  # fmt: skip
    """Slopes of the outputs along a run.

    The linear part is carried in modal coordinates, where a step costs two products a state.

    Parameters
    ----------
    equation
        With one step a sample.
    records
        Of the run, by window.
    changed
        Equations with each parameter changed, and by how much.

    Returns
    -------
    parameters, starts
        ``[parameter, output, sample]``, ``[state, output, sample]``; each window from its own start.

    Raises
    ------
    ModelError
        When a change gives equations of another form.
    """
    room = kernel_room(equation)
    ports = kernel_ports(equation)
    for record in records:
        largest = 1e-2 * np.abs(record.motion).max(axis=0)
        size = 2 * largest.size
        room.scale[:size] = np.maximum(room.scale[:size], np.tile(largest, 2))
    for one, _ in changed:
        _require_same_form(equation, one)
    to_modal, from_modal = modal_coordinates(equation.step[: len(equation.plan.a), : len(equation.plan.a)])
    line, lines = _other_lines(equation, changed)
    fixed = _fixed(equation, changed, to_modal, from_modal, line)
    q = len(changed) + len(to_modal)
    found = np.zeros((windows[-1][1], equation.output.shape[0], q))
    for (start, stop), record in zip(windows, records, strict=True):
        lead, lead_start, outputs = _leads(equation, record, changed, start, to_modal)
        found[start:stop, :, : len(changed)] = outputs
        unknowns = fixed._replace(lead=lead, lead_start=lead_start)
        change = _change(equation, found[start:stop])
        words = book(record, ports, equation.delays, room, change, unknowns, lines)
        law_slopes(words.ctypes.data, 1.0 / sample_rate_hz, start / sample_rate_hz)
    slopes = np.ascontiguousarray(found.transpose(2, 1, 0))
    return slopes[: len(changed)], slopes[len(changed) :]


def modal_coordinates(matrix: Real) -> tuple[Real, Real]:
    """``(T^-1, T)`` with ``T^-1 matrix T`` in real blocks of one or two; the identity where there are none."""
    if not matrix.size:
        return matrix, matrix
    # States are in m and in m/s: unless they are balanced, their sizes say more than the angles between modes.
    balanced, scale = balance(matrix)
    values, vectors = np.linalg.eig(balanced)
    columns = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag == 0:
            columns.append(vector.real)
        elif value.imag > 0:
            columns += [vector.real, vector.imag]
    basis = np.array(columns, dtype=np.float64).T
    if np.linalg.cond(basis) > _CONDITION:
        return np.eye(len(matrix)), np.eye(len(matrix))
    return np.asarray(np.linalg.inv(basis) / scale, dtype=np.float64), basis * scale[:, None]


def _fixed(
    equation: Equations,
    changed: Sequence[tuple[Equations, float]],
    to_modal: Real,
    from_modal: Real,
    line: Whole,
) -> Unknowns:
    """What doesn't depend on the window."""
    n, width = len(to_modal), equation.rows.shape[1]
    table = np.hstack([equation.step[:, :n] @ from_modal, equation.step[:, n + width :]])
    table[:n] = to_modal @ table[:n]
    own = table[:n, :n]
    own[np.abs(own) < 1e-12 * np.abs(own).max(initial=0.0)] = 0.0
    other, by = [], []
    for place, (one, size) in enumerate(changed):
        for law, (mine, its) in enumerate(zip(equation.laws.laws, one.laws.laws, strict=True)):
            if mine.parameters != its.parameters:
                other.append((place, law, int(one.laws.table[law, 1])))
                by.append(size)
    empty = np.zeros((1, 0, len(changed)))
    return Unknowns(
        table=np.ascontiguousarray(table), ends=equation.ends,
        start=np.ascontiguousarray(equation.start[:, :n] @ from_modal), through=equation.through,
        output=np.ascontiguousarray(equation.output[:, :n] @ from_modal),
        force_output=np.ascontiguousarray(equation.output[:, n + width :]),
        lead=empty, lead_start=empty[0], initial=to_modal,
        other=np.array(other, dtype=np.int64).reshape(-1, 3), by=np.array(by, dtype=np.float64),
        line=line, line_by=np.array([changed[place][1] for place in line[:, 0]], dtype=np.float64),
    )  # fmt: skip


def _other_lines(equation: Equations, changed: Sequence[tuple[Equations, float]]) -> tuple[Whole, DeadTimes]:
    """``[changed dead time, 2]`` parameter and dead time, and how those are then."""
    mine = equation.plan.delay_s
    found = [
        (place, delay) for place, (one, _) in enumerate(changed) for delay in np.flatnonzero(one.plan.delay_s != mine)
    ]
    lines = [changed[place][0].delays for place, _ in found]
    which = [delay for _, delay in found]
    return np.array(found, dtype=np.int64).reshape(-1, 2), DeadTimes(
        np.array([one.port[at] for one, at in zip(lines, which, strict=True)], dtype=np.int64),
        np.array([one.ago[at] for one, at in zip(lines, which, strict=True)], dtype=np.int64),
        np.array([one.share[at] for one, at in zip(lines, which, strict=True)]).reshape(-1, 4),
    )


def _leads(
    equation: Equations, record: March, changed: Sequence[tuple[Equations, float]], start: int, to_modal: Real
) -> tuple[Real, Real, Real]:
    """What changed tables and inputs add: to each step, to the start, to the outputs; the parameter last."""
    n, width, q = len(to_modal), equation.rows.shape[1], len(changed)
    steps = len(record.x)
    tables = np.array([(one.step - equation.step) / by for one, by in changed]).reshape(q, *equation.step.shape)
    tables[:, :n] = to_modal @ tables[:, :n]
    outputs = np.array([(one.output - equation.output) / by for one, by in changed]).reshape(
        q, *equation.output.shape
    )
    here = np.hstack([record.x, record.rows, record.force])
    ends = np.hstack([here[:-1], record.force[1:]])
    lead = (ends @ tables.transpose(2, 1, 0).reshape(ends.shape[1], tables.shape[1] * q)).reshape(
        steps - 1, tables.shape[1], q
    )
    seen = (here @ outputs.transpose(2, 1, 0).reshape(here.shape[1], outputs.shape[1] * q)).reshape(
        steps, outputs.shape[1], q
    )
    first = np.zeros((len(equation.start), q))
    for place, (one, by) in enumerate(changed):
        first[:, place] = (one.start - equation.start) @ here[0] / by
    for place, (one, by) in enumerate(changed):
        if one.rows is not equation.rows:
            rows = (one.rows[start : start + steps] - record.rows) / by
            moved = equation.step[:, n : n + width].copy()
            moved[:n] = to_modal @ moved[:n]
            lead[..., place] += rows[:-1] @ moved.T
            seen[..., place] += rows @ equation.output[:, n : n + width].T
            first[:, place] += equation.start[:, n : n + width] @ rows[0]
    return lead, first, seen


def _require_same_form(equation: Equations, other: Equations) -> None:
    mine, its = ([law.function for law in one.laws.laws] for one in (equation, other))
    same_plan = equation.plan.ports == other.plan.ports and equation.plan.delay_s.size == other.plan.delay_s.size
    if equation.step.shape != other.step.shape or mine != its or not same_plan:
        raise ModelError("a small change of a parameter gives a model of another form; start from another value")


def _change(equation: Equations, found: Real) -> Change:
    steps, _, q = found.shape
    n, p, count = len(equation.plan.a), len(equation.plan.ports), equation.laws.state.size
    arguments = 4 * p + count
    x, after, given, force, fresh, own, own_state = (
        np.zeros((rows, q)) for rows in (n, n + 2 * p, arguments, p, p, p, count)
    )
    slope, bend, level = np.zeros((p, arguments)), np.zeros((count, arguments)), np.zeros(count)
    past = np.zeros((steps if equation.delays.port.size else 1, equation.delays.port.size, q))
    return Change(x, after, given, force, fresh, own, own_state, slope, bend, level, past, found)
