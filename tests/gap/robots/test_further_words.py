"""Laws with a number that isn't linear: made by the engine that runs machines, with encoders of 16 bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.gap.robots.torques import torques_of
from chladni.robots.machine import Coupling, Loop, Machine, Ripple, Stop, Transmission, Uneven, as_described
from chladni.viewers.gap_summary import headline
from tests.robots.machines import RATE_HZ, arm, changed, commands, course, joint_log_of

pytest.importorskip("mujoco")

STEP = 2.0 * np.pi / 2**16
SECONDS = 12.0


def motor(**numbers: float) -> Transmission:
    """A motor that runs ahead of its link, on which the encoder sits."""
    return Transmission(**{"stiffness": np.inf, "gap": 0.0, "inertia": 0.2, "logs_motor": False} | numbers)


# What is changed at the shoulder, and the number that tells it.
LAWS = {
    "hysteresis": (lambda one: changed(one, 0, loop=Loop(force=5.0, yields=0.15)), "yield", 0.15),
    "ripple": (lambda one: changed(one, 0, ripple=Ripple(sine=3.0, cosine=1.0, period=0.4)), "period", 0.4),
    "one_sided_stop": (
        lambda one: changed(one, 0, stops=(Stop(stiffness=60.0, clearance=0.3, side=1.0),)), "clearance", 0.3,
    ),
    "dead_zone": (lambda one: changed(one, 0, dead=3.0), "width", 3.0),
    "rate_limit": (lambda one: changed(one, 0, rate=2.5), "rate", 2.5),
    "backlash": (lambda one: changed(one, 0, transmission=motor(gap=0.1)), "gap", 0.1),
    "joint_elasticity": (lambda one: changed(one, 0, transmission=motor(stiffness=400.0)), "stiffness", 400.0),
}  # fmt: skip


# How each is read, test_forward holds for all of them.
@pytest.mark.parametrize(
    "word",
    [word if word == "dead_zone" else pytest.param(word, marks=pytest.mark.nightly) for word in LAWS],
)
def test_a_law_is_named_with_its_number(word: str, tmp_path: Path) -> None:
    change, name, value = LAWS[word]
    robot, command = arm(tmp_path), commands(SECONDS)
    found = diagnose_robot(robot, joint_log_of(robot, read(change(as_described(robot)), command), command=command))
    assert [(one.effect, one.site) for one in found.causes] == [(word, "shoulder")]
    assert found.causes[0].probability > 0.6
    assert found.causes[0].parameters[name].value == pytest.approx(value, rel=0.15)
    assert found.gap.after < 0.5 * found.gap.before


@pytest.mark.nightly
def test_elasticity_is_told_where_the_log_reads_the_motor(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    machine = changed(as_described(robot), 0, transmission=motor(stiffness=400.0, logs_motor=True))
    found = diagnose_robot(robot, joint_log_of(robot, read(machine, command), command=command))
    assert [(one.effect, one.site) for one in found.causes] == [("joint_elasticity", "shoulder")]
    assert found.causes[0].parameters["stiffness"].value == pytest.approx(400.0, rel=0.15)


@pytest.mark.nightly
def test_a_loop_that_yields_with_its_motor_is_held_to_no_limit(tmp_path: Path) -> None:
    # Where the link is, its loop would ask for twice as much as the drive can give, and as the motor was ever asked.
    robot, command = arm(tmp_path), commands(SECONDS)
    position = read(changed(as_described(robot), 0, transmission=motor(stiffness=100.0)), command)
    log = joint_log_of(robot, position, command=command)
    free = torques_of(robot, log)
    shoulder = robot.joints[0]
    assert shoulder.servo is not None
    limit = 1.1 * float(np.max(np.abs(free.wanted[0])))
    assert np.max(np.abs(free.fast_served[0])) > 2.0 * limit
    limited = replace(shoulder, servo=replace(shoulder.servo, limit=limit))
    torques = torques_of(replace(robot, joints=(limited, *robot.joints[1:])), log)
    contest = Contest(torques)
    (spring,) = (
        one for one in contest.terms
        if (one.word, one.site, one.variant) == ("joint_elasticity", "shoulder", "encoder at the link")
    )  # fmt: skip
    fit = contest.fit([spring])
    assert fit.left.over_noise[0] < 1.0
    assert 1.0 / fit.values(0)[0][0] == pytest.approx(100.0, rel=0.1)


@pytest.mark.nightly
def test_a_spring_over_two_joints_is_told_at_both(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    cable = Coupling(joints=("shoulder", "elbow"), ratio=0.7, stiffness=25.0, torque=2.0)
    position = read(replace(as_described(robot), couplings=(cable,)), command)
    found = diagnose_robot(robot, joint_log_of(robot, position, command=command))
    assert [(one.effect, one.site) for one in found.causes] == [("joint_spring", "shoulder~elbow")]
    for name, value in (("stiffness", 25.0), ("ratio", 0.7), ("rest", -2.0 / 25.0)):
        assert found.causes[0].parameters[name].value == pytest.approx(value, rel=0.05)
    told = f"{found.causes[0].parameters['stiffness'].value:.4f}"
    assert f"shoulder with elbow has a spring of {told} " in headline(found)
    assert "over shoulder and 0.7" in headline(found)
    assert "times elbow, at rest at -" in headline(found)


@pytest.mark.nightly
def test_friction_that_changes_along_the_way_is_told_at_its_ends(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    rubs = Uneven(places=(-1.0, 0.0, 1.0), beyond=(3.0, 0.0, -3.0))
    machine = changed(as_described(robot), 0, friction=4.0, uneven=rubs)
    position = read(machine, command)
    found = diagnose_robot(robot, joint_log_of(robot, position, command=command))
    assert [(one.effect, one.site) for one in found.causes] == [("coulomb_friction", "shoulder")]
    low, high = position[0].min(), position[0].max()
    told = found.causes[0].parameters
    for name, place in (("force", 0.5 * (low + high)), ("at_lowest", low), ("at_highest", high)):
        there = 4.0 + np.interp(place, rubs.places, rubs.beyond)
        assert told[name].value == pytest.approx(there, abs=3.0 * told[name].std)
    assert found.gap.after < 0.5 * found.gap.before


def read(machine: Machine, command: np.ndarray) -> np.ndarray:
    """What the encoders say."""
    return STEP * np.rint(course(machine, command) / STEP)


@pytest.mark.nightly
def test_a_push_is_told_with_its_joint_and_time(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    time_s = np.arange(command.shape[1]) / RATE_HZ
    drives = as_described(robot)
    # A push on the elbow is what a command would do that moves by as much.
    pushed = command + 0.1 * np.stack([0.0 * time_s, np.exp(-(((time_s - 6.0) / 0.15) ** 2))])
    found = diagnose_robot(robot, joint_log_of(robot, read(drives, pushed), command=command))
    (cause,) = found.causes
    assert (found.verdict, cause.effect, cause.site) == ("unknown", "external_force", robot.joint("elbow").link)
    assert headline(found).startswith(f"Something pushes {cause.site} from 5.")
    (when,) = found.where.times
    for start, end in ((cause.parameters["start"].value, cause.parameters["end"].value), (when.start_s, when.end_s)):
        assert 5.2 < start < 6.0 < end < 6.8
    # 0.1 rad of the elbow's servo.
    assert cause.parameters["torque"].value == pytest.approx(6.0, rel=0.3)
    other = diagnose_robot(
        robot, joint_log_of(robot, read(drives, pushed), command=command), leave_out=frozenset({"external_force"})
    )
    assert not any(one.effect == "external_force" for one in other.causes)


def test_a_pause_of_the_loop_is_no_delay(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    late = changed(changed(as_described(robot), 0, delay_s=5e-4), 1, delay_s=5e-4)
    found = diagnose_robot(robot, joint_log_of(robot, read(late, command), command=command))
    assert found.verdict == "none"
