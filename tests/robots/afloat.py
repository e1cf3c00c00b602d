"""A robot on a base that nobody fixed: MuJoCo runs it by its own drives, and reads its IMU by its own sensors."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from chladni.robots.imu_log import ImuLog
from chladni.robots.joint_log import JointLog
from chladni.robots.loading import load_robot
from chladni.robots.robot import Robot
from tests.robots.machines import RATE_HZ, joint_log_of

LEG = """
      <body name="{0}_thigh" pos="{1} 0 -0.02">
        <joint name="{0}_hip" axis="0 1 0" damping="0.02" armature="0.005"{2}/>
        <inertial pos="0 0 -0.08" mass="0.8" diaginertia="0.003 0.003 0.0005"/>
        <body name="{0}_calf" pos="0 0 -0.2">
          <joint name="{0}_knee" axis="0.2 1 0" damping="0.02" armature="0.005"/>
          <inertial pos="0 0 -0.07" mass="0.4" diaginertia="0.001 0.001 0.0001"/>
        </body>
      </body>"""
#: Its free joint isn't the first of the world, and its base is turned in the description.
BIPED = """<mujoco model="biped">
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="ball" pos="3 0 0"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body>
    <body name="trunk" pos="0 0 0.5" euler="0 0 0.7">
      <freejoint/>
      <inertial pos="0.02 0 0.01" mass="3" diaginertia="0.03 0.06 0.06"/>
      <body name="head" pos="0.15 0.02 0.05" euler="0.1 0 0"><site name="imu" euler="0.2 -0.4 0.3"/></body>
{legs}
    </body>
  </worldbody>
  <actuator>
    <position joint="left_hip" kp="40" kv="1"{servo}/><position joint="left_knee" kp="25" kv="0.5"{servo}/>
    <position joint="right_hip" kp="40" kv="1"{servo}/><position joint="right_knee" kp="25" kv="0.5"{servo}/>
  </actuator>
  <sensor><gyro site="imu"/><accelerometer site="imu"/></sensor>
</mujoco>
"""
#: A cord at the trunk, N/m and N m/rad, and what damps it.
CORD, TWIST, DAMPED = 300.0, 8.0, 0.5


def biped(folder: Path, name: str = "biped.xml", *, left: str = "", servo: str = "") -> Robot:
    """Write and load it, or a machine that differs."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    legs = LEG.format("left", 0.1, left) + LEG.format("right", -0.1, "")
    path.write_text(BIPED.format(legs=legs, servo=servo))
    return load_robot(path)


def walking(seconds: float) -> np.ndarray:
    """``[4, sample]``: legs that swing in the air."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    parts = [(0.5, 1.1, 0.0), (0.6, 1.7, 0.7), (0.5, 0.9, 2.0), (0.6, 1.4, 1.3)]
    return np.stack(
        [
            size * np.sin(2 * np.pi * hz * time_s + phase) + 0.15 * np.sin(2 * np.pi * 1.6 * hz * time_s)
            for size, hz, phase in parts
        ]
    )


def hung(
    robot: Robot, command: np.ndarray, *, falls: bool = False, stands_s: float = 0.0, effort: bool = False
) -> JointLog:
    """What a machine logs that hangs from a cord, or falls; that for a time is held at the ends of its calves.

    With `effort` the log has the drives' torques, too.
    """
    import mujoco

    model, data = robot.model, mujoco.MjData(robot.model)
    every = round(1.0 / RATE_HZ / model.opt.timestep)
    places = [one.position for one in robot.joints]
    trunk, calves = model.body("trunk").id, [model.body(name).id for name in ("left_calf", "right_calf")]
    data.qpos[places] = command[:, 0]
    mujoco.mj_forward(model, data)
    start = data.xpos[trunk] + [0.0, 0.0, model.body_mass[trunk:].sum() * 9.81 / CORD]
    position, given = np.empty_like(command), np.empty_like(command)
    dofs = [one.dof for one in robot.joints]
    upright, turn, speed = np.array(data.xquat[trunk]), np.zeros(3), np.zeros(6)
    felt = []
    for sample, asked in enumerate(command.T):
        data.ctrl[:] = asked
        position[:, sample] = data.qpos[places]
        for _ in range(every):
            if not falls:
                mujoco.mju_subQuat(turn, upright, data.xquat[trunk])
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, trunk, speed, 0)
                pull = CORD * (start - data.xpos[trunk]) - 10 * DAMPED * speed[3:]
                twist = TWIST * data.xmat[trunk].reshape(3, 3) @ turn - DAMPED * speed[:3]
                stands = sample < stands_s * RATE_HZ
                data.xfrc_applied[trunk, :3] = 0.0 if stands else pull
                data.xfrc_applied[trunk, 3:] = twist
                data.xfrc_applied[calves] = 0.0
                for calf in calves if stands else ():
                    arm = data.xmat[calf].reshape(3, 3) @ [0.0, 0.0, -0.2] - (data.xipos[calf] - data.xpos[calf])
                    # A force of a body acts at its centre of mass.
                    data.xfrc_applied[calf] = [*pull / 2, *np.cross(arm, pull / 2)]
            mujoco.mj_step(model, data)
            given[:, sample] = data.qfrc_actuator[dofs]
            felt.append(data.sensordata.copy())
    # An IMU gives the mean about each of its samples: commands that step would be seen just after a step.
    half = every // 2
    sums = np.cumsum([felt[0]] * half + felt + [felt[-1]] * half, axis=0)
    sensed = (sums[every::every] - sums[:-every:every]).T / every
    log = joint_log_of(robot, position, command=command, effort=given if effort else None)
    imu = ImuLog(
        topic="/imu",
        site="imu",
        angular_velocity=sensed[:3],
        linear_acceleration=sensed[3:],
        orientation=None,
        sample_rate_hz=RATE_HZ,
    )
    return replace(log, imu=imu)
