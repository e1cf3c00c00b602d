"""Laws that hold a plainer one: which of both words a log tells, and where it's either."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.records.diagnosis import Candidate
from chladni.gap.robots.answer import Answer, Weighed
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.next_measurement import next_measurement
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.torques import torques_of
from chladni.robots.machine import Machine, as_described
from tests.robots.machines import arm, changed, commands, course, joint_log_of

pytest.importorskip("mujoco")

RUBS = 4.0
COULOMB, LOAD, STRIBECK = "coulomb_friction", "load_friction", "stribeck_friction"


def contest_of(
    folder: Path, change: Callable[[Machine], Machine], command: np.ndarray, *words: str
) -> tuple[Contest, Fit]:
    """Words of friction at the shoulder of a machine, by a log with some noise, and the best fit of the first."""
    robot = arm(folder)
    position = course(change(as_described(robot)), command)
    position += 2e-4 * np.random.default_rng(0).standard_normal(position.shape)
    torques = torques_of(robot, joint_log_of(robot, position, command=command))
    every = Contest(torques)
    contest = Contest(torques, terms=[one for one in every.terms if one.word in words]) if words[1:] else every
    keys = (words[0], "shoulder")
    fits = [contest.fit([term]) for term in contest.terms if term.key == keys and not term.variant]
    return contest, max(fits, key=lambda fit: fit.nats)


def weighed(folder: Path, change: Callable[[Machine], Machine], command: np.ndarray, word: str) -> Weighed:
    """What is said of a word there."""
    contest, best = contest_of(folder, change, command, word)
    (one,) = Answer(solved=Solved(contest=contest, best=best)).weighed
    return one


def rubbing(machine: Machine) -> Machine:
    return changed(machine, 0, friction=RUBS)


def bent(swing: float) -> np.ndarray:
    """Motions about a pose in which the arm's weight bears on the shoulder, by 4.5 N m."""
    return swing * commands(8.0) + np.array([[2.6], [0.0]])


def test_friction_under_a_load_that_hardly_changes_is_either_word(tmp_path: Path) -> None:
    one = weighed(tmp_path, rubbing, bent(0.05), COULOMB)
    assert one.candidate.effect == COULOMB
    assert Candidate(effect=LOAD, site="shoulder") in one.others
    # Both words are about as likely, each form of one as that of the other.
    assert 0.35 * one.of_any_law < one.probability < 0.6 * one.of_any_law


def test_a_motion_is_looked_for_that_tells_which(tmp_path: Path) -> None:
    contest, best = contest_of(tmp_path, rubbing, bent(0.05), COULOMB, LOAD)
    said = next_measurement(contest, best, [(0, Candidate(effect=COULOMB, site="shoulder"), 1.0)], [])
    assert (said or "").startswith("To tell Coulomb friction from load friction at shoulder, move ")


def test_a_load_that_changes_tells_the_words_apart(tmp_path: Path) -> None:
    dry = weighed(tmp_path, rubbing, bent(1.0), COULOMB)
    assert (dry.candidate.effect, dry.others) == (COULOMB, ())
    assert dry.probability == dry.of_any_law > 0.8
    by_load = weighed(tmp_path, lambda one: changed(one, 0, friction=0.5, load=0.2), bent(1.0), LOAD)
    assert (by_load.candidate.effect, by_load.others) == (LOAD, ())


@pytest.mark.parametrize(("rise", "word"), [(0.3, COULOMB), (2.0, STRIBECK)])
def test_a_rise_at_rest_is_a_law_of_its_own_where_it_is_no_detail(rise: float, word: str, tmp_path: Path) -> None:
    one = weighed(
        tmp_path, lambda one: changed(one, 0, friction=RUBS, rise=rise, fading=0.3), commands(8.0), STRIBECK
    )
    # Both are told.
    assert one.parameters["force"].value == pytest.approx(RUBS, rel=0.1)
    assert one.candidate.effect == word
