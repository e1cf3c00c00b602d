"""Kernel: how a march with laws changes with parameters and with where it starts, along the march itself."""

from typing import NamedTuple

from chladni.models.integrator.machine_code import ALONG, inlined_code, kernel, part_code
from chladni.models.integrator.plane import Integers2, Numbers1, Numbers2, Numbers3, opener
from chladni.models.integrator.port_kernel import Ports, end_of_states
from chladni.models.integrator.trapezoid_kernel import (
    FINE,
    MARCH_RECORDS,
    DeadTimes,
    March,
    Room,
    begin,
    begin_dead_times,
    equations,
    force_of,
    invert,
    look_back,
    see_own_step,
    slope_of,
)  # fmt: skip
from chladni.signals.arrays import Real


class Unknowns(NamedTuple):
    """What acts on the changes, the unknown last, so that all are done side by side.

    Parameters come first among the unknowns, then the states at the start.

    Attributes
    ----------
    table, ends, start, through
        Of the march, its states in any coordinates, see `March`.
    output
        ``[output, state]``, and ``force_output`` ``[output, port]``.
    lead
        ``[step, state + 2 port, parameter]``: what changed tables and inputs add to a step.
    lead_start
        ``[2 port, parameter]`` the same at the start.
    initial
        ``[state, state at the start]``.
    other
        ``[which, 3]`` parameter, law, address of the law's parameters when that parameter is changed.
    by
        ``[which]`` that change.
    line
        ``[changed dead time, 2]`` parameter and dead time, and `line_by` that change.
    """

    table: Numbers2
    ends: Numbers2
    start: Numbers2
    through: Numbers2
    output: Numbers2
    force_output: Numbers2
    lead: Numbers3
    lead_start: Numbers2
    initial: Numbers2
    other: Integers2
    by: Numbers1
    line: Integers2
    line_by: Numbers1


class Change(NamedTuple):
    """What changes with each unknown, ``[..., unknown]``, and the slopes of forces and law states.

    Attributes
    ----------
    x, next
        ``[state]`` before the step, ``[state + 2 port]`` after it.
    given
        ``[4 port + law state]``, see `Room`.
    force, fresh
        ``[port]`` before and after.
    own, own_state
        ``[port]``, ``[law state]``: by a law's own parameters.
    slope, bend
        ``[port, argument]``, ``[law state, argument]``, no unknown.
    level
        ``[law state]`` the law states themselves.
    past
        ``[step, delay]`` displacements at the ports of dead times.
    found
        ``[sample, output]`` of the outputs: the result.
    """

    x: Numbers2
    next: Numbers2
    given: Numbers2
    force: Numbers2
    fresh: Numbers2
    own: Numbers2
    own_state: Numbers2
    slope: Numbers2
    bend: Numbers2
    level: Numbers1
    past: Numbers3
    found: Numbers3


_OPEN = opener(*MARCH_RECORDS, Change, Unknowns, DeadTimes)


@inlined_code
def _slopes(ports: Ports, room: Room, change: Change, h: float, t: float) -> None:
    """Slopes of all forces and law states over what they depend on."""
    p, count = room.force.size, room.state.size
    for port in range(p):
        for argument in range(4 * p + count):
            change.slope[port, argument] = 0.0
    for place in range(count):
        for argument in range(4 * p + count):
            change.bend[place, argument] = 0.0
    for port in range(p):
        here = force_of(ports, room, port, h, t)
        low, high = _states_of(ports, port)
        for place in range(low, high):
            change.level[place] = room.state[place]
        for argument in range(4 * p + count if high > low else 2 * p):
            mine = argument % p == port if argument < 4 * p else low <= argument - 4 * p < high
            if not mine:
                continue
            change.slope[port, argument] = slope_of(ports, room, port, argument, here, h, t)
            by = FINE * max(abs(room.given[argument]), room.scale[argument])
            for place in range(low, high):
                change.bend[place, argument] = (room.state[place] - change.level[place]) / by
        for place in range(low, high):
            room.state[place] = change.level[place]


