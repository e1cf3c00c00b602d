"""Linear changes of a compiled model: further states, and forces at a port that follow from states and inputs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ModelError

# A port whose own force reaches its signal with a gain of one to within rounding leaves nothing to solve for.
_ILL_POSED = 1e-12
# Share by which numbers may differ that are the same but for rounding.
_ROUNDING = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Signal:
    """A row of a compiled model: ``states @ x + columns @ u + ports @ f``."""

    states: Real
    columns: Real
    ports: Real

    def __add__(self, other: Self) -> Self:
        return type(self)(
            states=self.states + other.states,
            columns=self.columns + other.columns,
            ports=self.ports + other.ports,
        )

    def scaled(self, factor: float) -> Self:
        """Give the signal times `factor`."""
        return type(self)(states=factor * self.states, columns=factor * self.columns, ports=factor * self.ports)

    def padded(self, count: int) -> Self:
        """Give the same signal in a model that has got `count` more states."""
        return type(self)(states=_wider(self.states, count), columns=self.columns, ports=self.ports)


def displacement(compiled: CompiledModel, port: int) -> Signal:
    """Give d of a port: a displacement, a command, or an output."""
    return Signal(
        states=compiled.displacement_state[port],
        columns=compiled.displacement_column[port],
        ports=compiled.displacement_port[port],
    )


def velocity(compiled: CompiledModel, port: int) -> Signal:
    """Give s of a port."""
    return Signal(
        states=compiled.velocity_state[port],
        columns=compiled.velocity_column[port],
        ports=compiled.velocity_port[port],
    )


def output(compiled: CompiledModel, row: int) -> Signal:
    """Give an output as the equations make it, before its sample maps."""
    return Signal(states=compiled.c[row], columns=compiled.d[row], ports=compiled.h[row])


def state(compiled: CompiledModel, row: int) -> Signal:
    """Give one state."""
    return Signal(
        states=np.eye(len(compiled.states))[row],
        columns=np.zeros(compiled.columns),
        ports=np.zeros(len(compiled.ports)),
    )


def column(compiled: CompiledModel, place: int) -> Signal:
    """Give one column of u."""
    return Signal(
        states=np.zeros(len(compiled.states)),
        columns=np.eye(compiled.columns)[place],
        ports=np.zeros(len(compiled.ports)),
    )


def rate(compiled: CompiledModel, signal: Signal, name: str) -> Signal:
    """Give the time derivative of a signal: ``row x`` has the rate ``row (A x + B u + G f)``.

    Raises
    ------
    ModelError
        When the signal follows a law's force or an input at once, so that its rate would need theirs; `name` says
        in the message whose signal it is.
    """
    if np.any(signal.ports):
        raise ModelError(f"{name!r}: what moves there jumps with a force, so it has no rate")
    return Signal(
        states=signal.states @ compiled.a,
        columns=signal.states @ compiled.b + _rate_of_columns(compiled, signal.columns, name),
        ports=signal.states @ compiled.g,
    )


def with_states(compiled: CompiledModel, names: Sequence[str]) -> CompiledModel:
    """Give the model with further states that stay at rest until `with_rate` says what moves them.

    A name that is taken gets a number, so that an effect may act at one site more than once.
    """
    count = len(names)
    # One after another: two of the new names may be the same.
    taken = [*compiled.states]
    for name in names:
        taken.append(_free_name(name, taken))
    return replace(
        compiled,
        a=_higher(_wider(compiled.a, count), count),
        b=_higher(compiled.b, count),
        g=_higher(compiled.g, count),
        c=_wider(compiled.c, count),
        displacement_state=_wider(compiled.displacement_state, count),
        velocity_state=_wider(compiled.velocity_state, count),
        states=tuple(taken),
    )


def _wider(matrix: Real, count: int) -> Real:
    """Zeros behind the last axis. `np.pad` takes ten times as long, and models are compiled by the thousand."""
    return np.concatenate([matrix, np.zeros((*matrix.shape[:-1], count))], axis=-1)


def _higher(matrix: Real, count: int) -> Real:
    return np.concatenate([matrix, np.zeros((count, matrix.shape[1]))])


def with_rate(compiled: CompiledModel, row: int, rate: Signal) -> CompiledModel:
    """Give the model with ``x'[row] = rate``."""
    a, b, g = compiled.a.copy(), compiled.b.copy(), compiled.g.copy()
    a[row], b[row], g[row] = rate.states, rate.columns, rate.ports
    return replace(compiled, a=a, b=b, g=g)


def with_feedback(compiled: CompiledModel, port: int, force: Signal) -> tuple[CompiledModel, Signal]:
    """Let `force` act at a port, for good: it becomes part of the linear equations.

    `force` may depend on the port's own force (a mass resists by the acceleration that it lowers), so the scalar
    equation is solved first.

    Returns
    -------
    compiled, force
        The changed model, and the force as it follows from states, inputs and what laws add.

    Raises
    ------
    ModelError
        When the equation has no solution: an algebraic loop with a gain of one.
    """
    keep = 1 - force.ports[port]
    if abs(keep) < _ILL_POSED:
        raise ModelError(f"{compiled.ports[port].name!r}: an algebraic loop with a gain of one has no solution")
    # The force changes every row that the port's force reaches, its own included.
    force = force.scaled(1 / keep)
    to_states, to_outputs = compiled.g[:, port], compiled.h[:, port]
    to_displacement, to_velocity = compiled.displacement_port[:, port], compiled.velocity_port[:, port]
    changed = replace(
        compiled,
        a=compiled.a + np.outer(to_states, force.states),
        b=compiled.b + np.outer(to_states, force.columns),
        g=compiled.g + np.outer(to_states, force.ports),
        c=compiled.c + np.outer(to_outputs, force.states),
        d=compiled.d + np.outer(to_outputs, force.columns),
        h=compiled.h + np.outer(to_outputs, force.ports),
        displacement_state=compiled.displacement_state + np.outer(to_displacement, force.states),
        displacement_column=compiled.displacement_column + np.outer(to_displacement, force.columns),
        displacement_port=compiled.displacement_port + np.outer(to_displacement, force.ports),
        velocity_state=compiled.velocity_state + np.outer(to_velocity, force.states),
        velocity_column=compiled.velocity_column + np.outer(to_velocity, force.columns),
        velocity_port=compiled.velocity_port + np.outer(to_velocity, force.ports),
    )
    return changed, force


