"""Robot files (``chladni.robot/1``): what a description doesn't hold of a robot, and what its logs call things."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from chladni.io.toml_reader import read_toml
from chladni.models.effects.wording import nearest
from chladni.models.files.model_tables import Number, Text
from chladni.models.files.quantity import number
from chladni.models.files.toml_text import toml_text
from chladni.robots.robot import DEFAULT_JOINT, BaseKind, CommandKind, EffortKind, ImuNames, LogNames, RobotTolerance
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from chladni.io.toml_reader import TomlMistakes
    from chladni.models.files.toml_text import Entry
    from chladni.robots.machine import Machine
    from chladni.robots.mujoco_model import Compiled
    from chladni.robots.robot import RobotJoint

ROBOT_FORMAT: Final = "chladni.robot/1"
_MOST_JOINTS: Final = 1000

# Units at a hinge and at a slide.
_UNITS: Final[Mapping[str, tuple[str, str]]] = {
    "kp": ("N m/rad", "N/m"),
    "kd": ("N m s/rad", "N s/m"),
    "limit": ("N m", "N"),
    "torque_constant": ("N m/A", "N/A"),
    "friction": ("N m", "N"),
}
PerJoint = dict[Text, Number]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class ImuTable(_Table):
    """``imu`` of ``[log]``."""

    topic: Text
    site: Text


class LogTable(_Table):
    """``[log]``."""

    state: Text | None = None
    command: Text | None = None
    command_kind: CommandKind | None = None
    effort: EffortKind | None = None
    torque_constant: PerJoint = Field(default={}, max_length=_MOST_JOINTS)
    names: list[Text] | None = Field(default=None, min_length=1, max_length=_MOST_JOINTS)
    imu: ImuTable | None = None


class ControlTable(_Table):
    """``[control]``."""

    kp: PerJoint = Field(default={}, max_length=_MOST_JOINTS)
    kd: PerJoint = Field(default={}, max_length=_MOST_JOINTS)
    limit: PerJoint = Field(default={}, max_length=_MOST_JOINTS)
    delay: Number = 0.0


class ToleranceTable(_Table):
    """``[tolerance]``."""

    inertia: Number = 0.03
    gains: Number = 0.0
    friction: Number = 0.0


class RobotTable(_Table):
    """A robot file."""

    format: Literal["chladni.robot/1"]
    description: Text
    base: BaseKind | None = None
    log: LogTable = LogTable()
    control: ControlTable = ControlTable()
    tolerance: ToleranceTable = ToleranceTable()


class RobotFile:
    """A robot file that was read, with the description that it names."""

    def __init__(self, table: RobotTable, compiled: Compiled) -> None:
        self._table, self.compiled = table, compiled

    @property
    def log(self) -> LogNames:
        """What logs call things."""
        log = self._table.log
        return LogNames(
            state=log.state,
            command=log.command,
            command_kind=log.command_kind,
            effort=log.effort,
            torque_constant=self._numbers("torque_constant", log.torque_constant),
            names=None if log.names is None else tuple(log.names),
            imu=None if log.imu is None else ImuNames(topic=log.imu.topic, site=log.imu.site),
        )

    @property
    def tolerance(self) -> RobotTolerance:
        """Of the description."""
        found = self._table.tolerance
        return RobotTolerance(
            inertia=number(found.inertia, "1"),
            gains=number(found.gains, "1"),
            friction=_number("friction", found.friction, None),
        )

    @property
    def delay_s(self) -> float:
        """Of all commands: the file's, else the description's."""
        given = "delay" in self._table.control.model_fields_set
        return number(self._table.control.delay, "s") if given else self.compiled.delay_s

    def control(self, name: Literal["kp", "kd", "limit"], joint: str) -> float | None:
        """Give a number of ``[control]`` for a joint; None where the file has none."""
        found = self._numbers(name, getattr(self._table.control, name))
        return found.get(joint, found.get(DEFAULT_JOINT))

    def _numbers(self, name: str, table: PerJoint) -> dict[str, float]:
        joints = {one.name: one for one in self.compiled.joints}
        return {joint: _number(name, value, joints.get(joint)) for joint, value in table.items()}


def read_robot_file(path: Path, compiled: Callable[[Path, BaseKind | None], Compiled]) -> tuple[RobotFile, Path]:
    """Read a robot file; give it and its description.

    Parameters
    ----------
    path
        TOML.
    compiled
        Loads a description with the base that the file asks for.

    Raises
    ------
    ModelError
        With a line for each mistake, and those of the description.
    """
    known: list[Compiled] = []

    def check(content: dict[str, Any], mistakes: TomlMistakes) -> None:
        named, base = content.get("description"), content.get("base")
        if isinstance(named, str) and named.isprintable():
            try:
                known.append(compiled(path.parent / named, base if base in ("fixed", "floating") else None))
            except ModelError as error:
                mistakes.add(("description",), "; ".join(error.mistakes))
        _check(content, known[0] if known else None, mistakes)

    table, _ = read_toml(path, RobotTable, kind=ModelError, check=check)
    return RobotFile(table, known[0]), path.parent / table.description


def _check(content: dict[str, Any], robot: Compiled | None, mistakes: TomlMistakes) -> None:
    """Find names that the description doesn't have, and numbers of the wrong unit or sign."""
    log, control, tolerance = (_table(content, one) for one in ("log", "control", "tolerance"))
    for name in ("kp", "kd", "limit"):
        _check_joints(("control", name), _table(control, name), robot, mistakes)
    _check_joints(("log", "torque_constant"), _table(log, "torque_constant"), robot, mistakes)
    names = log.get("names")
    listed = [one for one in names if isinstance(one, str)] if isinstance(names, list) else []
    for place, one in enumerate(listed):
        if robot is not None and one not in (known := [joint.name for joint in robot.joints]):
            mistakes.add(("log", "names", place), f"no joint {shown(one)}; {nearest(one, known, 'joints')}")
        elif one in listed[:place]:
            mistakes.add(("log", "names", place), f"{shown(one)} stands there twice; each joint has one command")
    site = _table(log, "imu").get("site")
    if robot is not None and isinstance(site, str) and site not in (places := [*robot.sites, *robot.links]):
        mistakes.add(("log", "imu", "site"), f"no site or link {shown(site)}; {nearest(site, places, 'places')}")
    _check_number(("control", "delay"), control.get("delay"), lambda value: number(value, "s"), mistakes)
    for name in ("inertia", "gains"):
        _check_number(("tolerance", name), tolerance.get(name), lambda value: number(value, "1"), mistakes)
    _check_number(
        ("tolerance", "friction"), tolerance.get("friction"), lambda value: _number("friction", value, None), mistakes
    )


