"""Hidden effects at joints and bodies."""

from collections.abc import Callable, Mapping
from math import pi

from chladni.gap.blind.assembly import added
from chladni.gap.blind.equations import Machine
from chladni.gap.blind.plan import GROUND, Hidden

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
