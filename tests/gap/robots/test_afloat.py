"""What is named of robots whose base nobody holds, by what their IMU feels."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.gap.robots.forward import simulated
from chladni.gap.robots.torques import torques_of
from chladni.gap.robots.words import ROBOT_WORDS, all_terms
from chladni.robots.joint_log import JointLog
from chladni.robots.machine import as_described
from chladni.signals.errors import LogError
from tests.robots.afloat import biped, hung, walking
from tests.robots.machines import RATE_HZ

pytest.importorskip("mujoco")

SECONDS = 12.0


def found_of(folder: Path, *, falls: bool = False, **machine: str) -> Diagnosis:
    """The answer on a log of a machine that differs from the robot as described."""
    log = hung(biped(folder, "machine/biped.xml", **machine), walking(SECONDS), falls=falls)
    return diagnose_robot(biped(folder), log)


def named(found: Diagnosis) -> set[tuple[str, str]]:
    """Words and sites."""
    return {(one.effect, one.site) for one in found.causes}


@pytest.mark.nightly
def test_filters_of_an_imu_are_no_cause(tmp_path: Path) -> None:
    robot, late = biped(tmp_path), 1
    log = hung(robot, walking(SECONDS))
    imu = replace(
        log.imu,
        angular_velocity=np.roll(log.imu.angular_velocity, late, axis=1),
        linear_acceleration=np.roll(log.imu.linear_acceleration, late, axis=1),
    )
    found = diagnose_robot(robot, replace(log, imu=imu))
    assert (found.verdict, found.causes) == ("none", ())
    torques = torques_of(robot, replace(log, imu=imu))
    right = torques_of(robot, log).missing
    # Of first order: half of the delay times the motion's own omega is left.
    left = torques.missing - late / RATE_HZ * torques.late_base - right
    assert left.std() < 0.1 * (torques.missing - right).std()


@pytest.mark.nightly
@pytest.mark.parametrize("falls", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_robot_that_is_right_lacks_nothing(tmp_path: Path, falls: bool) -> None:
    found = found_of(tmp_path, falls=falls)
    assert (found.verdict, found.causes) == ("none", ())


def test_friction_in_a_leg_is_named_with_its_size(tmp_path: Path) -> None:
    found = found_of(tmp_path, left=' frictionloss="0.4"')
    assert named(found) == {("coulomb_friction", "left_hip")}
    assert found.causes[0].parameters["force"].value == pytest.approx(0.4, rel=0.1)
    # Confirmed by simulation, on a base that moves as it did.
    assert found.gap.by == "windows"
    assert found.gap.after < 0.5 * found.gap.before


@pytest.mark.nightly
def test_friction_is_named_where_the_log_has_commands_and_efforts(tmp_path: Path) -> None:
    log = hung(biped(tmp_path, "machine/biped.xml", left=' frictionloss="0.4"'), walking(SECONDS), effort=True)
    found = diagnose_robot(biped(tmp_path), log)
    assert ("coulomb_friction", "left_hip") in named(found)
    assert {one.site for one in found.causes} == {"left_hip"}


@pytest.mark.nightly
def test_a_delay_of_all_commands(tmp_path: Path) -> None:
    found = found_of(tmp_path, servo=' delay="0.012" nsample="40"')
    assert named(found) == {("delay", "all commands")}
    assert found.causes[0].parameters["delay"].value == pytest.approx(0.012, abs=1e-3)


def test_the_simulation_of_what_was_described_follows_a_base_that_moves(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    log = hung(robot, walking(6.0))
    torques = torques_of(robot, log)
    run = [(300, 1200)]
    measured = log.position[:, 300:1200]
    found = simulated(as_described(robot), torques, run)[:, 300:1200]
    # Steps are of another length than the machine's, and the start is smoothed.
    assert np.sqrt(np.mean((found - measured) ** 2)) < 0.004 * measured.std()
    # On a base at rest the legs move otherwise.
    level = np.zeros_like(log.imu.linear_acceleration)
    level[2] = 9.81
    still = replace(log.imu, site="trunk", angular_velocity=np.zeros_like(level), linear_acceleration=level)
    other = simulated(as_described(robot), torques_of(robot, replace(log, imu=still)), run)[:, 300:1200]
    assert np.sqrt(np.mean((other - measured) ** 2)) > 0.01 * measured.std()


def test_without_an_imu_the_joints_tell_nothing(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    log = replace(hung(robot, walking(2.0)), imu=None)
    with pytest.raises(LogError, match=r"base floats.*record one \(sensor_msgs/Imu\) on trunk.*base = \"fixed\""):
        diagnose_robot(robot, log)


@pytest.mark.nightly
def test_what_stands_is_refused_with_the_time_in_the_air(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    with pytest.raises(LogError, match="held by its base, its legs in the air"):
        diagnose_robot(robot, hung(robot, walking(6.0), stands_s=9.0))
    with pytest.raises(
        LogError, match=r"stands on its last links for 4\.\d+ s.*from (5|6)\.\d+ to 1\d\.?\d* s after"
    ):
        diagnose_robot(robot, hung(robot, walking(12.0), stands_s=5.0))


TURNED = (0.06, -0.04, 0.05)


def turned(log: JointLog) -> JointLog:
    """What an IMU reads that is turned from how it's described."""
    back = Rotation.from_rotvec(TURNED).as_matrix().T
    assert log.imu is not None
    felt = (back @ log.imu.angular_velocity, back @ log.imu.linear_acceleration)
    return replace(log, imu=replace(log.imu, angular_velocity=felt[0], linear_acceleration=felt[1]))


@pytest.mark.nightly
def test_an_imu_that_is_turned_is_named(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    found = diagnose_robot(robot, turned(hung(robot, walking(SECONDS))))
    assert named(found) == {("misalignment", "imu")}
    angles = [found.causes[0].parameters[f"about_{axis}"] for axis in "xyz"]
    # Legs that swing about y tell the other two by what their knees' axes are turned, to 0.01 rad of one sigma.
    assert [one.value for one in angles] == pytest.approx(TURNED, abs=0.02)
    assert angles[1].value == pytest.approx(TURNED[1], abs=0.01)


def test_the_simulation_turns_the_imu_back(tmp_path: Path) -> None:
    robot, run = biped(tmp_path), [(300, 800)]
    log = hung(robot, walking(4.0))
    believed = as_described(robot)
    right = simulated(believed, torques_of(robot, log), run)[:, 300:800]
    wrong = torques_of(robot, turned(log))
    back = simulated(replace(believed, imu_turned=TURNED), wrong, run)[:, 300:800]
    np.testing.assert_allclose(back, right, atol=1e-9)
    assert np.abs(simulated(believed, wrong, run)[:, 300:800] - right).max() > 1e-3


def test_words_of_a_base_that_floats(tmp_path: Path) -> None:
    robot = biped(tmp_path)
    words = {term.word for term in all_terms(torques_of(robot, hung(robot, walking(3.0))))} - {"parameter"}
    assert words == set(ROBOT_WORDS) - {"gravity_tilt"}
