"""What hidden effects do to the equations: at joints and bodies, and in the way of signals."""

from collections.abc import Callable, Mapping
from math import pi

import numpy as np
from numpy.typing import NDArray

from chladni_withheld.chains.equations import Machine, Sum, added
from chladni_withheld.chains.plan import GROUND, Hidden

Matrix = NDArray[np.float64]
Expression = dict[str, float]
#: Of a force over position, at a joint or where an input acts.
RIPPLE_NUMBERS = ("amplitude", "period", "phase", "second", "second_phase", "third", "third_phase")
#: Numbers that each law at a joint takes, in its order.
JOINT_LAWS: Mapping[str, tuple[str, ...]] = {
    "lugre": ("sliding", "static", "speed", "exponent", "stiffness", "damping"),
    "dahl": ("force", "stiffness", "exponent"),
    "quadratic": ("coefficient", "laminar_speed"),
    "bouc_wen": ("force", "yield", "beta", "gamma", "exponent"),
    "masing": ("force", "yield"),
    "contact": ("stiffness", "clearance", "side", "dissipation", "exponent"),
    "soft_play": ("stiffness", "half_gap", "rounding", "damping"),
    "cubic_quintic": ("cubic", "quintic"),
    "rubber": ("stiffness", "length"),
    "arctangent": ("stiffness", "length"),
    "sine_spring": ("stiffness", "length"),
    "smooth_change": ("change", "middle", "width"),
    "ramp_change": ("change", "start", "end"),
    "periodic_change": ("change", "angular_frequency", "phase"),
    "ripple": RIPPLE_NUMBERS,
}
#: Natural frequencies of a clamped beam's second and third mode over its first, and their modal masses likewise
#: (Thomson & Dahleh, Theory of Vibration with Applications, section 9.5).
_BEAM = ((1.0, 1.0), (6.267, 0.307), (17.55, 0.106))


def at_joint(machine: Machine, hidden: Hidden) -> None:
    """Let a joint resist with one more law."""
    joint = machine.plan.joint(hidden.site)
    d, s = machine.stretch(joint)
    if hidden.law == "viscoelastic":
        machine.resist(joint, _maxwell(machine, hidden, s))
        return
    numbers = [hidden.numbers[name] for name in JOINT_LAWS[hidden.law]]
    machine.resist(joint, machine.assembly.law(f"{hidden.site}.{hidden.effect}", hidden.law, d, s, *numbers))


def _maxwell(machine: Machine, hidden: Hidden, speed: Mapping[str, float]) -> dict[str, float]:
    """Springs with a damper in series each, their corners two to a decade: damping that hardly knows a frequency."""
    forces = []
    for place in range(int(hidden.numbers["branches"])):
        name = f"{hidden.site}.maxwell{place}"
        corner = 2 * pi * hidden.numbers["lowest_hz"] * 10 ** (place / 2)
        machine.assembly.rates[name] = added((hidden.numbers["stiffness"], speed), (-corner, {name: 1.0}))
        forces.append((1.0, {name: 1.0}))
    return added(*forces)


def _rigid_mass(machine: Machine, hidden: Hidden) -> None:
    machine.masses[hidden.site] += hidden.numbers["mass"]


def _oscillator(machine: Machine, body: str, name: str, mass: float, frequency_hz: float, ratio: float) -> None:
    """Hang a mass on a body by a spring and damper."""
    machine.new_body(name, mass)
    omega = 2 * pi * frequency_hz
    d = added((1.0, machine.displacement(name)), (-1.0, machine.displacement(body)))
    s = added((1.0, machine.velocity(name)), (-1.0, machine.velocity(body)))
    force = added((mass * omega**2, d), (2 * ratio * mass * omega, s))
    machine.push(body, force)
    machine.push(name, added((-1.0, force)))


def _appendage(machine: Machine, hidden: Hidden) -> None:
    n = hidden.numbers
    _oscillator(machine, hidden.site, f"{hidden.site}.part1", n["mass"], n["frequency"], n["damping_ratio"])
    if n.get("second_mass", 0.0) > 0:
        _oscillator(machine, f"{hidden.site}.part1", f"{hidden.site}.part2", n["second_mass"], n["second_frequency"],
                    n["damping_ratio"])  # fmt: skip


def _beam(machine: Machine, hidden: Hidden) -> None:
    n = hidden.numbers
    for place, (times, share) in enumerate(_BEAM[:2], start=1):
        _oscillator(machine, hidden.site, f"{hidden.site}.part{place}", share * n["mass"], times * n["frequency"],
                    n["damping_ratio"])  # fmt: skip


def _tone(machine: Machine, hidden: Hidden) -> None:
    machine.push(hidden.site, {tone_name(hidden): 1.0})


def _gyroscope(machine: Machine, hidden: Hidden) -> None:
    """Cross-coupling of two bodies' velocities, which does no work."""
    rate = hidden.numbers["coefficient"]
    machine.push(hidden.site, added((rate, machine.velocity(hidden.source))))
    machine.push(hidden.source, added((-rate, machine.velocity(hidden.site))))


def tone_name(hidden: Hidden) -> str:
    """Name of the driving signal of an unseen tone."""
    return f"{hidden.site}.tone"


_AT_BODY: Mapping[str, Callable[[Machine, Hidden], None]] = {
    "rigid": _rigid_mass,
    "stiff_mount": _appendage,
    "appendage": _appendage,
    "beam": _beam,
    "tone": _tone,
    "gyroscope": _gyroscope,
}


def at_body(machine: Machine, hidden: Hidden) -> None:
    """Let something hang on a body or push it; the ground's own motion is a driving signal."""
    if hidden.site != GROUND:
        _AT_BODY[hidden.law](machine, hidden)


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


def _tone_on_signal(_machine: Machine, hidden: Hidden, signal: Sum) -> Expression:
    return added((1.0, signal), (1.0, {tone_name(hidden): 1.0}))


_THROUGH_SENSOR: Mapping[str, Callable[[Machine, Hidden, Sum], Expression]] = {
    "factor": _factor,
    "mount": _mount,
    "coupling": _coupling,
    "shift": _shift,
    "tone": _tone_on_signal,
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
