"""What pictures of robots are made from, against a machine whose friction is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.gap.robots.pictures import joint_motion
from chladni.gap.robots.torques import torques_of
from tests.robots.machines import RATE_HZ, arm, commands, joint_log_of, run_native

pytest.importorskip("mujoco")

SECONDS, FRICTION, DAMPING, DELAY_S = 12.0, 2.0, 0.5, 0.012


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """Of an arm whose shoulder rubs, and whose commands arrive late."""
    folder = tmp_path_factory.mktemp("arm")
    command = commands(SECONDS)
    machine = arm(folder, "machine/arm.xml", shoulder=f' frictionloss="{FRICTION}"',
                  servo=f' delay="{DELAY_S}" nsample="40"')  # fmt: skip
    robot = arm(folder)
    return diagnose_robot(robot, joint_log_of(robot, run_native(machine, command), command=command))


def test_a_friction_map_shows_the_friction_with_the_described_one_and_nothing_of_a_delay(found: Diagnosis) -> None:
    one = next(each for each in found.torque_maps if (each.site, each.over) == ("shoulder", "velocity"))
    assert one.is_named
    assert one.law is not None
    fast = np.abs(one.centre) > 0.3
    truth = FRICTION * np.sign(one.centre) + DAMPING * one.centre
    np.testing.assert_allclose(one.mean[fast], truth[fast], rtol=0.1)
    np.testing.assert_allclose(one.law[fast], truth[fast], rtol=0.1)
    np.testing.assert_allclose(one.described[fast], (DAMPING * one.centre)[fast], atol=0.02)
    assert (one.error > 0).all()
    # Bins hold one direction each.
    assert one.centre.size >= 8
    assert one.motion_unit == "rad/s"


def test_nothing_is_left_over_the_position(found: Diagnosis) -> None:
    one = next(each for each in found.torque_maps if (each.site, each.over) == ("shoulder", "position"))
    assert one.law is None
    assert not one.is_named
    assert np.max(np.abs(one.mean)) < 0.2 * FRICTION
    assert (np.diff(one.centre) > 0).all()


def test_the_motion_is_measured_and_simulated_at_50_hz(found: Diagnosis) -> None:
    motion = found.motion
    assert motion is not None
    assert motion.before is not None
    assert motion.after is not None
    assert motion.time_s.size == pytest.approx(50 * SECONDS, rel=0.01)
    assert not motion.gaps
    errors = [np.sqrt(np.mean((one - motion.measured) ** 2)) for one in (motion.before, motion.after)]
    assert errors[1] < 0.3 * errors[0]


def test_torques_are_on_the_time_of_the_log(found: Diagnosis) -> None:
    signals = found.signals
    assert signals is not None
    first_s, end_s = signals.span_s
    # Both ends go to the filter.
    assert first_s == pytest.approx(3 / 8, abs=0.01)
    assert end_s == pytest.approx(SECONDS - 3 / 8, abs=0.05)
    left = np.std(signals.measured - signals.after, axis=1)
    assert left[0] < 0.3 * np.std(signals.measured - signals.before, axis=1)[0]


def test_gaps_of_the_log_are_told(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(SECONDS)
    log = joint_log_of(robot, run_native(robot, command), command=command)
    cut = round(5 * RATE_HZ)
    later = replace(
        log, time_s=np.where(np.arange(log.time_s.size) < cut, log.time_s, log.time_s + 2.0), breaks=(cut,)
    )
    motion = joint_motion(torques_of(robot, later), None, named=False)
    assert (motion.before, motion.after) == (None, None)
    (last,) = motion.gaps
    assert motion.time_s[last] == pytest.approx(5.0, abs=0.03)
    assert motion.time_s[last + 1] == pytest.approx(7.0, abs=0.03)
