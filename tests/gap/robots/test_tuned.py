"""Masses within their tolerance: which of them a log pulls to the end of it."""

from dataclasses import replace
from pathlib import Path

import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.torques import torques_of
from chladni.gap.robots.tuned import pulled_masses
from chladni.robots.machine import as_described
from chladni.robots.robot import RobotTolerance
from tests.robots.machines import arm, commands, course, joint_log_of

pytest.importorskip("mujoco")


def solved_with(folder: Path, heavier: float, tolerance: float) -> Solved:
    """What the log of an arm tells whose forearm is heavier by a share, where no word takes part."""
    robot = replace(arm(folder), tolerance=RobotTolerance(inertia=tolerance))
    machine, command = as_described(robot), commands(12.0)
    inertial = machine.inertial.copy()
    inertial[robot.links.index("fore")] *= 1.0 + heavier
    log = joint_log_of(robot, course(replace(machine, inertial=inertial), command), command=command)
    contest = Contest(torques_of(robot, log))
    return Solved(contest=contest, best=contest.nothing)


@pytest.mark.parametrize("heavier", [0.05, -0.05])
def test_a_mass_that_is_hardly_within_its_tolerance_is_told_with_its_link(tmp_path: Path, heavier: float) -> None:
    found = solved_with(tmp_path, heavier, 0.01)
    mass = found.torques.robot.model.body("fore").mass[0]
    (one,) = pulled_masses(found)
    assert "fore" in one.links
    assert 2.0 < abs(one.over_tolerance) < 5.0
    # The tolerance holds it back.
    assert 0.4 < one.change / (heavier * mass) < 1.1


def test_a_mass_inside_its_tolerance_is_not(tmp_path: Path) -> None:
    assert not list(pulled_masses(solved_with(tmp_path, 0.05, 0.05)))
