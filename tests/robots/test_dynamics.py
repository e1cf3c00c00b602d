"""Inverse dynamics: the regressor gives MuJoCo's own torque, gravity turns with the base."""

from pathlib import Path

import numpy as np
import pytest

from chladni.robots.dynamics import gravity_columns, inertia_columns_of_links, inertial_numbers, needed_torque
from tests.robots.machines import arm

mujoco = pytest.importorskip("mujoco")


def test_the_torque_is_linear_in_the_inertial_numbers(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    rng = np.random.default_rng(1)
    position, velocity, acceleration = rng.standard_normal((3, 2, 40))
    need = needed_torque(robot, position, velocity, acceleration)
    links = np.einsum("vklp,lp->vk", need.regressor, inertial_numbers(robot))
    # Armature and damping are of the joints, not of the links.
    joints = np.array([[0.1], [0.05]]) * acceleration + np.array([[0.5], [0.2]]) * velocity
    np.testing.assert_allclose(links + joints, need.torque, atol=1e-12)


def test_inertia_between_joints_is_the_sum_of_what_links_add(tmp_path: Path) -> None:
    robot, poses = arm(tmp_path), np.array([[0.3, -0.2, 1.1], [-0.4, 0.5, 0.9]])
    links = np.einsum("lp,lpijk->ijk", inertial_numbers(robot), inertia_columns_of_links(robot, poses, [0, 1]))
    data, whole = mujoco.MjData(robot.model), np.zeros((2, 2))
    for pose, found in zip(poses.T, np.moveaxis(links, 2, 0), strict=True):
        data.qpos[:] = pose
        mujoco.mj_forward(robot.model, data)
        mujoco.mj_fullM(robot.model, data, whole)
        np.testing.assert_allclose(found, whole - np.diag([one.armature for one in robot.joints]), atol=1e-12)
    # About the shoulder, of a straight arm: each link's own and where it is.
    straight = inertia_columns_of_links(robot, np.zeros((2, 1)), [0])[..., 0, 0, 0]
    closed_form = (0.02 + 2.0 * 0.2**2) + (0.01 + 1.0 * 0.5**2)
    assert np.sum(inertial_numbers(robot) * straight) == pytest.approx(closed_form)


def test_a_pendulum_needs_what_a_closed_form_says(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    angle = np.linspace(-1.0, 1.0, 9)
    still = np.zeros((2, 9))
    need = needed_torque(robot, np.stack([angle, np.zeros(9)]), still, still)
    # Both links stand on the shoulder: m g l sin q each, and an axis along y turns them over.
    moment = 9.81 * (2.0 * 0.2 + 1.0 * 0.5)
    np.testing.assert_allclose(need.torque[0], -moment * np.sin(angle), atol=1e-12)


def test_a_base_that_is_turned_about_y_is_a_shoulder_that_is(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    angle = np.linspace(-1.0, 1.0, 9)
    about_x, about_y = gravity_columns(robot, np.stack([angle, np.zeros(9)]))
    moment = 9.81 * (2.0 * 0.2 + 1.0 * 0.5)
    np.testing.assert_allclose(about_y[0], -moment * np.cos(angle), rtol=1e-2)
    np.testing.assert_allclose(about_x, 0.0, atol=1e-2)
