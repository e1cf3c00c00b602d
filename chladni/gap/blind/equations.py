"""Equations of a planned structure with its hidden effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from chladni.gap.blind.assembly import Assembly, Sum, added
from chladni.gap.blind.plan import GROUND, Hidden, Input, Joint, Loop, Output, Plan

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
