"""Kernels: one step between samples with laws at ports, and how it changes with parameters and starts.

A step takes ``v = [x0, row, f0, f1]`` to ``[x1, m1] = B v``: states and motions at the ports. Between its ends the
port forces run along straight lines, as the inputs do; f1 is what the laws say of m1. Law states follow their own
equation, linearised in themselves at the middle of the step, exactly: bristles that bend within a step neither ring
nor lag.
"""

from math import expm1
from typing import NamedTuple

import numpy as np

from chladni.models.integrator.machine_code import ALONG, inlined_code, kernel, part_code
from chladni.models.integrator.plane import Integers1, Numbers1, Numbers2, opener
from chladni.models.integrator.port_kernel import Ports, end_of_states, law_force
from chladni.signals.arrays import Real

_ITERATIONS = 40
_HALVINGS = 12
#: Forces agree with their laws to this share of the largest so far; a step that misses by more has failed.
_MET = 1e-9
_NEARLY = 1e-6
#: Share of the largest motion so far below which a difference is taken on that, not on the motion itself.
_SMALL = 1e-2
#: Differences of motions for the slope of a force; of law states inside, whose own differences must be far below.
FINE, _LARGE = 1e-6, 1e-3


class DeadTimes(NamedTuple):
    """Dead times at ports, ``f(t) = d(t - delay) - d(t)``.

    Attributes
    ----------
    port
        ``[delay]``.
    ago
        ``[delay]`` steps back to the latest of four displacements.
    share
        ``[delay, 4]`` of each, the latest first.
    """

    port: Integers1
    ago: Integers1
    share: Numbers2


class Room(NamedTuple):
    """What one step works on.

    Attributes
    ----------
    given
        ``[4 port + law state]``: what forces depend on. Displacements and velocities after the step, then before it,
        then the law states before it.
    state, force
        Law states and forces after it.
    base
        ``[2 port]`` motions after it, without those forces.
    missed, tried, slope, matrix, inverse
        Of Newton's iteration.
    scale
        ``[4 port + law state]`` size of each argument, so that differences are taken on it.
    lagged, now
        ``[port]`` what dead times give of steps before, and their share of the displacement after the step itself.
    """

    given: Numbers1
    state: Numbers1
    force: Numbers1
    base: Numbers1
    missed: Numbers1
    tried: Numbers1
    slope: Numbers1
    matrix: Numbers2
    inverse: Numbers2
    scale: Numbers1
    lagged: Numbers1
    now: Numbers1


class March(NamedTuple):
    """Tables of one march, and what it fills.

    Attributes
    ----------
    table
        B ``[state + 2 port, state + width + 2 port]``.
    ends
        ``[2 port, port]``: the part of B that takes f1 to m1.
    start, through
        ``[2 port, state + width]``, ``[2 port, port]``: motions at the start, of state and row and of forces.
    rows
        ``[step, width]``.
    x, motion, force, state
        ``[step, ...]`` states, motions and forces at the ports, law states; of x and state the first row is given.
    """

    table: Numbers2
    ends: Numbers2
    start: Numbers2
    through: Numbers2
    rows: Numbers2
    x: Numbers2
    motion: Numbers2
    force: Numbers2
    state: Numbers2


#: What the march keeps in its book, and its slopes before what is their own.
MARCH_RECORDS = (March, Ports, DeadTimes, Room)
_OPEN = opener(*MARCH_RECORDS)


@inlined_code
def _bend(ports: Ports, law: int, room: Room, port: int, h: float, t: float) -> None:
    """States of a law at the end of the step, where it's asked for its force."""
    p = room.force.size
    first, last = ports.table[law, 2], end_of_states(ports, law)
    d = 0.5 * (room.given[port] + room.given[2 * p + port])
    s = 0.5 * (room.given[p + port] + room.given[3 * p + port])
    middle = t - 0.5 * h
    for place in range(first, last):
        ports.state[place] = room.given[4 * p + place]
    for place in range(first, last):
        here = room.given[4 * p + place]
        by = _LARGE * (abs(here) + _SMALL)
        ports.state[place] = here + by
        law_force(ports, law, d, s, middle, np.int64(0))
        there = ports.channels[0, p + place]
        ports.state[place] = here
        law_force(ports, law, d, s, middle, np.int64(0))
        rate = ports.channels[0, p + place]
        e = min(h * (there - rate) / by, 30.0)
        share = expm1(e) / e if abs(e) > 1e-6 else 1.0 + 0.5 * e
        room.state[place] = here + h * share * rate
    for place in range(first, last):
        ports.state[place] = room.state[place]


