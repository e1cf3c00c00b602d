"""What the documentation of well-known message types says beyond definitions: units, and what is bookkeeping."""

import re
from collections.abc import Mapping
from typing import Final

from chladni.io.decoding.schema import FieldInfo
from chladni.signals.channel import Role

MAX_LISTED_ELEMENTS: Final = 64
"""Arrays longer than this are pictures, scans or clouds, not channels; single elements can still be read by path."""

_ACCELERATION = "m/s^2"
_ANGULAR_VELOCITY = "rad/s"
_ANGULAR_ACCELERATION = "rad/s^2"

# ROS messages are in SI units without prefix (REP 103); the pattern is matched against the end of the leaf's path.
_ROS_PACKAGES = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")
_ROS_RULES: tuple[tuple[str, str, str], ...] = (
    # type of message, end of path, unit
    (r"sensor_msgs/Imu", r"linear_acceleration\.[xyz]", _ACCELERATION),
    (r"sensor_msgs/Imu", r"angular_velocity\.[xyz]", _ANGULAR_VELOCITY),
    (r"geometry_msgs/Accel\w*", r"(^|\.)linear\.[xyz]", _ACCELERATION),
    (r"geometry_msgs/Accel\w*", r"(^|\.)angular\.[xyz]", _ANGULAR_ACCELERATION),
    (r"geometry_msgs/Wrench\w*", r"(^|\.)force\.[xyz]", "N"),
    (r"geometry_msgs/Wrench\w*", r"(^|\.)torque\.[xyz]", "N m"),
    (r"(geometry_msgs/Twist\w*|nav_msgs/Odometry)", r"(^|\.)linear\.[xyz]", "m/s"),
    (r"(geometry_msgs/Twist\w*|nav_msgs/Odometry)", r"(^|\.)angular\.[xyz]", _ANGULAR_VELOCITY),
    (r"(geometry_msgs/Pose\w*|nav_msgs/Odometry)", r"(^|\.)position\.[xyz]", "m"),
    (r"geometry_msgs/Transform\w*", r"(^|\.)translation\.[xyz]", "m"),
    (r"geometry_msgs/Point(Stamped|32)?", r"(^|\.)[xyz]", "m"),
    (r"sensor_msgs/MagneticField", r"magnetic_field\.[xyz]", "T"),
    (r"sensor_msgs/FluidPressure", r"fluid_pressure", "Pa"),
    (r"sensor_msgs/Temperature", r"temperature", "degC"),
    (r"sensor_msgs/Range", r"range", "m"),
    (r"sensor_msgs/BatteryState", r"voltage", "V"),
    (r"sensor_msgs/BatteryState", r"current", "A"),
)

# A joint turns or slides: which of the two the log doesn't say, but nothing else is possible.
_OPEN_UNITS: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("sensor_msgs/JointState", "position"): ("m", "rad"),
    ("sensor_msgs/JointState", "velocity"): ("m/s", "rad/s"),
    ("sensor_msgs/JointState", "effort"): ("N", "N m"),
}

_PX4_UNITS: Mapping[str, Mapping[str, str]] = {
    "VehicleAcceleration": {"xyz": _ACCELERATION},
    "VehicleAngularVelocity": {"xyz": _ANGULAR_VELOCITY, "xyz_derivative": _ANGULAR_ACCELERATION},
    "VehicleAngularAcceleration": {"xyz": _ANGULAR_ACCELERATION},
    "SensorCombined": {"gyro_rad": _ANGULAR_VELOCITY, "accelerometer_m_s2": _ACCELERATION},
    "SensorAccel": {"x": _ACCELERATION, "y": _ACCELERATION, "z": _ACCELERATION, "temperature": "degC"},
    "SensorGyro": {"x": _ANGULAR_VELOCITY, "y": _ANGULAR_VELOCITY, "z": _ANGULAR_VELOCITY, "temperature": "degC"},
    "SensorAccelFifo": {"x": _ACCELERATION, "y": _ACCELERATION, "z": _ACCELERATION},
    "SensorGyroFifo": {"x": _ANGULAR_VELOCITY, "y": _ANGULAR_VELOCITY, "z": _ANGULAR_VELOCITY},
    "VehicleLocalPosition": {
        **dict.fromkeys(("x", "y", "z"), "m"),
        **dict.fromkeys(("vx", "vy", "vz"), "m/s"),
        **dict.fromkeys(("ax", "ay", "az"), _ACCELERATION),
    },
}

# Messages about the system and not of a sensor; transforms are named by frame and read by filter.
_NO_SIGNALS = (
    "rcl_interfaces",
    "rosgraph_msgs",
    "diagnostic_msgs",
    "tf2_msgs",
    "lifecycle_msgs",
    "rosbag2_interfaces",
)

