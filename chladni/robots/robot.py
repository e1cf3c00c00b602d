"""A robot as its description gives it: joints, links, servos, and what its logs call things."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

CommandKind = Literal["position", "velocity", "effort"]
EffortKind = Literal["measured", "commanded", "current", "none"]
BaseKind = Literal["fixed", "floating"]

DEFAULT_JOINT: Final = "default"
"""What stands for all joints that a table of a robot file doesn't name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """What the simulation believes of the drive of a joint.

    Attributes
    ----------
    kind
        What it's commanded by.
    kp, kd
        Gains at the joint, N m/rad and N m s/rad (N/m and N s/m of a slide); None where nothing says.
    limit
        Largest effort at the joint, N m or N; None without a bound.
    actuator
        Its name in the description; None where the robot file gives it.
    lag_s
        Time constant of a first-order filter on the command.
    """

    kind: CommandKind
    kp: float | None
    kd: float | None
    limit: float | None
    actuator: str | None
    lag_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotJoint:
    """A hinge or slide of the description, in SI units.

    Attributes
    ----------
    name, kind
        Of the joint.
    link
        Body that it moves.
    position, dof
        Indices into MuJoCo's ``qpos`` and ``qvel``.
    range
        Lowest and highest position; None without stops.
    damping, armature, friction
        What the description believes.
    servo
        None for a passive joint, and where nothing says how it's driven.
    effort_limit, velocity_limit
        Limits that the description gives the joint itself; None where it gives none.
    follows
        Joint that this one is coupled to (mimic); None for a joint of its own.
    """

    name: str
    kind: Literal["hinge", "slide"]
    link: str
    position: int
    dof: int
    range: tuple[float, float] | None
    damping: float
    armature: float
    friction: float
    servo: Servo | None
    effort_limit: float | None = None
    velocity_limit: float | None = None
    follows: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotTolerance:
    """How far the description may be off without being wrong, one sigma.

    Attributes
    ----------
    inertia, gains
        Relative.
    friction
        N m, or N of a slide.
    """

    inertia: float = 0.03
    gains: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuNames:
    """Where a log has the IMU of the base, and the site of the description where it sits."""

    topic: str
    site: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LogNames:
    """What the robot file says of logs; None where it leaves the choice to the log.

    Attributes
    ----------
    state, command
        Topics.
    command_kind
        What the command holds.
    effort
        What the state's effort is.
    torque_constant
        N m/A (N/A of a slide) by joint; of all joints that aren't named under ``default``.
    names
        Joints of a command whose messages have no names, in its order.
    imu
        Of the base.
    """

    state: str | None = None
    command: str | None = None
    command_kind: CommandKind | None = None
    effort: EffortKind | None = None
    torque_constant: Mapping[str, float] = field(default_factory=dict)
    names: tuple[str, ...] | None = None
    imu: ImuNames | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """A robot, made by `chladni.load_robot`.

    Attributes
    ----------
    name
        For people.
    joints
        Hinges and slides, in the order of the description.
    links
        Bodies, without the world.
    sites
        Points that the description names, such as where an IMU sits.
    model
        MuJoCo's ``MjModel``: gravity kept, visuals and collisions left out whose meshes are missing.
    description, robot_file
        Files; None without a robot file.
    base
        Whether the base is fixed to the world.
    delay_s
        Of all commands, as the simulation believes.
    tolerance
        Of the description.
    log
        What logs call things.
    remarks
        Sentences on what was left out while loading.
    """

    name: str
    joints: tuple[RobotJoint, ...]
    links: tuple[str, ...]
    model: Any
    description: Path
    robot_file: Path | None
    base: BaseKind
    delay_s: float
    tolerance: RobotTolerance
    log: LogNames
    remarks: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()

    def joint(self, name: str) -> RobotJoint:
        """Give the joint of this name; `KeyError` without one."""
        for one in self.joints:
            if one.name == name:
                return one
        raise KeyError(name)

    def is_behind(self, joint: RobotJoint, other: RobotJoint) -> bool:
        """Whether the other joint's link hangs on that of the first."""
        # MuJoCo's first body is the world.
        first, second = (1 + self.links.index(one.link) for one in (joint, other))
        return bool(self.model.body_parentid[second] == first)

    def hanging(self, joint: RobotJoint) -> tuple[str, ...]:
        """Give the link that a joint moves, and all that hang on it."""
        first = 1 + self.links.index(joint.link)
        found = {first}
        # MuJoCo numbers a body after the one that it hangs on.
        for body in range(first + 1, 1 + len(self.links)):
            if int(self.model.body_parentid[body]) in found:
                found.add(body)
        return tuple(self.links[body - 1] for body in sorted(found))
