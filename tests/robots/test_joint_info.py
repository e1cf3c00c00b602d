"""What a log can tell of a robot, in findings, in the table and in the document."""

from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.robots.joint_info import RobotLogInfo, encoder_resolution, robot_info
from tests.cli.conftest import Run, run  # noqa: F401  # a fixture
from tests.robots.made import ARM, JOINTS, URDF, JointTopic, motion, write_joints, written

pytest.importorskip("mujoco")

RATE_HZ = 200.0
STEP = 2 * np.pi / 4096
JOINT_KEYS = {
    "name", "link", "unit", "matched", "motion", "resolution", "still", "commanded", "effort", "servo", "kp", "kd",
}  # fmt: skip


def encoded(position: np.ndarray, step: float = STEP) -> np.ndarray:
    """Positions as an encoder reads them."""
    return np.round(position / step) * step


def states(**changes) -> JointTopic:
    position = changes.pop("position", encoded(motion(5, RATE_HZ, delay_s=0.02)))
    return JointTopic("/joint_states", position, rate_hz=RATE_HZ, **changes)


def commands(**changes) -> JointTopic:
    return JointTopic("/joint_commands", motion(5, RATE_HZ), rate_hz=RATE_HZ, **changes)


def told(folder: Path, topics, text: str = ARM) -> RobotLogInfo:
    name = "arm.xml" if "<mujoco" in text else "arm.urdf"
    with chladni.open(write_joints(folder / "log.mcap", topics)) as log:
        return robot_info(chladni.load_robot(written(folder, text, name)), log)


def findings(found: RobotLogInfo) -> str:
    return "\n".join(found.findings)


@pytest.mark.parametrize("bits", [10, 12, 14, 17])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_the_step_of_an_encoder_is_found_in_its_samples(bits: int, kind: type) -> None:
    step = 2 * np.pi / 2**bits
    position = encoded(motion(20, 500.0)[0], step).astype(kind).astype(np.float64)
    assert encoder_resolution(position) == pytest.approx(step, rel=1e-2)


def test_positions_on_no_lattice_have_no_step() -> None:
    noise = 1e-4 * np.random.default_rng(2).standard_normal((3, 4000))
    for row in motion(8, 500.0) + noise:
        assert encoder_resolution(row) is None
    assert encoder_resolution(np.zeros(100)) is None


def test_what_a_whole_log_of_a_known_robot_tells(tmp_path: Path) -> None:
    effort = motion(5, RATE_HZ)
    found = told(tmp_path, [states(effort=effort), commands()])
    assert [one.matched for one in found.joints] == [True] * 3
    assert [one.gains for one in found.joints] == ["kp 80, kd 4", "kp 200, kd 8", "effort"]
    assert [one.still for one in found.joints] == [False] * 3
    for one in found.joints:
        assert one.resolution == pytest.approx(STEP, rel=1e-6)
        assert one.commanded
        assert one.effort
    assert [one.unit for one in found.joints] == ["rad", "rad", "m"]


def test_positions_alone_tell_how_the_robot_moves_and_no_more(tmp_path: Path) -> None:
    assert "neither efforts nor commands" in findings(told(tmp_path, [states()]))


def test_without_efforts_and_gains_forces_are_told_less_well(tmp_path: Path) -> None:
    text = findings(told(tmp_path, [states(), commands()], URDF))
    assert "shoulder, elbow, lift: gains aren't known" in text
    assert "[control] of a robot file" in text
    # With gains of the description nothing is fitted.
    assert "lift: gains aren't known" in findings(told(tmp_path, [states(), commands()]))
    assert "shoulder" not in findings(told(tmp_path, [states(), commands()]))


def test_efforts_stand_in_for_gains(tmp_path: Path) -> None:
    text = findings(told(tmp_path, [states(effort=motion(5, RATE_HZ)), commands()], URDF))
    assert "torques are taken from the efforts" in text
    assert "no efforts" not in text


def test_joints_that_hardly_move_are_told(tmp_path: Path) -> None:
    position = motion(5, RATE_HZ, delay_s=0.02)
    position[0] *= 5 * STEP
    position[1] = 0.3
    found = told(tmp_path, [states(position=encoded(position)), commands()])
    assert [one.still for one in found.joints] == [True, True, False]
    assert "shoulder, elbow: hardly any motion against the encoder's steps" in findings(found)
    still = told(tmp_path, [states(position=np.full((3, 1000), 0.3)), commands()])
    assert "no joint moves enough" in findings(still)