@inlined_code
def force_of(ports: Ports, room: Room, port: int, h: float, t: float) -> float:
    """Force of all laws and dead times at a port, at the motion after the step; sets the states of laws."""
    p = room.force.size
    total: float = room.lagged[port] + room.now[port] * room.given[port]
    for law in range(ports.first[port], ports.first[port + 1]):
        if end_of_states(ports, law) > ports.table[law, 2]:
            _bend(ports, law, room, port, h, t)
        total += law_force(ports, law, room.given[port], room.given[p + port], t, np.int64(0))
    return total


@part_code
def missed_by(ports: Ports, room: Room, through: Real, force: Real, h: float, t: float) -> float:
    """Largest difference between the forces and what the laws say of the motion that they make."""
    p = room.force.size
    for row in range(2 * p):
        value = room.base[row]
        for port in range(p):
            value += through[row, port] * force[port]
        room.given[row] = value
    largest = 0.0
    for port in range(p):
        room.missed[port] = force[port] - force_of(ports, room, port, h, t)
        largest = max(largest, abs(room.missed[port]))
    return largest


@part_code
def slope_of(ports: Ports, room: Room, port: int, argument: int, here: float, h: float, t: float) -> float:
    """Change of a port's force with one of its arguments; leaves the law states as they are there."""
    kept = room.given[argument]
    by = FINE * max(abs(kept), room.scale[argument])
    room.given[argument] = kept + by
    slope: float = (force_of(ports, room, port, h, t) - here) / by
    room.given[argument] = kept
    return slope


@inlined_code
def equations(room: Room, through: Real) -> None:
    """Matrix of ``df - slope dm``, m moved by the forces themselves."""
    p = room.force.size
    for row in range(p):
        for column in range(p):
            value = 1.0 if row == column else 0.0
            value -= room.slope[row] * through[row, column] + room.slope[p + row] * through[p + row, column]
            room.matrix[row, column] = value


@inlined_code
def invert(room: Room) -> None:
    """Invert the matrix of the equations, by Gauss and Jordan without exchange: laws that resist make it dominant."""
    p = room.matrix.shape[0]
    for row in range(p):
        for column in range(p):
            room.inverse[row, column] = 1.0 if row == column else 0.0
    for pivot in range(p):
        factor = 1.0 / room.matrix[pivot, pivot] if room.matrix[pivot, pivot] != 0.0 else 0.0
        for column in range(p):
            room.matrix[pivot, column] *= factor
            room.inverse[pivot, column] *= factor
        for row in range(p):
            if row != pivot:
                share = room.matrix[row, pivot]
                for column in range(p):
                    room.matrix[row, column] -= share * room.matrix[pivot, column]
                    room.inverse[row, column] -= share * room.inverse[pivot, column]


@inlined_code
def _newton_change(ports: Ports, room: Room, through: Real, h: float, t: float) -> None:
    """Newton's change of the forces, in `slope`."""
    p = room.force.size
    for port in range(p):
        here = force_of(ports, room, port, h, t)
        for row in (port, p + port):
            room.slope[row] = slope_of(ports, room, port, row, here, h, t)
    equations(room, through)
    invert(room)
    for row in range(p):
        change = 0.0
        for column in range(p):
            change -= room.inverse[row, column] * room.missed[column]
        room.slope[row] = change


@part_code
def meet(ports: Ports, room: Room, through: Real, h: float, t: float, size: float) -> int:
    """Forces at the end of the step that agree with the laws: Newton, halved while it makes things worse."""
    p = room.force.size
    missed = missed_by(ports, room, through, room.force, h, t)
    for _ in range(_ITERATIONS):
        if missed <= _MET * size:
            return 0
        _newton_change(ports, room, through, h, t)
        share, best = 1.0, missed
        for _ in range(_HALVINGS):
            for row in range(p):
                room.tried[row] = room.force[row] + share * room.slope[row]
            best = missed_by(ports, room, through, room.tried, h, t)
            if best < missed:
                break
            share *= 0.5
        if not best < missed:
            break
        missed = best
        for row in range(p):
            room.force[row] = room.tried[row]
    missed = missed_by(ports, room, through, room.force, h, t)
    return 0 if missed <= _NEARLY * size else 1


