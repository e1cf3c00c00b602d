"""Descriptions of robots as their users have them: URDF from example-robot-data, fixed to the ground."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
import pinocchio as pin

from chladni.signals.errors import SetupError
from chladni_withheld.case import Matrix

_MOVING = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where a description comes from.

    Attributes
    ----------
    file
        End of its path in example-robot-data.
    moving
        Starts of the names of the joints that move; all others are held at zero.
    tool
        Whether a tool may be put at the last link: bare wrists weigh nothing without their rotors.
    """

    file: str
    moving: tuple[str, ...] = ("",)
    tool: bool = True


SOURCES: Mapping[str, Source] = {
    "ur3": Source(file="ur_description/urdf/ur3_robot.urdf"),
    "ur5": Source(file="ur_description/urdf/ur5_robot.urdf"),
    "ur10": Source(file="ur_description/urdf/ur10_robot.urdf"),
    "panda": Source(file="panda_description/urdf/panda.urdf", moving=("panda_joint",)),
    "xarm7": Source(file="xarm_description/urdf/xarm7.urdf", moving=("joint",)),
    "kinova": Source(file="kinova_description/robots/kinova.urdf", moving=("j2s6s200_joint_",)),
    "tiago": Source(file="tiago_description/robots/tiago_no_hand.urdf", moving=("arm_",)),
    "z1": Source(file="z1_description/urdf/z1.urdf"),
    "talos_arm": Source(file="talos_data/robots/talos_left_arm.urdf", moving=("arm_left_",)),
    "solo12": Source(file="solo_description/robots/solo12.urdf", tool=False),
    "anymal": Source(file="anymal_c_simple_description/urdf/anymal.urdf", tool=False),
    "go2": Source(file="go2_description/urdf/go2.urdf", tool=False),
    "a1": Source(file="a1_description/urdf/a1.urdf", tool=False),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """A rigid thing at the last link: mass, kg, its centre in the link's frame, m, and its radius of gyration, m."""

    mass: float
    centre: tuple[float, float, float]
    radius: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """A robot as its user believes it to be.

    Attributes
    ----------
    name
        One of `SOURCES`.
    urdf
        Text of the file.
    model
        As Pinocchio reads it.
    joints, links
        Moving joints in Pinocchio's order, and the link that each moves.
    low, high
        Ends of each joint's range, rad or m; of endless ones a turn and more.
    effort, speed
        What each joint is built for, N m and rad/s.
    """

    name: str
    urdf: str
    model: pin.Model
    joints: tuple[str, ...]
    links: tuple[str, ...]
    low: Matrix
    high: Matrix
    effort: Matrix
    speed: Matrix


@cache
def _text(file: str) -> str:
    try:
        found = [path for path in files("example-robot-data") or () if str(path).endswith(file)]
    except PackageNotFoundError as error:
        raise SetupError("robots need Pinocchio and descriptions; pip install pin example-robot-data") from error
    if not found:
        raise SetupError(f"example-robot-data has no {file}; install another version of it")
    return Path(str(found[0].locate())).read_text(encoding="utf-8")


def describe(name: str, *, tool: Tool | None = None, meshes: bool = False) -> Description:
    """Give a description by its name, with a tool at its last link.

    Parameters
    ----------
    meshes
        Whether visuals and collisions stay in the file, though their meshes aren't there.
    """
    source = SOURCES[name]
    root = ET.fromstring(_text(source.file))  # noqa: S314 - of a package that was asked for, not of a user
    _strip(root, meshes=meshes)
    moving = [joint for joint in root.iter("joint") if _moves(joint, source)]
    for joint in root.iter("joint"):
        if joint not in moving:
            _hold(joint)
        elif joint.get("type") == "continuous":
            _bound(joint)
    if tool is not None:
        _mount(root, moving[-1], tool)
    return _read(name, ET.tostring(root, encoding="unicode"), moving)


def _strip(root: ET.Element, *, meshes: bool) -> None:
    kept = {"link", "joint", *(("material",) if meshes else ())}
    for child in list(root):
        if child.tag not in kept:
            root.remove(child)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            if not meshes:
                link.remove(shape)
    for joint in root.iter("joint"):
        # Rubbing is what is asked for: no description says any.
        for part in [*joint.findall("dynamics"), *joint.findall("safety_controller"), *joint.findall("calibration")]:
            joint.remove(part)


def _moves(joint: ET.Element, source: Source) -> bool:
    fits = any(joint.get("name", "").startswith(start) for start in source.moving)
    return fits and joint.get("type") in _MOVING and joint.find("mimic") is None


def _hold(joint: ET.Element) -> None:
    joint.set("type", "fixed")
    for part in list(joint):
        if part.tag in ("axis", "limit", "mimic"):
            joint.remove(part)


def _bound(joint: ET.Element) -> None:
    """Give an endless joint ends: its angle is one number, as in the log."""
    joint.set("type", "revolute")
    limit = joint.find("limit")
    limit = ET.SubElement(joint, "limit", effort="50", velocity="2") if limit is None else limit
    limit.attrib.update({"lower": "-3", "upper": "3"})


def child(joint: ET.Element) -> str:
    """Link that a joint moves."""
    found = joint.find("child")
    return "" if found is None else found.get("link", "")


def _mount(root: ET.Element, last: ET.Element, tool: Tool) -> None:
    link = ET.SubElement(root, "link", name="tool")
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=" ".join(f"{x:.4f}" for x in tool.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{tool.mass:.4f}")
    around = f"{tool.mass * tool.radius**2:.6f}"
    ET.SubElement(inertial, "inertia", ixx=around, iyy=around, izz=around, ixy="0", ixz="0", iyz="0")
    fix(root, child(last), "tool", xyz=np.zeros(3), rpy=np.zeros(3))


def fix(root: ET.Element, parent: str, link: str, *, xyz: Matrix, rpy: Matrix) -> None:
    """Fix a link to another one; it's made where it's not there."""
    if root.find(f"link[@name='{link}']") is None:
        ET.SubElement(root, "link", name=link)
    joint = ET.SubElement(root, "joint", name=f"{link}_mount", type="fixed")
    place, turn = (" ".join(f"{one:.9g}" for one in values) for values in (xyz, rpy))
    ET.SubElement(joint, "origin", xyz=place, rpy=turn)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=link)


def _read(name: str, urdf: str, moving: list[ET.Element]) -> Description:
    model = pin.buildModelFromXML(urdf)
    links = {joint.get("name", ""): child(joint) for joint in moving}
    limits = {joint.get("name", ""): joint.find("limit") for joint in moving}
    joints = tuple(model.names[1:])

    def limit(key: str, usual: float) -> Matrix:
        given = [limits[joint] for joint in joints]
        found = [usual if one is None else float(one.get(key, usual)) for one in given]
        return np.array([one or usual for one in found])

    return Description(
        name=name, urdf=urdf, model=model, joints=joints, links=tuple(links[joint] for joint in joints),
        low=np.maximum(limit("lower", -3.0), -3.0), high=np.minimum(limit("upper", 3.0), 3.0),
        effort=limit("effort", 50.0), speed=limit("velocity", 3.0),
    )  # fmt: skip
