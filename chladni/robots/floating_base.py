"""A base that floats: where the description has it, and its motion as an IMU on it feels it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from chladni.signals.errors import ModelError
from chladni.signals.visible import visible

if TYPE_CHECKING:
    from chladni.robots.robot import Robot
    from chladni.signals.arrays import Real

#: MuJoCo's `mjJNT_FREE`.
_FREE: Final = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FloatingBase:
    """The free joint that carries all joints of a robot.

    Attributes
    ----------
    link
        Body that floats.
    position, dof
        First of its indices into MuJoCo's ``qpos`` (place, then quaternion) and ``qvel`` (linear in the world's axes,
        then angular in its own).
    """

    link: str
    position: int
    dof: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseMotion:
    """What moves a robot on its base: all that inverse dynamics needs of it.

    A robot feels its base's acceleration less gravity, which is what an accelerometer measures, and how the base
    turns. Neither its place nor its attitude is needed, so nothing drifts.

    Attributes
    ----------
    force
        ``[axis, sample]`` acceleration of the base's origin less gravity, in its own axes, m/s^2.
    angular_velocity, angular_acceleration
        ``[axis, sample]`` in its own axes, rad/s and rad/s^2.
    """

    force: Real
    angular_velocity: Real
    angular_acceleration: Real


def floating_base(robot: Robot) -> FloatingBase | None:
    """Give the base that carries the robot's joints; None where it's fixed.

    Raises
    ------
    ModelError
        When the joints hang on several bases.
    """
    if robot.base == "fixed":
        return None
    model = robot.model
    roots = {int(model.body_rootid[1 + robot.links.index(one.link)]) for one in robot.joints}
    if len(roots) > 1:
        told = ", ".join(visible(robot.links[one - 1]) for one in sorted(roots))
        raise ModelError(f"{robot.name}: its joints hang on several bases, {told}; describe one robot alone")
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) == _FREE and int(model.jnt_bodyid[joint]) in roots:
            return FloatingBase(
                link=robot.links[int(model.jnt_bodyid[joint]) - 1],
                position=int(model.jnt_qposadr[joint]),
                dof=int(model.jnt_dofadr[joint]),
            )
    raise ModelError(f"{robot.name}: its base is said to float, and no free joint carries it; give it one")


def place_on_base(robot: Robot, base: FloatingBase, site: str) -> tuple[Real, Real]:
    """Give the axes ``[3, 3]`` and the place ``[3]``, m, of a site or link in those of the base.

    Raises
    ------
    ModelError
        When joints lie between the two.
    """
    model, place, turned = robot.model, np.zeros(3), Rotation.identity()
    if site in robot.sites:
        number = robot.sites.index(site)
        body, place, turned = int(model.site_bodyid[number]), model.site_pos[number], _turned(model.site_quat[number])
    else:
        body = 1 + robot.links.index(site)
    while body != 1 + robot.links.index(base.link):
        if not body or model.body_jntnum[body]:
            raise ModelError(
                f"{robot.name}: {visible(site)}, where the IMU sits, isn't fixed to the base {visible(base.link)}; "
                "name a site or link on it as imu in [log] of the robot file, and record an IMU there"
            )
        own = _turned(model.body_quat[body])
        place, turned = own.apply(place) + model.body_pos[body], own * turned
        body = int(model.body_parentid[body])
    return np.asarray(turned.as_matrix()), np.asarray(place, dtype=np.float64)


def _turned(quaternion: Any) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternion), scalar_first=True)


def at_origin(place: Real, felt: BaseMotion) -> BaseMotion:
    """Give the motion of the base's origin by that of a place ``[3]`` on it, in the base's axes."""
    lever, turning = place[:, None], felt.angular_velocity
    around = _cross(felt.angular_acceleration, lever) + _cross(turning, _cross(turning, lever))
    return BaseMotion(
        force=felt.force - around,
        angular_velocity=turning,
        angular_acceleration=felt.angular_acceleration,
    )


def _cross(one: Real, other: Real) -> Real:
    return np.cross(one, other, axis=0)
