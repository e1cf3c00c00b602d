"""Kernel: forces of the laws and delay lines at given motions of the ports, and the history that delay lines read."""

from typing import NamedTuple

import numpy as np

from chladni.models.integrator.machine_code import ASK, call_law, inlined_code, kernel, part_code
from chladni.models.integrator.plane import Integers1, Integers2, Numbers1, Numbers2, Numbers3, opener
from chladni.models.integrator.port_plan import LawTable, PortPlan

#: A number that numba must not take as part of the type: it would compile the kernel once for each.
Stage = int | np.int64


class Ports(NamedTuple):
    """What acts at the ports, and where kernels put arguments and results of laws.

    Attributes
    ----------
    table, first, through
        See `LawTable` and `PortPlan`.
    motion
        ``[2 port]`` displacements, then velocities, at which the laws are asked.
    state
        ``[law state]`` at which the laws are asked.
    channels
        ``[stage, port + law state]``: forces, then rates of the law states.
    address
        Of `state` and of `channels`: laws take addresses.
    delay_port, delay_s
        Of each delay line.
    looped
        ``[1]``: 1 where no order of evaluation exists, so that only the implicit step can be made.
    lagged
        ``[stage, delay]`` the displacement that a delay line gives.
    """

    table: Integers2
    first: Integers1
    through: Numbers3
    motion: Numbers1
    state: Numbers1
    channels: Numbers2
    address: Integers1
    delay_port: Integers1
    delay_s: Numbers1
    looped: Integers1
    lagged: Numbers2


def ports_of(plan: PortPlan, laws: LawTable) -> Ports:
    """Lay out the laws and delay lines of a model, with memory to ask them."""
    count = len(plan.ports)
    state = np.zeros(max(1, laws.state.size))[: laws.state.size]
    channels = np.zeros((7, count + laws.state.size))
    return Ports(
        table=laws.table,
        first=laws.first,
        through=np.ascontiguousarray(plan.through),
        motion=np.zeros(2 * count),
        state=state,
        channels=channels,
        address=np.array([state.ctypes.data, channels.ctypes.data], dtype=np.int64),
        delay_port=plan.delay_port,
        delay_s=plan.delay_s,
        looped=np.array([int(plan.looped)]),
        lagged=np.zeros((6, plan.delay_s.size)),
    )


@inlined_code
def end_of_states(ports: Ports, law: int) -> int:
    """Place behind the last state of a law."""
    last: int = ports.table[law + 1, 2] if law + 1 < ports.table.shape[0] else ports.state.size
    return last


@inlined_code
def law_force(ports: Ports, law: int, d: float, s: float, t: float, stage: Stage) -> float:
    """Force of one law at one motion; writes its rates."""
    first = ports.table[law, 2]
    count = ports.first.size - 1
    rates = ports.address[1] + 8 * (stage * ports.channels.shape[1] + count + first)
    return call_law(ports.table[law, 0], d, s, t, ports.table[law, 1], ports.address[0] + 8 * first, rates)


@inlined_code
def port_forces(ports: Ports, t: float, stage: Stage, through: Stage) -> None:
    """Forces and rates of one stage from `motion` and `state`; port by port, so that earlier forces move later ports.

    When `through` is 0, `motion` already holds what the forces themselves make.
    """
    count = ports.first.size - 1
    for port in range(count):
        d, s = ports.motion[port], ports.motion[count + port]
        if through == 1:
            for earlier in range(port):
                force = ports.channels[stage, earlier]
                d += ports.through[0, port, earlier] * force
                s += ports.through[1, port, earlier] * force
            ports.motion[port], ports.motion[count + port] = d, s
        force = 0.0
        for law in range(ports.first[port], ports.first[port + 1]):
            force += law_force(ports, law, d, s, t, stage)
        for delay in range(ports.delay_s.size):
            if ports.delay_port[delay] == port:
                force += ports.lagged[stage, delay] - d
        ports.channels[stage, port] = force


_OPEN = opener(Ports)


@kernel(ASK)
def ask_laws(book: int, t: float, through: int) -> int:
    """`port_forces` at the start of a step, from outside of the kernels."""
    (ports,) = _OPEN(book)
    port_forces(ports, t, np.int64(0), through)
    return 0


class History(NamedTuple):
    """Displacements at the ports of delay lines, step by step.

    Attributes
    ----------
    begin, length
        ``[step]`` seconds.
    value
        ``[step, delay, 5]`` at the start, the quarters and the end of the step.
    hint
        ``[delay + 1]`` step at which each line was last asked; the last is the number of steps kept.
    """

    begin: Numbers1
    length: Numbers1
    value: Numbers3
    hint: Integers1


@part_code
def fill_lagged(history: History, ports: Ports, stage: Stage, t: float) -> None:
    """Displacement of each delay line at `t` less its dead time; 0 before the start."""
    for delay in range(ports.delay_s.size):
        ports.lagged[stage, delay] = _displacement(history, delay, t - ports.delay_s[delay])


@part_code
def _displacement(history: History, delay: int, t: float) -> float:
    count = history.hint[history.hint.size - 1]
    if t < 0.0 or count == 0:
        return 0.0
    step = min(history.hint[delay], count - 1)
    while step > 0 and history.begin[step] > t:
        step -= 1
    while step + 1 < count and history.begin[step + 1] <= t:
        step += 1
    history.hint[delay] = step
    # Polynomial of degree 4 through the five values; never across the end of a step, where an input may have a kink.
    x = 4.0 * (t - history.begin[step]) / history.length[step]
    total = 0.0
    for node in range(5):
        factor = 1.0
        for other in range(5):
            if other != node:
                factor *= (x - other) / (node - other)
        total += factor * history.value[step, delay, node]
    return total


_OPEN_HISTORY = opener(History, Ports)


@kernel(ASK)
def ask_delays(book: int, t: float, _: int) -> int:
    """`fill_lagged` at the start of a step, from outside of the kernels."""
    history, ports = _OPEN_HISTORY(book)
    fill_lagged(history, ports, np.int64(0), t)
    return 0
