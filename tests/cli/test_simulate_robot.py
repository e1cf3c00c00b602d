"""``chladni simulate ROBOT --log LOG``: a robot as described, run by the commands of a log."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import chladni
from tests.cli.conftest import Run
from tests.robots.machines import RATE_HZ, arm, commands, run_native
from tests.robots.made import JointTopic, write_joints

pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
NAMES = ("shoulder", "elbow")


@dataclass(frozen=True)
class Made:
    """A description, and the log of a machine."""

    description: Path
    log: Path
    position: np.ndarray


def made(folder: Path, **machine: str) -> Made:
    command = commands(4.0)
    position = run_native(arm(folder, "machine/arm.xml", **machine), command)
    arm(folder)
    topics = [
        JointTopic("/joint_states", position, rate_hz=RATE_HZ, names=NAMES),
        JointTopic("/joint_commands", command, rate_hz=RATE_HZ, names=NAMES),
    ]
    return Made(folder / "arm.xml", write_joints(folder / "arm.mcap", topics), position)


def test_a_machine_as_described_reads_what_is_simulated(run: Run, tmp_path: Path) -> None:
    right = made(tmp_path)
    outcome = run("simulate", right.description, "--log", right.log, "--out", tmp_path / "sim.mcap", "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["robot"], document["driven_by"]) == ("chladni.simulate/1", "arm", "arm.mcap")
    assert document["runs"] == 1
    # A thousandth: MuJoCo's own step, and where within a sample the log's first pose was.
    for one, measured in zip(document["joints"], right.position, strict=True):
        assert one["motion"] == pytest.approx(np.std(measured), rel=1e-6)
        assert one["error"] < 0.01 * one["motion"]
    with chladni.open_log(tmp_path / "sim.mcap") as simulated, chladni.open_log(right.log) as measured:
        paths = [f"/joint_states.position[{row}]" for row in range(2)]
        ours, theirs = simulated.read(paths), measured.read(paths)
        assert ours.start_time_ns == theirs.start_time_ns
        np.testing.assert_allclose(ours.values, theirs.values, atol=0.02)


def test_what_a_machine_has_beyond_shows_as_error(run: Run, tmp_path: Path) -> None:
    rubs = made(tmp_path, shoulder=' frictionloss="6"')
    asked = ("simulate", rubs.description, "--log", rubs.log, "--out", tmp_path / "sim.mcap")
    shoulder, elbow = (one["error"] / one["motion"] for one in run(*asked, "--json", "-").document["joints"])
    # A servo of 120 N m/rad gives way by 50 mrad before 6 N m yield.
    assert shoulder > 0.05
    assert elbow < 0.5 * shoulder
    outcome = run(*asked)
    assert "one run from the log's first pose" in outcome.out
    told = next(line for line in outcome.out.splitlines() if line.startswith("shoulder"))
    assert "mrad" in told


def test_what_has_no_meaning_for_a_robot_is_refused(run: Run, tmp_path: Path) -> None:
    right = made(tmp_path)
    out = ("--out", tmp_path / "sim.mcap")
    assert "give one with --log" in run("simulate", right.description, *out).err
    for option, value in (("--seconds", "3"), ("--rate", "500"), ("--noise", "0.1"), ("--set", "elbow.damping=2")):
        refused = run("simulate", right.description, "--log", right.log, option, value, *out)
        assert refused.code == 2
        assert f"{option} has no meaning for a robot" in refused.err
        assert not (tmp_path / "sim.mcap").exists()
    model = run("simulate", "structure", "--state", "/joint_states", *out)
    assert "--state and --command name topics of a robot's joints" in model.err


def test_a_robot_whose_drives_nobody_knows_is_refused(run: Run, tmp_path: Path) -> None:
    right = made(tmp_path)
    bare = right.description.read_text()
    first, last = bare.index("<actuator>"), bare.index("</actuator>") + len("</actuator>")
    right.description.write_text(bare[:first] + bare[last:])
    outcome = run("simulate", right.description, "--log", right.log, "--out", tmp_path / "sim.mcap")
    assert outcome.code == 2
    assert "nothing tells the torque of shoulder, elbow; give kp and kd in [control] of a robot file" in outcome.err
