"""Numbers of a machine set in a URDF."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chladni.robots.machine import about_centre, as_described
from chladni.robots.mujoco_motion import gravity_of
from chladni.signals.engineering import engineering

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

    from chladni.robots.machine import Machine, MachineJoint
    from chladni.signals.arrays import Real


class UrdfEdit:
    """Edits a URDF in place.

    Attributes
    ----------
    not_held
        Sentences on what URDF can't hold.
    """

    def __init__(self, root: ET.Element, machine: Machine) -> None:
        self._root, self._machine = root, machine
        self._described = as_described(machine.robot)
        self.not_held: list[str] = []

    def edit(self) -> bool:
        """Set what differs; give whether delays are held, which no URDF does."""
        joints = {one.get("name", ""): one for one in self._root.findall("joint")}
        for one, old in zip(self._machine.joints, self._described.joints, strict=True):
            self._edit_joint(joints[one.joint.name], one, old)
        links = {one.get("name", ""): one for one in self._root.findall("link")}
        rows = zip(self._machine.robot.links, self._machine.inertial, self._described.inertial, strict=True)
        for name, numbers, described in rows:
            if name in links and differs(numbers, described) and numbers[0] > 0:
                _edit_link(links[name], numbers)
        if any(self._machine.tilt):
            # MuJoCo reads options of its own from a URDF.
            option = _child(_child(self._root, "mujoco"), "option")
            option.set("gravity", written(gravity_of(self._machine.robot.model, self._machine.tilt)))
        for each in self._machine.couplings:
            shared = (
                ("a spring of", each.stiffness, "N m/rad"),
                ("Coulomb friction of", each.friction, "N m"),
                ("viscous friction of", each.damping, "N m s/rad"),
            )
            told = " and ".join(f"{what} {engineering(one, None, unit)}" for what, one, unit in shared if one)
            self.not_held.append(
                f"{each.joints[0]} and {each.joints[1]} share {told}; URDF has no such thing, MJCF has tendons"
            )
        return False

    def _edit_joint(self, element: ET.Element, one: MachineJoint, old: MachineJoint) -> None:
        for name, number, described in (
            ("damping", one.damping, old.damping),
            ("friction", one.friction, old.friction),
        ):
            if number != described:
                _child(element, "dynamics").set(name, written(number))
        name, unit = one.joint.name, "kg m^2" if one.joint.kind == "hinge" else "kg"
        if one.armature != old.armature:
            self.not_held.append(f"{name}: armature {one.armature:.4g} {unit}; URDF has none, MJCF has armature")
        if one.quadratic:
            self.not_held.append(f"{name}: damping by the square of the speed, {one.quadratic:.4g}; URDF has none")
        if one.stiffness or one.torque:
            self.not_held.append(f"{name}: a spring of {one.stiffness:.4g}, {one.torque:.4g} at zero; URDF has none")


def written(numbers: float | Real) -> str:
    """Give numbers as XML has them, with all that a log can tell and more."""
    return " ".join(f"{float(one):.12g}" for one in np.atleast_1d(numbers))


def differs(numbers: Real, described: Real) -> bool:
    """Whether a link's numbers were changed."""
    return not np.allclose(numbers, described, rtol=1e-12, atol=0.0)


def _edit_link(link: ET.Element, numbers: Real) -> None:
    mass, centre, inertia = about_centre(numbers)
    inertial = _child(link, "inertial")
    _child(inertial, "origin").attrib |= {"xyz": written(centre), "rpy": "0 0 0"}
    _child(inertial, "mass").set("value", written(mass))
    for name, (row, column) in _MOMENTS.items():
        _child(inertial, "inertia").set(name, written(inertia[row, column]))


_MOMENTS = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}


def _child(parent: ET.Element, tag: str) -> ET.Element:
    found = parent.find(tag)
    if found is None:
        found = parent.makeelement(tag, {})
        parent.append(found)
    return found
