"""Physics of hidden elements, and the integrator that moves a network with them.

All that is compiled stands in this one file: numba keeps machine code by the file that a function stands in, and
would go on using a law's old code in another file's integrator.
"""

from collections.abc import Callable
from math import atan, copysign, cos, exp, log1p, pi, sin, sqrt, tan, tanh
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from chladni_withheld.networks.network import Matrix

FunctionT = TypeVar("FunctionT", bound=Callable[..., object])
Elements = tuple[NDArray[np.int64], NDArray[np.int64], Matrix]
"""Codes ``[element]``, ends ``[element, 2]`` (-1 for the ground), numbers ``[element, PARAMETERS]``."""


def compiled(function: FunctionT) -> FunctionT:
    """Compile a function; its machine code is kept where there is a folder for it."""
    try:
        made: Any = numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba's word for having found no folder
        made = numba.njit(nogil=True)(function)
    machine_code: FunctionT = made
    return machine_code


PARAMETERS = 20
"""Numbers that an element has room for."""
SLIDERS = 8
"""Jenkins elements in one element, at most."""

# Codes of the laws: without memory, with a state that has a rate, with sliders that are moved on after each step.
(TURBULENT, MAGNETS, TANGENT, WIRES, ARCTANGENT, MEMBRANE, PLAY, HERTZ, BUMPER, COGGING, INCLINED, FILM, CHANGING,
 PERIODIC, BRISTLE, RELAXATION, SLIDING) = range(17)  # fmt: skip


@compiled
def turbulent(s: float, coefficient: float, laminar: float) -> float:
    """Flow through an orifice: quadratic above the speed `laminar`, viscous below."""
    return coefficient * s * sqrt(s * s + laminar * laminar)


@compiled
def magnets(d: float, stiffness: float, gap: float) -> float:
    """Two repelling magnets, one each side at `gap`, forces as 1/distance^2, without the tangent at rest."""
    x = min(max(d / gap, -0.9), 0.9)
    return stiffness * gap * (0.25 * (1 / (1 - x) ** 2 - 1 / (1 + x) ** 2) - x)


@compiled
def tangent(d: float, stiffness: float, reach: float) -> float:
    """An elastic bearing that ends at `reach`: a tangent curve, without the slope at rest."""
    x = min(max(d / reach, -0.95), 0.95)
    return stiffness * reach * (2 / pi * tan(pi / 2 * x) - x)


@compiled
def wires(d: float, stiffness: float, length: float) -> float:
    """Slack-free wires across the motion, pulled sideways."""
    return stiffness * d * (1 - length / sqrt(length * length + d * d))


@compiled
def arctangent(d: float, stiffness: float, reach: float) -> float:
    """A spring that gives way as an arctangent, without the slope at rest."""
    return stiffness * (reach * atan(d / reach) - d)


@compiled
def membrane(d: float, stiffness: float, reach: float) -> float:
    """A rolling membrane whose force ends at stiffness times reach, without the slope at rest."""
    return stiffness * d * (1 / sqrt(1 + (d / reach) ** 2) - 1)


@compiled
def play(d: float, stiffness: float, gap: float, rounding: float) -> float:
    """What turns a spring into one with play: rounded contact at half the gap each side, minus the spring itself."""
    above, below = d - 0.5 * gap, d + 0.5 * gap
    touching = 0.5 * (above + sqrt(above * above + rounding * rounding))
    touching += 0.5 * (below - sqrt(below * below + rounding * rounding))
    return stiffness * (touching - d)


@compiled
def hertz(d: float, s: float, stiffness: float, clearance: float, dissipation: float, side: float) -> float:
    """Contact of Hunt and Crossley beyond `clearance` on one side, by Hertz's power of 3/2; it never pulls."""
    depth = side * d - clearance
    if depth <= 0:
        return 0.0
    return side * max(stiffness * depth * sqrt(depth) * (1 + dissipation * side * s), 0.0)


@compiled
def bumper(d: float, s: float, stiffness: float, clearance: float, damping: float, side: float) -> float:
    """A rubber bumper beyond `clearance` on one side, linear with a damper; it never pulls."""
    depth = side * d - clearance
    if depth <= 0:
        return 0.0
    return side * max(stiffness * depth + damping * side * s, 0.0)


@compiled
def cogging(d: float, amplitude: float, period: float, phase: float) -> float:
    """A force periodic in position with a fifth of second harmonic, none at rest in the middle."""
    angle = 2 * pi * d / period + phase
    turned: float = sin(angle) - sin(phase) + 0.2 * (sin(2 * angle) - sin(2 * phase))
    return amplitude * turned


@compiled
def inclined(d: float, stiffness: float, length: float, angle: float) -> float:
    """A spring of free `length` at an `angle` to the motion, its own geometry exact, without the tangent at rest."""
    along, across = length * cos(angle) + d, length * sin(angle)
    now = sqrt(along * along + across * across)
    return stiffness * ((now - length) * along / now - cos(angle) ** 2 * d)