# Commands by their documentation, whose names don't say so.
_COMMANDS = (
    "ackermann_msgs/AckermannDrive",
    "px4_msgs/ActuatorMotors",
    "px4_msgs/ActuatorServos",
    "mavros_msgs/ActuatorControl",
    "mavros_msgs/AttitudeTarget",
    "mavros_msgs/PositionTarget",
    "mavros_msgs/OverrideRCIn",
)
_COMMAND_WORDS = frozenset(["command", "commands", "cmd", "cmds", "setpoint", "setpoints", "jog"])

_BOOKKEEPING = re.compile(
    r"(^|\.)(header|stamp|timestamp\w*|time|seq|sequence\w*|device_id|\w*_?id|frame|\w*covariance\w*|variance"
    r"|error_count|clip_counter|calibration_count|samples|status|\w*flags?|ORB_QUEUE_LENGTH)(\[\])*(\.|$)"
)
_FORCE_NAME = re.compile(r"(?:^|[^a-z])(hammer|shaker|force|torque|effort|thrust)(?:[^a-z]|$)")


def message_type(schema_name: str) -> str:
    """Package and name without the part in the middle that ROS 2 adds.

    Examples
    --------
    >>> message_type("sensor_msgs/msg/Imu")
    'sensor_msgs/Imu'
    """
    if "::" in schema_name:
        # DDS puts its own namespace around the type and an underscore behind it.
        schema_name = schema_name.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
    return schema_name.replace("/msg/", "/")


def known_unit(schema_name: str, leaf: str) -> str | None:
    """Unit that the documentation of a well-known message type gives a leaf; None where it gives none.

    sensor_msgs/JointState has none: its position is in rad or m, depending on a joint that the log doesn't describe.

    Examples
    --------
    >>> known_unit("sensor_msgs/msg/Imu", "linear_acceleration.x")
    'm/s^2'
    >>> known_unit("sensor_msgs/msg/JointState", "position")
    """
    kind = message_type(schema_name)
    package, _, name = kind.partition("/")
    if package == "px4_msgs":
        return _PX4_UNITS.get(name, {}).get(leaf)
    if package not in _ROS_PACKAGES:
        return None
    for type_pattern, path_pattern, unit in _ROS_RULES:
        if re.fullmatch(type_pattern, kind) and re.search(f"{path_pattern}$", leaf):
            return unit
    return None


def possible_units(schema_name: str, leaf: str) -> tuple[str, ...]:
    """Units among which the documentation of a well-known message type leaves a leaf's open; empty for all others.

    Examples
    --------
    >>> possible_units("sensor_msgs/msg/JointState", "velocity")
    ('m/s', 'rad/s')
    """
    return _OPEN_UNITS.get((message_type(schema_name), leaf), ())


def is_command(schema_name: str) -> bool:
    """Whether a message type is a command: set by a controller, and kept until the next.

    By the type's own documentation, or by a last word of its name that says so. A type that also carries measurements
    (geometry_msgs/Twist, sensor_msgs/JointState) is none, whatever its topic is called.

    Examples
    --------
    >>> is_command("px4_msgs/msg/VehicleRatesSetpoint"), is_command("unitree_go/msg/LowCmd")
    (True, True)
    >>> is_command("geometry_msgs/msg/Twist")
    False
    """
    kind = message_type(schema_name)
    name = re.split(r"[/.]", kind)[-1].removesuffix("Stamped")
    last = re.findall(r"[A-Z]+[a-z0-9]*|[a-z0-9]+", name)[-1:]
    return kind.removesuffix("Stamped") in _COMMANDS or any(word.lower() in _COMMAND_WORDS for word in last)


def has_signals(schema_name: str) -> bool:
    """Whether channels of a message type are listed at all."""
    return message_type(schema_name).partition("/")[0] not in _NO_SIGNALS


def is_signal(info: FieldInfo) -> bool:
    """Whether a leaf is listed as a channel: numbers, but no stamps, covariances, counters or identities.

    All other numbers can still be read by naming them.
    """
    if info.kind != "number" or info.dtype is None or _BOOKKEEPING.search(info.path):
        return False
    # Counted bytes are pictures and packed clouds.
    return not (info.array == "dynamic" and info.dtype.itemsize == 1)


def likely_role(name: str, unit: str) -> Role:
    """Excitation when the unit or the name says force; only a first choice, which the setup file overrides.

    Examples
    --------
    >>> likely_role("/shaker.wrench.force.z", "N"), likely_role("/daq.hammer", "1"), likely_role("/daq.response", "1")
    ('reference', 'reference', 'response')
    """
    if unit in ("N", "N m"):
        return "reference"
    # A name counts only while the unit is silent: an accelerometer on the shaker is a response.
    return "reference" if unit in ("1", "V") and _FORCE_NAME.search(name.lower()) else "response"
