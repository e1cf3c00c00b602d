"""What a robot's joints may do: its description's limits, shares of which are used, and what stands in for them."""

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import isfinite, pi
from typing import Final

import numpy as np

from chladni.io.log_info import some_of
from chladni.models.effects.wording import nearest
from chladni.robots.mujoco_motion import torque_alone
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError, SetupError
from chladni.signals.visible import visible

#: On either side of its start, of a hinge that the description lets turn without end, rad: cables mostly allow it.
FREE_TURN: Final = pi / 2.0
#: Where the description has no limit of velocity: rad/s, as slow joints of common arms have (KUKA iiwa, Franka: 1.7
#: to 2.6); m/s, half of which is the reduced speed of ISO 10218-1.
USUAL_SPEED: Final = {"hinge": 2.0, "slide": 0.5}
UNIT: Final = {"hinge": "rad", "slide": "m"}
#: Of its limit: a pose that asks for nearly all of it leaves nothing to move with.
_HOLDS: Final = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Shares:
    """How much of the limits is used, each above 0 and at most 1.

    Attributes
    ----------
    travel
        Of the way from the start pose to the stops, on both sides.
    speed, torque
        Of the limits of velocity and effort.
    """

    travel: float = 0.9
    speed: float = 0.5
    torque: float = 0.8

    def __post_init__(self) -> None:
        for name in ("travel", "speed", "torque"):
            share = getattr(self, name)
            if not 0.0 < share <= 1.0:
                raise SetupError(f"{name} is {share:g}; a share of the limit is above 0 and at most 1")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionLimits:
    """Limits of every degree of freedom of a robot, SI.

    Attributes
    ----------
    start
        ``[dof]``: pose that a motion starts from and ends in.
    low, high
        ``[dof]``: positions.
    speed
        ``[dof]``: largest magnitude of the velocity.
    torque
        ``[dof]``: largest magnitude of the effort; infinite without a limit.
    remarks
        Sentences on what the description doesn't say.
    """

    start: Real
    low: Real
    high: Real
    speed: Real
    torque: Real
    remarks: tuple[str, ...]


def moved_joints(robot: Robot, patterns: tuple[str, ...]) -> tuple[tuple[RobotJoint, ...], tuple[str, ...]]:
    """Give the joints that can be moved on their own and match a name or pattern, and sentences on others.

    Parameters
    ----------
    patterns
        Names, or shell patterns such as ``wrist_*``; all joints without any.

    Raises
    ------
    SetupError
        When one matches no joint, or names one that is coupled to another.
    """
    coupled = {name for one in robot.joints if one.follows is not None for name in (one.name, one.follows)}
    names = [one.name for one in robot.joints]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise SetupError(f"{robot.name} has no joint {visible(pattern)!r}; {nearest(pattern, names, 'joints')}")
        if pattern in coupled:
            raise SetupError(f"{visible(pattern)}: is coupled to another joint; only joints of their own are moved")
    chosen = tuple(
        one
        for one in robot.joints
        if one.name not in coupled and (not patterns or any(fnmatchcase(one.name, each) for each in patterns))
    )
    if not chosen:
        raise SetupError(f"{robot.name}: all joints that are asked for are coupled to others; name another")
    told = f"{', '.join(map(visible, sorted(coupled)))}: coupled to each other, and held at rest"
    return chosen, (told,) if coupled else ()


