"""The robot that was diagnosed, to be looked at in motion."""

import numpy as np

from chladni.gap.records.diagnosis import Diagnosis
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from chladni.robots.shapes import forward_kinematics, joint_places, shapes_of
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
    low, high = measured.place.min(axis=(0, 1)), measured.place.max(axis=(0, 1))
    return RobotScene(
        shapes=shapes_of(robot),
        joints=joints,
        share=np.array([shares.get(one.name, np.nan) for one in joints]),
        time_s=motion.time_s,
        gaps=motion.gaps,
        measured=measured,
        before=before,
        after=after,
        size=float(np.linalg.norm(high - low)) or 1.0,
        centre=(low + high) / 2.0,
    )


def _with_meshes(robot: Robot) -> Robot:
    """Load the description again with its meshes, which nothing but pictures needs."""
    try:
        return load_robot(robot.robot_file or robot.description)
    except ModelError:
        # A file that is gone, or a mesh that is refused, is no reason to show nothing.
        return robot
