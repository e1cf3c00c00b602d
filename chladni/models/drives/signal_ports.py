"""Ports at the signals of a loop, where effects act on what goes round."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port
from chladni.models.core.port_law import PortLaw

Matrix = NDArray[np.float64]


def with_input_port(compiled: CompiledModel, name: str, laws: Sequence[PortLaw] = ()) -> CompiledModel:
    """Give the model with an ``input`` port at the named input, and laws there; one that it has is kept.

    d is the command, and f adds to it: f goes wherever the command goes.
    """
    if not _has(compiled, name, "input"):
        column = compiled.column_of(name)
        unit = next(terminal.unit for terminal in compiled.inputs if terminal.name == name)
        compiled = _with_port(
            compiled,
            Port(name=name, kind="input", unit=unit, displacement_unit=unit),
            rates=compiled.b[:, column],
            outputs=compiled.d[:, column],
            displacements=compiled.displacement_column[:, column],
            velocities=compiled.velocity_column[:, column],
            states=np.zeros(len(compiled.states)),
            columns=np.eye(compiled.columns)[column],
            ports=np.zeros(len(compiled.ports)),
        )
    place = compiled.port_index(name, "input")
    return replace(compiled, laws=(*compiled.laws, *(replace(law, port=place) for law in laws)))


def with_output_port(compiled: CompiledModel, name: str) -> CompiledModel:
    """Give the model with an ``output`` port at the named output; one that it has is kept.

    d is the output, and f adds to it and so to what is fed back.
    """
    if _has(compiled, name, "output"):
        return compiled
    row = next(place for place, terminal in enumerate(compiled.outputs) if terminal.name == name)
    unit = compiled.outputs[row].unit
    return _with_port(
        compiled,
        Port(name=name, kind="output", unit=unit, displacement_unit=unit),
        rates=np.zeros(len(compiled.states)),
        outputs=np.eye(len(compiled.outputs))[row],
        displacements=np.zeros(len(compiled.ports)),
        velocities=np.zeros(len(compiled.ports)),
        states=compiled.c[row],
        columns=compiled.d[row],
        ports=compiled.h[row],
    )


def _has(compiled: CompiledModel, name: str, kind: str) -> bool:
    return any(port.name == name and port.kind == kind for port in compiled.ports)


def _with_port(
    compiled: CompiledModel,
    port: Port,
    *,
    rates: Matrix,
    outputs: Matrix,
    displacements: Matrix,
    velocities: Matrix,
    states: Matrix,
    columns: Matrix,
    ports: Matrix,
) -> CompiledModel:
    """Append a port: where its f goes (columns of G, H, Rd, Rs), and what its d is made of (rows of Pd, Qd, Rd)."""
    count = len(compiled.ports)
    displacement_port = np.zeros((count + 1, count + 1))
    displacement_port[:count, :count] = compiled.displacement_port
    displacement_port[:count, count], displacement_port[count, :count] = displacements, ports
    velocity_port = np.zeros((count + 1, count + 1))
    velocity_port[:count, :count], velocity_port[:count, count] = compiled.velocity_port, velocities
    return replace(
        compiled,
        g=np.column_stack([compiled.g, rates]),
        h=np.column_stack([compiled.h, outputs]),
        displacement_state=np.vstack([compiled.displacement_state, states]),
        displacement_column=np.vstack([compiled.displacement_column, columns]),
        displacement_port=displacement_port,
        velocity_state=np.vstack([compiled.velocity_state, np.zeros_like(states)]),
        velocity_column=np.vstack([compiled.velocity_column, np.zeros_like(columns)]),
        velocity_port=velocity_port,
        ports=(*compiled.ports, port),
    )
