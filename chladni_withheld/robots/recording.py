"""The files of a case: the log's topics, and the robot file."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from chladni.signals.channel import Channel
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni_withheld.case import START_TIME_NS, Matrix
from chladni_withheld.robots.descriptions import child, fix
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Motion
from chladni_withheld.robots.scene import Scene

STATE, COMMAND, URDF = "/joint_states", "/joint_commands", "robot.urdf"
IMU, IMU_LINK = "/imu", "trunk_imu"


def topics(rng: Rng, scene: Scene, motion: Motion) -> tuple[TimeSeries, ...]:
    """States and commands as messages, each at its own rate."""
    recorder, commands = scene.recorder, scene.commands
    step = recorder.resolution
    arrays = {"position": np.rint(motion.reading / step) * step}
    if recorder.velocity:
        arrays["velocity"] = _noisy(rng, motion.speed, 0.002)
    if recorder.effort != "none":
        felt = motion.given if recorder.effort == "measured" else motion.asked / recorder.torque_constant
        arrays["effort"] = _noisy(rng, felt, 0.0 if recorder.effort == "commanded" else 0.005)
    # Commands from the one that holds when the states begin.
    first = int(np.searchsorted(commands.t_s, recorder.state_s, "right")) - 1
    return (
        *_imu(rng, scene, motion),
        _series(scene, STATE, arrays, recorder.state_hz, recorder.state_s),
        _series(scene, COMMAND, {"position": commands.values[:, first:]}, recorder.command_hz,
                float(commands.t_s[first])),
    )  # fmt: skip


def _imu(rng: Rng, scene: Scene, motion: Motion) -> tuple[TimeSeries, ...]:
    """What an IMU on a base that floats reads, at its own rate."""
    if scene.machine.base is None:
        return ()
    sensor = scene.machine.base.sensor
    t_s, read = motion.imu[0], motion.imu[1:]
    t_s, read = t_s[t_s >= motion.t_s[0]], read[:, t_s >= motion.t_s[0]]
    rows = []
    for (constant, noise), part in zip((sensor.gyro, sensor.accelerometer), (read[:3], read[3:]), strict=True):
        rows.append(part + constant[:, None] + noise * rng.normal(size=part.shape))
    names = [f"{IMU}.{field}.{axis}" for field in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    return (
        TimeSeries(
            values=np.vstack(rows), sample_rate_hz=sensor.rate_hz,
            start_time_ns=START_TIME_NS + NS_PER_S + round(float(t_s[0]) * NS_PER_S),
            channels=tuple(Channel(name=name) for name in names),
        ),
    )  # fmt: skip


def described(scene: Scene) -> str:
    """Text of the description; of a base that floats with a link where the IMU sits."""
    if scene.machine.base is None:
        return scene.robot.urdf
    root = ET.fromstring(scene.robot.urdf)  # noqa: S314 - of a package that was asked for, not of a user
    children = {child(joint) for joint in root.iter("joint")}
    base = next(name for link in root.findall("link") if (name := link.get("name", "")) not in children)
    pose = scene.machine.base.sensor.pose
    fix(root, base, IMU_LINK, xyz=pose.translation, rpy=pin.rpy.matrixToRpy(pose.rotation))
    return ET.tostring(root, encoding="unicode")


def _noisy(rng: Rng, signals: Matrix, share: float) -> Matrix:
    return np.asarray(signals + share * signals.std(axis=1, keepdims=True) * rng.normal(size=signals.shape))


def _series(scene: Scene, topic: str, arrays: Mapping[str, Matrix], rate_hz: float, begin_s: float) -> TimeSeries:
    names = [f"{topic}.{array}[{joint}]" for array in arrays for joint in scene.robot.joints]
    return TimeSeries(
        values=np.vstack(list(arrays.values())), sample_rate_hz=rate_hz,
        start_time_ns=START_TIME_NS + NS_PER_S + round(begin_s * NS_PER_S),
        channels=tuple(Channel(name=name) for name in names),
    )  # fmt: skip


def robot_toml(scene: Scene) -> str:
    """Text of the robot file: ``chladni.robot/1``."""
    recorder, joints = scene.recorder, scene.robot.joints
    kp, kd = scene.gains
    lines = [
        'format = "chladni.robot/1"', f'description = "{URDF}"',
        f'base = "{"fixed" if scene.machine.base is None else "floating"}"', "",
        "[log]", f'state = "{STATE}"', f'command = "{COMMAND}"', 'command_kind = "position"',
        f'effort = "{recorder.effort}"',
    ]  # fmt: skip
    if scene.machine.base is not None:
        lines.append(f'imu = {{ topic = "{IMU}", site = "{IMU_LINK}" }}')
    if recorder.effort == "current":
        lines.append(f"torque_constant = {{ default = {recorder.torque_constant!r} }}")
    lines += ["", "[control]"]
    for key, values in (("kp", kp), ("kd", kd), ("limit", scene.machine.servo.limit)):
        lines.append(f"{key} = {_table(joints, values)}")
    lines += ['delay = "0 ms"', "", "[tolerance]"]
    lines += [f"{key} = {value!r}" for key, value in scene.tolerance.items()]
    return "\n".join([*lines, 'friction = "0 N m"', ""])


def _table(joints: tuple[str, ...], values: Matrix) -> str:
    numbers = [float(value) for value in values]
    usual = max(set(numbers), key=numbers.count)
    others = [f'"{joint}" = {value!r}' for joint, value in zip(joints, numbers, strict=True) if value != usual]
    return f"{{ {', '.join([f'default = {usual!r}', *others])} }}"
