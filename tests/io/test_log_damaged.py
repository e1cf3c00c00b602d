"""Damaged logs: whatever the bytes are, reading ends in samples or in one clear error."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from chladni.io.log import open_log
from chladni.signals.errors import ChladniError
from tests.make_logs import (
    IMU,
    JOINT_STATE,
    SAMPLE_BLOCK,
    SENSOR_ACCEL_FIFO,
    START_NS,
    LogMaker,
    accel_fifo,
    imu,
    joint_state,
    sample_block,
)


@pytest.fixture(scope="module")
def sound_log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A log of every kind of message, without checksums, so that damage reaches the messages."""
    path = tmp_path_factory.mktemp("sound") / "a.mcap"
    rng = np.random.default_rng(0)
    with LogMaker(path, compression="none", chunk_size=4000, enable_crcs=False) as maker:
        channels = (
            maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU),
            maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE),
            maker.ros2("/daq", "daq_msgs/msg/SampleBlock", SAMPLE_BLOCK),
            maker.ros2("/fifo", "px4_msgs/msg/SensorAccelFifo", SENSOR_ACCEL_FIFO),
            maker.json("/json"),
        )
        for index in range(30):
            stamp_ns = START_NS + index * 10_000_000
            raw = rng.integers(-99, 99, (3, 8))
            contents = (
                imu(stamp_ns, rng.standard_normal(3)),
                joint_state(stamp_ns, ["a", "b"], rng.standard_normal(2)),
                sample_block(stamp_ns, 800.0, ["u", "v"], rng.standard_normal((2, 8))),
                accel_fifo(index * 1000 + 5000, raw, dt_us=125.0, scale=0.1),
                {"timestamp": stamp_ns / 1e9, "v": index, "parts": [{"x": 1}, {"x": 2}]},
            )
            for channel, content in zip(channels, contents, strict=True):
                maker.write(channel, content, stamp_ns + 1_000_000)
    return path.read_bytes()


PATHS = [["/imu.linear_acceleration.x"], ["/joints.position[b]"], ["/daq.u"], ["/fifo.y"], ["/json.parts[1].x"]]


def read_all(path: Path) -> None:
    """Everything a user could ask for; only errors of our own may come out."""
    with suppress(ChladniError), open_log(path) as log:
        with suppress(ChladniError):
            assert all(series.samples for series in log.read_groups())
        for paths in PATHS:
            with suppress(ChladniError):
                log.read(paths, start_s=0.1)
            with suppress(ChladniError):
                assert all(block.samples for block in log.blocks(paths, seconds=0.05))
        with suppress(ChladniError):
            assert log.info().to_json()["format"] == "chladni.info/1"


def test_the_sound_log_is_read(sound_log: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(sound_log)
    with open_log(tmp_path / "a.mcap") as log:
        for paths in PATHS:
            assert log.read(paths).samples >= 30
        assert log.info().damage == ()


@pytest.mark.parametrize("seed", range(6))
def test_damage_never_crashes(sound_log: bytes, tmp_path: Path, seed: int) -> None:
    """A few logs, read in every way; tests/fuzz reads thousands."""
    rng = np.random.default_rng(seed)
    content = bytearray(sound_log)
    for _ in range(int(rng.integers(1, 30))):
        place = int(rng.integers(8, len(content)))
        length = int(rng.integers(1, 9))
        content[place : place + length] = rng.bytes(length) if rng.random() < 0.7 else b"\xff" * length
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content)
    read_all(path)
