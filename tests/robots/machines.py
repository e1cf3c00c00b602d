"""Machines that MuJoCo itself runs by its own drives, and the logs that they leave."""

from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np

from chladni.robots.joint_log import JointLog
from chladni.robots.loading import load_robot
from chladni.robots.machine import Machine
from chladni.robots.robot import Robot

RATE_HZ = 250.0
STEP_S = 0.0005

#: An arm that stands, with a place for what its machine has beyond it.
ARM = """<mujoco model="arm">
  <!-- angles in radian -->
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.5" armature="0.1"{shoulder}/>
      <inertial pos="0 0 0.2" mass="2" diaginertia="0.02 0.02 0.002"/>
      <body name="fore" pos="0 0 0.4">
        <joint name="elbow" axis="0 1 0" damping="0.2" armature="0.05"/>
        <inertial pos="0 0 0.1" mass="{mass}" diaginertia="0.01 0.01 0.001"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder_servo" joint="shoulder" kp="{kp}" kv="8"{servo}/>
    <position name="elbow_servo" joint="elbow" kp="60" kv="3"{servo}/>
  </actuator>
</mujoco>
"""
AS_DESCRIBED = {"shoulder": "", "mass": "1", "kp": "120", "servo": ""}


def arm(folder: Path, name: str = "arm.xml", **changed: str) -> Robot:
    """Write and load the arm, or a machine that differs."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(ARM.format(**(AS_DESCRIBED | changed)))
    return load_robot(path)


def commands(seconds: float, rate_hz: float = RATE_HZ) -> np.ndarray:
    """``[2, sample]``: motions of two joints, slow and fast."""
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return np.stack(
        [
            0.5 * np.sin(2 * np.pi * 0.5 * time_s) + 0.2 * np.sin(2 * np.pi * 1.3 * time_s),
            0.6 * np.sin(2 * np.pi * 0.8 * time_s + 0.5) + 0.1 * np.sin(2 * np.pi * 2.1 * time_s),
        ]
    )


def run_native(robot: Robot, command: np.ndarray, rate_hz: float = RATE_HZ) -> np.ndarray:
    """``[joint, sample]``: positions of a machine that MuJoCo runs by its own actuators; each command holds."""
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    every = round(1.0 / rate_hz / model.opt.timestep)
    found = np.empty_like(command)
    data.qpos[:] = command[:, 0]
    for sample, asked in enumerate(command.T):
        found[:, sample] = data.qpos
        data.ctrl[:] = asked
        mujoco.mj_step(model, data, every)
    return found


def joint_log_of(
    robot: Robot,
    position: np.ndarray,
    *,
    command: np.ndarray | None = None,
    effort: np.ndarray | None = None,
    rate_hz: float = RATE_HZ,
    kind: str = "position",
) -> JointLog:
    """A log of these signals."""
    time_s = np.arange(position.shape[1]) / rate_hz
    return JointLog(
        log="made.mcap", joints=tuple(one.name for one in robot.joints), sample_rate_hz=rate_hz, start_time_ns=0,
        time_s=time_s, position=position, velocity=None, effort=effort,
        effort_kind=None if effort is None else "measured", command=command,
        command_messages=None if command is None else tuple((time_s, row) for row in command),
        command_kind=None if command is None else kind, command_rate_hz=None if command is None else rate_hz,
        imu=None, breaks=(), state_topic="/joint_states", command_topic=None if command is None else "/commands",
        unmatched=(), unknown=(), remarks=(), damage=(),
    )  # fmt: skip


def course(machine: Machine, command: np.ndarray) -> np.ndarray:
    """``[joint, sample]``: what the machine does by the engine that confirms diagnoses."""
    from chladni.robots.mujoco_forward import Driven, run

    every = round(1.0 / RATE_HZ / STEP_S)
    held = np.repeat(command, every, axis=1)
    asked = np.empty_like(held)
    for row, one in enumerate(machine.joints):
        late = ceil(one.delay_s / STEP_S)
        asked[row] = np.concatenate([np.full(late, held[row, 0]), held[row]])[: held.shape[1]]
    driven = Driven(
        asked=asked, kind=("position",) * len(command), position=command[:, :1], velocity=np.zeros((len(command), 1)),
        steps=np.array([held.shape[1]]), every=every, step_s=STEP_S,
    )  # fmt: skip
    return run(machine, tuple(one.joint.name for one in machine.joints), driven)


def changed(machine: Machine, joint: int, **numbers: float) -> Machine:
    """The machine with other numbers at a joint."""
    joints = list(machine.joints)
    joints[joint] = replace(joints[joint], **numbers)
    return replace(machine, joints=tuple(joints))


def with_gains(machine: Machine, joint: int, **gains: float) -> Machine:
    """The machine with another servo."""
    servo = machine.joints[joint].servo
    assert servo is not None
    return changed(machine, joint, servo=replace(servo, **gains))
