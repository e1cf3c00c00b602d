"""What a machine has and its description lacks: words, sites, numbers, and what they change of the machine."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import pinocchio as pin

from chladni_withheld.case import PARAMETER, Matrix
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Load, Machine, Motion
from chladni_withheld.robots.scene import RefusedError, Scene

ALL_COMMANDS, WORLD = "all commands", "world"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """One cause.

    Attributes
    ----------
    effect, site, law, parameters
        As the truth tells it.
    change
        Gives the machine that has it.
    also
        Other words and sites that say the same.
    link
        Number of the link whose own inertia it is.
    """

    effect: str
    site: str
    change: Callable[[Machine], Machine]
    law: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    also: tuple[tuple[str, str], ...] = ()
    link: int = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """A scene and how its machine moves with nothing hidden: causes are as large as that asks for."""

    scene: Scene
    quiet: Motion

    @property
    def swing(self) -> Matrix:
        """RMS of each joint's torque about its mean, N m."""
        return self.quiet.given.std(axis=1)

    @property
    def fast(self) -> Matrix:
        """RMS of each joint's speed."""
        return self.quiet.speed.std(axis=1)

    def name(self, joint: int) -> str:
        """A joint's name."""
        return self.scene.robot.joints[joint]

    def require_reversals(self, joint: int) -> None:
        """Refuse a joint that its weight presses to one side all the time: play doesn't show there."""
        if not 0.15 < np.mean(self.quiet.given[joint] > 0.0) < 0.85:
            raise RefusedError("its torque doesn't change sides")

    def free_inertia(self, joint: int) -> float:
        """Inertia that a joint feels when all others are loose, at the log's middle."""
        model = self.scene.machine.model
        inverse = pin.computeMinverse(model, model.createData(), self.quiet.link[:, self.quiet.t_s.size // 2])
        return float(1.0 / np.triu(inverse)[joint, joint])


def _at(values: Matrix, joint: int, value: float) -> Matrix:
    new = np.array(values, dtype=float)
    new[joint] = value
    return new


def _part(machine: Machine, part: str, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers of one joint in one of its parts."""
    old = getattr(machine, part)
    return replace(machine, **{part: replace(old, **{key: _at(getattr(old, key), joint, value)
                                                     for key, value in numbers.items()})})  # fmt: skip


rubbing, served, driven = (partial(_part, part=part) for part in ("friction", "servo", "transmission"))


def _share(rng: Rng, least: float = 0.15, most: float = 0.6) -> float:
    return float(rng.uniform(least, most))


def coulomb(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre whose static force is that of sliding, within a tenth."""
    force = _share(rng) * float(stage.swing[joint])
    numbers = {"coulomb": force, "static": force * float(rng.uniform(1.0, 1.08)),
               "bristle": force / float(10 ** rng.uniform(-3.7, -3.0)), "speed": 0.05 * float(stage.fast[joint])}  # fmt: skip
    return Cause(effect="coulomb_friction", site=stage.name(joint), law="LuGre", parameters={"force": force, **numbers},
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def stribeck(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre that rubs more at rest."""
    force = _share(rng, 0.15, 0.4) * float(stage.swing[joint])
    numbers = {"coulomb": force, "static": force * float(rng.uniform(1.5, 2.2)),
               "bristle": force / float(10 ** rng.uniform(-3.7, -3.0)), "exponent": float(rng.uniform(0.8, 2.0)),
               "speed": float(rng.uniform(0.2, 0.5) * stage.fast[joint])}  # fmt: skip
    return Cause(effect="stribeck_friction", site=stage.name(joint), law="LuGre", parameters=numbers,
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def hysteresis(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Dahl's loop that yields over a good part of the motion; P. R. Dahl, Aerospace Corporation TOR-158 (1968)."""
    force = _share(rng, 0.3, 0.7) * float(stage.swing[joint])
    yields = float(rng.uniform(0.25, 0.6) * stage.quiet.link[joint].std())
    numbers = {"coulomb": force, "static": force, "bristle": force / yields}
    return Cause(effect="hysteresis", site=stage.name(joint), law="Dahl", parameters={"force": force, "yield": yields},
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def load_friction(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre whose level grows with the torque that is passed on."""
    torque = np.abs(stage.quiet.given[joint])
    if torque.std() < 0.4 * torque.mean():
        raise RefusedError("its load hardly changes")
    per_load = float(rng.uniform(0.1, 0.25))
    force = _share(rng, 0.0, 0.5) * per_load * float(torque.mean())
    numbers = {"coulomb": force, "static": force, "per_load": per_load, "speed": 0.05 * float(stage.fast[joint]),
               "bristle": per_load * float(torque.mean()) / float(10 ** rng.uniform(-3.7, -3.0))}  # fmt: skip
    return Cause(effect="load_friction", site=stage.name(joint), law="LuGre",
                 parameters={"force": force, "coefficient": per_load},
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def viscous(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Torque in proportion to speed."""
    coefficient = _share(rng) * float(stage.swing[joint] / stage.fast[joint])
    return Cause(effect="viscous_friction", site=stage.name(joint), law="linear",
                 parameters={"coefficient": coefficient},
                 change=lambda machine: rubbing(machine, joint=joint, viscous=coefficient))  # fmt: skip


def quadratic(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Torque in proportion to the square of speed."""
    coefficient = _share(rng) * float(stage.swing[joint] / stage.fast[joint] ** 2)
    return Cause(effect="quadratic_damping", site=stage.name(joint), law="square",
                 parameters={"coefficient": coefficient},
                 change=lambda machine: rubbing(machine, joint=joint, square=coefficient))  # fmt: skip


def common_delay(rng: Rng, _stage: Stage, _joint: int) -> Cause:
    """All commands arrive late."""
    delay_s = float(rng.uniform(0.003, 0.02))
    return Cause(effect="delay", site=ALL_COMMANDS, law="dead time", parameters={"delay": delay_s},
                 change=lambda machine: replace(machine, servo=replace(
                     machine.servo, delay_s=machine.servo.delay_s + delay_s)))  # fmt: skip


def joint_delay(rng: Rng, stage: Stage, joint: int) -> Cause:
    """The commands of one joint arrive late."""
    delay_s = float(rng.uniform(0.006, 0.03))
    return Cause(effect="delay", site=stage.name(joint), law="dead time", parameters={"delay": delay_s},
                 change=lambda machine: served(machine, joint=joint, delay_s=delay_s))  # fmt: skip


def gain(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A torque constant that isn't what it's believed to be."""
    value = float(rng.choice([rng.uniform(0.6, 0.9), rng.uniform(1.1, 1.4)]))
    # Without the torque in the log, kp and kd that are off alike are the same.
    also = (("controller_gain", stage.name(joint)),) if stage.scene.recorder.effort == "none" else ()
    return Cause(effect="gain_error", site=stage.name(joint), law="constant", parameters={"gain": value}, also=also,
                 change=lambda machine: served(machine, joint=joint, gain=value))  # fmt: skip


def controller_gain(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A loop whose gains are others than those believed, kp more or less than kd."""
    kp = float(rng.choice([rng.uniform(0.6, 0.85), rng.uniform(1.2, 1.5)]))
    kd = float(1.0 + rng.uniform(-0.4, 0.4) * (kp - 1.0))
    servo = stage.scene.machine.servo
    numbers = {"kp": kp * float(servo.kp[joint]), "kd": kd * float(servo.kd[joint])}
    return Cause(effect="controller_gain", site=stage.name(joint), law="constant", parameters={"kp": kp, "kd": kd},
                 change=lambda machine: served(machine, joint=joint, **numbers))  # fmt: skip


def saturation(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A motor that gives less than its most extreme command."""
    torque = np.abs(stage.quiet.given[joint])
    limit = float(np.quantile(torque, rng.uniform(0.75, 0.93)))
    return Cause(effect="saturation", site=stage.name(joint), law="hard", parameters={"limit": limit},
                 change=lambda machine: served(machine, joint=joint, most=limit))  # fmt: skip


def dead_zone(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A drive that gives nothing below some torque."""
    stage.require_reversals(joint)
    width = _share(rng, 0.3, 0.8) * float(stage.swing[joint])
    return Cause(effect="dead_zone", site=stage.name(joint), law="hard", parameters={"width": width},
                 change=lambda machine: served(machine, joint=joint, dead=width))  # fmt: skip


def payload(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A mass that nobody told of, at a last link: of the arm, or of a leg."""
    model = stage.scene.robot.model
    joint = int(rng.choice([index - 1 for index in range(1, model.njoints) if len(model.subtrees[index]) == 1]))
    arm = sum(model.inertias[index].mass for index in range(1, model.njoints))
    mass = float(rng.uniform(0.5, 2.5)) if arm > 3.0 and len(set(model.parents)) == model.nv else 0.0
    mass = mass or float(rng.uniform(0.3, 1.5)) * float(model.inertias[joint + 1].mass)
    centre = rng.uniform(-1.0, 1.0, 3) * np.array([0.04, 0.04, 0.08])
    link = stage.scene.robot.links[joint]
    body = pin.Inertia(mass, centre, mass * 0.03**2 * np.eye(3))
    numbers = {"mass": mass, **dict(zip(("x", "y", "z"), centre.tolist(), strict=True))}
    return Cause(effect="payload", site=link, law="rigid", parameters=numbers, link=joint,
                 change=lambda machine: _heavier(machine, joint, body), also=((PARAMETER, f"{link}.mass"),))  # fmt: skip


def _heavier(machine: Machine, joint: int, body: pin.Inertia) -> Machine:
    model = machine.model.copy()
    model.inertias[joint + 1] = model.inertias[joint + 1] + body
    return replace(machine, model=model)


def heavy_link(share: float, stage: Stage, joint: int) -> Cause:
    """A link that is heavier by a share than its description says."""
    own = stage.scene.robot.model.inertias[joint + 1]
    link = stage.scene.robot.links[joint]
    body = pin.Inertia(share * own.mass, own.lever, share * own.inertia)
    return Cause(effect=PARAMETER, site=f"{link}.mass", law="heavier", link=joint, also=(("payload", link),),
                 parameters={"nominal": own.mass, "true": (1.0 + share) * own.mass},
                 change=lambda machine: _heavier(machine, joint, body))  # fmt: skip


def armature(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A rotor that turns with its joint, many times faster."""
    inertia = _share(rng, 0.2, 0.8) * float(stage.swing[joint] / stage.quiet.acceleration[joint].std())

    def change(machine: Machine) -> Machine:
        model = machine.model.copy()
        model.armature = _at(model.armature, joint, inertia)
        return replace(machine, model=model)

    return Cause(
        effect="armature", site=stage.name(joint), law="rotor", parameters={"inertia": inertia}, change=change
    )


def elasticity(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A spring between motor and link."""
    feels = stage.free_inertia(joint)
    stiffness = (2.0 * np.pi * float(rng.uniform(4.0, 12.0))) ** 2 * feels
    motor = float(rng.uniform(0.1, 0.5)) * feels
    damping = 2.0 * float(rng.uniform(0.01, 0.05)) * float(np.sqrt(stiffness * feels))
    numbers = {"stiffness": stiffness, "damping": damping, "inertia": motor}
    logs_motor = bool(rng.random() < 0.4)
    return Cause(effect="joint_elasticity", site=stage.name(joint), law=f"linear, encoder at the {'motor' if logs_motor else 'link'}",
                 parameters=numbers, change=lambda machine: _two_sided(machine, joint, logs_motor, numbers))  # fmt: skip


def _two_sided(machine: Machine, joint: int, logs_motor: bool, numbers: Mapping[str, float]) -> Machine:
    made = driven(machine, joint=joint, **numbers)
    return replace(made, transmission=replace(made.transmission, logs_motor=logs_motor))


def backlash(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Play between motor and link, whose teeth are stiff."""
    stage.require_reversals(joint)
    feels = stage.free_inertia(joint)
    motor = float(rng.uniform(0.1, 0.4)) * feels
    both = feels * motor / (feels + motor)
    stiffness = (2.0 * np.pi * float(rng.uniform(60.0, 100.0))) ** 2 * both
    numbers = {"stiffness": stiffness, "damping": 0.4 * float(np.sqrt(stiffness * both)), "inertia": motor,
               "gap": float(rng.uniform(0.01, 0.05))}  # fmt: skip
    return Cause(effect="backlash", site=stage.name(joint), law="stiff teeth, encoder at the link", parameters=numbers,
                 change=lambda machine: _two_sided(machine, joint, False, numbers))  # fmt: skip


def _loaded(effect: str, site: str, law: str, parameters: Mapping[str, float], load: Load,
            also: tuple[tuple[str, str], ...] = ()) -> Cause:  # fmt: skip
    return Cause(effect=effect, site=site, law=law, parameters=parameters, also=also,
                 change=lambda machine: replace(machine, loads=(*machine.loads, load)))  # fmt: skip


def joint_spring(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A cable, a hose, a counterbalance."""
    q = stage.quiet.link[joint]
    stiffness = _share(rng, 0.2, 0.7) * float(stage.swing[joint] / q.std())
    rest = float(q.mean() + rng.uniform(-1.5, 1.5) * q.std())
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return _loaded("joint_spring", stage.name(joint), "linear", {"stiffness": stiffness, "rest": rest},
                   lambda _model, _data, _t, q, _v: -stiffness * (q - rest) * only)  # fmt: skip


def one_sided_stop(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A bumper inside the joint's way."""
    q, side = stage.quiet.link[joint], float(rng.choice([-1.0, 1.0]))
    clearance = float(np.quantile(side * q, rng.uniform(0.7, 0.88)))
    deep = float(np.max(side * q)) - clearance
    power = float(rng.choice([1.0, 1.5]))
    stiffness = float(rng.uniform(1.0, 3.0) * stage.swing[joint]) / deep**power
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return _loaded("one_sided_stop", stage.name(joint), f"power {power}",
                   {"stiffness": stiffness, "clearance": side * clearance, "power": power},
                   lambda _model, _data, _t, q, _v:
                   -side * stiffness * max(side * q[joint] - clearance, 0.0) ** power * only)  # fmt: skip


def ripple(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Cogging: torque that is periodic in the angle."""
    q = stage.quiet.link[joint]
    wave = 2.0 * np.pi * float(rng.uniform(1.0, 3.0)) / float(stage.fast[joint])
    if wave * np.ptp(q) < 6.0 * np.pi:
        raise RefusedError("its angle hardly passes a wave")
    amplitude, phase = _share(rng, 0.3, 0.8) * float(stage.swing[joint]), float(rng.uniform(0.0, 2.0 * np.pi))
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return _loaded("ripple", stage.name(joint), "sine",
                   {"amplitude": amplitude, "period": 2.0 * np.pi / wave, "phase": phase},
                   lambda _model, _data, _t, q, _v: amplitude * np.sin(wave * q[joint] + phase) * only)  # fmt: skip


def encoder_offset(rng: Rng, stage: Stage, joint: int) -> Cause:
    """An encoder whose zero is elsewhere."""
    offset = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.15))
    return Cause(effect="encoder_offset", site=stage.name(joint), law="constant", parameters={"offset": offset},
                 change=lambda machine: replace(machine, offset=_at(machine.offset, joint, offset)))  # fmt: skip


def gravity_tilt(rng: Rng, _stage: Stage, _joint: int) -> Cause:
    """A base that isn't level: turned about x, then about y."""
    angles = np.deg2rad(rng.choice([-1.0, 1.0], 2) * rng.uniform(1.5, 8.0, 2))

    def change(machine: Machine) -> Machine:
        model = machine.model.copy()
        turn = pin.rpy.rpyToMatrix(float(angles[0]), float(angles[1]), 0.0)
        model.gravity = pin.Motion(turn.T @ machine.model.gravity.linear, np.zeros(3))
        return replace(machine, model=model)

    return Cause(effect="gravity_tilt", site=WORLD, law="rotation", change=change,
                 parameters={"about_x": float(angles[0]), "about_y": float(angles[1])})  # fmt: skip


def push(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Somebody leans against a link for half a second."""
    begin_s = float(rng.uniform(0.2, 0.8) * stage.scene.recorder.length_s)
    force = rng.normal(size=3)
    force /= np.linalg.norm(force)
    model = stage.scene.machine.model
    middle = stage.quiet.link[:, np.searchsorted(stage.quiet.t_s, begin_s)]
    # As hard as the joints feel that much.
    print_over = _jacobian(model, model.createData(), middle, joint).T @ force
    felt = int(np.argmax(np.abs(print_over) / stage.swing))
    force *= float(rng.uniform(0.8, 2.0) * stage.swing[felt]) / max(abs(float(print_over[felt])), 1e-9)
    sites = [stage.name(felt), stage.name(joint)]

    def load(model: pin.Model, data: pin.Data, t: float, q: Matrix, _v: Matrix) -> Matrix:
        if not begin_s <= t < begin_s + 0.5:
            return np.zeros(q.size)
        found: Matrix = _jacobian(model, data, q, joint).T @ force
        return found * float(np.sin(np.pi * (t - begin_s) / 0.5))

    return _loaded("push", stage.scene.robot.links[joint], "half sine",
                   {"start": begin_s, "end": begin_s + 0.5, "force": float(np.linalg.norm(force))}, load,
                   tuple(("push", site) for site in dict.fromkeys(sites)))  # fmt: skip


def _jacobian(model: pin.Model, data: pin.Data, q: Matrix, joint: int) -> Matrix:
    """Of the link's origin, in the world's axes: ``[axis, joint]``."""
    pin.computeJointJacobians(model, data, q)
    found: Matrix = pin.getJointJacobian(model, data, joint + 1, pin.LOCAL_WORLD_ALIGNED)[:3]
    return found


def _pair(rng: Rng, stage: Stage) -> tuple[int, int]:
    """Two joints of which one moves the other's link."""
    model = stage.scene.robot.model
    pairs = [(a - 1, b - 1) for a in range(1, model.njoints) for b in model.subtrees[a].tolist() if a != b]
    first, second = pairs[int(rng.integers(len(pairs)))]
    return first, second


def coupled_spring(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A cable over two joints."""
    first, second = _pair(rng, stage)
    way = np.zeros(len(stage.scene.robot.joints))
    way[first], way[second] = 1.0, float(rng.uniform(0.5, 1.5) * rng.choice([-1.0, 1.0]))
    stretch = way @ stage.quiet.link
    swing = float(np.sqrt(stage.swing[first] * stage.swing[second]))
    stiffness, rest = float(rng.uniform(0.4, 1.0)) * swing / float(stretch.std()), float(stretch.mean())
    names = stage.name(first), stage.name(second)
    return _loaded("coupled_spring", "~".join(names), "linear", {"stiffness": stiffness},
                   lambda _model, _data, _t, q, _v: -stiffness * (float(way @ q) - rest) * way,
                   tuple(("coupled_spring", name) for name in names))  # fmt: skip


def coupled_friction(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A wrist whose two motors turn one gear: friction on the sum of their speeds."""
    first, second = _pair(rng, stage)
    way = np.zeros(len(stage.scene.robot.joints))
    way[first] = way[second] = 1.0
    force = _share(rng, 0.3, 0.7) * float(np.sqrt(stage.swing[first] * stage.swing[second]))
    soft = 0.05 * float(np.hypot(stage.fast[first], stage.fast[second]))
    names = stage.name(first), stage.name(second)
    return _loaded("coupled_friction", "~".join(names), "tanh", {"force": force},
                   lambda _model, _data, _t, _q, v: -force * np.tanh(float(way @ v) / soft) * way,
                   tuple(("coupled_friction", name) for name in names))  # fmt: skip


Draw = Callable[[Rng, Stage, int], Cause]
#: Words of the contract; `delay` is drawn in two ways.
CAUSES: Mapping[str, Draw] = {
    "coulomb_friction": coulomb, "stribeck_friction": stribeck, "hysteresis": hysteresis, "load_friction": load_friction,
    "viscous_friction": viscous, "quadratic_damping": quadratic, "common_delay": common_delay, "joint_delay": joint_delay,
    "gain_error": gain, "controller_gain": controller_gain, "saturation": saturation, "dead_zone": dead_zone,
    "payload": payload, "armature": armature, "joint_elasticity": elasticity, "backlash": backlash,
    "joint_spring": joint_spring, "one_sided_stop": one_sided_stop, "ripple": ripple, "encoder_offset": encoder_offset,
    "gravity_tilt": gravity_tilt,
}  # fmt: skip
#: What no word says.
OUTSIDE_CAUSES: Mapping[str, Draw] = {
    "push": push, "coupled_spring": coupled_spring, "coupled_friction": coupled_friction,
}  # fmt: skip
