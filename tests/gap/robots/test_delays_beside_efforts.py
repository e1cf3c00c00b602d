"""Delays where efforts stand beside commands: efforts hold whole commands, a motion answers to all of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.solved import Solved, solved
from chladni.gap.robots.torques import ALL_COMMANDS, torques_of
from chladni.robots.joint_log import JointLog
from chladni.robots.robot import Robot
from tests.robots.machines import STEP_S, arm, commands, joint_log_of

mujoco = pytest.importorskip("mujoco")

RATE_HZ, LATE_S = 100.0, 0.013


def late_log(folder: Path, robot: Robot) -> JointLog:
    """A log of efforts and velocities at samples, of a machine whose commands come late and are held."""
    machine = arm(folder, "late/arm.xml", servo=f' delay="{LATE_S}" nsample="40"').model
    data, command = mujoco.MjData(machine), commands(12.0, RATE_HZ)
    position, velocity, effort = (np.empty_like(command) for _ in range(3))
    every = round(1.0 / RATE_HZ / STEP_S)
    data.qpos[:] = command[:, 0]
    for sample, asked in enumerate(command.T):
        position[:, sample], velocity[:, sample] = data.qpos, data.qvel
        data.ctrl[:] = asked
        mujoco.mj_step(machine, data)
        effort[:, sample] = data.qfrc_actuator
        mujoco.mj_step(machine, data, every - 1)
    position += 1e-4 * np.random.default_rng(0).standard_normal(position.shape)
    log = joint_log_of(robot, position, command=command, effort=effort, rate_hz=RATE_HZ)
    return replace(log, velocity=velocity)


def delay_of(found: Solved) -> float:
    place = next(place for place, one in enumerate(found.best.terms) if one.key == ("delay", ALL_COMMANDS))
    return found.numbers(place)["delay"][0]


def test_which_velocity_loops_damp_is_told_whatever_delay_is_described(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    log = late_log(tmp_path, robot)
    for described in (0.0, LATE_S):
        torques = torques_of(replace(robot, delay_s=described), log)
        np.testing.assert_array_equal(torques.loop_velocity, log.velocity)


def test_a_delay_of_more_than_a_sample_is_all_that_is_named(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    found = solved(torques_of(robot, late_log(tmp_path, robot)), frozenset(), lambda _: None)
    assert [one.key for one in found.best.terms] == [("delay", ALL_COMMANDS)]
    assert delay_of(found) == pytest.approx(LATE_S, abs=1e-3)
