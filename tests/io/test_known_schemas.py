"""Units and bookkeeping that documentation tells of well-known message types."""

import numpy as np
import pytest

from chladni.io.decoding import FieldInfo
from chladni.io.known_schemas import has_signals, is_signal, known_unit, likely_role, message_type, possible_units


@pytest.mark.parametrize(
    ("schema", "leaf", "unit"),
    [
        # REP 103: ROS messages are in SI units.
        ("sensor_msgs/msg/Imu", "linear_acceleration.x", "m/s^2"),
        ("sensor_msgs/Imu", "angular_velocity.z", "rad/s"),
        ("sensor_msgs/msg/Imu", "orientation.x", None),
        ("geometry_msgs/msg/Accel", "linear.y", "m/s^2"),
        ("geometry_msgs/msg/AccelStamped", "accel.angular.y", "rad/s^2"),
        ("geometry_msgs/msg/AccelWithCovarianceStamped", "accel.accel.linear.y", "m/s^2"),
        ("geometry_msgs/msg/Wrench", "force.x", "N"),
        ("geometry_msgs/msg/WrenchStamped", "wrench.torque.x", "N m"),
        ("geometry_msgs/msg/TwistStamped", "twist.linear.x", "m/s"),
        ("nav_msgs/msg/Odometry", "twist.twist.angular.x", "rad/s"),
        ("nav_msgs/msg/Odometry", "pose.pose.position.x", "m"),
        ("geometry_msgs/msg/PoseStamped", "pose.orientation.x", None),
        ("sensor_msgs/msg/MagneticField", "magnetic_field.x", "T"),
        ("sensor_msgs/msg/FluidPressure", "fluid_pressure", "Pa"),
        # A joint may turn or slide; the log doesn't say.
        ("sensor_msgs/msg/JointState", "position", None),
        ("std_msgs/msg/Float64", "data", None),
        ("px4_msgs/msg/VehicleAcceleration", "xyz", "m/s^2"),
        ("px4_msgs/msg/SensorCombined", "gyro_rad", "rad/s"),
        ("px4_msgs/msg/SensorCombined", "accelerometer_m_s2", "m/s^2"),
        ("px4_msgs/msg/Unheard", "x", None),
        # The same names in a message nobody documented mean nothing.
        ("my_msgs/msg/Imu", "linear_acceleration.x", None),
    ],
)
def test_units(schema: str, leaf: str, unit: str | None) -> None:
    assert known_unit(schema, leaf) == unit


@pytest.mark.parametrize(
    ("schema", "leaf", "units"),
    [
        ("sensor_msgs/msg/JointState", "position", ("m", "rad")),
        ("sensor_msgs/JointState", "velocity", ("m/s", "rad/s")),
        ("sensor_msgs::msg::dds_::JointState_", "effort", ("N", "N m")),
        ("my_msgs/msg/JointState", "position", ()),
        ("std_msgs/msg/Float64", "data", ()),
    ],
)
def test_units_that_a_type_leaves_open(schema: str, leaf: str, units: tuple[str, ...]) -> None:
    assert possible_units(schema, leaf) == units


def field(path: str, kind: str = "number", dtype: str = "f8", array: object = None) -> FieldInfo:
    return FieldInfo(path=path, kind=kind, dtype=np.dtype(dtype), dims=() if array is None else (array,))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("info", "listed"),
    [
        (field("linear_acceleration.x"), True),
        (field("temperature"), True),
        (field("esc[].rpm", array=8), True),
        (field("header.stamp", "time", "i8"), False),
        (field("header.seq", dtype="u4"), False),
        (field("on", "bool", "?"), False),
        (field("linear_acceleration_covariance", array=9), False),
        (field("pose.covariance", array=36), False),
        (field("timestamp_sample", dtype="u8"), False),
        (field("device_id", dtype="u4"), False),
        (field("error_count", dtype="u4"), False),
        (field("data", dtype="u1", array="dynamic"), False),
        (field("covariance[][]", array=3), False),
    ],
)
def test_what_is_a_signal(info: FieldInfo, listed: bool) -> None:
    assert is_signal(info) is listed


def test_messages_about_the_system_have_none() -> None:
    assert not has_signals("rcl_interfaces/msg/Log")
    assert has_signals("sensor_msgs/msg/Imu")
    assert has_signals("")


def test_names_of_types() -> None:
    assert message_type("sensor_msgs::msg::Imu") == "sensor_msgs/Imu"
    assert message_type("sensor_msgs::msg::dds_::Imu_") == "sensor_msgs/Imu"
    assert message_type("foxglove.IMU") == "foxglove.IMU"


@pytest.mark.parametrize(
    ("name", "unit", "role"),
    [
        ("/shaker.wrench.force.z", "N", "reference"),
        ("/daq.hammer", "1", "reference"),
        ("/daq.hammer", "V", "reference"),
        # An accelerometer on the shaker is a response.
        ("/shaker.accel.linear.x", "m/s^2", "response"),
        ("/workforce.x", "1", "response"),
        ("/axis.effort[0]", "1", "reference"),
    ],
)
def test_likely_role(name: str, unit: str, role: str) -> None:
    assert likely_role(name, unit) == role
