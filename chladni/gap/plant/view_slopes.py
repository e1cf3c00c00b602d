"""How the response of a linear view moves with the equations, from what is solved already."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.plant.linear_view import LinearView, Way, along
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import Response, response_slopes
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

    With ``z X = Phi X + Gamma R + ...`` the states move by ``(z I - Phi)^-1 (dPhi X + dGamma R + ...)``, of which
    the outputs see what `LinearView.printed` holds: no change needs a solution of its own.

    Parameters
    ----------
    changed
        Models of the `same_frame` whose equations are changed a little.
    step
        By how much, in the unit that derivatives are wanted for.
    transient, forces
        Of the response.
    """
    n, count = len(view.compiled.states), len(changed)
    signals = [view.states(transient, forces), view.inputs()]
    for way, force in forces:
        if way.port is not None or way.column is not None:
            signals.append(np.stack([force, (view.lines.z - 1.0) * force]))
    rows = np.concatenate(signals)
    by_step, through = _coefficients(view, changed, step, forces)
    drive = along(by_step.reshape(count * n, rows.shape[0]), rows).reshape(count, n, *rows.shape[1:])
    found = np.einsum("nol,pnsl->posl", view.printed, drive, optimize=False)
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
    ways = [way for way, _ in forces if way.port is not None or way.column is not None]
    ports = [way.port for way in ways if way.port is not None]
    width = len(here.states) + hold.width
    by_step = np.zeros((len(changed), len(here.states), width + 2 * len(ways)))
    through = np.zeros((len(changed), len(rows), width + 2 * len(ways)))
    for place, (one, moved) in enumerate(zip(changed, _moved(view, changed, step, ports), strict=True)):
        by_step[place, :, :width] = moved.state
        through[place, :, : len(here.states)] = (one.c - here.c)[rows] / step
        columns = slice(len(here.states), len(here.states) + hold.columns)
        through[place, :, columns] = hold.spread((one.d - here.d)[rows]) / step
        for index, way in enumerate(ways):
            at = width + 2 * index
            if way.port is not None:
                by_step[place, :, at : at + 2] = moved.force[:2, :, ports.index(way.port)].T
                through[place, :, at] = (one.h - here.h)[rows, way.port] / step
            elif way.column is not None:
                by_step[place, :, at : at + 2] = moved.state[:, len(here.states) + np.array(view.places(way.column))]
                through[place, :, at] = (one.d - here.d)[rows, way.column] / step
    return by_step, through


def _moved(view: LinearView, changed: Sequence[CompiledModel], step: float, ports: Sequence[int]) -> list[Response]:
    """Derivatives of one step."""
    here, hold = view.compiled, view.hold
    changes = [
        (
            (one.a - here.a) / step,
            hold.spread((one.b - here.b) / step),
            (one.g[:, ports] - here.g[:, ports]) / step,
        )
        for one in changed
    ]
    return response_slopes(
        here.a,
        hold.spread(here.b),
        here.g[:, ports],
        hold,
        changes,
        step_s=1.0 / view.lines.sample_rate_hz,
        kink_at=hold.kink_at,
    )
