"""Masses within their tolerance: which of them a log pulls to the end of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.torques import torques_of
from chladni.gap.robots.tuned import beyond_their_prior, pulled_masses
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
    assert abs(one.over_tolerance) > 2.0
    # The tolerance, which would hold it back, takes no part.
    assert one.change == pytest.approx(heavier * mass, abs=3.0 * one.std)
    assert one.std < 0.2 * abs(one.change)
    assert one.instead == ()


def test_a_mass_inside_its_tolerance_is_not(tmp_path: Path) -> None:
    assert not list(pulled_masses(solved_with(tmp_path, 0.05, 0.05)))


def fitted(columns: np.ndarray, measured: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """What a measurement says of numbers of one deviation each, mean and covariance (Bishop 2006, equation 3.50)."""
    covariance = np.linalg.inv(np.eye(columns.shape[1]) + columns.T @ columns / noise**2)
    return covariance @ columns.T @ measured / noise**2, covariance


def test_numbers_that_a_log_does_not_tell_apart_are_told_together() -> None:
    columns = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    (one,) = beyond_their_prior(*fitted(columns, np.array([6.0, 0.5]), 0.1))
    assert {one.place, *one.instead} == {0, 1}
    # One is far off, or two are: the latter is told as one thing, too.
    assert one.value == pytest.approx(6.0, abs=3.0 * one.std)


def test_what_is_held_back_at_one_is_not_told_of_another() -> None:
    columns = np.array([[1.0, 0.4], [0.2, 1.0]])
    (one,) = beyond_their_prior(*fitted(columns, columns @ [6.0, 0.0], 1.0))
    assert (one.place, one.instead) == (0, ())
    two = beyond_their_prior(*fitted(columns, columns @ [8.0, -7.0], 0.5))
    assert {each.place for each in two} == {0, 1}


def test_where_all_are_as_believed_any_is_told_one_time_in_twenty() -> None:
    random, columns = np.random.default_rng(0), np.random.default_rng(1).standard_normal((8, 6))
    truth, noise = random.standard_normal((2000, 6)), 0.5 * random.standard_normal((2000, 8))
    told = [any(True for _ in beyond_their_prior(*fitted(columns, columns @ one + each, 0.5)))
            for one, each in zip(truth, noise, strict=True)]  # fmt: skip
    # Bonferroni's bound, within three deviations of a binomial.
    assert 0.02 < np.mean(told) < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 2000)
