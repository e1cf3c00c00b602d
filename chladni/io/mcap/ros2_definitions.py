"""ROS 2 message definitions that the log writer uses, and the schema text made of them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

PRIMITIVES: dict[str, str] = {
    "float64": "<f8",
    "float32": "<f4",
    "int32": "<i4",
    "uint32": "<u4",
}
"""Primitive types that occur in `DEFINITIONS`, with their little-endian NumPy type."""

DEFINITIONS: dict[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Accel": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/AccelStamped": "std_msgs/Header header\ngeometry_msgs/Accel accel",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "geometry_msgs/Vector3Stamped": "std_msgs/Header header\ngeometry_msgs/Vector3 vector",
    "sensor_msgs/Imu": (
        "std_msgs/Header header\n"
        "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance"
    ),
    "sensor_msgs/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"
    ),
    "chladni_msgs/ScalarStamped": "std_msgs/Header header\nfloat64 value",
    "daq_msgs/SampleBlock": (
        "std_msgs/Header header\nfloat64 sample_rate\nstring[] channel_names\nfloat32[] samples"
    ),
    "daq_msgs/SampleBlock64": (
        "std_msgs/Header header\nfloat64 sample_rate\nstring[] channel_names\nfloat64[] samples"
    ),
}
"""Message types by their package and name, one field a line."""

_FIELD = re.compile(r"^(?P<type>[\w/]+)(?:\[(?P<count>\d*)\])? (?P<name>\w+)$")
_SEPARATOR = "=" * 80


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageField:
    """A field of a message definition; `count` elements when it's a fixed array, -1 for a sequence, else None."""

    name: str
    type: str
    count: int | None = None


def message_fields(type_name: str, definitions: Mapping[str, str] = DEFINITIONS) -> tuple[MessageField, ...]:
    """Give the fields of one message type, in their order on the wire.

    Examples
    --------
    >>> [field.name for field in message_fields("std_msgs/Header")]
    ['stamp', 'frame_id']
    """
    return tuple(_parse_field(line) for line in definitions[type_name].splitlines())


def leaf_paths(type_name: str, definitions: Mapping[str, str] = DEFINITIONS) -> tuple[str, ...]:
    """Give the paths of all float64 values that a message of this type always holds.

    Examples
    --------
    >>> leaf_paths("geometry_msgs/Vector3Stamped")
    ('vector.x', 'vector.y', 'vector.z')
    """
    paths: list[str] = []
    for field in message_fields(type_name, definitions):
        for place in _places(field):
            if field.type == "float64":
                paths.append(place)
            elif field.type in definitions:
                paths += [f"{place}.{rest}" for rest in leaf_paths(field.type, definitions)]
    return tuple(paths)


def schema_text(type_name: str, definitions: Mapping[str, str] = DEFINITIONS) -> str:
    """Give the definition of a type followed by those of all types it holds, as the ros2msg encoding asks for."""
    needed: dict[str, None] = {}
    _collect(type_name, definitions, needed)
    parts = [definitions[type_name]]
    parts += [f"{_SEPARATOR}\nMSG: {name}\n{definitions[name]}" for name in needed if name != type_name]
    return "\n".join(parts) + "\n"


def schema_name(type_name: str) -> str:
    """Give the full ROS 2 name: ``sensor_msgs/Imu`` is ``sensor_msgs/msg/Imu``."""
    package, _, name = type_name.partition("/")
    return f"{package}/msg/{name}"


def _collect(type_name: str, definitions: Mapping[str, str], needed: dict[str, None]) -> None:
    needed.setdefault(type_name)
    for field in message_fields(type_name, definitions):
        if field.type in definitions:
            _collect(field.type, definitions, needed)


def _parse_field(line: str) -> MessageField:
    match = _FIELD.match(line)
    if match is None:
        raise AssertionError(f"no message field: {line!r}")
    count = match["count"]
    return MessageField(
        name=match["name"], type=match["type"], count=None if count is None else int(count) if count else -1
    )


def _places(field: MessageField) -> list[str]:
    if field.count is None:
        return [field.name]
    return [f"{field.name}[{index}]" for index in range(max(field.count, 0))]
