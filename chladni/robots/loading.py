"""Loading of robots: MJCF, URDF, or a robot file that names one of them."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from chladni.io.regular_file import open_regular
from chladni.robots.description import description_kind
from chladni.robots.mjcf import read_mjcf
from chladni.robots.mujoco_model import Compiled, compile_robot
from chladni.robots.robot import LogNames, Robot, RobotTolerance, Servo
from chladni.robots.urdf import read_urdf
from chladni.signals.errors import ModelError

if TYPE_CHECKING:
    from collections.abc import Callable

    from chladni.robots.description import Description
    from chladni.robots.robot import BaseKind, RobotJoint
    from chladni.robots.robot_file import RobotFile

Made = TypeVar("Made")

_HEAD_BYTES: Final = 1 << 16
_FORMAT: Final = re.compile(r"^\s*format\s*=\s*[\"']chladni\.robot/", re.MULTILINE)


def load_robot(path: Path | str, *, meshes: bool = True) -> Robot:
    """Load a robot.

    Parameters
    ----------
    path
        An MJCF or a URDF file, told by its root element; or a robot file (TOML, format ``chladni.robot/1``) that
        names one. Meshes may be missing.
    meshes
        Whether meshes that are there are loaded, to draw the robot. MuJoCo takes seconds for those of a humanoid;
        they are loaded all the same where masses come from them.

    Returns
    -------
    Robot
        Its joints, what drives them as far as the files say, and MuJoCo's model. ``remarks`` say what was left out.

    Raises
    ------
    ModelError
        When MuJoCo isn't installed; when a file is wrong, one line for each mistake; when joints form a loop or a
        ball, which can't be diagnosed.

    Examples
    --------
    >>> import tempfile
    >>> text = '''<mujoco model="arm"><worldbody><body name="upper"><joint name="shoulder" axis="0 1 0"/>
    ... <inertial pos="0 0 0.2" mass="2" diaginertia="0.02 0.02 0.002"/></body></worldbody>
    ... <actuator><position joint="shoulder" kp="80" kv="4"/></actuator></mujoco>'''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "arm.xml"
    ...     _ = path.write_text(text)
    ...     robot = load_robot(path)
    >>> robot.joints[0].name, robot.joints[0].servo.kp, robot.joints[0].servo.kd
    ('shoulder', 80.0, 4.0)
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        compiled = _described(path, None, meshes=meshes)
        return _robot(path, compiled, compiled.delay_s)
    # Pydantic takes its time, and a description alone needs none.
    from chladni.robots.robot_file import read_robot_file

    file, description = read_robot_file(path, partial(_described, meshes=meshes))
    robot = replace(
        _robot(description, file.compiled, file.delay_s), robot_file=path, log=file.log, tolerance=file.tolerance
    )
    return replace(robot, joints=tuple(_with_control(one, file) for one in robot.joints))


def is_robot_file(path: Path) -> bool:
    """Whether a file describes a robot, by its content: the root element of MJCF or URDF, or a robot file's format.

    Raises
    ------
    ModelError
        When there is no such file, or it can't be read.
    """
    if path.suffix.lower() != ".toml":
        return description_kind(path) is not None
    with open_regular(path, ModelError) as file:
        return _FORMAT.search(file.read(_HEAD_BYTES).decode("utf-8-sig", errors="replace")) is not None


def made_of(path: Path, base: BaseKind | None, make: Callable[[Description], Made], *, meshes: bool) -> Made:
    """Give what is made of a description; without meshes that are there, when MuJoCo refuses them or nobody asks.

    Parameters
    ----------
    path
        MJCF or URDF.
    base
        What the robot file says; None leaves it as it is.
    make
        Raises `ModelError` where MuJoCo refuses the description.
    """
    kind = description_kind(path)
    if kind is None:
        raise ModelError(f"{path}: is neither MJCF (<mujoco>) nor URDF (<robot>); name a file that is one of them")
    read = read_mjcf if kind == "mjcf" else read_urdf
    bare = read(path, meshes=False, base=base)
    if not meshes and not bare.weightless:
        return make(replace(bare, shapeless=""))
    found = read(path, meshes=True, base=base)
    try:
        return make(found)
    except ModelError:
        if not found.meshes:
            raise
        return make(bare)


def _described(path: Path, base: BaseKind | None, *, meshes: bool) -> Compiled:
    def compiled(found: Description) -> Compiled:
        made = compile_robot(found.xml, file=str(path), velocity_limits=found.velocity_limits)
        return replace(made, remarks=(*filter(None, [found.shapeless]), *found.remarks, *made.remarks))

    return made_of(path, base, compiled, meshes=meshes)


def _robot(path: Path, compiled: Compiled, delay_s: float) -> Robot:
    return Robot(
        name=compiled.name or path.stem,
        joints=compiled.joints,
        links=compiled.links,
        sites=compiled.sites,
        model=compiled.model,
        description=path,
        robot_file=None,
        base=compiled.base,
        delay_s=delay_s,
        tolerance=RobotTolerance(),
        log=LogNames(),
        remarks=compiled.remarks,
    )


def _with_control(joint: RobotJoint, file: RobotFile) -> RobotJoint:
    """Let the robot file say what it knows of a joint's servo."""
    kp, kd, limit = (file.control(name, joint.name) for name in ("kp", "kd", "limit"))
    kind = file.log.command_kind
    if joint.follows is not None or (joint.servo is None and (kp, kd, limit, kind) == (None, None, None, None)):
        return joint
    servo = joint.servo or Servo(kind="position", kp=None, kd=None, limit=joint.effort_limit, actuator=None)
    return replace(
        joint,
        servo=replace(
            servo,
            kind=kind or ("position" if kp is not None else servo.kind),
            kp=servo.kp if kp is None else kp,
            kd=servo.kd if kd is None else kd,
            limit=servo.limit if limit is None else limit,
        ),
    )
