"""What a machine has and its description lacks: words, sites, numbers, and what they change of the machine."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from chladni_withheld.case import PARAMETER, Matrix
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Machine, Motion
from chladni_withheld.robots.scene import Scene, with_servo

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
    """

    effect: str
    site: str
    change: Callable[[Machine], Machine]
    law: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    also: tuple[tuple[str, str], ...] = ()


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
        found: Matrix = np.sqrt(np.mean(self.quiet.speed**2, axis=1))
        return found

    def pick(self, rng: Rng) -> int:
        """A joint."""
        return int(rng.integers(len(self.scene.robot.joints)))


def _at(values: Matrix, joint: int, value: float) -> Matrix:
    new = np.array(values, dtype=float)
    new[joint] = value
    return new


def coulomb(rng: Rng, stage: Stage, joint: int) -> Cause:
    """LuGre whose static force is that of sliding, within a tenth."""
    force = float(rng.uniform(0.15, 0.6) * stage.swing[joint])
    numbers = {
        "coulomb": force, "static": force * float(rng.uniform(1.0, 1.08)), "bristle": force / 10 ** rng.uniform(-3.7, -3.0),
        "speed": float(0.05 * stage.fast[joint]),
    }  # fmt: skip
    return Cause(effect="coulomb_friction", site=stage.scene.robot.joints[joint], law="LuGre",
                 parameters={"force": force, **numbers}, change=lambda machine: rubbing(machine, joint, **numbers))  # fmt: skip


def rubbing(machine: Machine, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers of one joint's friction."""
    law = machine.friction
    changed = {name: _at(getattr(law, name), joint, value) for name, value in numbers.items()}
    return replace(machine, friction=replace(law, **changed))


def viscous(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Torque in proportion to speed."""
    coefficient = float(rng.uniform(0.15, 0.6) * stage.swing[joint] / stage.fast[joint])
    return Cause(effect="viscous_friction", site=stage.scene.robot.joints[joint], law="linear",
                 parameters={"coefficient": coefficient},
                 change=lambda machine: rubbing(machine, joint, viscous=coefficient))  # fmt: skip


def common_delay(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """All commands arrive late."""
    delay_s = float(rng.uniform(0.003, 0.02))
    return Cause(effect="delay", site=ALL_COMMANDS, law="dead time", parameters={"delay": delay_s},
                 change=lambda machine: with_servo(machine, delay_s=machine.servo.delay_s + delay_s))  # fmt: skip


def gain(rng: Rng, stage: Stage, joint: int) -> Cause:
    """A torque constant that isn't what it's believed to be."""
    value = float(rng.choice([rng.uniform(0.6, 0.9), rng.uniform(1.1, 1.4)]))
    name = stage.scene.robot.joints[joint]
    return Cause(effect="gain_error", site=name, law="constant", parameters={"gain": value},
                 also=(("controller_gain", name),) if stage.scene.recorder.effort == "none" else (),
                 change=lambda machine: with_servo(machine, gain=_at(machine.servo.gain, joint, value)))  # fmt: skip


def payload(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A mass that nobody told of, at the last link (of a leg)."""
    ends = stage_ends(stage)
    joint = int(rng.choice(ends))
    link, model = stage.scene.robot.links[joint], stage.scene.robot.model
    carried = sum(model.inertias[index].mass for index in model.subtrees[joint + 1])
    mass = float(np.clip(carried * rng.uniform(0.15, 0.8), 0.02, 2.5))
    centre = rng.uniform(-1.0, 1.0, 3) * np.array([0.05, 0.05, 0.08])
    body = pin.Inertia(mass, centre, mass * 0.03**2 * np.eye(3))

    def change(machine: Machine) -> Machine:
        heavier = machine.model.copy()
        heavier.inertias[joint + 1] = heavier.inertias[joint + 1] + body
        return replace(machine, model=heavier)

    numbers = {"mass": mass, **dict(zip(("x", "y", "z"), centre.tolist(), strict=True))}
    return Cause(effect="payload", site=link, law="rigid", parameters=numbers, change=change,
                 also=((PARAMETER, f"{link}.mass"),))  # fmt: skip


def stage_ends(stage: Stage) -> list[int]:
    """Joints whose links carry no other."""
    model = stage.scene.robot.model
    return [index - 1 for index in range(1, model.njoints) if len(model.subtrees[index]) == 1]


Draw = Callable[[Rng, Stage, int], Cause]
CAUSES: Mapping[str, Draw] = {
    "coulomb_friction": coulomb,
    "viscous_friction": viscous,
    "delay": common_delay,
    "gain_error": gain,
    "payload": payload,
}
