"""Equations of a planned machine: named sums, structures, drives, and the arrays that the integrator takes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni_withheld.chains.plan import GROUND, Hidden, Input, Joint, Loop, Output, Plan

#: In the order of `chladni_withheld.chains.laws.any_law`; ``delay`` is the loop's own.
LAWS = (
    "lugre", "dahl", "quadratic", "bouc_wen", "masing", "contact", "soft_play", "cubic_quintic", "rubber",
    "arctangent", "sine_spring", "smooth_change", "ramp_change", "periodic_change", "ripple", "hard_limit",
    "soft_limit", "hyperbolic_limit", "overlap", "slew", "position_gain", "delay",
)  # fmt: skip
LAW_NUMBERS = {word: number for number, word in enumerate(LAWS)}
DELAY = LAW_NUMBERS["delay"]
#: Elements of a Masing network.
MASING_ELEMENTS = 6
#: Own states of the laws that have any.
LAW_STATES = {"lugre": 1, "dahl": 1, "bouc_wen": 1, "masing": MASING_ELEMENTS, "slew": 1}


#: A weighted sum of states, driving signals and laws, by name.
Sum = Mapping[str, float]
Matrix = NDArray[np.float64]
_MOST_NUMBERS = 8


def added(*terms: tuple[float, Sum]) -> dict[str, float]:
    """Weighted sum of sums.

    Examples
    --------
    >>> added((1.0, {"a": 2.0}), (-2.0, {"a": 1.0, "b": 1.0}))
    {'a': 0.0, 'b': -2.0}
    """
    total: dict[str, float] = {}
    for weight, part in terms:
        for name, share in part.items():
            total[name] = total.get(name, 0.0) + weight * share
    return total


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedLaw:
    """A law of `law_words.LAWS` and what it sees.

    Attributes
    ----------
    name
        Of what it gives.
    word
        Which law.
    d, s
        Sums of states, driving signals and laws that were placed before.
    numbers
        See the law.
    """

    name: str
    word: str
    d: Sum
    s: Sum
    numbers: tuple[float, ...]


@dataclass(slots=True)
class Assembly:
    """Equations under construction: driving signals, rates of states, laws and outputs."""

    inputs: list[str] = field(default_factory=list)
    rates: dict[str, dict[str, float]] = field(default_factory=dict)
    laws: list[PlacedLaw] = field(default_factory=list)
    outputs: dict[str, dict[str, float]] = field(default_factory=dict)
    #: Seconds by which an output is recorded late.
    shifts: dict[str, float] = field(default_factory=dict)

    def law(self, name: str, word: str, d: Sum, s: Sum, *numbers: float) -> dict[str, float]:
        """Place a law and give the sum that stands for its value."""
        self.laws.append(PlacedLaw(name=name, word=word, d=d, s=s, numbers=numbers))
        return {name: 1.0}

    def filtered(self, name: str, signal: Sum, num: Sequence[float], den: Sequence[float]) -> dict[str, float]:
        """Pass a signal through a ratio of polynomials in s, highest power first; `den` begins with 1."""
        # Observer form, as of second order: z1' = n1 u - d1 y + z2, z2' = n0 u - d0 y, with y = z1 + n2 u.
        out = added((1.0, {f"{name}.z1": 1.0}), (num[0], signal))
        for place in range(1, len(den)):
            following = [(1.0, {f"{name}.z{place + 1}": 1.0})] if place + 1 < len(den) else []
            self.rates[f"{name}.z{place}"] = added((num[place], signal), (-den[place], out), *following)
        return out

    def arrays(self, interval: float, steps: int) -> "Arrays":
        """Give what the integrator takes; a shift is rounded to its steps."""
        columns = [*self.inputs, *(law.name for law in self.laws)]
        of_state = {name: place for place, name in enumerate(self.rates)}
        of_signal = {name: place for place, name in enumerate(columns)}

        def rows(sums: list[Sum]) -> tuple[Matrix, Matrix]:
            x, e = np.zeros((len(sums), len(of_state))), np.zeros((len(sums), len(of_signal)))
            for row, one in enumerate(sums):
                for name, share in one.items():
                    if name in of_state:
                        x[row, of_state[name]] = share
                    else:
                        e[row, of_signal[name]] = share
            return x, e

        own = np.cumsum([0, *(LAW_STATES.get(law.word, 0) for law in self.laws)])
        numbers = np.zeros((len(self.laws), _MOST_NUMBERS))
        for row, law in enumerate(self.laws):
            numbers[row, : len(law.numbers)] = law.numbers
        words = np.array([LAW_NUMBERS[law.word] for law in self.laws], dtype=np.int64)
        return Arrays(
            system=(*rows(list(self.rates.values())), len(self.inputs)),
            law=(words, own[:-1].astype(np.int64), numbers,
                 *rows([law.d for law in self.laws]), *rows([law.s for law in self.laws])),
            observed=(*rows(list(self.outputs.values())),
                      np.array([round(self.shifts.get(name, 0.0) / interval * steps) for name in self.outputs],
                               dtype=np.int64)),
            states=len(self.rates) + int(own[-1]),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrays:
    """What `chladni_withheld.chains.kernel.march` takes."""

    system: tuple[Matrix, Matrix, int]
    law: tuple[NDArray[np.int64], NDArray[np.int64], Matrix, Matrix, Matrix, Matrix, Matrix]
    observed: tuple[Matrix, Matrix, NDArray[np.int64]]
    states: int


def fastest(assembly: Assembly, interval: float) -> float:
    """Largest magnitude of an eigenvalue of the linear part, 1/s."""
    a = assembly.arrays(interval, 1).system[0]
    return float(np.abs(np.linalg.eigvals(a)).max(initial=0.0))


#: Driving signal of a floor that moves unseen, and of unseen tones by site.
FLOOR = "floor"


@dataclass(slots=True)
class Machine:
    """A machine under construction: what effects may take hold of.

    Attributes
    ----------
    assembly
        Its equations.
    forces
        On each body, as sums.
    masses
        Of each body.
    acting
        Of each input, the signal behind its actuator.
    signals
        Of a drive, what may be measured besides motions.
    """

    assembly: Assembly
    plan: Plan
    numbers: Mapping[str, float]
    forces: dict[str, dict[str, float]]
    masses: dict[str, float]
    acting: dict[str, dict[str, float]] = field(default_factory=dict)
    signals: dict[str, dict[str, float]] = field(default_factory=dict)

    def displacement(self, body: str) -> dict[str, float]:
        """Displacement of a body; the ground has none."""
        return {} if body == GROUND else {f"{body}.q": 1.0}

    def velocity(self, body: str) -> dict[str, float]:
        """Velocity of a body."""
        return {} if body == GROUND else {f"{body}.v": 1.0}

    def stretch(self, joint: Joint) -> tuple[dict[str, float], dict[str, float]]:
        """Displacement and speed of a joint, second body minus first."""
        return (
            added((1.0, self.displacement(joint.second)), (-1.0, self.displacement(joint.first))),
            added((1.0, self.velocity(joint.second)), (-1.0, self.velocity(joint.first))),
        )

    def push(self, body: str, force: Sum) -> None:
        """Let a force act on a body."""
        if body != GROUND:
            self.forces[body] = added((1.0, self.forces[body]), (1.0, force))

    def resist(self, joint: Joint, force: Sum) -> None:
        """Let a joint resist with a force."""
        self.push(joint.second, added((-1.0, force)))
        self.push(joint.first, force)

    def floor(self) -> dict[str, float]:
        """Acceleration of the ground."""
        seen = [self.acting[one.name] for one in self.plan.inputs if one.at == GROUND]
        return added(*((1.0, one) for one in seen), (1.0, {FLOOR: 1.0} if FLOOR in self.assembly.inputs else {}))

    def new_body(self, name: str, mass: float) -> None:
        """Add a body with states."""
        self.forces[name], self.masses[name] = {}, mass


def empty_machine(plan: Plan, numbers: Mapping[str, float], unseen: Sequence[str] = ()) -> Machine:
    """Start a machine without parts. `unseen` names driving signals that aren't in the plan."""
    assembly = Assembly(inputs=[*plan.driven(), *unseen])
    return Machine(assembly=assembly, plan=plan, numbers=numbers, forces={}, masses={})


