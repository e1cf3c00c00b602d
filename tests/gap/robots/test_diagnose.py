"""What is named of robots whose machines are known: MuJoCo runs them by its own drives."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.gap.robots.torques import torques_of
from chladni.gap.robots.words import ROBOT_WORDS, all_terms
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from chladni.signals.errors import LogError, ModelError, SetupError
from tests.robots.machines import ARM, AS_DESCRIBED, RATE_HZ, arm, commands, joint_log_of, run_native

pytest.importorskip("mujoco")

SECONDS = 12.0


def found_of(folder: Path, *, leave_out: frozenset[str] = frozenset(), **machine: str) -> Diagnosis:
    """The answer on a log of a machine that differs from the arm as described."""
    command = commands(SECONDS)
    position = run_native(arm(folder, "machine/arm.xml", **machine), command)
    robot = arm(folder)
    return diagnose_robot(robot, joint_log_of(robot, position, command=command), leave_out=leave_out)


def named(found: Diagnosis) -> set[tuple[str, str]]:
    """Words and sites."""
    return {(one.effect, one.site) for one in found.causes}


def test_a_robot_that_is_right_lacks_nothing(tmp_path: Path) -> None:
    found = found_of(tmp_path)
    assert found.verdict == "none"
    assert not found.causes


def test_friction_and_a_delay_are_named_with_their_sizes(tmp_path: Path) -> None:
    found = found_of(tmp_path, shoulder=' frictionloss="2"', servo=' delay="0.012" nsample="40"')
    assert named(found) == {("coulomb_friction", "shoulder"), ("delay", "all commands")}
    sizes = {one.effect: next(iter(one.parameters.values())) for one in found.causes}
    assert sizes["coulomb_friction"].value == pytest.approx(2.0, rel=0.1)
    assert sizes["delay"].value == pytest.approx(0.012, abs=1e-3)
    assert all(one.probability > 0.6 for one in found.causes)
    assert found.gap.by == "windows"
    assert found.gap.after < 0.2 * found.gap.before
    assert found.where.sites[0].name == "shoulder"


def test_gains_are_told_from_torques(tmp_path: Path) -> None:
    found = found_of(tmp_path, kp="96")
    assert ("controller_gain", "shoulder") in named(found)
    assert found.causes[0].parameters["kp"].value == pytest.approx(0.8, abs=0.04)


def test_a_heavy_forearm_is_one_of_its_own_words(tmp_path: Path) -> None:
    found = found_of(tmp_path, mass="1.6")
    names = named(found)
    assert len(names) == 1
    assert names <= {("payload", "fore"), ("parameter", "fore.mass")}


def test_less_friction_than_described_is_a_wrong_value(tmp_path: Path) -> None:
    command = commands(SECONDS)
    machine = arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="0.5"')
    robot = arm(tmp_path, "described/arm.xml", shoulder=' frictionloss="2.5"')
    log = joint_log_of(robot, run_native(machine, command), command=command)
    found = diagnose_robot(robot, log)
    assert named(found) == {("parameter", "shoulder.frictionloss")}
    assert found.verdict == "parameters"
    assert found.causes[0].parameters["value"].value == pytest.approx(0.5, abs=0.3)


@pytest.mark.nightly
def test_a_word_that_is_left_out_is_not_replaced_by_a_sure_wrong_one(tmp_path: Path) -> None:
    frictions = {word for word in ROBOT_WORDS if "friction" in word}
    found = found_of(tmp_path, shoulder=' frictionloss="2"', leave_out=frozenset(frictions | {"quadratic_damping"}))
    assert all(one.probability < 0.9 for one in found.causes)
    if found.verdict == "unknown":
        assert "shoulder" in (found.advice or "")


@pytest.mark.nightly
def test_efforts_that_were_measured_need_no_gains(tmp_path: Path) -> None:
    command = commands(SECONDS)
    position = run_native(arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="2"'), command)
    robot = without_servos(arm(tmp_path))
    found = diagnose_robot(robot, joint_log_of(robot, position, effort=efforts(command, position)))
    assert named(found) == {("coulomb_friction", "shoulder")}


def efforts(command: np.ndarray, position: np.ndarray) -> np.ndarray:
    """What the drives gave about a sample: half of the time for the command before it."""
    velocity = np.gradient(position, 1.0 / RATE_HZ, axis=1)
    asked = 0.5 * (command + np.concatenate([command[:, :1], command[:, :-1]], axis=1))
    return np.array([[120.0], [60.0]]) * (asked - position) - np.array([[8.0], [3.0]]) * velocity


def without_servos(robot: Robot) -> Robot:
    """As a URDF has it."""
    return replace(robot, joints=tuple(replace(one, servo=None) for one in robot.joints))


def test_what_can_not_be_told_is_refused_with_what_to_do(tmp_path: Path) -> None:
    command = commands(3.0)
    robot = arm(tmp_path)
    position = run_native(robot, command)
    still = np.repeat(position[:, :1], position.shape[1], axis=1)
    with pytest.raises(ModelError, match=r"no gains of its drives.*\[control\]"):
        diagnose_robot(without_servos(robot), joint_log_of(robot, still, command=command))
    with pytest.raises(LogError, match="neither commands nor measured efforts"):
        diagnose_robot(robot, joint_log_of(robot, position))
    with pytest.raises(LogError, match="record a longer one"):
        diagnose_robot(robot, joint_log_of(robot, position[:, :100], command=command[:, :100]))
    with pytest.raises(ModelError, match="no free joint carries it; give it one"):
        diagnose_robot(replace(robot, base="floating"), joint_log_of(robot, position, command=command))


def test_gains_that_nobody_says_are_fitted(tmp_path: Path) -> None:
    command = commands(SECONDS)
    position = run_native(arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="2"'), command)
    step = 2.0 * np.pi / 2**14
    robot = without_servos(arm(tmp_path))
    found = diagnose_robot(robot, joint_log_of(robot, step * np.rint(position / step), command=command))
    assert named(found) == {("coulomb_friction", "shoulder")}
    assert found.causes[0].parameters["force"].value == pytest.approx(2.0, rel=0.1)
    assert found.tuned_parameters["shoulder.kp"].value == pytest.approx(120.0, rel=0.05)
    assert found.tuned_parameters["elbow.kp"].value == pytest.approx(60.0, rel=0.05)
    assert found.tuned_parameters["elbow.kp"].nominal is None
    assert found.gap.by == "windows"


@pytest.mark.parametrize("unknown", ["command", "effort"])
def test_a_joint_whose_drive_is_not_known_takes_nothing_from_the_others(tmp_path: Path, unknown: str) -> None:
    command = commands(SECONDS)
    position = run_native(arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="2"'), command)
    robot = arm(tmp_path)
    log = joint_log_of(robot, position, command=command)
    if unknown == "command":
        messages = (log.command_messages or ())[:1]
        none = (np.zeros(0), np.zeros(0))
        log = replace(log, command=np.stack([command[0], np.full_like(command[0], np.nan)]),
                      command_messages=(*messages, none))  # fmt: skip
    else:
        log = joint_log_of(robot, position, effort=efforts(command, position))
        effort = np.array(log.effort)
        effort[1] = np.nan
        log = replace(log, effort=effort)
    found = diagnose_robot(robot, log)
    assert named(found) == {("coulomb_friction", "shoulder")}
    assert [one.name for one in found.where.channels] == ["shoulder"]
    assert any("elbow: no torque is known there" in remark for remark in found.remarks)


def test_a_gap_is_not_bridged(tmp_path: Path) -> None:
    command = commands(SECONDS)
    position = run_native(arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="2"'), command)
    robot = arm(tmp_path)
    whole = joint_log_of(robot, position, command=command)
    kept = np.r_[0:1200, 1500:3000]
    log = replace(
        whole, position=position[:, kept], command=command[:, kept], time_s=whole.time_s[kept], breaks=(1200,)
    )
    found = diagnose_robot(robot, log)
    assert named(found) == {("coulomb_friction", "shoulder")}
    assert found.causes[0].parameters["force"].value == pytest.approx(2.0, rel=0.1)


@pytest.mark.nightly
def test_any_log_that_is_long_enough_is_diagnosed(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(3.0)
    position = run_native(robot, command)
    for samples in (int(1.5 * RATE_HZ), int(1.5 * RATE_HZ) + 1, int(1.7 * RATE_HZ)):
        log = joint_log_of(robot, position[:, :samples], command=command[:, :samples])
        assert not diagnose_robot(robot, log).causes


def test_words_that_can_be_left_out_are_those_that_take_part(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(6.0)
    torques = torques_of(robot, joint_log_of(robot, run_native(robot, command), command=command))
    words = {term.word for term in all_terms(torques)} - {"parameter"}
    assert words == set(ROBOT_WORDS) - {"misalignment"}


def test_the_facade_takes_a_robot_and_its_bag(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    machine = arm(tmp_path, "machine/arm.xml", shoulder=' frictionloss="2"')
    bag = tmp_path / "arm.mcap"
    channels = [chladni.Channel(name=f"/joint_states.position[{one.name}]") for one in robot.joints]
    asked = [chladni.Channel(name=f"/joint_commands.position[{one.name}]") for one in robot.joints]
    series = [
        chladni.TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=tuple(names))
        for values, names in ((run_native(machine, command), channels), (command, asked))
    ]
    chladni.write_mcap(series, bag)
    # A word that has no column yet is one all the same.
    found = chladni.diagnose_gap(robot.description, bag, leave_out=["backlash", "hysteresis@shoulder"])
    assert named(found) == {("coulomb_friction", "shoulder")}
    assert ("hysteresis", "shoulder") not in {(one.effect, one.site) for one in found.answer_set}
    assert found.used[0].log == "arm.mcap"
    with pytest.raises(SetupError, match="one log at a time"):
        chladni.diagnose_gap(robot.description, [bag, bag])
    with pytest.raises(SetupError, match="no effect 'coulomb' of a robot"):
        chladni.diagnose_gap(robot.description, bag, leave_out=["coulomb"])
    with pytest.raises(SetupError, match=r"no payload at 'shoulder' to leave out; sites: fore, upper"):
        chladni.diagnose_gap(robot.description, bag, leave_out=["payload@shoulder"])
    with pytest.raises(SetupError, match="commands of a robot are always held"):
        chladni.diagnose_gap(robot.description, bag, join="hold")


def test_a_word_may_be_left_out_at_one_site(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(3.0)
    torques = torques_of(robot, joint_log_of(robot, run_native(robot, command), command=command))
    sites = [
        {term.site for term in all_terms(torques, left_out) if term.word == "armature"}
        for left_out in (frozenset[str](), frozenset({"armature@elbow"}), frozenset({"armature"}))
    ]
    assert sites == [{"shoulder", "elbow"}, {"shoulder"}, set()]


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
def test_damping_that_a_machine_has_none_of_is_a_wrong_value(tmp_path: Path, seed: int) -> None:
    machine = tmp_path / "machine" / "arm.xml"
    machine.parent.mkdir()
    machine.write_text(ARM.format(**AS_DESCRIBED).replace('damping="0.5"', 'damping="0"'))
    command = commands(SECONDS)
    position = run_native(load_robot(machine), command)
    # Where readings would have it rather negative, none is what's left of it.
    noise = 2e-5 * np.random.default_rng(seed).standard_normal(position.shape)
    found = diagnose_robot(arm(tmp_path), joint_log_of(arm(tmp_path), position + noise, command=command))
    assert [(one.effect, one.site) for one in found.causes] == [("parameter", "shoulder.damping")]
    value = found.causes[0].parameters["value"]
    assert value.nominal == 0.5
    assert value.value == pytest.approx(0.0, abs=max(3.0 * value.std, 0.1))


def test_a_log_that_was_cut_short_is_told_so(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(1.0)
    log = replace(joint_log_of(robot, command, command=command), damage=("the file ends within a chunk",))
    with pytest.raises(LogError, match=r"without a gap \(the file ends within a chunk\); record a longer one"):
        diagnose_robot(robot, log)
