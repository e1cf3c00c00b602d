"""Noise of readings asks for as much torque as the machine has inertia, not the description."""

from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.solved import solved
from chladni.gap.robots.torques import Torques, torques_of
from chladni.robots.machine import as_described
from tests.robots.machines import arm, changed, commands, course, joint_log_of, run_native

pytest.importorskip("mujoco")

SECONDS, SHAKE_RAD = 8.0, 2e-3


def read(folder: Path, position: np.ndarray) -> Torques:
    """What the arm as described lacks for positions that are read with noise."""
    shaken = position + SHAKE_RAD * np.random.default_rng(0).standard_normal(position.shape)
    return torques_of(arm(folder), joint_log_of(arm(folder), shaken, command=commands(SECONDS)))


def with_rotor(folder: Path, armature: float) -> np.ndarray:
    """Positions of an arm whose shoulder has another rotor."""
    return course(changed(as_described(arm(folder)), 0, armature=armature), commands(SECONDS))


def test_a_rotor_makes_the_noise_of_its_joint_louder_and_no_law_explains_that(tmp_path: Path) -> None:
    torques = read(tmp_path, with_rotor(tmp_path, 1.0))
    assert {one.key for one in solved(torques, frozenset(), lambda _: None).best.terms} == {("armature", "shoulder")}


def test_a_payload_makes_the_noise_of_all_joints_louder_and_no_law_explains_that(tmp_path: Path) -> None:
    machine = arm(tmp_path, "machine/arm.xml", mass="4")
    torques = read(tmp_path, run_native(machine, commands(SECONDS)))
    found = solved(torques, frozenset(), lambda _: None)
    assert {one.key for one in found.best.terms} <= {("payload", "fore"), ("parameter", "fore.mass")}
    assert np.all(found.contest.noise(found.best) > found.torques.noise)


def test_noise_of_a_set_is_that_of_a_description_with_its_numbers(tmp_path: Path) -> None:
    machine = arm(tmp_path, "machine/arm.xml", mass="4")
    position = run_native(machine, commands(SECONDS))
    torques = read(tmp_path, position)
    contest = Contest(torques)
    fit = contest.fit([next(one for one in contest.terms if one.key == ("payload", "fore"))])
    described = torques_of(machine, torques.log).sensed_noise
    of_readings = np.sqrt(contest.noise(fit) ** 2 - torques.rounding**2)
    np.testing.assert_allclose(of_readings, described, rtol=0.1)
