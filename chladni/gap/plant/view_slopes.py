"""How the response of a linear view moves with the equations, from what is solved already."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.plant.linear_view import LinearView, Way, along
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import response_slopes
from chladni.models.integrator.hold import Hold, free_hold
from chladni.signals.arrays import Complex, Real


def same_frame(here: CompiledModel, there: CompiledModel) -> bool:
    """Whether two models differ by the numbers of their equations alone: no other delays, clocks or signals."""
    return (
        here.states == there.states
        and here.inputs == there.inputs
        and here.input_delays_s == there.input_delays_s
        and here.output_offsets_s == there.output_offsets_s
        and len(here.generated) == len(there.generated)
        and len(here.ports) == len(there.ports)
    )


def view_slopes(
    view: LinearView,
    changed: Sequence[CompiledModel],
    step: float,
    transient: Real,
    forces: Sequence[tuple[Way, Complex]],
) -> Complex:
    """``[change, output, segment, line]``: derivatives of `LinearView.response`.

    With ``z X = Phi X + Gamma R + ...`` the states move by ``(z I - Phi)^-1 (dPhi X + dGamma R + ...)``, of which the
    outputs see what `LinearView.printed` holds: no change needs a solution of its own. The changed models are of the
    `same_frame`; their equations are changed by `step`, in the unit that derivatives are wanted for.
    """
    n, count = len(view.compiled.states), len(changed)
    signals = [view.states(transient, forces), view.inputs()]
    for way, force in forces:
        signals.append(way.carried[:, None] * force)
    rows = np.concatenate(signals)
    by_step, through = _coefficients(view, changed, step, forces)
    drive = along(by_step.reshape(count * n, rows.shape[0]), rows).reshape(count, n, *rows.shape[1:])
    # A product a line: BLAS takes a third of the time that a sum over indices does.
    segments, lines = drive.shape[2:]
    by_line = drive.transpose(3, 1, 0, 2).reshape(lines, n, count * segments)
    found = view.printed.transpose(2, 1, 0) @ by_line
    found = found.reshape(lines, len(view.rows), count, segments).transpose(2, 1, 3, 0)
    moved = np.flatnonzero(np.any(through != 0, axis=(1, 2)))
    if moved.size:
        direct = along(through[moved].reshape(-1, rows.shape[0]), rows)
        found[moved] += direct.reshape(moved.size, len(view.rows), *rows.shape[1:])
    found *= view.shift[:, None]
    return np.asarray(found, dtype=np.complex128)


def _coefficients(
    view: LinearView, changed: Sequence[CompiledModel], step: float, forces: Sequence[tuple[Way, Complex]]
) -> tuple[Real, Real]:
    """``[change, state, signal]`` and ``[change, output, signal]``: what each signal adds to states and outputs."""
    here, hold, rows = view.compiled, view.hold, view.rows
    ports = [way.port for way, _ in forces if way.port is not None]
    n, width = len(here.states), len(here.states) + hold.width
    size = width + sum(len(way.carried) for way, _ in forces)
    by_step, through = np.zeros((len(changed), n, size)), np.zeros((len(changed), len(rows), size))
    free = free_hold(len(ports))
    inputs = _moved(view, hold, here.b, [(one.a - here.a, one.b - here.b) for one in changed], step)
    acting = [(one.a - here.a, (one.g - here.g)[:, ports]) for one in changed] if ports else []
    laws = _moved(view, free, here.g[:, ports], acting, step)
    for place, one in enumerate(changed):
        by_step[place, :, :width] = inputs[place]
        through[place, :, :n] = (one.c - here.c)[rows] / step
        through[place, :, n : n + hold.columns] = hold.spread((one.d - here.d)[rows]) / step
        at, of_port = width, 0
        for way, _ in forces:
            places = slice(at, at + len(way.carried))
            if way.port is not None:
                by_step[place, :, places] = laws[place][:, n + free.places(free.inner(of_port))]
                through[place, :, at] = (one.h - here.h)[rows, way.port] / step
                of_port += 1
            elif way.column is not None:
                by_step[place, :, places] = inputs[place][:, n + hold.places(hold.inner(way.column))]
                through[place, :, at] = (one.d - here.d)[rows, way.column] / step
            at = places.stop
    return by_step, through


def _moved(view: LinearView, hold: Hold, b: Real, changes: Sequence[tuple[Real, Real]], step: float) -> list[Real]:
    """``[state, state + width]`` for each change of A and of what signals enter by: derivatives of one step."""
    none = np.zeros((len(b), 0))
    found = response_slopes(
        view.compiled.a,
        hold.spread(b),
        none,
        hold,
        [(by_a / step, hold.spread(by_b / step), none) for by_a, by_b in changes],
        step_s=1.0 / view.lines.sample_rate_hz,
        kink_at=hold.kink_at,
    )
    return [one.state for one in found]
