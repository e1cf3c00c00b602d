"""A network of bodies: one degree of freedom each, joined as trees, loops and several grounded feet."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Spectrum = NDArray[np.complexfloating[Any, Any]]
GROUND = -1
"""Index of the ground where a body's would stand."""
Where = Literal["body", "joint", "ground"]
Measures = Literal["acceleration", "velocity", "displacement", "force"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """A spring and a damper in parallel from body `first` to body `second`."""

    name: str
    first: int
    second: int
    stiffness: float
    damping: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """An input: a force at body `at`, an actuator across joint `at`, or the acceleration of the ground."""

    name: str
    where: Where
    at: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """An output at body `at`, or across joint `at`, its second end minus its first."""

    name: str
    measures: Measures
    where: Where
    at: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """Bodies, joints, inputs and outputs, with their numbers.

    Attributes
    ----------
    rotary
        Whether bodies turn (inertias, torques, angles) instead of moving along an axis.
    bodies, masses
        Names, and kg or kg m^2.
    """

    rotary: bool
    bodies: tuple[str, ...]
    masses: tuple[float, ...]
    joints: tuple[Joint, ...]
    drives: tuple[Drive, ...]
    sensors: tuple[Sensor, ...]

    @property
    def mass_word(self) -> str:
        """Key of a body's mass in the model file."""
        return "inertia" if self.rotary else "mass"

    def numbers(self) -> dict[str, float]:
        """Numbers that the model file states, by the names of its parameters; a damper or spring of zero is none."""
        numbers = {f"{body}.{self.mass_word}": mass for body, mass in zip(self.bodies, self.masses, strict=True)}
        for joint in self.joints:
            of_joint = {f"{joint.name}.stiffness": joint.stiffness, f"{joint.name}.damping": joint.damping}
            numbers |= {name: value for name, value in of_joint.items() if value}
        return numbers

    def with_numbers(self, numbers: Mapping[str, float]) -> "Network":
        """Give the same network with other numbers, by the names of `numbers`."""
        masses = [
            numbers.get(f"{body}.{self.mass_word}", mass) for body, mass in zip(self.bodies, self.masses, strict=True)
        ]
        joints = [
            replace(
                joint,
                stiffness=numbers.get(f"{joint.name}.stiffness", joint.stiffness),
                damping=numbers.get(f"{joint.name}.damping", joint.damping),
            )
            for joint in self.joints
        ]
        return replace(self, masses=tuple(masses), joints=tuple(joints))

    def direction(self, first: int, second: int) -> Matrix:
        """How the bodies move the `second` end away from the `first`: ``[body]`` of +1, -1, 0."""
        ends = np.zeros(len(self.bodies))
        if second != GROUND:
            ends[second] += 1.0
        if first != GROUND:
            ends[first] -= 1.0
        return ends

    def joint_direction(self, joint: int) -> Matrix:
        """`direction` of a joint's two ends."""
        return self.direction(self.joints[joint].first, self.joints[joint].second)

    def place(self, port: Drive | Sensor) -> Matrix:
        """`direction` of an input or output: of its body against the ground, or of its joint."""
        if port.where == "body":
            return self.direction(GROUND, port.at)
        return self.joint_direction(port.at) if port.where == "joint" else np.zeros(len(self.bodies))

    def matrices(self) -> tuple[Matrix, Matrix, Matrix]:
        """Mass, damping and stiffness matrices ``[body, body]``."""
        damping = np.zeros((len(self.bodies), len(self.bodies)))
        stiffness = damping.copy()
        for number, joint in enumerate(self.joints):
            pattern = np.outer(self.joint_direction(number), self.joint_direction(number))
            damping += joint.damping * pattern
            stiffness += joint.stiffness * pattern
        return np.diag(self.masses), damping, stiffness

    def forces(self) -> Matrix:
        """What a unit of each input does to the bodies, ``[body, input]``, seen from the ground (d'Alembert)."""
        columns = [-np.array(self.masses) if drive.where == "ground" else self.place(drive) for drive in self.drives]
        return np.stack(columns, axis=1)

    def poles(self) -> NDArray[np.complex128]:
        """Poles in the upper half plane, rad/s, slowest first."""
        mass, damping, stiffness = self.matrices()
        inverse = np.linalg.inv(mass)
        bodies = len(self.bodies)
        state = np.block([[np.zeros((bodies, bodies)), np.eye(bodies)], [-inverse @ stiffness, -inverse @ damping]])
        poles = np.linalg.eigvals(state).astype(np.complex128)
        return poles[poles.imag > 0][np.argsort(np.abs(poles[poles.imag > 0]))]

    def modes_hz(self) -> Matrix:
        """Natural frequencies, lowest first."""
        mass, _, stiffness = self.matrices()
        squares = np.linalg.eigvals(np.linalg.inv(mass) @ stiffness).real
        modes: Matrix = np.sqrt(np.sort(squares).clip(min=0)) / (2 * np.pi)
        return modes

    def joined(self) -> set[frozenset[int]]:
        """Pairs of bodies, or a body and the ground, that a joint joins."""
        return {frozenset((joint.first, joint.second)) for joint in self.joints}

    def apart(self) -> list[tuple[int, int]]:
        """Pairs that no joint joins; the ground comes first in its pairs."""
        joined = self.joined()
        places = range(GROUND, len(self.bodies))
        return [(a, b) for a in places for b in places if a < b and frozenset((a, b)) not in joined]

    def pair_name(self, first: int, second: int) -> str:
        """Site of a pair: ``a~b`` or ``ground~b``."""
        return f"{'ground' if first == GROUND else self.bodies[first]}~{self.bodies[second]}"