@inlined_code
def _states_of(ports: Ports, port: int) -> tuple[int, int]:
    low = high = 0
    for law in range(ports.first[port], ports.first[port + 1]):
        if end_of_states(ports, law) > ports.table[law, 2]:
            if high == low:
                low = ports.table[law, 2]
            high = end_of_states(ports, law)
    return low, high


@inlined_code
def _own(ports: Ports, room: Room, change: Change, unknowns: Unknowns, h: float, t: float) -> None:
    """What the laws' own parameters add to forces and law states."""
    p, count, q = room.force.size, room.state.size, change.x.shape[1]
    for row in range(p):
        for unknown in range(q):
            change.own[row, unknown] = 0.0
    for row in range(count):
        for unknown in range(q):
            change.own_state[row, unknown] = 0.0
    for which in range(unknowns.by.size):
        unknown, law, by = unknowns.other[which, 0], unknowns.other[which, 1], unknowns.by[which]
        port = 0
        while ports.first[port + 1] <= law:
            port += 1
        here = force_of(ports, room, port, h, t)
        low, high = _states_of(ports, port)
        for place in range(low, high):
            change.level[place] = room.state[place]
        kept = ports.table[law, 1]
        ports.table[law, 1] = unknowns.other[which, 2]
        change.own[port, unknown] += (force_of(ports, room, port, h, t) - here) / by
        ports.table[law, 1] = kept
        for place in range(low, high):
            change.own_state[place, unknown] += (room.state[place] - change.level[place]) / by
            room.state[place] = change.level[place]


@inlined_code
def _look_back(
    march: March, delays: DeadTimes, change: Change, unknowns: Unknowns, lines: DeadTimes, step: int
) -> None:
    """What dead times add to forces: displacements of steps before, and another dead time."""
    for delay in range(delays.port.size):
        for node in range(delays.share.shape[1]):
            past = step - delays.ago[delay] - node
            if 0 <= past < step:
                for unknown in range(change.past.shape[2]):
                    share = delays.share[delay, node] * change.past[past, delay, unknown]
                    change.own[delays.port[delay], unknown] += share
    for which in range(unknowns.line_by.size):
        unknown, delay = unknowns.line[which, 0], unknowns.line[which, 1]
        there = look_back(lines, which, march.motion, step, step)
        here = look_back(delays, delay, march.motion, step, step)
        change.own[delays.port[delay], unknown] += (there - here) / unknowns.line_by[which]


@inlined_code
def _keep(delays: DeadTimes, change: Change, step: int) -> None:
    for delay in range(delays.port.size):
        for unknown in range(change.past.shape[2]):
            change.past[step, delay, unknown] = change.given[delays.port[delay], unknown]


@inlined_code
def _clear(matrix: Real) -> None:
    for row in range(matrix.shape[0]):
        for unknown in range(matrix.shape[1]):
            matrix[row, unknown] = 0.0


@inlined_code
def _add(target: Real, row: int, share: float, source: Real, place: int) -> None:
    """Add a share of the changes of one quantity to those of another."""
    if share != 0.0:
        for unknown in range(target.shape[1]):
            target[row, unknown] += share * source[place, unknown]


@inlined_code
def _copy(target: Real, row: int, source: Real, place: int) -> None:
    for unknown in range(target.shape[1]):
        target[row, unknown] = source[place, unknown]


@inlined_code
def _settle(room: Room, change: Change, through: Real, first: int) -> None:
    """Changes of forces, motions and law states after a step, from those of the motions without these forces."""
    p, count = room.force.size, room.state.size
    for port in range(p):
        room.slope[port], room.slope[p + port] = change.slope[port, port], change.slope[port, p + port]
    equations(room, through)
    invert(room)
    _clear(change.fresh)
    for row in range(2 * p):
        _copy(change.given, row, change.next, first + row)
    for port in range(p):
        for argument in range(4 * p + count):
            _add(change.own, port, change.slope[port, argument], change.given, argument)
    for port in range(p):
        for other in range(p):
            _add(change.fresh, port, room.inverse[port, other], change.own, other)
    for row in range(2 * p):
        for port in range(p):
            _add(change.given, row, through[row, port], change.fresh, port)
    for place in range(count):
        for argument in range(4 * p + count):
            _add(change.own_state, place, change.bend[place, argument], change.given, argument)