def _check_joints(
    loc: tuple[str, ...], table: dict[str, Any], robot: Compiled | None, mistakes: TomlMistakes
) -> None:
    joints = {} if robot is None else {one.name: one for one in robot.joints}
    for name, value in table.items():
        if joints and name != DEFAULT_JOINT and name not in joints:
            mistakes.add((*loc, name), f"no joint {shown(name)}; {nearest(name, [DEFAULT_JOINT, *joints], 'joints')}")
            continue

        def read(value: float | str, name: str = name) -> float:
            return _number(loc[-1], value, joints.get(name))

        _check_number((*loc, name), value, read, mistakes)


def _check_number(
    loc: tuple[str, ...], value: object, read: Callable[[float | str], float], mistakes: TomlMistakes
) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return
    try:
        found = read(value)
    except ModelError as error:
        # What is no finite number, the tables tell.
        if isinstance(value, str):
            mistakes.add(loc, str(error))
        return
    if found < 0:
        mistakes.add(loc, f"found {shown(value)}; must not be negative")


def _number(name: str, value: float | str, joint: RobotJoint | None) -> float:
    """Read a number at a joint; in the unit of either kind where none is named."""
    at_hinge, at_slide = _UNITS[name]
    if joint is not None:
        return number(value, at_hinge if joint.kind == "hinge" else at_slide)
    try:
        return number(value, at_hinge)
    except ModelError:
        return number(value, at_slide)


def _table(content: dict[str, Any], name: str) -> dict[str, Any]:
    found = content.get(name)
    return found if isinstance(found, dict) else {}


def robot_file_text(machine: Machine, description: str) -> str:
    """Write a robot file that names a description, with what it can hold of a machine.

    Parameters
    ----------
    machine
        Its gains, its limits and the least of its delays are written; what logs call things, and tolerances, as the
        robot has them.
    description
        Name of the file, beside it.
    """
    robot = machine.robot
    driven = [one for one in machine.joints if one.servo is not None]
    control: dict[str, Entry] = {}
    for place, name in enumerate(("kp", "kd", "limit")):
        numbers = {one.joint.name: one.gains()[place] for one in driven if getattr(one.servo, name) is not None}
        if numbers:
            control[name] = numbers
    control["delay"] = f"{1e3 * min((one.delay_s for one in driven), default=robot.delay_s):.9g} ms"
    tolerance = robot.tolerance
    return toml_text(
        {
            "format": ROBOT_FORMAT,
            "description": description,
            "base": robot.base,
            "log": _log_entries(robot.log),
            "control": control,
            "tolerance": {
                "inertia": tolerance.inertia, "gains": tolerance.gains, "friction": f"{tolerance.friction:.9g} N m"
            },
        }
    )  # fmt: skip


def _log_entries(log: LogNames) -> dict[str, Entry]:
    found: dict[str, Entry] = {}
    for name in ("state", "command", "command_kind", "effort"):
        if getattr(log, name) is not None:
            found[name] = getattr(log, name)
    if log.torque_constant:
        found["torque_constant"] = dict(log.torque_constant)
    if log.names is not None:
        found["names"] = list(log.names)
    if log.imu is not None:
        found["imu"] = {"topic": log.imu.topic, "site": log.imu.site}
    return found
