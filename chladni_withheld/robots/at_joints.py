"""Causes at joints: friction, transmissions, rotors, springs, stops, encoders."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from chladni_withheld.robots.cause import Cause, Stage, at, driven, loaded, rubbing, share
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Machine
from chladni_withheld.robots.scene import RefusedError


def coulomb(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre whose static force is that of sliding, within a tenth."""
    force = share(rng) * float(stage.swing[joint])
    numbers = {
        "coulomb": force,
        "static": force * float(rng.uniform(1.0, 1.08)),
        "bristle": force / float(10 ** rng.uniform(-3.7, -3.0)),
        "speed": 0.05 * float(stage.fast[joint]),
    }
    return Cause(
        effect="coulomb_friction",
        site=stage.name(joint),
        law="LuGre",
        parameters={"force": force, **numbers},
        change=lambda machine: rubbing(machine, joint=joint, **numbers),
    )


def stribeck(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre that rubs more at rest."""
    force = share(rng, 0.15, 0.4) * float(stage.swing[joint])
    numbers = {"coulomb": force, "static": force * float(rng.uniform(1.5, 2.2)),
               "bristle": force / float(10 ** rng.uniform(-3.7, -3.0)), "exponent": float(rng.uniform(0.8, 2.0)),
               "speed": float(rng.uniform(0.2, 0.5) * stage.fast[joint])}  # fmt: skip
    return Cause(effect="stribeck_friction", site=stage.name(joint), law="LuGre", parameters=numbers,
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def hysteresis(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Dahl's loop that yields over a good part of the motion; P. R. Dahl, Aerospace Corporation TOR-158 (1968)."""
    force = share(rng, 0.3, 0.7) * float(stage.swing[joint])
    yields = float(rng.uniform(0.25, 0.6) * stage.quiet.link[joint].std())
    numbers = {"coulomb": force, "static": force, "bristle": force / yields}
    return Cause(
        effect="hysteresis",
        site=stage.name(joint),
        law="Dahl",
        parameters={"force": force, "yield": yields},
        change=lambda machine: rubbing(machine, joint=joint, **numbers),
    )


def load_friction(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre whose level grows with the torque that is passed on."""
    torque = np.abs(stage.quiet.given[joint])
    if torque.std() < 0.4 * torque.mean():
        raise RefusedError("its load hardly changes")
    per_load = float(rng.uniform(0.1, 0.25))
    force = share(rng, 0.0, 0.5) * per_load * float(torque.mean())
    numbers = {"coulomb": force, "static": force, "per_load": per_load, "speed": 0.05 * float(stage.fast[joint]),
               "bristle": per_load * float(torque.mean()) / float(10 ** rng.uniform(-3.7, -3.0))}  # fmt: skip
    return Cause(effect="load_friction", site=stage.name(joint), law="LuGre",
                 parameters={"force": force, "coefficient": per_load},
                 change=lambda machine: rubbing(machine, joint=joint, **numbers))  # fmt: skip


def viscous(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Torque in proportion to speed."""
    coefficient = share(rng) * float(stage.swing[joint] / stage.fast[joint])
    return Cause(effect="viscous_friction", site=stage.name(joint), law="linear",
                 parameters={"coefficient": coefficient},
                 change=lambda machine: rubbing(machine, joint=joint, viscous=coefficient))  # fmt: skip


def quadratic(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Torque in proportion to the square of speed."""
    coefficient = share(rng) * float(stage.swing[joint] / stage.fast[joint] ** 2)
    return Cause(effect="quadratic_damping", site=stage.name(joint), law="square",
                 parameters={"coefficient": coefficient},
                 change=lambda machine: rubbing(machine, joint=joint, square=coefficient))  # fmt: skip


def armature(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A rotor that turns with its joint, many times faster."""
    inertia = share(rng, 0.2, 0.8) * float(stage.swing[joint] / stage.quiet.acceleration[joint].std())

    def change(machine: Machine) -> Machine:
        model = machine.model.copy()
        model.armature = at(model.armature, joint, inertia)
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
    return Cause(
        effect="joint_elasticity",
        site=stage.name(joint),
        law=f"linear, encoder at the {'motor' if logs_motor else 'link'}",
        parameters=numbers,
        change=lambda machine: _two_sided(machine, joint, logs_motor, numbers),
    )


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
    return Cause(
        effect="backlash",
        site=stage.name(joint),
        law="stiff teeth, encoder at the link",
        parameters=numbers,
        change=lambda machine: _two_sided(machine, joint, False, numbers),
    )


def joint_spring(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A cable, a hose, a counterbalance."""
    q = stage.quiet.link[joint]
    stiffness = share(rng, 0.2, 0.7) * float(stage.swing[joint] / q.std())
    rest = float(q.mean() + rng.uniform(-1.5, 1.5) * q.std())
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return loaded("joint_spring", stage.name(joint), "linear", {"stiffness": stiffness, "rest": rest},
                   lambda _model, _data, _t, q, _v: -stiffness * (q - rest) * only)  # fmt: skip


def one_sided_stop(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A bumper inside the joint's way."""
    q, side = stage.quiet.link[joint], float(rng.choice([-1.0, 1.0]))
    clearance = float(np.quantile(side * q, rng.uniform(0.7, 0.88)))
    deep = float(np.max(side * q)) - clearance
    power = float(rng.choice([1.0, 1.5]))
    stiffness = float(rng.uniform(1.0, 3.0) * stage.swing[joint]) / deep**power
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return loaded("one_sided_stop", stage.name(joint), f"power {power}",
                   {"stiffness": stiffness, "clearance": side * clearance, "power": power},
                   lambda _model, _data, _t, q, _v:
                   -side * stiffness * max(side * q[joint] - clearance, 0.0) ** power * only)  # fmt: skip


def ripple(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Cogging: torque that is periodic in the angle."""
    q = stage.quiet.link[joint]
    wave = 2.0 * np.pi * float(rng.uniform(1.0, 3.0)) / float(stage.fast[joint])
    if wave * np.ptp(q) < 6.0 * np.pi:
        raise RefusedError("its angle hardly passes a wave")
    amplitude, phase = share(rng, 0.3, 0.8) * float(stage.swing[joint]), float(rng.uniform(0.0, 2.0 * np.pi))
    only = np.eye(len(stage.scene.robot.joints))[joint]
    return loaded("ripple", stage.name(joint), "sine",
                   {"amplitude": amplitude, "period": 2.0 * np.pi / wave, "phase": phase},
                   lambda _model, _data, _t, q, _v: amplitude * np.sin(wave * q[joint] + phase) * only)  # fmt: skip


def encoder_offset(rng: Rng, stage: Stage, joint: int) -> Cause:
    """An encoder whose zero is elsewhere."""
    offset = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.15))
    return Cause(effect="encoder_offset", site=stage.name(joint), law="constant", parameters={"offset": offset},
                 change=lambda machine: replace(machine, offset=at(machine.offset, joint, offset)))  # fmt: skip
