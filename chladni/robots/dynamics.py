"""Inverse dynamics of a robot: the torque that a motion needs, and what each link's inertia adds to it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.robots.floating_base import FloatingBase
from chladni.robots.robot import Robot
from chladni.signals.arrays import Real
from chladni.signals.value import Value

#: Inertial numbers of a link: mass, first moment (x, y, z), inertia about the link's origin (xx, yy, zz, xy, xz, yz).
INERTIAL = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Needed(Value):
    """What a motion needs.

    Attributes
    ----------
    torque
        ``[dof, sample]`` at every degree of freedom, with gravity, armature, springs and damping as described, N m
        (N); without friction and drives.
    regressor
        ``[dof, sample, link, 10]``: the torque is linear in a link's `INERTIAL` numbers (Atkeson, An & Hollerbach
        1986); per kg, kg m, kg m^2.
    """

    torque: Real
    regressor: Real

    def __post_init__(self) -> None:
        self._freeze()


def needed_torque(robot: Robot, position: Real, velocity: Real, acceleration: Real) -> Needed:
    """Give the torque that a motion needs.

    Parameters
    ----------
    position, velocity, acceleration
        ``[dof, sample]``, SI; of every degree of freedom of the robot in its order.
    """
    from chladni.robots.mujoco_motion import walk

    torque, links = walk(robot.model, position, velocity, acceleration)
    return Needed(torque=torque, regressor=_regressor(links))


def inertia_columns_of_links(robot: Robot, position: Real, dofs: Sequence[int]) -> Real:
    """Give ``[link, 10, dof, dof, pose]``: joint-space inertia a unit of the links' `INERTIAL` numbers.

    Parameters
    ----------
    position
        ``[qpos, pose]``.
    dofs
        Degrees of freedom that are asked for.
    """
    from chladni.robots.mujoco_motion import walk, weightless

    poses, count = position.shape[1], len(dofs)
    # One acceleration after the other at each pose.
    turned = np.zeros((robot.model.nv, count, poses))
    turned[list(dofs), np.arange(count)] = 1.0
    turned = turned.reshape(robot.model.nv, -1)
    _, links = walk(weightless(robot.model), np.tile(position, count), np.zeros_like(turned), turned)
    columns = _regressor(links)[list(dofs)].reshape(count, count, poses, -1, INERTIAL)
    return np.ascontiguousarray(np.moveaxis(columns, (3, 4), (0, 1)))


def motion_torque(robot: Robot, position: Real, velocity: Real, acceleration: Real) -> Real:
    """Give ``[dof, sample]``: the torque of `needed_torque`, without what links add to it."""
    from chladni.robots.mujoco_motion import torque_alone

    return torque_alone(robot.model, position, velocity, acceleration)


def carried_columns(robot: Robot, base: FloatingBase, position: Real) -> Real:
    """Give ``[6, dof, sample]``: torque a unit of the base's acceleration, linear, then angular, in its own axes.

    Parameters
    ----------
    position
        ``[qpos, sample]`` with the base's axes those of the world.
    """
    from chladni.robots.mujoco_motion import inertia_columns

    return inertia_columns(robot.model, position, slice(base.dof, base.dof + 6))


def gravity_columns(robot: Robot, position: Real) -> Real:
    """Give ``[2, dof, sample]``: torque a radian that the base is turned by, about its x and y axes."""
    from chladni.robots.mujoco_motion import tilted, torque_alone

    step, still = 1e-3, np.zeros((robot.model.nv, position.shape[1]))
    level = torque_alone(robot.model, position, still, still)
    turned = [torque_alone(tilted(robot.model, axis, step), position, still, still) for axis in (0, 1)]
    return (np.stack(turned) - level) / step


def inertial_numbers(robot: Robot) -> Real:
    """Give ``[link, 10]``: the `INERTIAL` numbers of the links as described."""
    from chladni.robots.mujoco_motion import inertials

    found = []
    for mass, centre, about_centre in inertials(robot.model):
        about = about_centre + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        moments = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        found.append(np.concatenate([[mass], mass * centre, moments]))
    return np.array(found)


def _regressor(links: "tuple[Real, ...]") -> Real:
    """Columns by Newton and Euler about each link's own origin, in its own frame."""
    translate, rotate, turned, linear, angular, spin = links
    # [sample, link, axis] in the link's frame.
    inside = np.swapaxes(turned, -1, -2)
    accel, alpha, omega = (np.einsum("klij,klj->kli", inside, one) for one in (linear, angular, spin))
    turning = _cross(alpha) + _cross(omega) @ _cross(omega)
    force = np.zeros((*accel.shape, INERTIAL))
    moment = np.zeros_like(force)
    force[..., 0] = accel
    force[..., 1:4] = turning
    # h x a = -a x h
    moment[..., 1:4] = -_cross(accel)
    moment[..., 4:] = _on_inertia(alpha) + _cross(omega) @ _on_inertia(omega)
    world_force, world_moment = turned @ force, turned @ moment
    columns = np.einsum("klav,klap->vklp", translate, world_force)
    columns += np.einsum("klav,klap->vklp", rotate, world_moment)
    return np.ascontiguousarray(columns)


def _cross(vector: Real) -> Real:
    """Matrices of the cross product with a vector."""
    x, y, z = np.moveaxis(vector, -1, 0)
    none = np.zeros_like(x)
    rows = [[none, -z, y], [z, none, -x], [-y, x, none]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _on_inertia(vector: Real) -> Real:
    """Matrices ``[axis, 6]`` that give I v from the six numbers of I."""
    x, y, z = np.moveaxis(vector, -1, 0)
    none = np.zeros_like(x)
    rows = [[x, none, none, y, z, none], [none, y, none, x, none, z], [none, none, z, none, x, y]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