@compiled
def film(d: float, s: float, damping: float, gap: float) -> float:
    """A squeezed film's damper, which grows with the square of the way from the middle."""
    return damping * (d / gap) ** 2 * s


@compiled
def changing(d: float, t: float, stiffness: float, form: float, start_s: float, length_s: float) -> float:
    """A part of a spring that comes or goes: with warmth (0), at once as a crack does (1), or as a creep (2)."""
    since, part = t - start_s, 0.0
    if form == 1:
        part = 0.5 * (1 + tanh(2 * since / length_s))
    elif since > 0:
        part = 1 - exp(-since / length_s) if form == 0 else log1p(since / length_s)
    return stiffness * d * part


@compiled
def bristle_limit(s: float, sliding: float, rise: float, speed: float) -> float:
    """Force of steady sliding: from sliding + rise at rest down to sliding, a Lorentz curve of the speed."""
    return sliding + rise / (1 + (s / speed) ** 2)


@compiled
def bristle_rate(s: float, bend: float, stiffness: float, limit: float) -> float:
    """How fast LuGre's bristles bend."""
    return s - stiffness * abs(s) * bend / limit


@compiled
def slider_forces(
    way: float, stretched: Matrix, stiffnesses: Matrix, yields: Matrix, moved: Matrix
) -> tuple[float, float]:
    """Jenkins elements in parallel, `way` beyond where their springs were `stretched`: force, share that slides.

    `moved` gets their new stretch. Exact for a way without reversal, so short steps follow any motion.
    """
    force, sliding, count = 0.0, 0, 0
    for number in range(SLIDERS):
        if yields[number] <= 0:
            break
        count += 1
        stretch = stretched[number] + way
        if abs(stretch) >= yields[number]:
            sliding += 1
            stretch = copysign(yields[number], stretch)
        moved[number] = stretch
        force += stiffnesses[number] * stretch
    return force, sliding / max(count, 1)


@compiled
def _smooth_force(code: int, d: float, p: Matrix) -> float:
    if code == MAGNETS:
        return magnets(d, p[0], p[1])
    if code == TANGENT:
        return tangent(d, p[0], p[1])
    if code == WIRES:
        return wires(d, p[0], p[1])
    if code == ARCTANGENT:
        return arctangent(d, p[0], p[1])
    if code == MEMBRANE:
        return membrane(d, p[0], p[1])
    if code == COGGING:
        return cogging(d, p[0], p[1], p[2])
    return inclined(d, p[0], p[1], p[2])


@compiled
def _other_force(code: int, d: float, s: float, t: float, p: Matrix) -> tuple[float, float]:
    """Force of a law without memory, and 1 where it acts, if it acts by times."""
    if code == TURBULENT:
        return turbulent(s, p[0], p[1]), 1.0
    if code == FILM:
        return film(d, s, p[0], p[1]), 1.0
    if code == CHANGING:
        return changing(d, t, p[0], p[1], p[2], p[3]), 1.0
    if code == PERIODIC:
        return p[0] * d * sin(2 * pi * t / p[1] + p[2]), 1.0
    if code == PLAY:
        return play(d, p[0], p[1], p[2]), 1.0 if abs(d) < 0.5 * p[1] else 0.0
    if code == HERTZ:
        force = hertz(d, s, p[0], p[1], p[2], p[3])
        return force, 1.0 if force != 0 else 0.0
    if code == BUMPER:
        force = bumper(d, s, p[0], p[1], p[2], p[3])
        return force, 1.0 if force != 0 else 0.0
    return _smooth_force(code, d, p), 1.0


@compiled
def element_force(
    code: int, d: float, s: float, t: float, p: Matrix, bend: float, kept: Matrix, moved: Matrix
) -> tuple[float, float, float]:
    """Force of an element, the rate of its state, and how much of it acts (slides, touches) now.

    `kept` holds the sliders' stretch and, last, the way at which they had it.
    """
    if code == BRISTLE:
        limit = bristle_limit(s, p[1], p[2], p[3])
        rate = bristle_rate(s, bend, p[0], limit)
        return p[0] * bend + p[4] * rate, rate, 1.0 if p[0] * abs(bend) > 0.8 * p[1] else 0.0
    if code == RELAXATION:
        return p[0] * bend, s - bend / p[1], 1.0
    if code == SLIDING:
        force, share = slider_forces(d - kept[SLIDERS], kept, p[:SLIDERS], p[SLIDERS : 2 * SLIDERS], moved)
        return force, 0.0, share
    force, acts = _other_force(code, d, s, t, p)
    return force, 0.0, acts


@compiled
def _across(values: Matrix, first: int, second: int, offset: int) -> float:
    difference = 0.0
    if second >= 0:
        difference += values[offset + second]
    if first >= 0:
        difference -= values[offset + first]
    return difference


