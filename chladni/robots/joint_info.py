"""What a log can tell of a robot: what was matched, how well joints are seen and moved, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chladni.robots.joint_log import JointLog, joint_log
from chladni.signals.visible import visible
from chladni.signals.wording import near_words

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chladni.io.log import Log
    from chladni.robots.robot import Robot, RobotJoint
    from chladni.signals.arrays import Real

# A step of the encoder is told from chance by this many levels ...
_FEWEST_LEVELS: Final = 8
# ... of which at most one in twenty lies off the lattice, by a tenth of a step.
_OFF_LATTICE, _MOST_OFF = 0.1, 0.05
#: Steps of the encoder below which the root mean square of a motion says little of forces: its speed, taken from
#: differences, is then mostly that of the steps.
FEWEST_STEPS: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class JointInfo:
    """What a log tells of one joint.

    Attributes
    ----------
    joint
        Of the description.
    matched
        Whether the log has its position.
    motion
        From lowest to highest position, rad or m; None where it isn't matched.
    resolution
        Smallest step of the position; None where it's finer than the samples show.
    still
        Whether it hardly moves against that.
    commanded, effort
        Whether the log has its command, and its effort.
    gains
        What is known of its servo, in words.
    """

    joint: RobotJoint
    matched: bool
    motion: float | None
    resolution: float | None
    still: bool
    commanded: bool
    effort: bool
    gains: str

    @property
    def unit(self) -> str:
        """Of position."""
        return "rad" if self.joint.kind == "hinge" else "m"

    def to_json(self) -> dict[str, Any]:
        """Give plain values."""
        return {
            "name": self.joint.name,
            "link": self.joint.link,
            "unit": self.unit,
            "matched": self.matched,
            "motion": self.motion,
            "resolution": self.resolution,
            "still": self.still,
            "commanded": self.commanded,
            "effort": self.effort,
            "servo": None if self.joint.servo is None else self.joint.servo.kind,
            "kp": None if self.joint.servo is None else self.joint.servo.kp,
            "kd": None if self.joint.servo is None else self.joint.servo.kd,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotLogInfo:
    """What a log tells of a robot.

    Attributes
    ----------
    robot
        The robot.
    log
        Its joints in the log.
    joints
        All of the robot.
    findings
        Sentences: what wasn't matched, how the log was read, what it can and can't tell.
    """

    robot: Robot
    log: JointLog
    joints: tuple[JointInfo, ...]
    findings: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Give the value of ``robot`` in ``chladni info --json``."""
        return {
            "name": self.robot.name,
            "base": self.robot.base,
            "state": self.log.state_topic,
            "command": self.log.command_topic,
            "command_kind": self.log.command_kind,
            "effort_kind": self.log.effort_kind,
            "state_rate_hz": self.log.sample_rate_hz,
            "command_rate_hz": self.log.command_rate_hz,
            "imu": None if self.log.imu is None else self.log.imu.topic,
            "samples": int(self.log.position.shape[1]),
            "stretches": len(self.log.breaks) + 1,
            "joints": [one.to_json() for one in self.joints],
            "unknown": list(self.log.unknown),
            "findings": list(self.findings),
        }


def robot_info(robot: Robot, log: Log, *, state: str | None = None, command: str | None = None) -> RobotLogInfo:
    """Match a robot with a log and say what it can tell; arguments and errors as of `joint_log`."""
    matched = joint_log(robot, log, state=state, command=command)
    joints = tuple(_joint_info(one, matched) for one in robot.joints)
    return RobotLogInfo(robot=robot, log=matched, joints=joints, findings=tuple(_findings(robot, matched, joints)))


def encoder_resolution(position: Real) -> float | None:
    """Estimate the step of an encoder from the levels that its samples take.

    Levels of an encoder are whole multiples of one step; the smallest distance of two is tried, and refined by the
    levels close to one another.

    Parameters
    ----------
    position
        ``[sample]``, finite.

    Returns
    -------
    float or None
        In the unit of position; None where the levels are no lattice, or too few.

    Examples
    --------
    >>> step = 2 * np.pi / 4096
    >>> turning = np.round(np.sin(np.arange(3000) / 200) / step) * step
    >>> bool(abs(encoder_resolution(turning) / step - 1) < 1e-6)
    True
    >>> encoder_resolution(np.sin(np.arange(3000) / 200)) is None
    True
    """
    levels = np.unique(position)
    # Rounded numbers lie beside one another for one level.
    kind = np.float32 if (levels == levels.astype(np.float32)).all() else np.float64
    rounding = 4 * float(np.finfo(kind).eps) * float(np.abs(levels).max(initial=0.0))
    distances = np.diff(levels[np.append(True, np.diff(levels) > rounding)])
    if distances.size + 1 < _FEWEST_LEVELS:
        return None
    step = float(distances.min())
    # Many steps apart, a small error of the step is as large as one.
    close = distances[distances < step / (2 * _OFF_LATTICE)]
    step = float(np.mean(close / np.round(close / step)))
    off = np.abs(close / step - np.round(close / step)) > _OFF_LATTICE + rounding / step
    if close.size < _FEWEST_LEVELS - 1 or np.mean(off) > _MOST_OFF:
        return None
    return step


