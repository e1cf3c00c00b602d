"""Laws of the hidden physics: what a force or signal is at a displacement, a speed and a time.

Written apart from the catalogue of the diagnosis, and mostly in other forms: a diagnosis must recognise friction that
isn't its own formula. Each law is ``law(d, s, t, p, z, dz) -> value`` with numbers `p`, own states `z` and their
rates `dz` (written by the law); d and s are what the law is given: a joint's displacement and speed, or a signal.
This file is imported when something is simulated, since it compiles.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba as nb

from chladni.signals.cache_folder import CACHED
from chladni_withheld.chains.equations import MASING_ELEMENTS

FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])
_JIT: Any = nb.njit(cache=CACHED, nogil=True, fastmath=False, error_model="numpy")
_SOURCES = [path.stat() for path in sorted(Path(__file__).parent.glob("*.py"))]
_STAMP = max(each.st_mtime for each in _SOURCES), sum(each.st_size for each in _SOURCES)


def compiled(function: FunctionT) -> FunctionT:
    """Compile a function when it's first called, and keep the result where that is possible."""
    made: FunctionT = _JIT(function)
    # numba looks at one file only: a loop would go on with a law that has changed in another file.
    kept = getattr(getattr(made, "_cache", None), "_cache_file", None)
    if kept is not None:
        vars(kept)["_source_stamp"] = _STAMP
    return made


_STEEP = 12.0


@compiled
def soft_step(x: float) -> float:
    """Integral of the logistic function, ``ln(1 + exp x)``, without overflow."""
    return x if x > 30.0 else math.log1p(math.exp(x)) if x > -30.0 else 0.0


@compiled
def logistic(x: float) -> float:
    """``1/(1 + exp(-x))`` without overflow."""
    return 1.0 / (1.0 + math.exp(-min(max(x, -40.0), 40.0)))


@compiled
def soft_dead_zone(d: float, half: float, width: float) -> float:
    """Dead zone of half width `half` whose corners are rounded over `width`."""
    return width * (soft_step((d - half) / width) - soft_step((-d - half) / width))


@compiled
def lugre(_d: float, s: float, _t: float, p: Any, z: Any, dz: Any) -> float:
    """Bristle friction; `p`: sliding, static force, Stribeck speed and exponent, bristle stiffness and damping.

    C. Canudas de Wit and others, IEEE Transactions on Automatic Control 40 (1995), equations 2 to 6.
    """
    steady = p[0] + (p[1] - p[0]) * math.exp(-((abs(s) / p[2]) ** p[3]))
    dz[0] = s - p[4] * abs(s) / steady * z[0]
    return float(p[4] * z[0] + p[5] * dz[0])


@compiled
def dahl(_d: float, s: float, _t: float, p: Any, z: Any, dz: Any) -> float:
    """Dahl's friction with an exponent; `p`: force, bristle stiffness, exponent. Its state is the force's share."""
    left = 1.0 - z[0] * (1.0 if s > 0 else -1.0)
    dz[0] = p[1] / p[0] * s * max(left, 0.0) ** p[2]
    return float(p[0] * z[0])