def begin_structure(machine: Machine) -> None:
    """Add bodies, springs and dampers."""
    plan, numbers = machine.plan, machine.numbers
    for body in plan.bodies:
        machine.new_body(body, numbers[plan.inertia_of(body)])
    for joint in plan.joints:
        d, s = machine.stretch(joint)
        k, c = numbers[f"{joint.name}.stiffness"], numbers[f"{joint.name}.damping"]
        machine.resist(joint, added((k, d), (c, s)))


def finish_structure(machine: Machine) -> None:
    """Let the inputs act as forces."""
    for one in machine.plan.inputs:
        _act(machine, one)


def write_motion(machine: Machine) -> None:
    """Write the rates of all bodies, once all forces are known."""
    floor = machine.floor()
    for body, force in machine.forces.items():
        machine.assembly.rates[f"{body}.q"] = {f"{body}.v": 1.0}
        machine.assembly.rates[f"{body}.v"] = added((1.0 / machine.masses[body], force), (-1.0, floor))


def _act(machine: Machine, one: Input) -> None:
    signal = machine.acting[one.name]
    if one.joint:
        joint = machine.plan.joint(one.joint)
        machine.push(joint.second, signal)
        machine.push(joint.first, added((-1.0, signal)))
    elif one.at != GROUND:
        machine.push(one.at, signal)