def _joint_info(joint: RobotJoint, log: JointLog) -> JointInfo:
    matched = joint.name in log.joints
    row = log.joints.index(joint.name) if matched else 0
    position = log.position[row] if matched else np.zeros(0)
    resolution = encoder_resolution(position) if matched else None
    spread = float(np.std(position)) if matched else 0.0
    return JointInfo(
        joint=joint,
        matched=matched,
        motion=float(np.ptp(position)) if matched else None,
        resolution=resolution,
        still=matched and (_few_levels(position) or (resolution is not None and spread < FEWEST_STEPS * resolution)),
        commanded=matched and log.command is not None and bool(np.isfinite(log.command[row]).any()),
        effort=matched and log.effort is not None and bool(np.isfinite(log.effort[row]).any()),
        gains=_gains(joint),
    )


def _few_levels(position: Real) -> bool:
    return np.unique(position).size < _FEWEST_LEVELS


def _gains(joint: RobotJoint) -> str:
    servo = joint.servo
    if servo is None:
        return ""
    if servo.kind == "effort":
        return "effort"
    told = [f"{name} {value:.4g}" for name, value in (("kp", servo.kp), ("kd", servo.kd)) if value is not None]
    return ", ".join(told)


def _findings(robot: Robot, log: JointLog, joints: Sequence[JointInfo]) -> Iterator[str]:
    yield from robot.remarks
    yield from _names(robot, log)
    yield from log.remarks
    yield from _torques(log, joints)
    yield from _motion(joints)
    if len(log.breaks):
        yield f"samples of the joints come in {len(log.breaks) + 1} stretches: what lies between isn't bridged"
    if robot.base == "floating":
        remedy = "record its IMU, and name it as imu in [log] of a robot file"
        told = remedy if log.imu is None else "its IMU is read"
        yield f"the base floats, and joints don't tell how it moves; {told}"


def _names(robot: Robot, log: JointLog) -> Iterator[str]:
    for name in log.unmatched:
        near = near_words(name, log.unknown)
        yield (
            f"joint {visible(name)} isn't in {visible(log.state_topic)}"
            + (f"; is it {visible(near[0])} there? Rename one of them" if near else "; it counts as at rest")
        )
    unknown = [name for name in log.unknown if not near_words(name, log.unmatched)]
    if unknown:
        yield f"{_some(unknown)}: no joint of {visible(robot.name)} is called so"


def _torques(log: JointLog, joints: Sequence[JointInfo]) -> Iterator[str]:
    """Say by what the torque of the joints is known."""
    seen = [one for one in joints if one.matched]
    without_effort = [one for one in seen if not one.effort]
    # Where the command is the effort, no gains are in between.
    unknown = [
        one.joint.name
        for one in without_effort
        if not (log.command_kind == "effort" and one.commanded) and not one.joint.follows and not _known(one.joint)
    ]
    if log.command is None:
        yield "the log has no commands: delays, gains and limits can't be told"
    if log.effort is None:
        yield "the log has no efforts: torques are what the servos give by their gains, command and position"
    elif without_effort:
        yield f"{_some([one.joint.name for one in without_effort])}: no effort in the log"
    if log.command is None and log.effort is None:
        yield "neither efforts nor commands: the log tells how the robot moves, and not what drives it; record one"
    elif log.command_kind == "position" and not without_effort and not all(_known(one.joint) for one in seen):
        yield "gains aren't known for all joints: torques are taken from the efforts"
    elif unknown:
        yield (
            f"{_some(unknown)}: gains aren't known, and are fitted with the rest, so forces are told less well; give "
            "kp and kd in [control] of a robot file, or record efforts"
        )


def _known(joint: RobotJoint) -> bool:
    return joint.servo is not None and joint.servo.kp is not None


def _motion(joints: Sequence[JointInfo]) -> Iterator[str]:
    still = [one for one in joints if one.still]
    if still and len(still) == sum(one.matched for one in joints):
        yield "no joint moves enough to tell its friction or inertia; record a larger motion"
    elif still:
        yield (
            f"{_some([one.joint.name for one in still])}: hardly any motion against the encoder's steps; friction, "
            "inertia and play there can't be told"
        )


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(map(visible, names[:5])) + more
