"""Small MCAP logs made with the mcap library, whose content is known."""

import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic

START_NS = 1_700_000_000_000_000_000
RATE_HZ = 100.0

_SEPARATOR = "=" * 80
_HEADER = f"""{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR3 = f"""{_SEPARATOR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
IMU = f"""std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{_HEADER}{_VECTOR3}{_SEPARATOR}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
ACCEL_STAMPED = f"""std_msgs/Header header
geometry_msgs/Accel accel
{_HEADER}{_VECTOR3}{_SEPARATOR}
MSG: geometry_msgs/Accel
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
"""
JOINT_STATE = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""
SAMPLE_BLOCK = f"""std_msgs/Header header
float64 sample_rate
string[] channel_names
float32[] samples
{_HEADER}"""
SENSOR_ACCEL_FIFO = """uint64 timestamp
uint64 timestamp_sample
uint32 device_id
float32 dt
float32 scale
uint8 samples
int16[32] x
int16[32] y
int16[32] z
"""
FLOAT64 = "float64 data\n"


class LogMaker:
    """Writes one log; a context manager.

    Parameters
    ----------
    path
        The file.
    compression
        ``zstd``, ``lz4`` or ``none``.
    chunk_size
        Bytes after which a chunk is closed; small ones make many batches.
    """

    def __init__(self, path: Path, *, compression: str = "zstd", chunk_size: int = 16_384, **options: Any) -> None:
        kind = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "none": CompressionType.NONE}[compression]
        self.path = path
        self._file = path.open("wb")
        self._writer = Writer(self._file, compression=kind, chunk_size=chunk_size, **options)
        self._writer.start()
        self._encoders: dict[int, Any] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.finish()
        self._file.close()

    def ros2(self, topic: str, datatype: str, definition: str, metadata: Mapping[str, str] | None = None) -> int:
        """Register a ROS 2 topic and give its channel id; register it again for a second channel on the topic."""
        schema = self._writer.register_schema(datatype, "ros2msg", definition.encode())
        channel = self._writer.register_channel(topic, "cdr", schema, dict(metadata or {}))
        self._encoders[channel] = serialize_dynamic(datatype, definition)[datatype]
        return channel

    def json(self, topic: str, schema: Mapping[str, Any] | None = None) -> int:
        """Register a JSON topic, with or without schema, and give its channel id."""
        number = 0
        if schema is not None:
            number = self._writer.register_schema("json", "jsonschema", json.dumps(schema).encode())
        channel = self._writer.register_channel(topic, "json", number)
        self._encoders[channel] = lambda message: json.dumps(message).encode()
        return channel

    def raw(self, topic: str, *, encoding: str, schema: tuple[str, str, bytes] | None = None) -> int:
        """Register a topic whose messages are given as bytes."""
        number = self._writer.register_schema(*schema) if schema is not None else 0
        channel = self._writer.register_channel(topic, encoding, number)
        self._encoders[channel] = bytes
        return channel

    def write(
        self,
        channel: int,
        message: Any,
        log_time_ns: int,
        *,
        publish_time_ns: int | None = None,
        sequence: int = 0,
    ) -> None:
        """Write one message: a mapping for ROS 2 and JSON, bytes for raw topics."""
        self._writer.add_message(
            channel,
            log_time_ns,
            self._encoders[channel](message),
            log_time_ns if publish_time_ns is None else publish_time_ns,
            sequence,
        )


def header(stamp_ns: int, frame_id: str = "") -> dict[str, Any]:
    """A std_msgs/Header."""
    return {"stamp": {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9}, "frame_id": frame_id}


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict[str, float]:
    """A geometry_msgs/Vector3."""
    return {"x": float(x), "y": float(y), "z": float(z)}


def imu(stamp_ns: int, linear: Sequence[float], angular: Sequence[float] = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    """A sensor_msgs/Imu."""
    return {
        "header": header(stamp_ns),
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        "orientation_covariance": [0.0] * 9,
        "angular_velocity": vector(*angular),
        "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": vector(*linear),
        "linear_acceleration_covariance": [0.0] * 9,
    }


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float] = (),
    effort: Sequence[float] = (),
) -> dict[str, Any]:
    """A sensor_msgs/JointState."""
    return {
        "header": header(stamp_ns),
        "name": list(names),
        "position": list(position),
        "velocity": list(velocity),
        "effort": list(effort),
    }


def sample_block(stamp_ns: int, rate_hz: float, names: Sequence[str], samples: np.ndarray) -> dict[str, Any]:
    """A block of samples ``[channel, sample]``, channel after channel."""
    return {
        "header": header(stamp_ns),
        "sample_rate": rate_hz,
        "channel_names": list(names),
        "samples": np.asarray(samples, np.float32).reshape(-1).tolist(),
    }


def accel_fifo(stamp_us: int, samples: np.ndarray, *, dt_us: float, scale: float) -> dict[str, Any]:
    """A px4_msgs/SensorAccelFifo with raw samples ``[axis, sample]``, at most 32 of them."""
    padded = np.zeros((3, 32), np.int16)
    padded[:, : samples.shape[1]] = samples
    return {
        "timestamp": stamp_us + 50,
        "timestamp_sample": stamp_us,
        "device_id": 7,
        "dt": dt_us,
        "scale": scale,
        "samples": samples.shape[1],
        "x": padded[0].tolist(),
        "y": padded[1].tolist(),
        "z": padded[2].tolist(),
    }


def write_imu_log(
    path: Path,
    linear: np.ndarray,
    *,
    rate_hz: float = 200.0,
    topic: str = "/imu",
    start_ns: int = START_NS,
    late_ns: int = 2_000_000,
    **options: Any,
) -> np.ndarray:
    """Write ``linear[axis, sample]`` as Imu messages, logged `late_ns` after their stamps; give the stamps."""
    stamps_ns = start_ns + np.rint(np.arange(linear.shape[1]) / rate_hz * 1e9).astype(np.int64)
    with LogMaker(path, **options) as log:
        channel = log.ros2(topic, "sensor_msgs/msg/Imu", IMU)
        for stamp_ns, sample in zip(stamps_ns.tolist(), linear.T, strict=True):
            log.write(channel, imu(stamp_ns, sample), stamp_ns + late_ns)
    return stamps_ns


def write_scalars(path: Path, columns: Mapping[str, tuple[Iterable[int], Iterable[float]]], **options: Any) -> None:
    """Write std_msgs/Float64 topics (no stamp of their own) from (log times, values), in time order."""
    with LogMaker(path, **options) as log:
        rows = []
        for topic, (times_ns, values) in columns.items():
            channel = log.ros2(topic, "std_msgs/msg/Float64", FLOAT64)
            rows += [(int(time), channel, float(value)) for time, value in zip(times_ns, values, strict=True)]
        for time_ns, channel, value in sorted(rows):
            log.write(channel, {"data": value}, time_ns)


def tone(number: np.ndarray, *, offset_s: float = 0.0, tone_hz: float = 5.0) -> np.ndarray:
    """Samples of a sine by their numbers, at `RATE_HZ`."""
    sine: np.ndarray = np.sin(2 * np.pi * tone_hz * (number / RATE_HZ + offset_s))
    return sine


def write_numbers(
    path: Path,
    times_ns: Iterable[int],
    values: Iterable[float],
    *,
    channel: Sequence[int] | None = None,
    **options: Any,
) -> None:
    """Write Float64 messages to ``/s`` in the order given, through one MCAP channel or several (from 0)."""
    owners = [0] * len(list(times_ns)) if channel is None else list(channel)
    with LogMaker(path, **options) as maker:
        channels = [maker.ros2("/s", "std_msgs/msg/Float64", FLOAT64) for _ in range(1 + max(owners))]
        for time_ns, value, owner in zip(times_ns, values, owners, strict=True):
            maker.write(channels[owner], {"data": float(value)}, int(time_ns))


def two_sensors(path: Path, *, offset_s: float, joins_at: int = 0, seconds: int = 4, **options: Any) -> None:
    """Write a tone of 5 Hz by one publisher, and one of 7 Hz and three times the size by another, on ``/s``."""
    number = np.arange(round(seconds * RATE_HZ))
    second = number[joins_at:]
    times = START_NS + np.rint(np.concatenate([number / RATE_HZ, second / RATE_HZ + offset_s]) * 1e9).astype(np.int64)
    values = np.concatenate([tone(number), 3 * tone(second, offset_s=offset_s, tone_hz=7.0)])
    owner = np.repeat([0, 1], [number.size, second.size])
    order = np.argsort(times, kind="stable")
    write_numbers(path, times[order], values[order], channel=owner[order].tolist(), **options)


def write_stored(path: Path, log_ns: np.ndarray, values: np.ndarray, **options: Any) -> None:
    """Write a std_msgs/Float64 topic ``/s`` in the order given, which needn't be that of the log times."""
    with LogMaker(path, **options) as log:
        channel = log.ros2("/s", "std_msgs/msg/Float64", FLOAT64)
        for time_ns, value in zip(log_ns.tolist(), values.tolist(), strict=True):
            log.write(channel, {"data": value}, time_ns)


#: Of `write_driven`: how late its state is, and how large against the command.
LATE_S, GAIN = 0.012, 0.5


def write_driven(path: Path) -> None:
    """Write commands at 50 Hz, and a state at 250 Hz that is half of what was commanded three samples before."""
    commands = np.random.default_rng(4).standard_normal(6000)
    with LogMaker(path) as maker:
        command = maker.ros2("/drive", "my_msgs/msg/MotorCommand", FLOAT64)
        encoder = maker.ros2("/encoder", "std_msgs/msg/Float64", FLOAT64)
        for number, value in enumerate(commands):
            maker.write(command, {"data": value}, START_NS + number * 20_000_000)
        for number, value in enumerate(GAIN * np.repeat(commands, 5)):
            maker.write(encoder, {"data": value}, START_NS + number * 4_000_000 + round(LATE_S * 1e9))


def protobuf_log(path: Path, values: Iterable[float], *, rate_hz: float = 100.0) -> None:
    """Write a protobuf topic ``/sensor`` with google.protobuf.Timestamp and a double, encoded by hand."""
    from google.protobuf import descriptor_pb2, timestamp_pb2

    file = descriptor_pb2.FileDescriptorProto(
        name="sample.proto", package="test", dependency=["google/protobuf/timestamp.proto"], syntax="proto3"
    )
    message = file.message_type.add(name="Sample")
    message.field.add(name="timestamp", number=1, type=11, type_name=".google.protobuf.Timestamp", label=1)
    message.field.add(name="value", number=2, type=1, label=1)
    known = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(known)
    schema = descriptor_pb2.FileDescriptorSet(file=[known, file]).SerializeToString()
    with LogMaker(path) as log:
        channel = log.raw("/sensor", encoding="protobuf", schema=("test.Sample", "protobuf", schema))
        for index, value in enumerate(values):
            stamp_ns = START_NS + round(index / rate_hz * 1e9)
            stamp = timestamp_pb2.Timestamp(seconds=stamp_ns // 10**9, nanos=stamp_ns % 10**9).SerializeToString()
            body = b"\x0a" + bytes([len(stamp)]) + stamp + b"\x11" + struct.pack("<d", value)
            log.write(channel, body, stamp_ns + 1_000_000)


def with_strange_topics(path: Path) -> Path:
    """A log at 100 Hz: noise in /good.x, messages that can't be decoded in /bad, and text in /text."""
    values = np.random.default_rng(1).standard_normal(100)
    with LogMaker(path) as maker:
        topics = [
            (maker.json("/good"), [{"x": value} for value in values.tolist()]),
            (maker.raw("/bad", encoding="flatbuffer"), [b"????"] * 100),
            (maker.json("/text"), [{"note": "all is well"}] * 100),
        ]
        for index in range(100):
            for channel, messages in topics:
                maker.write(channel, messages[index], START_NS + index * 10_000_000)
    return path
