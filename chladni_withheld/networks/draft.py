"""A draft of a hidden effect: its word, its place, and what it adds to a machine at any size."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass

import numpy as np

from chladni_withheld.networks.machine import Addition, Element
from chladni_withheld.networks.network import GROUND, Matrix, Spectrum
from chladni_withheld.networks.scene import Scene

Rng = np.random.Generator
Filter = Callable[[Matrix], Spectrum]


@dataclass(frozen=True, slots=True)
class Made:
    """What a draft adds, what is told of it, and, where it's linear in a signal, its frequency response."""

    addition: Addition
    parameters: Mapping[str, float]
    response: Filter | None = None


@dataclass(frozen=True, slots=True)
class Draft:
    """An effect whose size isn't settled.

    Attributes
    ----------
    word, law, site, source
        See `chladni_withheld.case.HiddenEffect`.
    build
        What is added, by size; a size is relative to what the machine does, so that 0.1 is plausible for many.
    sizes
        Where to begin, and the smallest and largest at which the effect is what its word says.
    fixed
        Whether there is nothing to choose: all sizes do the same.
    acting
        Least and largest share of time in which it acts and is what its word says: friction must slide and stick.
    direction
        Along which it acts as a force; None for what becomes of a signal.
    is_number
        Whether a number beyond its tolerance does the same, as a mass does that is added.
    """

    word: str
    law: str
    site: str
    build: Callable[[float], Made]
    sizes: tuple[float, float, float]
    _: KW_ONLY
    fixed: bool = False
    acting: tuple[float, float] = (0.0, 1.0)
    direction: Matrix | None = None
    source: str | None = None
    is_number: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class JointPort:
    """A joint, and what it goes through in the bare machine."""

    number: int
    name: str
    first: int
    second: int
    stiffness: float
    way: float
    speed: float
    load: float
    direction: Matrix

    def element(self, code: int, *numbers: float) -> Addition:
        """What acts beside the joint's spring and damper."""
        element = Element(code=code, first=self.first, second=self.second, numbers=numbers, joint=self.number)
        return Addition(elements=(element,))


def pick_joint(rng: Rng, scene: Scene, *, spring: bool = False) -> JointPort:
    """Pick a joint; `spring`: one that has a spring. Its `stiffness` is what it carries by its way if it has none."""
    joints = scene.network.joints
    number = int(rng.choice([row for row, joint in enumerate(joints) if joint.stiffness > 0 or not spring]))
    joint = joints[number]
    way, speed = scene.travel(joint.first, joint.second)
    load = scene.load(number)
    return JointPort(
        number=number, name=joint.name, first=joint.first, second=joint.second,
        stiffness=joint.stiffness or load / way, way=way, speed=speed, load=load,
        direction=scene.network.joint_direction(number),
    )  # fmt: skip


def pick(rng: Rng, things: tuple[int, ...] | range) -> int | None:
    """Pick one; None of none."""
    return int(rng.choice(list(things))) if len(things) else None


def pick_bodies_apart(rng: Rng, scene: Scene) -> tuple[int, int] | None:
    """Pick two bodies that share no joint; None of none."""
    pairs = [(first, second) for first, second in scene.network.apart() if first != GROUND]
    chosen = pick(rng, range(len(pairs)))
    return None if chosen is None else pairs[chosen]