@compiled
def quadratic(_d: float, s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Turbulent damping that is laminar near rest; `p`: coefficient, speed of the change."""
    return float(p[0] * s * math.sqrt(s * s + p[1] * p[1]))


@compiled
def cubic_quintic(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``p0 d^3 + p1 d^5``."""
    return float(d * d * d * (p[0] + p[1] * d * d))


@compiled
def rubber(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``k (a sinh(d/a) - d)``: what a progressive buffer adds to its own slope k; `p`: k, a."""
    return float(p[0] * (p[1] * math.sinh(min(max(d / p[1], -20.0), 20.0)) - d))


@compiled
def arctangent(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``k (a atan(d/a) - d)``: what a yielding spring lacks to its first slope k; `p`: k, a."""
    return float(p[0] * (p[1] * math.atan(d / p[1]) - d))


@compiled
def sine_spring(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``k (a sin(d/a) - d)``, constant beyond its top: a spring like a magnet's or a pendulum's; `p`: k, a."""
    angle = min(max(d / p[1], -0.5 * math.pi), 0.5 * math.pi)
    return float(p[0] * (p[1] * math.sin(angle) - d))


@compiled
def soft_play(d: float, s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Play with rounded corners; `p`: k, half gap, rounding, c that is missing inside the play."""
    held = logistic((d - p[1]) / p[2]) + logistic((-d - p[1]) / p[2])
    return float(p[0] * (soft_dead_zone(d, p[1], p[2]) - d) - p[3] * s * max(1.0 - held, 0.0))


@compiled
def contact(d: float, s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """One-sided contact; `p`: stiffness, clearance, side, dissipation [s/m], exponent (3/2: Hertz).

    K. H. Hunt and F. R. E. Crossley, Journal of Applied Mechanics 42 (1975).
    """
    depth = p[2] * d - p[1]
    if depth <= 0.0:
        return 0.0
    return float(p[2] * p[0] * depth ** p[4] * max(1.0 + p[3] * p[2] * s, 0.0))


@compiled
def bouc_wen(_d: float, s: float, _t: float, p: Any, z: Any, dz: Any) -> float:
    """Bouc-Wen of any shape; `p`: plateau force, yield displacement, beta, gamma (beta + gamma = 1), exponent."""
    same = 1.0 if s * z[0] > 0 else -1.0
    dz[0] = s / p[1] * (1.0 - abs(z[0]) ** p[4] * (p[2] * same + p[3]))
    return float(p[0] * z[0])


@compiled
def masing(_d: float, s: float, _t: float, p: Any, z: Any, dz: Any) -> float:
    """Springs with sliders in parallel, which yield one after the other; `p`: force, mean yield displacement.

    W. D. Iwan, Journal of Applied Mechanics 33 (1966), with a finite number of elements.
    """
    force = 0.0
    for k in range(MASING_ELEMENTS):
        stop = p[1] * (0.25 + 1.5 * k / (MASING_ELEMENTS - 1))
        # A slider that gives way at once would be a jump of the rate; this one does within a few percent.
        sliding = abs(z[k]) ** _STEEP if s * z[k] > 0 else 0.0
        dz[k] = s / stop * (1.0 - sliding)
        force += p[0] / MASING_ELEMENTS * z[k]
    return float(force)


@compiled
def smooth_change(d: float, _s: float, t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Stiffness that goes over from one value to another; `p`: change [N/m], middle [s], width [s]."""
    return float(p[0] * d * logistic((t - p[1]) / p[2]))


@compiled
def ramp_change(d: float, _s: float, t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Stiffness that changes along a straight line; `p`: change [N/m], start [s], end [s]."""
    return float(p[0] * d * min(max((t - p[1]) / (p[2] - p[1]), 0.0), 1.0))


@compiled
def periodic_change(d: float, _s: float, t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Stiffness that swings; `p`: amplitude [N/m], angular frequency, phase."""
    return float(p[0] * d * math.cos(p[1] * t + p[2]))


@compiled
def ripple(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Force over position; `p`: amplitude, period, phase, share and phase of the second harmonic, of the third."""
    angle = 2.0 * math.pi * d / p[1]
    more = p[3] * math.sin(2.0 * angle + p[4]) + p[5] * math.sin(3.0 * angle + p[6])
    return float(p[0] * (math.sin(angle + p[2]) + more))


@compiled
def hard_limit(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Clip to +-p0."""
    return float(min(max(d, -p[0]), p[0]))


@compiled
def soft_limit(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``d/(1 + |d/p0|^p1)^(1/p1)``: the larger p1, the sharper the knee."""
    return float(d / (1.0 + abs(d / p[0]) ** p[1]) ** (1.0 / p[1]))


@compiled
def hyperbolic_limit(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """``p0 tanh(d/p0)``."""
    return float(p[0] * math.tanh(d / p[0]))


@compiled
def overlap(d: float, _s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Dead zone with rounded corners; `p`: half width, rounding."""
    return soft_dead_zone(d, p[0], p[1])


@compiled
def slew(d: float, _s: float, _t: float, p: Any, z: Any, dz: Any) -> float:
    """Tracker whose rate is limited; `p`: rate, time constant near its goal."""
    dz[0] = p[0] * math.tanh((d - z[0]) / (p[0] * p[1]))
    return float(z[0])


@compiled
def position_gain(d: float, s: float, _t: float, p: Any, _z: Any, _dz: Any) -> float:
    """Signal d with a gain that falls and rises with position s; `p`: share, length over which it changes."""
    return float(d * (1.0 + p[0] * math.tanh(s / p[1])))


@compiled
def law_at_joint(number: int, d: float, s: float, t: float, p: Any, z: Any, dz: Any) -> float:
    """Law by its number in `law_words.LAWS`, of those that hold two bodies together."""
    if number == 0:
        return lugre(d, s, t, p, z, dz)
    if number == 1:
        return dahl(d, s, t, p, z, dz)
    if number == 2:
        return quadratic(d, s, t, p, z, dz)
    if number == 3:
        return bouc_wen(d, s, t, p, z, dz)
    if number == 4:
        return masing(d, s, t, p, z, dz)
    if number == 5:
        return contact(d, s, t, p, z, dz)
    if number == 6:
        return soft_play(d, s, t, p, z, dz)
    return elastic_law(number, d, s, t, p, z, dz)


@compiled
def elastic_law(number: int, d: float, s: float, t: float, p: Any, z: Any, dz: Any) -> float:
    """Laws of displacement, and of displacement and time."""
    if number == 7:
        return cubic_quintic(d, s, t, p, z, dz)
    if number == 8:
        return rubber(d, s, t, p, z, dz)
    if number == 9:
        return arctangent(d, s, t, p, z, dz)
    if number == 10:
        return sine_spring(d, s, t, p, z, dz)
    if number == 11:
        return smooth_change(d, s, t, p, z, dz)
    if number == 12:
        return ramp_change(d, s, t, p, z, dz)
    if number == 13:
        return periodic_change(d, s, t, p, z, dz)
    return ripple(d, s, t, p, z, dz)


@compiled
def law_of_signal(number: int, d: float, s: float, t: float, p: Any, z: Any, dz: Any) -> float:
    """Laws that a signal passes."""
    if number == 15:
        return hard_limit(d, s, t, p, z, dz)
    if number == 16:
        return soft_limit(d, s, t, p, z, dz)
    if number == 17:
        return hyperbolic_limit(d, s, t, p, z, dz)
    if number == 18:
        return overlap(d, s, t, p, z, dz)
    if number == 19:
        return slew(d, s, t, p, z, dz)
    return position_gain(d, s, t, p, z, dz)


@compiled
def any_law(number: int, d: float, s: float, t: float, p: Any, z: Any, dz: Any) -> float:
    """Law by its number."""
    return law_at_joint(number, d, s, t, p, z, dz) if number < 15 else law_of_signal(number, d, s, t, p, z, dz)
