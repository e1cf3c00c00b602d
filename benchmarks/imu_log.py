"""Make the Imu log that the reading benchmark uses: one message a sample, as a robot records it."""

import struct
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

IMU_DEFINITION = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""

PERIOD_NS = 1_000_000
START_NS = 1_700_000_000_000_000_000


def imu_numbers(messages: int) -> np.ndarray:
    """Give the 37 doubles of each message: noise in rates and accelerations, a slow turn, constant covariances."""
    rng = np.random.default_rng(1)
    numbers = np.zeros((messages, 37))
    angle = np.linspace(0.0, 20.0, messages)
    numbers[:, 2], numbers[:, 3] = np.sin(angle / 2), np.cos(angle / 2)
    for first in (4, 16, 28):
        numbers[:, [first, first + 4, first + 8]] = 1e-3
    numbers[:, 13:16] = 0.01 * rng.standard_normal((messages, 3))
    numbers[:, 25:28] = rng.standard_normal((messages, 3)) + np.array([0.0, 0.0, 9.80665])
    return numbers


def write_imu_log(path: Path, messages: int, *, jitter_ns: int = 0) -> None:
    """Write `messages` Imu messages at 1 kHz, zstd, chunk CRCs on; their stamps scatter by one sigma `jitter_ns`."""
    numbers = imu_numbers(messages)
    scatter = np.rint(jitter_ns * np.random.default_rng(5).standard_normal(messages)).astype(np.int64)
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start(profile="ros2")
        schema = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", IMU_DEFINITION.encode())
        channel = writer.register_channel("/imu", "cdr", schema)
        for index in range(messages):
            stamp = START_NS + index * PERIOD_NS + int(scatter[index])
            seconds, nanoseconds = divmod(stamp, 1_000_000_000)
            # "imu\0" is four bytes long, so the doubles start at 16 after the four bytes of the encapsulation.
            header = struct.pack("<4siII4s", b"\0\1\0\0", seconds, nanoseconds, 4, b"imu\0")
            writer.add_message(channel, stamp, header + numbers[index].tobytes(), stamp, index)
        writer.finish()
