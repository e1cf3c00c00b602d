"""A base that floats: what its IMU feels is all that inverse dynamics needs, against Pinocchio."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.torques import torques_of
from chladni.robots.floating_base import floating_base, place_on_base
from chladni.robots.imu_log import ImuLog
from chladni.robots.loading import load_robot
from chladni.signals.errors import ModelError
from tests.robots.afloat import biped
from tests.robots.machines import joint_log_of
from tests.robots.made import written

pytest.importorskip("mujoco")

RATE_HZ = 500.0
LINK = """<link name="{0}"><inertial><origin xyz="0.01 {2} -0.05" rpy="0.1 0.2 0"/><mass value="{1}"/>
<inertia ixx="0.02" iyy="0.025" izz="0.015" ixy="0.002" ixz="0" iyz="0.001"/></inertial></link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"
rpy="0.3 0 0.1"/><axis xyz="{4}"/><limit lower="-3" upper="3" effort="50" velocity="9"/></joint>"""
URDF = (
    '<robot name="legs">'
    + LINK.format("trunk", 5, 0.03) + LINK.format("hip", 1, 0.02) + LINK.format("calf", 0.5, 0)
    + LINK.format("other", 0.8, -0.01) + '<link name="imu"/>'
    + JOINT.format("hip_joint", "trunk", "hip", "0.2 0.1 0", "1 0 0")
    + JOINT.format("knee_joint", "hip", "calf", "0 0.05 -0.2", "0 1 0")
    + JOINT.format("other_joint", "trunk", "other", "-0.2 0.1 0", "0 0.6 0.8")
    + '<joint name="imu_mount" type="fixed"><parent link="trunk"/><child link="imu"/>'
    '<origin xyz="0.1 -0.05 0.08" rpy="0.4 -0.3 1.2"/></joint></robot>'
)  # fmt: skip
ROBOT_FILE = """format = "chladni.robot/1"
description = "legs.urdf"
base = "floating"
[control]
kp = { default = 10.0 }
kd = { default = 1.0 }
"""


def sines(rng: np.random.Generator, rows: int, size: float, time_s: np.ndarray) -> tuple[np.ndarray, ...]:
    """``[row, sample]`` of slow motion, its rate and its second derivative."""
    omega, phase = 2 * np.pi * rng.uniform(0.2, 1.2, (rows, 1)), rng.uniform(0, 6, (rows, 1))
    angle = omega * time_s + phase
    return size * np.sin(angle), size * omega * np.cos(angle), -size * omega**2 * np.sin(angle)


def test_torques_are_those_of_a_base_that_moves_in_the_world(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="pip install pin")
    (tmp_path / "legs.urdf").write_text(URDF)
    robot = load_robot(written(tmp_path, ROBOT_FILE, "robot.toml"))
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    data, rng, time_s = model.createData(), np.random.default_rng(3), np.arange(4000) / RATE_HZ
    joints, twist = sines(rng, 3, 0.6, time_s), sines(rng, 6, 1.0, time_s)
    sensor = model.getFrameId("imu")
    pose, felt, torque = pin.SE3.Random(), [], []
    for k in range(time_s.size):
        q = np.concatenate([pin.SE3ToXYZQUAT(pose), joints[0][:, k]])
        v, a = (np.concatenate([twist[order][:, k], joints[order + 1][:, k]]) for order in (0, 1))
        torque.append(pin.rnea(model, data, q, v, a))
        pin.forwardKinematics(model, data, q, v, a)
        pin.updateFramePlacements(model, data)
        point = pin.getFrameClassicalAcceleration(model, data, sensor, pin.LOCAL).linear
        down = data.oMf[sensor].rotation.T @ model.gravity.linear
        felt.append([*pin.getFrameVelocity(model, data, sensor, pin.LOCAL).angular, *(point - down)])
        middle = twist[0][:, k] + twist[1][:, k] / (2 * RATE_HZ)
        pose = pose * pin.exp6(pin.Motion(middle / RATE_HZ))
    sensed = np.array(felt).T
    imu = ImuLog(
        topic="/imu",
        site="imu",
        angular_velocity=sensed[:3],
        linear_acceleration=sensed[3:],
        orientation=None,
        sample_rate_hz=RATE_HZ,
    )
    order = [model.names.tolist().index(one.name) - 2 for one in robot.joints]
    position = joints[0][order]
    log = replace(joint_log_of(robot, position, command=position, rate_hz=RATE_HZ), imu=imu)
    torques = torques_of(robot, log)
    truth = np.array(torque).T[:, torques.kept]
    # The filter takes a little of the products of motions.
    np.testing.assert_allclose(
        torques.of_joints(torques.need.torque), truth[6:][order], atol=2e-3 * np.abs(truth[6:]).max()
    )
    # What holds the base is told in the axes of its own, force first, as Pinocchio has it.
    np.testing.assert_allclose(torques.held, truth[:6], atol=2e-3 * np.abs(truth[:6]).max())


def test_the_base_is_that_of_the_joints(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    base = floating_base(robot)
    assert base is not None
    assert (base.link, base.position, base.dof) == ("trunk", 7, 6)
    axes, place = place_on_base(robot, base, "imu")
    import mujoco

    data = mujoco.MjData(robot.model)
    mujoco.mj_forward(robot.model, data)
    trunk = data.body("trunk").xmat.reshape(3, 3)
    np.testing.assert_allclose(axes, trunk.T @ data.site("imu").xmat.reshape(3, 3), atol=1e-12)
    np.testing.assert_allclose(place, trunk.T @ (data.site("imu").xpos - data.body("trunk").xpos), atol=1e-12)
    with pytest.raises(
        ModelError, match=r"left_calf, where the IMU sits, isn't fixed to the base trunk; name a site"
    ):
        place_on_base(robot, base, "left_calf")


def test_a_base_that_floats_is_one(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    one = '<body name="{0}"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><body name="{0}_arm">'
    one += '<joint name="{0}_joint"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body>'
    two = f"<mujoco><worldbody>{one.format('a')}{one.format('b')}</worldbody></mujoco>"
    with pytest.raises(ModelError, match="its joints hang on several bases, a, b"):
        floating_base(load_robot(written(tmp_path, two, "two.xml")))
    assert floating_base(replace(robot, base="fixed")) is None


def test_noise_of_an_imu_is_what_its_torques_shake_by(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    rng, count = np.random.default_rng(1), 20000
    level = np.zeros((3, count))
    level[2] = 9.81
    still = np.zeros((4, count))
    quiet = ImuLog(
        topic="/imu",
        site="imu",
        angular_velocity=np.zeros((3, count)),
        linear_acceleration=level,
        orientation=None,
        sample_rate_hz=RATE_HZ,
    )
    shaken = replace(
        quiet,
        angular_velocity=quiet.angular_velocity + 0.02 * rng.normal(size=(3, count)),
        linear_acceleration=quiet.linear_acceleration + 0.3 * rng.normal(size=(3, count)),
    )
    log = joint_log_of(robot, still, command=still, rate_hz=RATE_HZ)
    one, other = (torques_of(robot, replace(log, imu=imu)) for imu in (quiet, shaken))
    shakes = np.std(other.missing - one.missing, axis=1)
    # The filter's edge isn't sharp: what is about the cutoff counts for half in noise that grows with frequency.
    np.testing.assert_allclose(other.sensed_noise, shakes, rtol=0.25)
