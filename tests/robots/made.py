"""Robots as text, and logs of their joints, whose content is known."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tests.make_logs import JOINT_STATE, START_NS, LogMaker, joint_state

JOINTS = ("shoulder", "elbow", "lift")

ARM = """<mujoco model="arm">
  <compiler angle="radian"/>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="4" diaginertia="0.02 0.02 0.02"/>
      <body name="upper">
        <joint name="shoulder" axis="0 1 0" range="-2 2" limited="true" damping="0.5" armature="0.1"
               frictionloss="0.3"/>
        <inertial pos="0 0 0.2" mass="2" diaginertia="0.02 0.02 0.002"/>
        <body name="fore" pos="0 0 0.4">
          <joint name="elbow" axis="0 1 0" range="-2.5 2.5" limited="true"/>
          <inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.001"/>
          <body name="hand" pos="0 0 0.3">
            <joint name="lift" type="slide" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder_servo" joint="shoulder" kp="80" kv="4" forcerange="-30 30"/>
    <general name="elbow_servo" joint="elbow" gainprm="50" biastype="affine" biasprm="0 -50 -2" gear="2"/>
    <motor name="lift_motor" joint="lift" gear="10" ctrlrange="-3 3"/>
  </actuator>
</mujoco>
"""

_INERTIA = (
    '<inertial><origin xyz="0 0 0.1"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>'
)
_MESH = '<{0}><geometry><mesh filename="package://arm_description/meshes/{1}.stl"/></geometry></{0}>'
URDF = f"""<?xml version="1.0" encoding="latin-1"?>
<!-- an arm -->
<robot name="urdf_arm">
  <link name="base_link"/>
  <link name="upper">{_INERTIA}{_MESH.format("visual", "upper")}{_MESH.format("collision", "upper")}</link>
  <link name="fore">{_INERTIA}{_MESH.format("visual", "fore")}</link>
  <link name="hand">{_INERTIA}</link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute">
    <parent link="base_link"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="30" velocity="3"/><dynamics damping="0.5" friction="0.3"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit effort="20" velocity="4"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="fore"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.1" effort="50" velocity="0.5"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="hand"/><child link="tool"/></joint>
  <transmission name="t"><type>any</type></transmission>
  <gazebo reference="upper"><material>Gazebo/Grey</material></gazebo>
</robot>
"""


def written(folder: Path, text: str, name: str = "arm.xml") -> Path:
    """Write a description."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def motion(seconds: float, rate_hz: float, *, delay_s: float = 0.0, joints: int = 3) -> np.ndarray:
    """``[joint, sample]``: smooth motions, of another course for each joint, late by `delay_s`."""
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz - delay_s
    return np.stack(
        [0.8 * np.sin(2 * np.pi * (0.7 + 0.2 * joint) * time_s) + 0.1 * np.sin(9 * time_s) for joint in range(joints)]
    )


class JointTopic:
    """Messages of a topic: a JointState for each column of `position`."""

    def __init__(
        self,
        topic: str,
        position: np.ndarray,
        *,
        rate_hz: float,
        names: Sequence[str] | Sequence[Sequence[str]] = JOINTS,
        velocity: np.ndarray | None = None,
        effort: np.ndarray | None = None,
        offset_s: float = 0.0,
        times_s: np.ndarray | None = None,
    ) -> None:
        self.topic, self.position, self.velocity, self.effort = topic, position, velocity, effort
        samples = position.shape[1]
        self.times_s = (np.arange(samples) / rate_hz if times_s is None else times_s) + offset_s
        self.names = [list(names)] * samples if isinstance(names[0], str) else [list(one) for one in names]


def write_joints(path: Path, topics: Sequence[JointTopic], *, metadata: Mapping[str, str] | None = None) -> Path:
    """Write a log of JointState topics, all messages in the order of their times."""
    with LogMaker(path) as log:
        messages = []
        for one in topics:
            channel = log.ros2(one.topic, "sensor_msgs/msg/JointState", JOINT_STATE, metadata)
            for place, time_s in enumerate(one.times_s.tolist()):
                stamp_ns = START_NS + round(time_s * 1e9)
                rows = [
                    () if values is None else values[:, place].tolist()
                    for values in (one.position, one.velocity, one.effort)
                ]
                messages.append((stamp_ns, channel, joint_state(stamp_ns, one.names[place], *rows)))
        for stamp_ns, channel, message in sorted(messages, key=lambda each: each[:2]):
            log.write(channel, message, stamp_ns)
    return path