def motion_limits(
    robot: Robot, moved: tuple[RobotJoint, ...], pose: Mapping[str, float], shares: Shares
) -> MotionLimits:
    """Give the limits of a motion.

    Parameters
    ----------
    moved
        Joints that move; the others rest at the start pose.
    pose
        Start of joints by name, rad (m); the middle of its range for a joint that isn't named.

    Raises
    ------
    SetupError
        When a pose names no joint or lies beyond its stops.
    ModelError
        When a joint that moves has no room, a slide has no stops, or the start pose takes all the effort.
    """
    known = [one.name for one in robot.joints]
    for name in pose:
        if name not in known:
            raise SetupError(f"{robot.name} has no joint {visible(name)!r}; {nearest(name, known, 'joints')}")
    start = np.array(robot.model.qpos0, dtype=np.float64)
    low, high, speed, torque = start.copy(), start.copy(), np.zeros(start.size), np.full(start.size, np.inf)
    free, unhurried, unlimited = [], [], []
    for joint in robot.joints:
        dof = joint.dof
        start[dof] = _start(robot, joint, pose.get(joint.name))
        torque[dof] = shares.torque * effort_limit(joint)
        if joint not in moved:
            low[dof] = high[dof] = start[dof]
            continue
        below, above = _room(robot, joint, float(start[dof]))
        low[dof], high[dof] = start[dof] - shares.travel * below, start[dof] + shares.travel * above
        speed[dof] = shares.speed * (joint.velocity_limit or USUAL_SPEED[joint.kind])
        free += [joint] if joint.range is None else []
        unhurried += [joint] if joint.velocity_limit is None else []
        unlimited += [joint] if not isfinite(torque[dof]) else []
    _require_held(robot, start, torque, shares)
    return MotionLimits(
        start=start, low=low, high=high, speed=speed, torque=torque, remarks=tuple(_told(free, unhurried, unlimited)),
    )  # fmt: skip


def _start(robot: Robot, joint: RobotJoint, asked: float | None) -> float:
    stops = joint.range
    if asked is None:
        rest = float(robot.model.qpos0[joint.position])
        return rest if stops is None else (stops[0] + stops[1]) / 2.0
    if not isfinite(asked) or (stops is not None and not stops[0] <= asked <= stops[1]):
        within = "" if stops is None else f" from {stops[0]:g} to {stops[1]:g} {UNIT[joint.kind]}"
        raise SetupError(f"{visible(joint.name)} can't start at {asked:g}; give a position within its range{within}")
    return asked


def _room(robot: Robot, joint: RobotJoint, start: float) -> tuple[float, float]:
    """Way below and above the start."""
    if joint.range is None:
        if joint.kind == "slide":
            raise ModelError(
                f"{robot.name}: slide {visible(joint.name)} has no stops in the description; give it a range there, "
                "or move other joints"
            )
        return FREE_TURN, FREE_TURN
    below, above = start - joint.range[0], joint.range[1] - start
    if below <= 0.0 or above <= 0.0:
        raise ModelError(
            f"{robot.name}: {visible(joint.name)} starts at {start:g} {UNIT[joint.kind]} and has no room on one side "
            f"(range {joint.range[0]:g} to {joint.range[1]:g}); start it further inside"
        )
    return below, above


def effort_limit(joint: RobotJoint) -> float:
    """Give the lower one of a joint's and its servo's; infinite without any."""
    of_servo = None if joint.servo is None else joint.servo.limit
    return min((one for one in (joint.effort_limit, of_servo) if one is not None), default=np.inf)


def _require_held(robot: Robot, start: Real, torque: Real, shares: Shares) -> None:
    """Refuse a start pose that takes nearly all that the drives may give."""
    still = np.zeros((start.size, 1))
    needed = np.abs(torque_alone(robot.model, start[:, None], still, still)[:, 0])
    for joint in robot.joints:
        dof = joint.dof
        if needed[dof] > _HOLDS * torque[dof]:
            unit = "N m" if joint.kind == "hinge" else "N"
            raise ModelError(
                f"{robot.name}: holding {visible(joint.name)} in the start pose takes {needed[dof]:.3g} {unit} of "
                f"the {torque[dof]:.3g} {unit} that may be used ({shares.torque:g} of its limit); give another pose, "
                "or a larger share of the torque"
            )


def _told(free: list[RobotJoint], unhurried: list[RobotJoint], unlimited: list[RobotJoint]) -> list[str]:
    found = []
    if free:
        turn = f"at most {FREE_TURN:.3g} rad to either side"
        found.append(f"{_of(free)}: no stops in the description; {turn} are used, make sure that cables allow it")
    if unhurried:
        usual = " and ".join(
            f"{USUAL_SPEED[kind]:g} {UNIT[kind]}/s"
            for kind in USUAL_SPEED
            if any(one.kind == kind for one in unhurried)
        )
        found.append(f"{_of(unhurried)}: no limit of velocity in the description; {usual} stands in for it")
    if unlimited:
        found.append(f"{_of(unlimited)}: no limit of effort in the description; torque isn't bounded there")
    return found


def _of(joints: list[RobotJoint]) -> str:
    return some_of([one.name for one in joints])