def motion(machine: Machine, output: Output) -> dict[str, float]:
    """What a perfect sensor measures. Accelerations are those in space, and need a finished machine."""
    if output.measures not in ("acceleration", "velocity", "displacement"):
        return machine.signals[output.measures]
    ends = [(1.0, output.at)]
    if output.joint:
        joint = machine.plan.joint(output.joint)
        ends = [(1.0, joint.second), (-1.0, joint.first)]
    if output.measures == "acceleration":
        parts = [(sign, machine.assembly.rates[f"{body}.v"]) for sign, body in ends if body != GROUND]
        inside = not any(body == GROUND for _, body in ends)
        # At one body the ground's own acceleration counts; between two it cancels.
        space = machine.floor() if not output.joint and inside else {}
        return added(*parts, (1.0, space))
    if output.measures == "velocity":
        return added(*((sign, machine.velocity(body)) for sign, body in ends))
    return added(*((sign, machine.displacement(body)) for sign, body in ends))


def command(machine: Machine, loop: Loop, position: Sum, speed: Sum) -> dict[str, float]:
    """Force that a controller asks for, behind its limit; `position` and `speed` as its sensor gives them."""
    n, reference = machine.numbers, {loop.name: 1.0}
    error = added((1.0, reference), (-1.0, position))
    kp = n[f"{loop.name}.kp"]
    if loop.law == "p-p":
        kv = n[f"{loop.name}.kv"]
        u = added((kv * kp, error), (-kv, speed))
    else:
        u = added((kp, error), (-n[f"{loop.name}.kd"], speed))
    if loop.law == "pid":
        machine.assembly.rates[f"{loop.name}.i"] = dict(error)
        u = added((1.0, u), (n[f"{loop.name}.ki"], {f"{loop.name}.i": 1.0}))
    force = added((n[f"{loop.name}.gain"], u))
    if loop.limit is None:
        return force
    return machine.assembly.law(f"{loop.name}.limit", "hard_limit", force, {}, loop.limit)


def effects_at(effects: Sequence[Hidden], site: str) -> list[Hidden]:
    """Effects at a site, in order."""
    return [one for one in effects if one.site == site]


#: Joint and body of each kind of drive, and the parameter that holds the body's inertia.
PARTS: Mapping[str, tuple[str, str, str]] = {
    "pneumatic-motor": ("piston", "axis", "reduced_mass"),
    "hydraulic-motor": ("piston", "axis", "reduced_mass"),
    "dc-servo": ("shaft", "rotor", "inertia"),
}