@inlined_code
def _pass_on(room: Room, change: Change) -> None:
    """What was after the step is before the next."""
    p = room.force.size
    for row in range(2 * p):
        _copy(change.given, 2 * p + row, change.given, row)
    for place in range(room.state.size):
        _copy(change.given, 4 * p + place, change.own_state, place)
    for port in range(p):
        _copy(change.force, port, change.fresh, port)


@inlined_code
def _carry(change: Change, unknowns: Unknowns, step: int) -> None:
    """Changes of states and motions after a step, without those of its last forces."""
    n, p, known = change.x.shape[0], change.force.shape[0], unknowns.lead.shape[2]
    for row in range(n + 2 * p):
        for unknown in range(known):
            change.next[row, unknown] = unknowns.lead[step, row, unknown]
        for unknown in range(known, change.x.shape[1]):
            change.next[row, unknown] = 0.0
        for column in range(n):
            _add(change.next, row, unknowns.table[row, column], change.x, column)
        for port in range(p):
            _add(change.next, row, unknowns.table[row, n + port], change.force, port)


@inlined_code
def _write(change: Change, unknowns: Unknowns, step: int) -> None:
    """Add the changes of the outputs at a sample."""
    q, found = change.x.shape[1], change.found
    for row in range(found.shape[1]):
        for column in range(change.x.shape[0]):
            share = unknowns.output[row, column]
            for unknown in range(q):
                found[step, row, unknown] += share * change.x[column, unknown]
        for port in range(change.force.shape[0]):
            share = unknowns.force_output[row, port]
            if share != 0.0:
                for unknown in range(q):
                    found[step, row, unknown] += share * change.force[port, unknown]


@part_code
def _open(march: March, ports: Ports, room: Room, change: Change, unknowns: Unknowns, t: float) -> None:
    """Changes at the start of a window: of the state itself, and of the motions and forces that it makes at once."""
    n, p, known = change.x.shape[0], room.force.size, unknowns.lead.shape[2]
    begin(march, ports, room, t)
    _clear(change.x)
    _clear(change.next)
    _clear(change.given)
    for row in range(n):
        for column in range(n):
            change.x[row, known + column] = unknowns.initial[row, column]
    for row in range(2 * p):
        for unknown in range(known):
            change.next[row, unknown] = unknowns.lead_start[row, unknown]
        for column in range(n):
            _add(change.next, row, unknowns.start[row, column], change.x, column)
    _slopes(ports, room, change, 0.0, t)
    _own(ports, room, change, unknowns, 0.0, t)
    _settle(room, change, unknowns.through, 0)


@kernel(ALONG)
def law_slopes(book: int, h: float, begin_s: float) -> int:
    """Add to `Change.found` what changes along a march that was made.

    The march is differentiated as it was made, step by step, laws that switch included.
    """
    march, ports, delays, room, change, unknowns, lines = _OPEN(book)
    n, p = change.x.shape[0], room.force.size
    begin_dead_times(delays, room.lagged, room.now)
    _open(march, ports, room, change, unknowns, begin_s)
    see_own_step(delays, room.now)
    _keep(delays, change, 0)
    for step in range(march.rows.shape[0]):
        _pass_on(room, change)
        _write(change, unknowns, step)
        if step == march.rows.shape[0] - 1:
            break
        _carry(change, unknowns, step)
        t = begin_s + (step + 1) * h
        for row in range(2 * p):
            room.given[2 * p + row] = march.motion[step, row]
            room.given[row] = march.motion[step + 1, row]
        for place in range(room.state.size):
            room.given[4 * p + place] = room.state[place]
        _slopes(ports, room, change, h, t)
        _own(ports, room, change, unknowns, h, t)
        _look_back(march, delays, change, unknowns, lines, step + 1)
        _settle(room, change, unknowns.ends, n)
        _keep(delays, change, step + 1)
        for row in range(n):
            for unknown in range(change.x.shape[1]):
                change.x[row, unknown] = change.next[row, unknown]
            for port in range(p):
                _add(change.x, row, unknowns.table[row, n + p + port], change.fresh, port)
    return 0
