"""From equations between named signals to a compiled model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: A sum of signals: coefficient by name.
Sum = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedPort:
    """A port with the sums that are its displacement and its velocity, and the laws that act there.

    What the laws add is the signal ``kind:name``, such as ``joint:piston``, for the equations to use.
    """

    port: Port
    displacement: Sum
    velocity: Sum
    #: Laws whose ``port`` is filled in when the model is compiled.
    laws: tuple[PortLaw, ...] = ()

    @property
    def signal(self) -> str:
        """Name of what the laws add up to."""
        return f"{self.port.kind}:{self.port.name}"


def compile_equations(
    *,
    rates: Mapping[str, Sum],
    inputs: Sequence[Terminal],
    outputs: Sequence[Terminal],
    signals: Mapping[str, Sum],
    ports: Sequence[PlacedPort] = (),
) -> CompiledModel:
    """Compile linear equations between named signals.

    Parameters
    ----------
    rates
        Time derivative of each state, as a sum of states, inputs, signals and what laws add (``joint:piston``).
    inputs
        Each one column, named by the terminal.
    outputs
        Each a state, input or signal of the terminal's name. An output with an ``output`` port carries what the
        port's laws add.
    signals
        Further sums by name, such as ``acceleration``; each uses states, inputs, what laws add, and signals that
        stand before it.
    ports
        Where effects and laws may act.

    Raises
    ------
    ModelError
        When a sum names something that isn't there.

    Examples
    --------
    >>> compiled = compile_equations(
    ...     rates={"velocity": {"force": 0.5, "velocity": -1.0}}, signals={},
    ...     inputs=(Terminal(name="force", unit="N"),), outputs=(Terminal(name="velocity", unit="m/s"),),
    ... )
    >>> compiled.a.item(), compiled.b.item(), compiled.c.item()
    (-1.0, 0.5, 1.0)
    """
    # A row has one place for each state, input and port, in this order.
    names = [*rates, *(terminal.name for terminal in inputs), *(placed.signal for placed in ports)]
    rows = dict(zip(names, np.eye(len(names)), strict=True))
    # In order, so that a signal may use those before it and no loop can hide among them.
    for name, total in signals.items():
        rows[name] = _row(total, rows, name)
    n, m = len(rates), len(inputs)
    dynamics = _stack([_row(total, rows, name) for name, total in rates.items()], len(names))
    read = _stack([_output_row(terminal, rows) for terminal in outputs], len(names))
    displacement = _stack([_row(placed.displacement, rows, placed.signal) for placed in ports], len(names))
    velocity = _stack([_row(placed.velocity, rows, placed.signal) for placed in ports], len(names))
    return CompiledModel(
        a=dynamics[:, :n],
        b=dynamics[:, n : n + m],
        c=read[:, :n],
        d=read[:, n : n + m],
        g=dynamics[:, n + m :],
        h=read[:, n + m :],
        displacement_state=displacement[:, :n],
        displacement_column=displacement[:, n : n + m],
        displacement_port=displacement[:, n + m :],
        velocity_state=velocity[:, :n],
        velocity_column=velocity[:, n : n + m],
        velocity_port=velocity[:, n + m :],
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        states=tuple(rates),
        ports=tuple(placed.port for placed in ports),
        laws=tuple(
            PortLaw(port=place, function=law.function, parameters=law.parameters, state=law.state)
            for place, placed in enumerate(ports)
            for law in placed.laws
        ),
    )


def _row(total: Sum, rows: Mapping[str, Real], what: str) -> Real:
    row = np.zeros(next(iter(rows.values())).size)
    for name, coefficient in total.items():
        if name not in rows:
            raise ModelError(f"{what}: {name!r} is no signal; there are: {', '.join(rows)}")
        row = row + coefficient * rows[name]
    return row


def _output_row(terminal: Terminal, rows: Mapping[str, Real]) -> Real:
    carried = f"output:{terminal.name}"
    return _row({terminal.name: 1.0, **({carried: 1.0} if carried in rows else {})}, rows, f"output {terminal.name}")


def _stack(rows: list[Real], columns: int) -> Real:
    # Reshaped, because a list without rows has lost its number of columns.
    return np.asarray(rows, dtype=np.float64).reshape(len(rows), columns)
