"""Writing of descriptions with what was found: the user's own MJCF or URDF, and what it can't hold beside it."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.atomic import atomic_write
from chladni.io.regular_file import read_text
from chladni.robots.description import MOST_BYTES, description_kind, parsed, parsed_text, text_of
from chladni.robots.loading import load_robot, made_of
from chladni.robots.machine import as_described
from chladni.robots.mjcf import whole_mjcf
from chladni.robots.mujoco_model import mjcf_of
from chladni.robots.robot_file import robot_file_text
from chladni.robots.written_mjcf import MjcfEdit
from chladni.robots.written_urdf import UrdfEdit
from chladni.signals.errors import ModelError

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET
    from collections.abc import Iterator

    from chladni.robots.machine import Machine, MachineJoint
    from chladni.robots.robot import Robot

_COMMENTS: Final = re.compile(r"<!--.*?-->", re.DOTALL)
_FILES: Final = ("meshdir", "texturedir", "assetdir")


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenRobot:
    """What was written.

    Attributes
    ----------
    description, robot_file
        Files; the second is None where nothing asks for one. It names the first.
    not_held
        Sentences on what neither file can hold.
    """

    description: Path
    robot_file: Path | None
    not_held: tuple[str, ...]

    @property
    def robot(self) -> Path:
        """The file to load."""
        return self.robot_file or self.description


def write_robot(machine: Machine, path: Path | str, *, overwrite: bool = True) -> WrittenRobot:
    """Write a robot's description with the numbers of its machine, in the format that it came in.

    Elements, comments and layout stay as they are; only numbers that differ are set. What MJCF includes is put in its
    place. A URDF becomes MJCF, which holds more, when the path ends in ``.xml``. A robot file of the same name is
    written beside it, where the robot had one, or for what only it can hold: servos of a URDF, and delays.

    Parameters
    ----------
    machine
        Made by `chladni.robots.machine.as_described` and changed, or found by a diagnosis.
    path
        Of the description, ``.xml`` or ``.urdf``.
    overwrite
        Whether files that are there are replaced.

    Raises
    ------
    ModelError
        When the description can't be read again, or what was written doesn't load.
    LogError
        When a file can't be written, or is there and mustn't be replaced.
    """
    path, robot = Path(path), machine.robot
    if path.suffix.lower() == ".toml":
        raise ModelError(f"{path}: a description is written, with a robot file beside it; name it .xml or .urdf")
    root, kind, prolog = _read(robot, path)
    converted = kind != description_kind(robot.description)
    edit = MjcfEdit(root, machine, add_drives=converted) if kind == "mjcf" else UrdfEdit(root, machine)
    held = edit.edit()
    if not converted:
        _relocate(root, robot.description.parent, path.parent)
    text = f'<?xml version="1.0" encoding="utf-8"?>\n{prolog}{text_of(root)}\n'
    robot_file = path.with_suffix(".toml") if _asks_for_file(machine, kind, delay_held=held) else None
    with atomic_write(path, overwrite=overwrite) as file:
        file.write(text.encode())
    if robot_file is not None:
        with atomic_write(robot_file, overwrite=overwrite) as file:
            file.write(robot_file_text(machine, path.name).encode())
    written = WrittenRobot(
        description=path,
        robot_file=robot_file,
        not_held=(*edit.not_held, *_held_by_none(machine, delay_held=held)),
    )
    load_robot(written.robot)
    return written


def _read(robot: Robot, path: Path) -> tuple[ET.Element, str, str]:
    """Read the description as it is, or as MJCF; its kind, and comments that stand before it."""
    file = robot.description
    kind = description_kind(file)
    if kind == "urdf" and path.suffix.lower() == ".xml":
        return _converted(robot), "mjcf", ""
    root = whole_mjcf(file, comments=True) if kind == "mjcf" else parsed(file, comments=True)
    text = read_text(file, MOST_BYTES, ModelError)
    start = re.search(rf"<{re.escape(root.tag)}\b", _COMMENTS.sub(lambda one: " " * len(one[0]), text))
    head = text[: start.start()] if start else ""
    return root, kind or "urdf", "".join(f"{one}\n" for one in _COMMENTS.findall(head))


def _converted(robot: Robot) -> ET.Element:
    file, base = robot.description, None if robot.robot_file is None else robot.base
    text = made_of(file, base, lambda found: mjcf_of(found.xml, file=str(file)), meshes=True)
    return parsed_text(text, file, comments=True)


def _relocate(root: ET.Element, old: Path, new: Path) -> None:
    """Let relative names of mesh files and folders lead to where they are."""
    old, new = old.resolve(), new.resolve()
    if old == new:
        return
    if root.tag == "mujoco":
        if root.find("asset/*[@file]") is None:
            return
        compiler = root.find("compiler")
        if compiler is None:
            compiler = root.makeelement("compiler", {})
            root.insert(0, compiler)
        if not any(one.get(name) for one in root.findall("compiler") for name in _FILES):
            compiler.set("assetdir", "")
        for one in root.findall("compiler"):
            for name in _FILES:
                if name in one.attrib:
                    one.set(name, os.path.relpath(old / one.get(name, ""), new))
        return
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "").removeprefix("file://")
        if name and "://" not in name:
            mesh.set("filename", os.path.relpath(old / name, new))


def _asks_for_file(machine: Machine, kind: str, *, delay_held: bool) -> bool:
    driven = any(one.servo is not None for one in machine.joints)
    late = any(one.delay_s > 0 for one in machine.joints)
    return machine.robot.robot_file is not None or (kind == "urdf" and driven) or (late and not delay_held)


def _held_by_none(machine: Machine, *, delay_held: bool) -> Iterator[str]:
    """Say what no description holds."""
    described = {one.joint.name: one for one in as_described(machine.robot).joints}
    for one in machine.joints:
        yield from _not_held(one)
        if one.gain != 1.0 and (one.servo is None or (one.servo.kind == "effort" and one.servo.actuator is None)):
            yield f"{one.joint.name}: {one.gain:.4g} of the asked torque arrives; no actuator says so"
    if any(machine.imu_turned):
        told = ", ".join(f"{angle:.3g}" for angle in machine.imu_turned)
        yield f"the IMU is turned by {told} rad about its own axes"
    delays = {one.delay_s for one in machine.joints if one.servo is not None or described[one.joint.name].servo}
    if len(delays) > 1 and not delay_held:
        told = ", ".join(f"{one.joint.name} {1e3 * one.delay_s:.3g} ms" for one in machine.joints if one.delay_s > 0)
        yield f"commands arrive late by different times ({told}): a robot file has one delay, the least of them"


def _not_held(one: MachineJoint) -> Iterator[str]:
    hinge = one.joint.kind == "hinge"
    name, force, angle, rotor = one.joint.name, *(("N m", "rad", "kg m^2") if hinge else ("N", "m", "kg"))
    if one.load:
        yield f"{name}: friction of {one.load:.4g} of the load; {one.friction:.4g} {force} are held"
    if one.rise:
        yield f"{name}: Stribeck friction, {one.rise:.4g} {force} more when slower than {one.fading:.3g} {angle}/s"
    if one.uneven is not None:
        at = ", ".join(f"{one.friction + each:.4g} {force} at {place:.4g} {angle}" for place, each in
                       zip(one.uneven.places, one.uneven.beyond, strict=True))  # fmt: skip
        yield f"{name}: friction that changes along its way, {at}; {one.friction:.4g} {force} are held"
    if one.loop is not None and one.loop.force:
        yield f"{name}: friction of {one.loop.force:.4g} {force} that builds up over {one.loop.yields:.3g} {angle}"
    if one.ripple is not None:
        size = float(np.hypot(one.ripple.sine, one.ripple.cosine))
        yield f"{name}: ripple of {size:.4g} {force} with a period of {one.ripple.period:.4g} {angle}"
    for stop in one.stops:
        yield (
            f"{name}: a stop of {stop.stiffness:.4g} {force}/{angle} {'above' if stop.side > 0 else 'below'} "
            f"{stop.side * stop.clearance:.4g} {angle}"
        )
    if one.transmission is not None:
        between = one.transmission
        way = (
            f"play of {between.gap:.3g} {angle}"
            if between.gap
            else f"a spring of {between.stiffness:.4g} {force}/{angle}"
        )
        yield f"{name}: {way} between motor and link, and a rotor of {between.inertia:.3g} {rotor} before it"
    if one.dead:
        yield f"{name}: its drive gives nothing below {one.dead:.4g} {force}"
    if np.isfinite(one.rate):
        yield f"{name}: its reference goes no faster than {one.rate:.4g} {angle}/s"
    if one.lag_s:
        yield f"{name}: its torque lags by {1e3 * one.lag_s:.3g} ms"
    if one.reading or one.drive_reading:
        yield f"{name}: its encoder reads {one.reading + one.drive_reading:.4g} {angle} more than its position"
