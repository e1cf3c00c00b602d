"""Which motion is advised where a log leaves an answer open, and that it tells."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import sawtooth

import chladni
from chladni.cli.main import main
from chladni.gap.records.diagnosis import Candidate, Diagnosis
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.gap.robots.next_measurement import Motion, _log_of, next_measurement
from chladni.gap.robots.torques import torques_of
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from tests.gap.robots.test_diagnose import efforts
from tests.robots.machines import ARM, AS_DESCRIBED, RATE_HZ, arm, commands, joint_log_of, run_native

pytest.importorskip("mujoco")

NOISE = 1e-3
RUBS = {"shoulder": ' frictionloss="0.6"'}


def at_one_speed(seconds: float = 12.0, amplitude: float = 0.1) -> np.ndarray:
    """``[2, sample]``: a shoulder that goes back and forth at one speed, at which friction of any law is the same."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    triangle = amplitude * sawtooth(2 * np.pi * 0.25 * time_s + np.pi / 2, 0.5)
    return gaussian_filter1d(np.stack([triangle, 0.3 * np.sin(2 * np.pi * 0.4 * time_s)]), 0.05 * RATE_HZ, axis=1)


def diagnosed(robot: Robot, machine: Robot, command: np.ndarray) -> Diagnosis:
    """What is said of a log of the machine."""
    position = run_native(machine, command)
    noise = NOISE * np.random.default_rng(0).standard_normal(position.shape)
    # Loops are left out: at one speed they're a third law of the same friction.
    log = joint_log_of(robot, position + noise, command=command)
    return diagnose_robot(robot, log, leave_out=frozenset({"hysteresis"}))


def viscous(folder: Path) -> Robot:
    """A machine whose shoulder is damped more."""
    path = folder / "machine.xml"
    path.write_text(ARM.format(**AS_DESCRIBED).replace('damping="0.5"', 'damping="3.5"'))
    return load_robot(path)


def motion_of(said: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """Run the command that a sentence ends with, and read the motion: positions of both joints."""
    command = said[said.index("chladni excite") :]
    monkeypatch.chdir(folder)
    assert main(shlex.split(command)[1:]) == 0
    with chladni.open(folder / "motion.csv") as log:
        return np.asarray(log.read().values[:2])


@pytest.mark.nightly
@pytest.mark.parametrize("truth", ["coulomb_friction", pytest.param("viscous_friction", marks=pytest.mark.nightly)])
def test_the_motion_that_is_advised_tells_what_was_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, truth: str
) -> None:
    robot, rubs = arm(tmp_path, "my arm.xml"), arm(tmp_path, "machine/arm.xml", **RUBS)
    before = diagnosed(robot, rubs, at_one_speed())
    probabilities = {(one.effect, one.site): one.probability for one in before.causes}
    assert probabilities.get(("coulomb_friction", "shoulder"), 0.0) < 0.9
    said = before.next_measurement or ""
    assert said.startswith("To tell ")
    assert {"Coulomb friction", "viscous friction"} == set(re.findall(r"\w+ friction", said))
    # Moved alone, friction of the shoulder would look like that of its speed and the elbow's together.
    assert "at shoulder, move all joints: " in said
    assert said.endswith("my arm.xml' --out motion.csv")
    command = motion_of(said, tmp_path, monkeypatch)
    after = diagnosed(robot, rubs if truth == "coulomb_friction" else viscous(tmp_path), command)
    assert [(one.effect, one.site) for one in after.causes] == [(truth, "shoulder")]
    # Damping of a joint is what another kd of its servo would be, but for a number more.
    assert {one.effect for one in after.answer_set} - {truth} <= {"controller_gain"}
    assert "coulomb" not in (after.next_measurement or "")


@pytest.mark.parametrize("by_effort", [False, True])
def test_a_motion_is_laid_out_as_a_log_that_lacks_nothing(tmp_path: Path, by_effort: bool) -> None:
    robot, command = arm(tmp_path), at_one_speed(amplitude=0.5)
    position = run_native(robot, command) + NOISE * np.random.default_rng(0).standard_normal(command.shape)
    log = joint_log_of(robot, position, command=None if by_effort else command, effort=command if by_effort else None)
    torques = torques_of(robot, log)
    laid = replace(torques, log=_log_of(torques, Motion(words="").made(robot, 64.0)))
    size = np.sqrt(np.mean(laid.missing**2, axis=1))
    assert np.all(size < 0.1 * np.std(laid.wanted, axis=1))
    # Noise of the log at hand, whatever the rate.
    np.testing.assert_allclose(laid.reading_noise**2 / 64.0, NOISE**2 / RATE_HZ, rtol=0.5)
    beyond = np.full((2, laid.log.time_s.size), 0.7)
    more = replace(torques, log=_log_of(torques, Motion(words="").made(robot, 64.0), beyond))
    np.testing.assert_allclose(more.missing - laid.missing, 0.7, atol=0.01)


@pytest.mark.nightly
def test_what_is_sure_needs_no_further_motion(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    late = np.roll(commands(12.0), 3, axis=1)
    found = diagnose_robot(robot, joint_log_of(robot, run_native(robot, late), command=commands(12.0)))
    assert {(one.effect, one.site) for one in found.causes} == {("delay", "all commands")}
    assert found.next_measurement is None
    assert diagnosed(arm(tmp_path), arm(tmp_path), at_one_speed()).next_measurement is None


@pytest.mark.nightly
def test_what_no_motion_tells_is_one_answer(tmp_path: Path) -> None:
    machine = arm(tmp_path, "machine/arm.xml", mass="1.3")
    said = diagnosed(arm(tmp_path), machine, at_one_speed(4.0, 0.3)).next_measurement or ""
    assert "another value of fore.mass" in said
    assert "payload at fore" in said
    assert said.endswith("Take them as one answer.")


def test_where_no_word_explains_it_the_joint_is_moved_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, command = arm(tmp_path), at_one_speed(amplitude=0.5)
    contest = Contest(torques_of(robot, joint_log_of(robot, run_native(robot, command), command=command)))
    said = next_measurement(contest, contest.nothing, (), ["elbow"]) or ""
    assert "at elbow: move elbow alone at up to 0.1 rad/s, then with --speed 1" in said
    moved = motion_of(said, tmp_path, monkeypatch)
    assert np.ptp(moved[0]) == 0.0
    assert np.ptp(moved[1]) > 0.05
    assert next_measurement(contest, contest.nothing, (), ()) is None


def test_play_between_a_drive_and_its_joint_moves_that_joint(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), at_one_speed(6.0, amplitude=0.5)
    position = run_native(robot, command)
    # Where commands and efforts are logged, loops have rows of their own behind those of the joints.
    log = joint_log_of(robot, position, command=command, effort=efforts(command, position))
    contest = Contest(torques_of(robot, log))
    play = next(term for term in contest.terms if term.word == "backlash" and term.rows == (1, 3))
    named = [(0, Candidate(effect=play.word, site=play.site), 1.0)]
    said = next_measurement(contest, contest.fit([play]), named, ()) or ""
    assert "backlash at elbow" in said
    assert "move elbow alone" in said
