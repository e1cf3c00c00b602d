"""A cause: what a machine has and its description lacks, and what that changes of the machine."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from chladni_withheld.case import Matrix
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
        return np.asarray(self.quiet.given.std(axis=1))

    @property
    def fast(self) -> Matrix:
        """RMS of each joint's speed."""
        return np.asarray(self.quiet.speed.std(axis=1))

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


def at(values: Matrix, joint: int, value: float) -> Matrix:
    """The values with another one at a joint."""
    new = np.array(values, dtype=float)
    new[joint] = value
    return new


def _part(machine: Machine, part: str, joint: int, numbers: Mapping[str, float]) -> Machine:
    old = getattr(machine, part)
    changed = {key: at(getattr(old, key), joint, value) for key, value in numbers.items()}
    return replace(machine, **{part: replace(old, **changed)})


def rubbing(machine: Machine, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers of one joint's friction."""
    return _part(machine, "friction", joint, numbers)


def served(machine: Machine, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers of one joint's servo."""
    return _part(machine, "servo", joint, numbers)


def driven(machine: Machine, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers of one joint's transmission."""
    return _part(machine, "transmission", joint, numbers)


def share(rng: Rng, least: float = 0.15, most: float = 0.6) -> float:
    """Share of a joint's torque."""
    return float(rng.uniform(least, most))


def loaded(effect: str, site: str, law: str, parameters: Mapping[str, float], load: Load,
            also: tuple[tuple[str, str], ...] = ()) -> Cause:  # fmt: skip
    """A cause that adds torque at the joints."""
    return Cause(effect=effect, site=site, law=law, parameters=parameters, also=also,
                 change=lambda machine: replace(machine, loads=(*machine.loads, load)))  # fmt: skip
