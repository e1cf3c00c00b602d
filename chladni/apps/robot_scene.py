"""The robot that was diagnosed, to be looked at in motion."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.records.diagnosis import Diagnosis
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from chladni.robots.shapes import Shape, forward_kinematics, joint_places, shapes_of
from chladni.signals.errors import ModelError
from chladni.viewers.robot_scene import RobotScene


def robot_scene(found: Diagnosis) -> RobotScene | None:
    """Give a diagnosed robot with its meshes, measured and simulated; None for models."""
    motion = found.motion
    if motion is None or found.machine is None:
        return None
    robot = _with_meshes(found.machine.robot)
    measured = forward_kinematics(robot, motion.joints, motion.measured)
    before, after = (
        None if one is None else forward_kinematics(robot, motion.joints, one)
        for one in (motion.before, motion.after)
    )
    shares = {one.name: one.share for one in found.where.sites}
    joints = joint_places(robot)
    shapes = shapes_of(robot)
    # What no joint moves, such as a target or a table, may stand anywhere.
    links = sorted({one.link for one in joints})
    moved, around = measured.place[:, links], np.array([_reach(shapes, link) for link in links])[:, None]
    low, high = (moved - around).min(axis=1), (moved + around).max(axis=1)
    return RobotScene(
        shapes=shapes,
        joints=joints,
        share=np.array([shares.get(one.name, np.nan) for one in joints]),
        time_s=motion.time_s,
        gaps=motion.gaps,
        measured=measured,
        before=before,
        after=after,
        size=float(np.linalg.norm(high - low, axis=1).max()) or 1.0,
        centre=np.mean((low + high) / 2.0, axis=0),
    )


def _reach(shapes: Sequence[Shape], link: int) -> float:
    """How far the shapes of a link reach from its origin at most, m."""
    return max((float(np.linalg.norm(one.place)) + one.radius for one in shapes if one.link == link), default=0.0)


def _with_meshes(robot: Robot) -> Robot:
    """Load the description again with its meshes, which nothing but pictures needs."""
    try:
        return load_robot(robot.robot_file or robot.description)
    except ModelError:
        # A file that is gone, or a mesh that is refused, is no reason to show nothing.
        return robot
