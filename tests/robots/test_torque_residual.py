"""The torque that a description doesn't explain is what was added to the one it does."""

from pathlib import Path

import numpy as np
import pytest

from chladni.apps.live import live
from chladni.robots.dynamics import motion_torque
from chladni.robots.loading import load_robot
from tests.robots.made import ARM, JointTopic, motion, write_joints, written

RATE_HZ, SECONDS = 500.0, 12.0


def made(folder: Path, *, added: np.ndarray | None = None, with_effort: bool = True) -> tuple[Path, Path]:
    """A log of the arm in motion with the torque that it needs, and some more; and its description."""
    description = written(folder, ARM)
    robot = load_robot(description)
    position = motion(SECONDS, RATE_HZ)
    velocity = np.gradient(position, 1 / RATE_HZ, axis=1, edge_order=2)
    acceleration = np.gradient(velocity, 1 / RATE_HZ, axis=1, edge_order=2)
    effort = motion_torque(robot, position, velocity, acceleration)
    effort += np.array([[one.friction] for one in robot.joints]) * np.sign(velocity)
    if added is not None:
        effort = effort + added
    topic = JointTopic(
        "/joint_states", position, rate_hz=RATE_HZ, velocity=velocity, effort=effort if with_effort else None
    )
    return write_joints(folder / "arm.mcap", [topic]), description


def residual(log: Path, description: Path) -> dict[str, np.ndarray]:
    found: dict[str, list[np.ndarray]] = {}
    for state in live(log, robot=description, modes_every_s=0):
        for series in state.series:
            for channel, row in zip(series.channels, series.values, strict=True):
                if channel.name.startswith("torque_residual."):
                    found.setdefault(channel.name.removeprefix("torque_residual."), []).append(row)
    return {name: np.concatenate(rows) for name, rows in found.items()}


def test_a_motion_that_the_description_explains_leaves_little(tmp_path: Path) -> None:
    found = residual(*made(tmp_path))
    assert set(found) == {"shoulder", "elbow", "lift"}
    for name, values in found.items():
        # Where a joint turns round its friction changes sign within what is smoothed over.
        assert np.nanmedian(np.abs(values[20:-20])) < 0.02, name


def test_what_was_added_to_one_joint_is_its_residual(tmp_path: Path) -> None:
    samples = round(SECONDS * RATE_HZ)
    pull = np.zeros((3, samples))
    pull[1] = 0.8 * np.sin(2 * np.pi * 1.3 * np.arange(samples) / RATE_HZ)
    found = residual(*made(tmp_path, added=pull))
    expected = pull[1, -found["elbow"].size :]
    assert np.corrcoef(found["elbow"][50:-50], np.roll(pull[1], 0)[12:-12][50:-50])[0, 1] > 0.99
    assert expected.size
    assert np.nanmedian(np.abs(found["shoulder"][20:-20])) < 0.02


def test_states_without_torque_are_told_and_the_rest_goes_on(tmp_path: Path) -> None:
    log, description = made(tmp_path, with_effort=False)
    states = list(live(log, robot=description, modes_every_s=0))
    told = [event.text for state in states for event in state.events if event.kind == "note"]
    assert any("no effort of all joints" in text for text in told)
    assert states[-1].densities


def test_a_robot_file_that_isnt_there_is_refused_before_anything(tmp_path: Path) -> None:
    log, _ = made(tmp_path)
    with pytest.raises(Exception, match="nowhere"):
        next(live(log, robot=tmp_path / "nowhere.urdf"))
