"""What was found is confirmed by simulation, against machines that MuJoCo runs by its own drives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.forward import machine_of, simulated
from chladni.gap.robots.solved import Solved, solved
from chladni.gap.robots.tolerances import LOOP_S
from chladni.gap.robots.torques import Torques, torques_of
from chladni.gap.robots.trial import Confirmed, Trial
from chladni.robots.machine import Coupling, as_described
from chladni.robots.robot import RobotTolerance
from tests.robots.machines import (
    RATE_HZ,
    arm,
    changed,
    commands,
    course,
    joint_log_of,
    run_native,
    with_gains,
)

pytest.importorskip("mujoco")

SECONDS = 12.0
FRICTION, MASS, DELAY_S = 2.0, 1.4, 0.012


def torques(folder: Path, **machine: str) -> Torques:
    """Torques of the arm as described, by a log of a machine."""
    command = commands(SECONDS)
    position = run_native(arm(folder, "machine/arm.xml", **machine), command)
    robot = arm(folder)
    return torques_of(robot, joint_log_of(robot, position, command=command))


def found_by(one: Torques) -> Solved:
    """The whole answer."""
    return solved(one, frozenset(), lambda _: None)


def test_a_description_that_is_right_reproduces_its_log(tmp_path: Path) -> None:
    one = torques(tmp_path)
    found = simulated(as_described(one.robot), one, [(500, 1500)])
    assert np.isnan(found[:, :500]).all()
    assert np.isnan(found[:, 1500:]).all()
    # Steps are of another length than the machine's, and the start is smoothed.
    np.testing.assert_allclose(found[:, 500:1500], one.log.position[:, 500:1500], atol=1e-3)


def trial(found: Solved) -> Confirmed | None:
    """What simulation says of all that was found."""
    return Trial(torques=found.torques).of(found.best.terms)


@pytest.fixture(scope="module")
def friction_and_mass(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    """A shoulder that rubs, and a forearm that is too heavy."""
    folder = tmp_path_factory.mktemp("arm")
    return found_by(torques(folder, shoulder=f' frictionloss="{FRICTION}"', mass=f"{MASS}"))


def test_what_was_found_closes_the_gap_on_stretches_that_no_fit_saw(friction_and_mass: Solved) -> None:
    found = trial(friction_and_mass)
    assert found is not None
    assert found.held_out
    assert found.joints == ("shoulder", "elbow")
    assert found.horizon_s == pytest.approx(2.0)
    assert found.before > 0.02
    assert found.after < 0.1 * found.before
    assert (found.per_joint_after < found.per_joint_before).all()
    assert_told(found)


def assert_told(found: Confirmed) -> None:
    """The numbers are those of the positions."""
    there = found.judged
    assert 0 < np.count_nonzero(there) < there.size
    motion = np.std(found.measured[:, there], axis=1)
    errors = found.course_before.whole[:, there] - found.measured[:, there]
    np.testing.assert_allclose(found.per_joint_before, np.sqrt(np.mean(errors**2, axis=1)) / motion)
    np.testing.assert_allclose(found.motion, motion)
    assert found.before == pytest.approx(np.sqrt(np.mean(found.per_joint_before**2)))


def test_the_machine_has_the_numbers_that_were_found(friction_and_mass: Solved) -> None:
    machine = machine_of(friction_and_mass.contest, friction_and_mass.best)
    assert machine.joints[0].friction == pytest.approx(FRICTION, rel=0.1)
    assert machine.joints[1].friction < 0.1
    # The motion tells the first moment best.
    assert machine.inertial[1, 3] == pytest.approx(0.1 * MASS, rel=0.1)
    assert machine.joints[0].delay_s == 0.0


@pytest.mark.nightly
def test_a_delay_of_all_commands_and_weak_gains(tmp_path: Path) -> None:
    late = torques(tmp_path, servo=f' delay="{DELAY_S}" nsample="40"', kp="96")
    found = found_by(late)
    machine = machine_of(found.contest, found.best)
    for one in machine.joints:
        assert one.delay_s == pytest.approx(DELAY_S, abs=1e-3)
    kp, kd, _ = machine.joints[0].gains()
    assert kp == pytest.approx(96.0, rel=0.03)
    assert kd == pytest.approx(8.0, rel=0.1)
    closing = trial(found)
    assert closing is not None
    assert closing.after < 0.1 * closing.before


def test_without_a_delay_commands_wait_no_longer_than_a_loop_may(tmp_path: Path) -> None:
    contest = Contest(torques(tmp_path, servo=f' delay="{DELAY_S}" nsample="40"'))
    assert contest.tolerances(contest.nothing)["turn"][0] > 4.0
    machine = machine_of(contest, contest.nothing)
    assert all(0.0 < one.delay_s <= 3.0 * LOOP_S for one in machine.joints)


def test_tolerated_masses_are_set_in_the_sense_in_which_they_help(tmp_path: Path) -> None:
    one = torques(tmp_path, mass="1.04")
    contest = Contest(one)
    described, within = as_described(one.robot), machine_of(contest, contest.nothing)
    assert within.inertial[1, 3] == pytest.approx(0.104, rel=0.015)
    true = as_described(arm(tmp_path, "machine/arm.xml", mass="1.04"))
    courses = [simulated(each, one, [(500, 1500)])[:, 500:1500] for each in (true, described, within)]
    assert np.std(courses[2] - courses[0]) < 0.5 * np.std(courses[1] - courses[0])


def test_a_log_of_efforts_runs_in_short_windows(tmp_path: Path) -> None:
    robot = arm(tmp_path, "machine/arm.xml", shoulder=f' frictionloss="{FRICTION}"')
    command = commands(SECONDS)
    position = run_native(robot, command)
    velocity = np.gradient(position, 1.0 / RATE_HZ, axis=1)
    effort = np.array([[120.0], [60.0]]) * (command - position) - np.array([[8.0], [3.0]]) * velocity
    described = arm(tmp_path)
    one = torques_of(described, joint_log_of(described, position, effort=effort))
    found = trial(found_by(one))
    assert found is not None
    assert found.horizon_s == pytest.approx(1.0 / one.cutoff_hz, abs=1.0 / RATE_HZ)
    assert found.after < 0.3 * found.before


def test_nothing_is_run_where_the_drive_of_a_joint_is_not_known(tmp_path: Path) -> None:
    command = commands(SECONDS)
    robot = arm(tmp_path)
    log = joint_log_of(robot, run_native(robot, command), command=command)
    unknown = replace(robot.joints[1], servo=None)
    one = torques_of(replace(robot, joints=(robot.joints[0], unknown)), log)
    assert Trial(torques=one).of(()) is None


def test_a_short_log_judges_by_all_of_it_and_says_so(tmp_path: Path) -> None:
    command = commands(3.0)
    robot = arm(tmp_path)
    log = joint_log_of(robot, run_native(robot, command), command=command)
    found = Trial(torques=torques_of(robot, log)).of(())
    assert found is not None
    assert not found.held_out
    assert found.judged.all()


# What is changed, the words that say it, and whether their number is that of the machine.
LAWS = {
    "coulomb_friction": lambda one: changed(one, 0, friction=2.0),
    "viscous_friction": lambda one: changed(one, 0, damping=3.0),
    "quadratic_damping": lambda one: changed(one, 0, quadratic=1.5),
    "load_friction": lambda one: changed(one, 0, friction=0.5, load=0.2),
    "joint_spring": lambda one: changed(one, 0, stiffness=20.0, torque=4.0),
    "armature": lambda one: changed(one, 0, armature=0.5),
    "gain_error": lambda one: changed(one, 0, gain=0.8),
    "controller_gain": lambda one: with_gains(one, 0, kp=100.0, kd=12.0),
    "lag": lambda one: changed(one, 0, lag_s=0.006),
    "delay": lambda one: changed(one, 0, delay_s=0.004),
    "encoder_offset of the log": lambda one: changed(one, 0, reading=0.05),
    "encoder_offset of the drive": lambda one: changed(one, 0, drive_reading=0.05),
    "payload": lambda one: replace(one, inertial=one.inertial + np.array([np.zeros(10), POINT])),
    "gravity_tilt": lambda one: replace(one, tilt=(0.0, 0.05)),
    "coulomb_friction sum": lambda one: replace(one, couplings=(Coupling(joints=BOTH, ratio=1.0, friction=0.8),)),
    "joint_spring between": lambda one: replace(
        one, couplings=(Coupling(joints=BOTH, ratio=1.0, stiffness=15.0, torque=4.0),)
    ),
    "viscous_friction difference": lambda one: replace(
        one, couplings=(Coupling(joints=BOTH, ratio=-1.0, damping=0.8),)
    ),
}
BOTH = ("shoulder", "elbow")
#: 0.6 kg on the axis of the forearm, 0.05 m from its origin: its inertia about that, which no number says, is small.
POINT = np.array([0.6, 0.0, 0.0, 0.03, 0.0015, 0.0015, 0.0, 0.0, 0.0, 0.0])
SITES = {"payload": "fore", "gravity_tilt": "world", "coulomb_friction sum": "shoulder~elbow",
         "joint_spring between": "shoulder~elbow", "viscous_friction difference": "shoulder~elbow"}  # fmt: skip
#: Which of a word's terms it is; the variant where it isn't a ratio.
RATIOS = {"joint_spring between": 1.0}


@pytest.mark.parametrize("name", LAWS)
def test_a_word_at_its_site_is_read_as_the_law_that_made_the_log(name: str, tmp_path: Path) -> None:
    # Inertias are known, so that they take no part of what the word says.
    robot = replace(arm(tmp_path), tolerance=RobotTolerance(inertia=1e-4))
    machine, command = LAWS[name](as_described(robot)), commands(SECONDS)
    one = torques_of(robot, joint_log_of(robot, course(machine, command), command=command))
    contest = Contest(one)
    word, _, variant = name.partition(" ")
    found = [
        term for term in contest.terms
        if (term.word, term.site) == (word, SITES.get(name, "shoulder"))
        and (term.form_value == RATIOS[name] if name in RATIOS else variant == (term.variant or ""))
    ]  # fmt: skip
    read = machine_of(contest, contest.fit(found))
    for each, truth in zip(read.joints, machine.joints, strict=True):
        kp, kd, _ = truth.gains()
        assert each.gains()[:2] == (pytest.approx(kp, rel=0.03), pytest.approx(kd, rel=0.1))
        for number, size in NUMBERS.items():
            assert getattr(each, number) == pytest.approx(getattr(truth, number), rel=0.1, abs=size), number
    # An arm that moves in a plane hardly tells of the tilt across it.
    assert read.tilt[1] == pytest.approx(machine.tilt[1], abs=0.01)
    for number in ("friction", "damping", "stiffness", "torque"):
        shared = [sum(getattr(each, number) for each in one.couplings) for one in (read, machine)]
        assert shared[0] == pytest.approx(shared[1], rel=0.1), number
    # The first moments, which gravity tells best.
    np.testing.assert_allclose(read.inertial[:, 1:4], machine.inertial[:, 1:4], atol=5e-3)


#: By how much the smoothing of velocities may move what isn't there.  A loop's turn is a delay, too.
NUMBERS = {"friction": 0.05, "damping": 0.05, "quadratic": 0.05, "load": 0.02, "stiffness": 1.0, "torque": 0.3,
           "armature": 0.02, "lag_s": 5e-4, "delay_s": 1e-3, "reading": 2e-3, "drive_reading": 2e-3}  # fmt: skip