def begin_drive(machine: Machine) -> None:
    """Add the moving body with its viscous loss, and what the drive's force is."""
    joint, body, inertia = PARTS[machine.plan.drive]
    n = machine.numbers
    machine.new_body(body, n[inertia])
    machine.resist(machine.plan.joint(joint), added((n["viscous_loss"], machine.velocity(body))))
    if machine.plan.drive == "dc-servo":
        force, signals = added((n["torque_constant"], {"current": 1.0})), {"current": {"current": 1.0}}
        machine.signals |= {"torque": force, **signals}
    else:
        force = added((n["active_area"], {"pressure_drop": 1.0}))
        machine.signals["pressure_drop"] = {"pressure_drop": 1.0}
    machine.signals["force"] = force
    machine.push(body, force)


def finish_drive(machine: Machine) -> None:
    """Let the inputs act, and write the rates of what isn't a motion."""
    _FINISH[machine.plan.drive](machine)


def _load(machine: Machine, name: str) -> None:
    """A load resists."""
    if name in machine.acting:
        machine.push(PARTS[machine.plan.drive][1], added((-1.0, machine.acting[name])))


def _piston(machine: Machine, capacity: float, flow: Sum) -> None:
    """``Q = A v + a_m dp + c d(dp)/dt``."""
    n = machine.numbers
    machine.assembly.rates["pressure_drop"] = added(
        (1.0 / capacity, flow),
        (-n["active_area"] / capacity, machine.velocity("axis")),
        (-n["leakage"] / capacity, {"pressure_drop": 1.0}),
    )
    _load(machine, "load")


def _pneumatic(machine: Machine) -> None:
    n = machine.numbers
    _piston(machine, n["air_volume"] / (n["adiabatic_exponent"] * n["pressure"]), machine.acting["flow"])


def _hydraulic(machine: Machine) -> None:
    n, command = machine.numbers, machine.acting["flow"]
    flow: Sum = command
    if machine.plan.options.get("valve_lag") == "on":
        spool = {"spool": 1.0}
        machine.assembly.rates["spool"] = added((1 / n["valve_time"], command), (-1 / n["valve_time"], spool))
        flow = spool
    _piston(machine, n["oil_volume"] / n["bulk_modulus"], flow)


def _servo(machine: Machine) -> None:
    """Armature, and around it the loops that are closed, the innermost last."""
    n, current, speed = machine.numbers, {"current": 1.0}, machine.velocity("rotor")
    voltage: Sum
    if machine.plan.options.get("loop") == "position":
        position = added((1.0, machine.acting["position_reference"]), (-1.0, machine.displacement("rotor")))
        wanted_speed = added((n["position_gain"], position))
        wanted_current = _pi(machine, "speed_part", n["velocity_gain"], n["velocity_time"], wanted_speed, speed,
                             weight=n["velocity_weight"])  # fmt: skip
        voltage = _pi(machine, "current_part", n["current_gain"], n["current_time"], wanted_current, current)
    else:
        voltage = machine.acting["voltage"]
    machine.assembly.rates["current"] = added(
        (1.0 / n["inductance"], voltage),
        (-n["resistance"] / n["inductance"], current),
        (-n["back_emf"] / n["inductance"], speed),
    )
    _load(machine, "load_torque")


def _pi(machine: Machine, state: str, gain: float, time_s: float, wanted: Sum, found: Sum, *, weight: float = 1.0,
        ) -> dict[str, float]:  # fmt: skip
    """``gain (weight r - y + integral(r - y)/time)``."""
    machine.assembly.rates[state] = added((gain / time_s, wanted), (-gain / time_s, found))
    return added((weight * gain, wanted), (-gain, found), (1.0, {state: 1.0}))


_FINISH: Mapping[str, Callable[[Machine], None]] = {
    "pneumatic-motor": _pneumatic,
    "hydraulic-motor": _hydraulic,
    "dc-servo": _servo,
}