@part_code
def begin(march: March, ports: Ports, room: Room, t: float) -> int:
    """Motions and forces at the start of a window, which make each other at once."""
    n, p = march.x.shape[1], room.force.size
    for row in range(2 * p):
        value = 0.0
        for column in range(n):
            value += march.start[row, column] * march.x[0, column]
        for column in range(march.rows.shape[1]):
            value += march.start[row, n + column] * march.rows[0, column]
        room.base[row] = value
        room.given[2 * p + row] = value
    for place in range(room.state.size):
        room.given[4 * p + place] = march.state[0, place]
    for port in range(p):
        room.force[port] = 0.0
    missed = missed_by(ports, room, march.through, room.force, 0.0, t)
    return meet(ports, room, march.through, 0.0, t, max(missed, 1e-300))


@inlined_code
def _record(march: March, room: Room, step: int) -> None:
    """Keep what a step ended with, and begin the next one from it."""
    p = room.force.size
    for row in range(2 * p):
        march.motion[step, row] = room.given[row]
        room.scale[row] = max(room.scale[row], _SMALL * abs(room.given[row]))
        room.scale[2 * p + row] = room.scale[row]
        room.given[2 * p + row] = room.given[row]
    for place in range(room.state.size):
        march.state[step, place] = room.state[place]
        room.given[4 * p + place] = room.state[place]
    for port in range(p):
        march.force[step, port] = room.force[port]


@inlined_code
def _advance(march: March, room: Room, step: int) -> None:
    """States and motions after the step, without its last forces."""
    n, p, width = march.x.shape[1], room.force.size, march.rows.shape[1]
    for row in range(n + 2 * p):
        value = 0.0
        for column in range(n):
            value += march.table[row, column] * march.x[step, column]
        for column in range(width):
            value += march.table[row, n + column] * march.rows[step, column]
        for port in range(p):
            value += march.table[row, n + width + port] * march.force[step, port]
        if row < n:
            march.x[step + 1, row] = value
        else:
            room.base[row - n] = value


@inlined_code
def begin_dead_times(delays: DeadTimes, lagged: Real, now: Real) -> None:
    """At the start of a window nothing is behind: all that acts ``[port]`` is the displacement that is missing."""
    for port in range(now.size):
        lagged[port] = now[port] = 0.0
    for delay in range(delays.port.size):
        now[delays.port[delay]] -= 1.0


@inlined_code
def see_own_step(delays: DeadTimes, now: Real) -> None:
    """After the start, a dead time below two steps sees the displacement ``[port]`` at the end of its own."""
    for delay in range(delays.port.size):
        if delays.ago[delay] == 0:
            now[delays.port[delay]] += delays.share[delay, 0]


@inlined_code
def look_back(delays: DeadTimes, delay: int, motion: Real, step: int, latest: int) -> float:
    """Displacement that comes at a step, of those up to the latest in ``motion [step, port]``; 0 before the start."""
    total = 0.0
    for node in range(delays.share.shape[1]):
        past = step - delays.ago[delay] - node
        if 0 <= past <= latest:
            total += delays.share[delay, node] * motion[past, delays.port[delay]]
    return total


@kernel(ALONG)
def law_march(book: int, h: float, begin_s: float) -> int:
    """March through one window; gives how many steps did not meet their laws."""
    march, ports, delays, room = _OPEN(book)
    n, p, width = march.x.shape[1], room.force.size, march.rows.shape[1]
    begin_dead_times(delays, room.lagged, room.now)
    failed = begin(march, ports, room, begin_s)
    see_own_step(delays, room.now)
    size = 1e-300
    for step in range(march.rows.shape[0]):
        _record(march, room, step)
        for port in range(p):
            size = max(size, abs(room.force[port]))
        if step == march.rows.shape[0] - 1:
            break
        _advance(march, room, step)
        for port in range(p):
            room.lagged[port] = 0.0
        for delay in range(delays.port.size):
            room.lagged[delays.port[delay]] += look_back(delays, delay, march.motion, step + 1, step)
        failed += meet(ports, room, march.ends, h, begin_s + (step + 1) * h, size)
        for row in range(n):
            for port in range(p):
                march.x[step + 1, row] += march.table[row, n + width + p + port] * room.force[port]
    return failed