def test_names_that_nearly_match_are_told_on_both_sides(tmp_path: Path) -> None:
    found = told(tmp_path, [states(names=["shoulder", "elbow_joint", "gripper"])])
    text = findings(found)
    assert "joint elbow isn't in /joint_states; is it elbow_joint there? Rename one of them" in text
    assert "joint lift isn't in /joint_states; it counts as at rest" in text
    assert "gripper: no joint of arm is called so" in text


def test_a_floating_base_is_told(tmp_path: Path) -> None:
    afloat = ARM.replace('<body name="base">', '<body name="base"><freejoint/>')
    assert "record its IMU, and name it as imu in [log] of a robot file" in findings(
        told(tmp_path, [states()], afloat)
    )


# --- the command ---


def test_info_tells_what_matches_in_a_table_and_a_document(run: Run, tmp_path: Path) -> None:  # noqa: F811
    log = write_joints(tmp_path / "log.mcap", [states(names=["shoulder", "elbow", "hand"]), commands()])
    robot = written(tmp_path, ARM)
    outcome = run("info", log, "--robot", robot, "--json", tmp_path / "info.json")
    assert outcome.code == 0
    assert "arm: 2 of 3 joints; states /joint_states 200 Hz; position commands /joint_commands 200 Hz" in outcome.out
    assert "not in the log" in outcome.out
    document = run("info", log, "--robot", robot, "--json", "-").document["robot"]
    assert set(document) == {
        "name", "base", "state", "command", "command_kind", "effort_kind", "state_rate_hz", "command_rate_hz",
        "imu", "samples", "stretches", "joints", "unknown", "findings",
    }  # fmt: skip
    assert (document["state"], document["command"], document["unknown"]) == (
        "/joint_states",
        "/joint_commands",
        ["hand"],
    )
    assert [set(one) for one in document["joints"]] == [JOINT_KEYS] * 3
    assert [one["name"] for one in document["joints"] if one["matched"]] == [*JOINTS[:2]]
    assert document["joints"][0]["kp"] == 80.0


def test_topics_can_be_named_and_need_a_robot(run: Run, tmp_path: Path) -> None:  # noqa: F811
    log = write_joints(tmp_path / "log.mcap", [states(), commands()])
    robot = written(tmp_path, ARM)
    outcome = run("info", log, "--robot", robot, "--state", "/joint_commands", "--command", "/joint_states")
    assert "states /joint_commands" in outcome.out
    outcome = run("info", log, "--state", "/joint_states")
    assert outcome.code == 2
    assert "--robot FILE" in outcome.err


def test_what_is_wrong_with_a_robot_is_one_line(run: Run, tmp_path: Path) -> None:  # noqa: F811
    log = write_joints(tmp_path / "log.mcap", [states()])
    outcome = run("info", log, "--robot", tmp_path / "gone.xml")
    assert outcome.code == 2
    assert outcome.err.strip().endswith("gone.xml: no such file")


# --- measured ones ---


@pytest.mark.parametrize(
    ("robot", "log", "joints", "commanded", "step"),
    [
        ("go2_fixed.xml", "go2_pace_iit.mcap", 12, "/joint_commands", None),
        ("so101.urdf", "so101_sage_multisine.mcap", 6, "/joint_commands", 2 * np.pi / 4096),
        ("so101.urdf", "so101_sage_friction_gravity.mcap", 6, "/joint_commands", 2 * np.pi / 4096),
        ("so101.urdf", "so101_sage_single_joint_elbow.mcap", 6, "/joint_commands", 2 * np.pi / 4096),
        ("tx40.urdf", "tx40.mcap", 6, None, None),
    ],
)
def test_measured_robots_are_matched(
    shared_data: Path, robot: str, log: str, joints: int, commanded: str | None, step: float | None
) -> None:
    folder = shared_data / "robots"
    if not folder.is_dir():
        pytest.skip(f"measured robots not found in {folder}")
    with chladni.open(folder / log) as opened:
        found = robot_info(chladni.load_robot(folder / robot), opened)
    assert len(found.log.joints) == len(found.joints) == joints
    assert (found.log.state_topic, found.log.command_topic) == ("/joint_states", commanded)
    assert np.isfinite(found.log.position).all()
    assert found.log.breaks == ()
    if step is not None:
        elbow = next(one for one in found.joints if one.joint.name == "elbow_flex")
        assert elbow.resolution == pytest.approx(step, rel=1e-2)


def test_an_iiwa_without_its_meshes_is_loaded(shared_data: Path) -> None:
    path = shared_data / "robots" / "iiwa14.xml"
    if not path.is_file():
        pytest.skip(f"no {path}")
    robot = chladni.load_robot(path)
    assert [one.servo.kp for one in robot.joints] == [2000.0] * 7
    assert [one.servo.kd for one in robot.joints] == [200.0] * 7