@compiled
def slopes(
    t: float, state: Matrix, drive: Matrix, flow: Matrix, push: Matrix, elements: Elements, kept: Matrix,
    rates: Matrix, results: Matrix, moved: Matrix,
) -> None:  # fmt: skip
    """Rates of the ways, speeds and elements' states; `results`: forces of the elements and how much they act."""
    codes, ends, numbers = elements
    bodies = len(flow)
    for row in range(bodies):
        rates[row] = state[bodies + row]
        total = 0.0
        for column in range(2 * bodies):
            total += flow[row, column] * state[column]
        for column in range(len(drive)):
            total += flow[row, 2 * bodies + column] * drive[column]
        rates[bodies + row] = total
    for number in range(len(codes)):
        first, second = ends[number, 0], ends[number, 1]
        force, rate, acts = element_force(
            codes[number], _across(state, first, second, 0), _across(state, first, second, bodies), t,
            numbers[number], state[2 * bodies + number], kept[number], moved[number],
        )  # fmt: skip
        rates[2 * bodies + number], results[0, number], results[1, number] = rate, force, acts
        for row in range(bodies):
            rates[bodies + row] -= push[row, number] * force


@compiled
def _keep(state: Matrix, elements: Elements, kept: Matrix, moved: Matrix) -> None:
    """Move the sliders on to where the step ends."""
    codes, ends, numbers = elements
    for number in range(len(codes)):
        if codes[number] == SLIDING:
            d = _across(state, ends[number, 0], ends[number, 1], 0)
            way, p = d - kept[number, SLIDERS], numbers[number]
            slider_forces(way, kept[number], p[:SLIDERS], p[SLIDERS : 2 * SLIDERS], moved[number])
            # One by one: a slice's checks of its shape would take a third of the compilation.
            for slider in range(SLIDERS):
                kept[number, slider] = moved[number, slider]
            kept[number, SLIDERS] = d


@compiled
def _read(view: Matrix, state: Matrix, rates: Matrix, forces: Matrix, drive: Matrix, readings: Matrix) -> None:
    """Read all sensors: columns of `view` are ways, speeds, accelerations, forces of the elements, inputs."""
    bodies = (len(state) - len(forces)) // 2
    for row in range(len(readings)):
        total = 0.0
        for column in range(2 * bodies):
            total += view[row, column] * state[column]
        for column in range(bodies):
            total += view[row, 2 * bodies + column] * rates[bodies + column]
        for column in range(len(forces)):
            total += view[row, 3 * bodies + column] * forces[column]
        for column in range(len(drive)):
            total += view[row, 3 * bodies + len(forces) + column] * drive[column]
        readings[row] = total


@compiled
def integrate(
    flow: Matrix, push: Matrix, elements: Elements, view: Matrix, drives: Matrix, jumps: NDArray[np.bool_],
    start_s: float, step_s: float,
) -> tuple[Matrix, Matrix]:  # fmt: skip
    """Move a network from rest by Runge and Kutta's fourth-order steps.

    Parameters
    ----------
    flow
        Accelerations by ways, speeds and inputs, ``[body, 2 bodies + inputs]``.
    push
        Accelerations by the elements' forces, which are subtracted, ``[body, element]``.
    elements
        See `Elements`.
    view
        What sensors show of ways, speeds, accelerations, forces of elements, and inputs, ``[sensor, all these]``.
    drives, jumps
        ``[input, 2 steps + 1]`` at ends and middles of steps, and which of them are constant between these.

    Returns
    -------
    tuple
        Readings ``[sensor, step]`` at the beginning of each step, and how much each element acted, ``[element]``.
    """
    count, inputs = len(elements[0]), len(drives)
    steps, size = (drives.shape[1] - 1) // 2, 2 * len(flow) + count
    kept, moved = np.zeros((count, SLIDERS + 1)), np.zeros((count, SLIDERS))
    state, ahead, rates, total = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    drive, results, acted = np.zeros(inputs), np.zeros((2, count)), np.zeros(count)
    readings = np.empty((len(view), steps))
    for step in range(steps):
        for row in range(size):
            ahead[row] = state[row]
        for stage in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[stage]
            # A drive that jumps at a step's end has not yet jumped in that step.
            for number in range(inputs):
                drive[number] = drives[number, 2 * step + (0, 1, 1, 1 if jumps[number] else 2)[stage]]
            t = start_s + (step + part) * step_s
            slopes(t, ahead, drive, flow, push, elements, kept, rates, results, moved)
            if stage == 0:
                _read(view, state, rates, results[0], drive, readings[:, step])
                for number in range(count):
                    acted[number] += results[1, number]
                for row in range(size):
                    total[row] = 0.0
            for row in range(size):
                total[row] += (1.0, 2.0, 2.0, 1.0)[stage] / 6 * rates[row]
                ahead[row] = state[row] + (0.5, 0.5, 1.0, 0.0)[stage] * step_s * rates[row]
        for row in range(size):
            state[row] += step_s * total[row]
        _keep(state, elements, kept, moved)
    return readings, acted / max(steps, 1)
