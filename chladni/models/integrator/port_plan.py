"""Ports at which something acts, in the order in which their laws can be evaluated, and the table of laws."""

from dataclasses import dataclass

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port_law import PortLaw
from chladni.models.integrator.hold import Hold
from chladni.models.integrator.machine_code import law_address
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True)
class LawTable:
    """Laws in the order of the ports, as the kernels read them.

    Attributes
    ----------
    table
        ``[law, 3]`` address of the function, address of its parameters, place of its first state.
    first
        ``[port + 1]`` place of the first law of each port.
    parameters
        All parameters one after another: kept alive here, since the kernels know their addresses only.
    state
        Initial values of all law states, one after another.
    laws
        In this order.
    """

    table: Whole
    first: Whole
    parameters: Real
    state: Real
    laws: tuple[PortLaw, ...]


@dataclass(frozen=True, slots=True)
class PortPlan:
    """Equations reduced to the ports at which laws or delay lines act.

    Attributes
    ----------
    ports
        Indices into the model's ports, in the order of evaluation.
    b, g, c, d, h
        Of the model, with internal columns and these ports only.
    motion_state, motion_column
        ``[2 port, state]``, ``[2 port, column]``: displacements, then velocities.
    through
        ``[2, port, port]``: displacement and velocity that the forces themselves make, at once.
    looped
        Whether they form a loop, so that no order of evaluation exists.
    delay_port, delay_s
        ``[delay]`` place in `ports` and dead time of each delay line, by port.
    """

    ports: tuple[int, ...]
    a: Real
    b: Real
    g: Real
    c: Real
    d: Real
    h: Real
    motion_state: Real
    motion_column: Real
    through: Real
    looped: bool
    delay_port: Whole
    delay_s: Real


def port_plan(compiled: CompiledModel, hold: Hold) -> PortPlan:
    """Reduce a compiled model to the ports at which something acts; the others cost nothing."""
    for line in compiled.delays:
        if not (np.isfinite(line.delay_s) and line.delay_s >= 0):
            name = compiled.ports[line.port].name
            raise ModelError(f"port {name!r}: delay {line.delay_s} s must be finite and not negative")
    delays = [line for line in compiled.delays if line.delay_s > 0]
    active = sorted({law.port for law in compiled.laws} | {line.port for line in delays})
    order, looped = _evaluation_order(compiled, active)
    place = {port: index for index, port in enumerate(order)}
    delays.sort(key=lambda line: place[line.port])
    rows = np.ix_(order, order)
    return PortPlan(
        ports=tuple(order),
        a=compiled.a,
        b=hold.spread(compiled.b),
        g=compiled.g[:, order],
        c=compiled.c,
        d=hold.spread(compiled.d),
        h=compiled.h[:, order],
        motion_state=np.vstack([compiled.displacement_state[order], compiled.velocity_state[order]]),
        motion_column=hold.spread(np.vstack([compiled.displacement_column[order], compiled.velocity_column[order]])),
        through=np.stack([compiled.displacement_port[rows], compiled.velocity_port[rows]]),
        looped=looped,
        delay_port=np.array([place[line.port] for line in delays], dtype=np.int64),
        delay_s=np.array([line.delay_s for line in delays], dtype=np.float64),
    )


def law_table(compiled: CompiledModel, plan: PortPlan, laws: tuple[PortLaw, ...] | None = None) -> LawTable:
    """Compile the laws and lay out their parameters and states."""
    place = {port: index for index, port in enumerate(plan.ports)}
    chosen = sorted(compiled.laws if laws is None else laws, key=lambda law: place[law.port])
    for law in chosen:
        if not np.all(np.isfinite([*law.parameters, *law.state])):
            name = compiled.ports[law.port].name
            raise ModelError(f"law {law.function.__name__!r} at {name!r}: parameters and states must be finite")
    parameters = np.array([number for law in chosen for number in law.parameters] or [0.0], dtype=np.float64)
    state = np.array([number for law in chosen for number in law.state], dtype=np.float64)
    table = np.zeros((len(chosen), 3), dtype=np.int64)
    table[:, 0] = [law_address(law.function) for law in chosen]
    table[:, 1] = parameters.ctypes.data + 8 * _starts([len(law.parameters) for law in chosen])
    table[:, 2] = _starts([len(law.state) for law in chosen])
    first = np.searchsorted([place[law.port] for law in chosen], np.arange(len(plan.ports) + 1))
    return LawTable(table=table, first=first.astype(np.int64), parameters=parameters, state=state, laws=tuple(chosen))


def _starts(lengths: list[int]) -> Whole:
    return np.cumsum([0, *lengths], dtype=np.int64)[:-1]


def _evaluation_order(compiled: CompiledModel, active: list[int]) -> tuple[list[int], bool]:
    """Order in which each port's motion depends on forces of earlier ports only; False when there's one."""
    depends = (compiled.displacement_port != 0) | (compiled.velocity_port != 0)
    order: list[int] = []
    waiting = list(active)
    while waiting:
        ready = [port for port in waiting if not depends[port, waiting].any()]
        if not ready:
            return order + waiting, True
        order += ready
        waiting = [port for port in waiting if port not in ready]
    return order, False
