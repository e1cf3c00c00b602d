"""Hidden effects in the way of signals: actuators and sensors."""

from collections.abc import Callable, Mapping
from math import pi

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.assembly import Sum, added
from chladni.gap.blind.equations import Machine
from chladni.gap.blind.hidden_forces import RIPPLE_NUMBERS, tone_name
from chladni.gap.blind.plan import GROUND, Hidden

Matrix = NDArray[np.float64]
Expression = dict[str, float]
#: Numbers that each law of a signal takes, in its order.
SIGNAL_LAWS: Mapping[str, tuple[str, ...]] = {
    "hard_limit": ("limit",),
    "soft_limit": ("limit", "sharpness"),
    "hyperbolic_limit": ("limit",),
    "overlap": ("width", "rounding"),
    "slew": ("rate", "tracking_time"),
    "position_gain": ("share", "length"),
    "ripple": RIPPLE_NUMBERS,
}
#: Laws that act on the samples of a sensor, behind its noise.
ON_SAMPLES = ("clip", "round_clip", "floor_steps", "round_steps", "square", "held")


def through_actuator(machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    """What an actuator makes of a command."""
    n, name = hidden.numbers, f"{hidden.site}.{hidden.effect}"
    if hidden.law == "factor":
        return added((n["gain"], signal))
    if hidden.law == "second_order":
        omega = 1.0 / n["time_constant"]
        return machine.assembly.filtered(name, signal, (0.0, 0.0, omega**2),
                                         (1.0, 2 * n["damping_ratio"] * omega, omega**2))  # fmt: skip
    if hidden.law in ("dead_time", "smeared"):
        return _delayed(machine, hidden, name, signal)
    numbers = [n[key] for key in SIGNAL_LAWS[hidden.law]]
    place, speed = acting_place(machine, hidden.site)
    if hidden.law == "ripple":
        return added((1.0, signal), (1.0, machine.assembly.law(name, "ripple", place, speed, *numbers)))
    return machine.assembly.law(name, hidden.law, signal, place, *numbers)


def _delayed(machine: Machine, hidden: Hidden, name: str, signal: Sum) -> Expression:
    """Dead time, or several that differ a little: a transport that smears what it carries."""
    delay, spread = hidden.numbers["delay"], hidden.numbers.get("spread", 0.0)
    shares = (0.25, 0.5, 0.25) if spread else (1.0,)
    parts = []
    for place, share in enumerate(shares):
        late = delay * (1.0 + spread * (place - (len(shares) - 1) / 2))
        parts.append((share, machine.assembly.law(f"{name}{place}", "delay", signal, {}, late)))
    return added(*parts)


def acting_place(machine: Machine, site: str) -> tuple[Expression, Expression]:
    """Displacement and speed of the place at which an input acts; nothing for the ground."""
    one = next(each for each in machine.plan.inputs if each.name == site)
    if one.joint:
        return machine.stretch(machine.plan.joint(one.joint))
    return (machine.displacement(one.at), machine.velocity(one.at)) if one.at not in ("", GROUND) else ({}, {})


def _factor(_machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    return added((hidden.numbers["gain"], signal))


def _mount(machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    """Sensor on a spring, and beside it a damper that hangs on a spring of its own, as wax and rubber do.

    Zener's model: stiffness over mass ``w^2 + 2 zeta w s/(1 + tau s)``, and what it carries over that plus s^2.
    """
    omega, ratio = 2 * pi * hidden.numbers["frequency"], hidden.numbers["damping_ratio"]
    rate = omega / hidden.numbers["relaxation"]
    stiff, still = omega**2 + 2 * ratio * omega * rate, omega**2 * rate
    return machine.assembly.filtered(
        f"{hidden.site}.mount", signal, (0.0, 0.0, stiff, still), (1.0, rate, stiff, still)
    )


def _coupling(machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    """Third-order high-pass, as of three coupling stages of which one is slow."""
    omega, ratio = 2 * pi * hidden.numbers["corner"], hidden.numbers["damping_ratio"]
    slow = machine.assembly.filtered(
        f"{hidden.site}.slow", signal, (1.0, 0.0, 0.0), (1.0, hidden.numbers["slow"] * omega, 0.0)
    )
    return machine.assembly.filtered(
        f"{hidden.site}.coupling", slow, (1.0, 0.0, 0.0), (1.0, 2 * ratio * omega, omega**2)
    )


def _shift(machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    machine.assembly.shifts[hidden.site] = hidden.numbers["offset"]
    return dict(signal)


def _tone(_machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    return added((1.0, signal), (1.0, {tone_name(hidden): 1.0}))


_THROUGH_SENSOR: Mapping[str, Callable[[Machine, Hidden, Sum], Expression]] = {
    "factor": _factor,
    "mount": _mount,
    "coupling": _coupling,
    "shift": _shift,
    "tone": _tone,
}


def through_sensor(machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    """What a sensor makes of a motion, before its samples are taken."""
    return dict(signal) if hidden.law in ON_SAMPLES else _THROUGH_SENSOR[hidden.law](machine, hidden, signal)


def on_samples(hidden: Hidden, values: Matrix) -> Matrix:
    """What a sensor's converter makes of samples.

    Parameters
    ----------
    values
        ``[sample]``, noise included: it's converted with the rest.
    """
    n = hidden.numbers
    if hidden.law == "clip":
        return np.clip(values, -n["limit"] * (1 - n["asymmetry"]), n["limit"] * (1 + n["asymmetry"]))
    if hidden.law == "round_clip":
        over = 1.0 + np.abs(values / n["limit"]) ** n["sharpness"]
        return np.asarray(values / over ** (1.0 / n["sharpness"]))
    if hidden.law == "floor_steps":
        return np.asarray(n["step"] * (np.floor(values / n["step"]) + 0.5))
    if hidden.law == "round_steps":
        return np.asarray(n["step"] * np.rint(values / n["step"]))
    if hidden.law == "square":
        return np.asarray(values + n["coefficient"] * (values**2 - np.mean(values**2)))
    return _held(values, n)


def _held(values: Matrix, n: Mapping[str, float]) -> Matrix:
    """Samples that stay where they were for a while, at random."""
    rng = np.random.default_rng(int(n["seed"]))
    held = values.copy()
    length = int(n["samples"])
    for start in rng.integers(0, max(values.size - length, 1), size=int(n["count"])):
        held[start : start + length] = held[start]
    return held
