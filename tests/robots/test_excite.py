"""Motions that excite a robot: their closed form, their limits, and what they tell apart."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.robots.dynamics import needed_torque
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from chladni.robots.trajectory import FourierSeries, Trajectory
from chladni.signals.errors import ModelError, SetupError
from tests.robots.made import ARM, URDF, written

pytest.importorskip("mujoco")

#: Two links in a vertical plane, with limits of all kinds.
PLANAR = """<robot name="planar">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0.05"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.15 0 0.02"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="1.0" upper="2.6" effort="{effort}" velocity="3"/><dynamics friction="0.3" damping="0.1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="1.5" effort="{effort}" velocity="4"/></joint>
</robot>
"""


def planar(folder: Path, effort: float = 60.0) -> Robot:
    """The two links, with drives of some strength."""
    return load_robot(written(folder, PLANAR.format(effort=effort), f"planar_{effort:g}.urdf"))


def motion_of(made: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """``[3, joint, sample]``: positions, velocities and accelerations by the sums as the paper writes them."""
    found = np.zeros((3, len(made.joints), time_s.size))
    found[0] += made.position[:, :1]
    for joint, row in enumerate(made.coefficients):
        for place in range(made.harmonics):
            a, b = row[place], row[made.harmonics + place]
            omega = 2 * np.pi * made.base_frequency_hz * (place + 1)
            sine, cosine = np.sin(omega * time_s), np.cos(omega * time_s)
            found[0, joint] += a / omega * sine + b / omega * (1 - cosine)
            found[1, joint] += a * cosine + b * sine
            found[2, joint] += omega * (b * cosine - a * sine)
    return found


def test_a_series_starts_at_rest_without_acceleration() -> None:
    series = FourierSeries(harmonics=4, base_frequency_hz=0.25)
    free = np.random.default_rng(5).standard_normal(series.at_rest.shape[1])
    for time_s in (0.0, 4.0, 8.0):
        np.testing.assert_allclose(series.at_rest @ free @ series.basis(np.array([time_s])), 0.0, atol=1e-13)
    assert series.at_rest.shape == (8, 6)


def test_velocity_and_acceleration_are_the_derivatives() -> None:
    series, step = FourierSeries(harmonics=3, base_frequency_hz=0.2), 1e-5
    time_s = np.linspace(0.3, 4.0, 7)
    slope = (series.basis(time_s + step) - series.basis(time_s - step)) / (2 * step)
    np.testing.assert_allclose(series.basis(time_s)[1:], slope[:2], atol=1e-8)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("effort", "base_hz"), [(60.0, 0.1), *(pytest.param(one, 0.6, marks=pytest.mark.nightly) for one in (60.0, 12.0))]
)
def test_limits_hold_between_the_samples_of_every_grid(tmp_path: Path, effort: float, base_hz: float) -> None:
    robot = planar(tmp_path, effort)
    pose = {"shoulder": 1.6, "elbow": 0.1}
    made = chladni.excite(robot, base_frequency_hz=base_hz, pose=pose, travel=0.8, speed=0.6, torque=0.9)
    position, velocity, acceleration = motion_of(made, np.linspace(0.0, 1.0 / base_hz, 20_011))
    low, high = np.array([1.6 - 0.8 * 0.6, 0.1 - 0.8 * 2.1]), np.array([1.6 + 0.8 * 1.0, 0.1 + 0.8 * 1.4])
    assert np.all(position >= low[:, None])
    assert np.all(position <= high[:, None])
    speed = np.max(np.abs(velocity), axis=1) / (0.6 * np.array([3.0, 4.0]))
    assert np.all(speed <= 1.0)
    torque = needed_torque(robot, position, velocity, acceleration).torque.copy()
    torque[0] += 0.3 * np.sign(velocity[0])
    share = np.max(np.abs(torque), axis=1) / (0.9 * effort)
    assert np.all(share <= 1.0)
    # Of a motion that is kept small by nothing nobody learns.
    travel = np.max(np.maximum(position / high[:, None], (position < low[:, None] + 0.02)), axis=1)
    assert max(*speed, *share, *travel) > 0.9


def test_rows_are_the_series_and_end_where_they_start(tmp_path: Path) -> None:
    made = chladni.excite(planar(tmp_path), duration_s=8.0, sample_rate_hz=100.0, base_frequency_hz=0.25)
    assert made.position.shape == (2, 801)
    expected = motion_of(made, np.arange(801) / 100.0)
    for rows, truth in zip((made.position, made.velocity, made.acceleration), expected, strict=True):
        np.testing.assert_allclose(rows, truth, atol=1e-9)
    np.testing.assert_allclose(made.position[:, 0], [1.8, -0.25], atol=1e-12)
    for rows in (made.position - made.position[:, :1], made.velocity, made.acceleration):
        np.testing.assert_allclose(rows[:, [0, -1]], 0.0, atol=1e-12)


@pytest.mark.nightly
def test_the_torque_makes_mujoco_accelerate_as_planned(tmp_path: Path) -> None:
    import mujoco

    robot = load_robot(written(tmp_path, PLANAR.format(effort=60).replace('friction="0.3"', ""), "bare.urdf"))
    made = chladni.excite(robot, sample_rate_hz=20.0)
    data = mujoco.MjData(robot.model)
    for column in range(0, made.position.shape[1], 10):
        data.qpos[:], data.qvel[:] = made.position[:, column], made.velocity[:, column]
        data.qfrc_applied[:] = made.torque[:, column]
        mujoco.mj_forward(robot.model, data)
        np.testing.assert_allclose(data.qacc, made.acceleration[:, column], atol=1e-8)


@pytest.mark.nightly
def test_two_links_in_a_plane_have_eleven_base_parameters_that_are_told_better(tmp_path: Path) -> None:
    made = chladni.excite(planar(tmp_path), seed=3)
    # Moment about the axis and two first moments of each link, an armature that isn't one with the first moment,
    # Coulomb and viscous friction of each joint.
    assert made.parameters == 11
    assert made.condition < 0.7 * made.random_condition
    alone = chladni.excite(planar(tmp_path), joints=["elbow"])
    assert alone.parameters == 5
    np.testing.assert_array_equal(alone.position[0], 1.8)
    assert alone.moved == ("elbow",)


@pytest.mark.nightly
def test_numbers_come_with_less_error_from_the_optimised_motion(tmp_path: Path) -> None:
    robot = planar(tmp_path)
    made = chladni.excite(robot, sample_rate_hz=20.0)
    rng, errors = np.random.default_rng(0), []
    for _ in range(9):
        other = replace_coefficients(made, rng)
        errors.append(error_of(robot, other))
    assert error_of(robot, motion_of(made, np.arange(200) / 20.0)) < 0.7 * float(np.median(errors))


def replace_coefficients(made: Trajectory, rng: np.random.Generator) -> np.ndarray:
    """Another motion inside the same limits."""
    series = FourierSeries(harmonics=made.harmonics, base_frequency_hz=made.base_frequency_hz)
    drawn = rng.standard_normal((2, series.at_rest.shape[1])) @ series.at_rest.T
    other = motion_of(replace(made, coefficients=drawn), np.arange(200) / 20.0)
    from_start = other[0] - other[0][:, :1]
    room = np.array([[0.9 * 0.8], [0.9 * 1.75]])
    used = np.maximum(np.max(np.abs(from_start) / room, axis=1), np.max(np.abs(other[1]), axis=1) / [1.5, 2.0])
    return motion_of(replace(made, coefficients=drawn / used[:, None]), np.arange(200) / 20.0)


def error_of(robot: Robot, motion: np.ndarray) -> float:
    """RMS of the relative errors of eleven numbers that torques with noise of 1 N m tell (Cramer and Rao)."""
    position, velocity, acceleration = motion
    links = needed_torque(robot, position, velocity, acceleration).regressor
    # Moment about the axis and the two first moments across it, of each link.
    own = links[:, :, [robot.links.index(one) for one in ("upper", "fore")]][..., [5, 1, 3]]
    laws = [np.einsum("jk,ji->jki", rows, np.eye(2)) for rows in (np.sign(velocity), velocity)]
    armature = np.einsum("k,j->jk", acceleration[1], [0.0, 1.0])[..., None]
    columns = [own.reshape(2, -1, 6), *laws, armature]
    whole = np.concatenate(columns, axis=2).reshape(-1, 11)
    truth = np.array([0.1, 0.4, 0.1, 0.04, 0.15, 0.05, 0.5, 0.5, 0.5, 0.5, 0.02])
    return float(np.sqrt(np.mean(np.diag(np.linalg.inv(whole.T @ whole)) / truth**2)))


@pytest.mark.nightly
def test_the_same_seed_gives_the_same(tmp_path: Path) -> None:
    robot = planar(tmp_path)
    one, same, other = (chladni.excite(robot, seed=seed).coefficients for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.allclose(one, other)


@pytest.mark.nightly
def test_what_a_description_leaves_open_is_told(tmp_path: Path) -> None:
    made = chladni.excite(written(tmp_path, URDF, "arm.urdf"), speed=1.0)
    assert any(text.startswith("elbow: no stops in the description; at most 1.57 rad") for text in made.remarks)
    assert abs(made.position[1]).max() < np.pi / 2
    assert any("collisions" in text for text in made.remarks)
    mjcf = chladni.excite(written(tmp_path, ARM), joints=["sh*", "elbow"], speed=1.0)
    assert any("shoulder, elbow: no limit of velocity" in text and "2 rad/s" in text for text in mjcf.remarks)
    assert 1.9 < np.max(np.abs(mjcf.velocity)) <= 2.0
    assert any("elbow: no limit of effort" in text for text in mjcf.remarks)
    assert np.max(np.abs(mjcf.torque[0])) <= 0.8 * 30.0


def test_coupled_joints_rest_and_are_told(tmp_path: Path) -> None:
    coupled = URDF.replace(
        '<joint name="elbow" type="continuous">', '<joint name="elbow" type="continuous"><mimic joint="shoulder"/>'
    )
    path = written(tmp_path, coupled, "coupled.urdf")
    made = chladni.excite(path)
    assert made.moved == ("lift",)
    assert "elbow, shoulder: coupled to each other, and held at rest" in made.remarks
    with pytest.raises(SetupError, match="shoulder: is coupled to another joint"):
        chladni.excite(path, joints=["shoulder"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"joints": ["elbou"]}, "has no joint 'elbou'; did you mean elbow"),
        ({"joints": ["wrist_*"]}, r"has no joint 'wrist_\*'; joints: shoulder, elbow"),
        ({"pose": {"hand": 0.0}}, "has no joint 'hand'"),
        ({"pose": {"elbow": 2.0}}, "elbow can't start at 2; give a position within its range from -2 to 1.5 rad"),
        ({"travel": 0.0}, "travel is 0; a share of the limit is above 0"),
        ({"speed": 1.5}, "speed is 1.5"),
        ({"torque": float("nan")}, "torque is nan"),
        ({"harmonics": 1}, "two at least"),
        ({"duration_s": 25.0, "base_frequency_hz": 0.1}, "2.5 periods of 0.1 Hz.*give a length of 20 s"),
        ({"duration_s": float("inf")}, "length is inf"),
        ({"sample_rate_hz": 1.0}, "need a rate above 1 Hz"),
        ({"duration_s": 10_000.0}, "repeat a shorter one"),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(SetupError, match=message):
        chladni.excite(planar(tmp_path), **options)


def test_a_robot_that_can_not_be_excited_is_refused_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"slide lift has no stops.*or move other joints"):
        chladni.excite(written(tmp_path, ARM))
    with pytest.raises(ModelError, match="its base floats"):
        chladni.excite(replace(planar(tmp_path), base="floating"))
    with pytest.raises(ModelError, match=r"elbow starts at 1\.5 rad and has no room on one side"):
        chladni.excite(planar(tmp_path), pose={"elbow": 1.5})
    with pytest.raises(ModelError, match=r"holding shoulder in the start pose takes [\d.]+ N m of the 4 N m"):
        chladni.excite(planar(tmp_path, 5.0), pose={"shoulder": 2.6, "elbow": -1.0}, joints=["elbow"])