def with_displacement(compiled: CompiledModel, port: int, signal: Signal) -> CompiledModel:
    """Give the model with d of a port replaced: what acts there next sees `signal`."""
    states, columns = compiled.displacement_state.copy(), compiled.displacement_column.copy()
    ports = compiled.displacement_port.copy()
    states[port], columns[port], ports[port] = signal.states, signal.columns, signal.ports
    return replace(compiled, displacement_state=states, displacement_column=columns, displacement_port=ports)


def with_output(compiled: CompiledModel, row: int, signal: Signal) -> CompiledModel:
    """Give the model with an output replaced."""
    c, d, h = compiled.c.copy(), compiled.d.copy(), compiled.h.copy()
    c[row], d[row], h[row] = signal.states, signal.columns, signal.ports
    return replace(compiled, c=c, d=d, h=h)


def ground_acceleration(compiled: CompiledModel, port: int) -> Signal:
    """Give the acceleration that the motion at a port lacks, because it is measured from a ground that shakes.

    In coordinates that move with the ground a free body falls behind by exactly the ground's acceleration; in
    coordinates at rest, or where the ground's shaking doesn't turn a rotor, it isn't felt at once. Which inputs
    shake the ground shows too: they act as what laws add at the ground does.
    """
    rest = Signal(
        states=np.zeros(len(compiled.states)),
        columns=np.zeros(compiled.columns),
        ports=np.zeros(len(compiled.ports)),
    )
    grounds = [place for place, found in enumerate(compiled.ports) if found.kind == "ground"]
    if not grounds or abs(compiled.velocity_state[port] @ compiled.g[:, grounds[0]] + 1.0) > _ROUNDING:
        return rest
    ground = grounds[0]
    # Compared to rounding: effects attached before have changed both columns in the same way, but not bit by bit.
    shaking = (
        _agrees(compiled.b, compiled.g[:, [ground]])
        & _agrees(compiled.d, compiled.h[:, [ground]])
        & np.all(compiled.velocity_column == compiled.velocity_port[:, [ground]], axis=0)
    )
    return replace(rest, columns=shaking.astype(np.float64), ports=np.eye(len(compiled.ports))[ground])


def _agrees(columns: Real, wanted: Real) -> Mask:
    """``[column]``: those that are the wanted one but for rounding."""
    return np.asarray(np.all(np.abs(columns - wanted) <= _ROUNDING * np.abs(wanted), axis=0))


def with_columns_replaced(compiled: CompiledModel, first: int, passed: Sequence[Signal], rows: int) -> CompiledModel:
    """Let the columns from `first` on carry other signals, made of states and columns.

    `rows` states feel the new signals; those behind them (a filter's) go on feeling the old ones.
    """
    span = slice(first, first + len(passed))
    states = np.array([signal.states for signal in passed])
    columns = np.array([signal.columns for signal in passed])

    def through(matrix: Real) -> tuple[Real, Real]:
        # What the old signals did is taken out, and put back as far as the new ones are made of them.
        kept = matrix.copy()
        kept[:, span] = 0.0
        return matrix[:, span] @ states, kept + matrix[:, span] @ columns

    a, b = through(compiled.b[:rows])
    c, d = through(compiled.d)
    displacement_state, displacement_column = through(compiled.displacement_column)
    velocity_state, velocity_column = through(compiled.velocity_column)
    return replace(
        compiled,
        a=np.vstack([compiled.a[:rows] + a, compiled.a[rows:]]),
        b=np.vstack([b, compiled.b[rows:]]),
        c=compiled.c + c,
        d=d,
        displacement_state=compiled.displacement_state + displacement_state,
        displacement_column=displacement_column,
        velocity_state=compiled.velocity_state + velocity_state,
        velocity_column=velocity_column,
    )


def _rate_of_columns(compiled: CompiledModel, through: Real, name: str) -> Real:
    """Each column that holds a derivative is handed on to the one that holds the next."""
    shifted = np.zeros(compiled.columns)
    last = np.ones(compiled.columns, dtype=bool)
    for terminal in compiled.inputs:
        first = compiled.column_of(terminal.name)
        shifted[first + 1 : first + 1 + terminal.derivatives] = through[first : first + terminal.derivatives]
        last[first : first + terminal.derivatives] = False
    if np.any(through[last]):
        raise ModelError(f"{name!r}: what moves there follows an input at once, and no input gives the rate it needs")
    return shifted


def _free_name(name: str, taken: Sequence[str]) -> str:
    if name not in taken:
        return name
    number = 2
    while f"{name}.{number}" in taken:
        number += 1
    return f"{name}.{number}"
