"""What MuJoCo tells of a robot's motion: torques, accelerations and Jacobians, sample by sample."""

from collections.abc import Iterator
from copy import copy
from typing import Any

import numpy as np

from chladni.signals.arrays import Real


def walk(model: Any, position: Real, velocity: Real, acceleration: Real) -> tuple[Real, tuple[Real, ...]]:
    """Follow a motion ``[dof, sample]``.

    Returns
    -------
    torque
        ``[dof, sample]`` of inverse dynamics, without friction and drives.
    links
        Jacobians of each link's origin ``[sample, link, axis, dof]`` (translation, rotation); its axes
        ``[sample, link, axis, axis]``; its acceleration less gravity, angular acceleration and angular velocity
        ``[sample, link, axis]``; all in the world's frame.
    """
    import mujoco

    quiet, data = _quiet(model)
    samples, links, dofs = position.shape[1], quiet.nbody - 1, quiet.nv
    torque = np.empty((dofs, samples))
    translate, rotate = (np.empty((samples, links, 3, dofs)) for _ in range(2))
    turned = np.empty((samples, links, 3, 3))
    accel, speed = np.empty((samples, links, 6)), np.empty((samples, links, 6))
    kind = mujoco.mjtObj.mjOBJ_XBODY
    for sample in range(samples):
        data.qpos[:], data.qvel[:] = position[:, sample], velocity[:, sample]
        data.qacc[:] = acceleration[:, sample]
        mujoco.mj_inverse(quiet, data)
        torque[:, sample] = data.qfrc_inverse
        mujoco.mj_rnePostConstraint(quiet, data)
        turned[sample] = data.xmat[1:].reshape(links, 3, 3)
        for link in range(links):
            mujoco.mj_jacBody(quiet, data, translate[sample, link], rotate[sample, link], link + 1)
            mujoco.mj_objectAcceleration(quiet, data, kind, link + 1, accel[sample, link], 0)
            mujoco.mj_objectVelocity(quiet, data, kind, link + 1, speed[sample, link], 0)
    return torque, (translate, rotate, turned, accel[..., 3:], accel[..., :3], speed[..., :3])


def inertia_rms(model: Any, position: Real) -> Real:
    """Give ``[dof, dof]``: joint-space inertia, RMS over poses ``[dof, pose]``."""
    import mujoco

    quiet, data = _quiet(model)
    poses = position.T
    found, unit, product = np.zeros((quiet.nv, quiet.nv)), np.eye(quiet.nv), np.zeros(quiet.nv)
    for pose in poses:
        data.qpos[:] = pose
        mujoco.mj_forward(quiet, data)
        for dof in range(quiet.nv):
            mujoco.mj_mulM(quiet, data, product, unit[dof])
            found[dof] += product**2
    return np.asarray(np.sqrt(found / len(poses)))


def inertia_columns(model: Any, position: Real, dofs: slice) -> Real:
    """Give ``[column, dof, sample]``: columns of the joint-space inertia, torque a unit of these accelerations."""
    import mujoco

    quiet, data = _quiet(model)
    units = np.eye(quiet.nv)[dofs]
    found, product = np.empty((len(units), quiet.nv, position.shape[1])), np.zeros(quiet.nv)
    for sample, pose in enumerate(position.T):
        data.qpos[:] = pose
        mujoco.mj_forward(quiet, data)
        for column, unit in enumerate(units):
            mujoco.mj_mulM(quiet, data, product, unit)
            found[column, :, sample] = product
    return found


def torque_alone(model: Any, position: Real, velocity: Real, acceleration: Real) -> Real:
    """Give ``[dof, sample]``: the torque of `walk`."""
    import mujoco

    quiet, data = _quiet(model)
    torque = np.empty((quiet.nv, position.shape[1]))
    for sample, (pose, speed, rate) in enumerate(zip(position.T, velocity.T, acceleration.T, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = pose, speed, rate
        mujoco.mj_inverse(quiet, data)
        torque[:, sample] = data.qfrc_inverse
    return torque


def tilted(model: Any, axis: int, angle: float) -> Any:
    """Give the same robot with its base turned about the world's x (0) or y (1) axis by an angle, rad."""
    import mujoco

    other, quaternion = copy(model), np.zeros(4)
    # Seen from the base, gravity turns the other way.
    mujoco.mju_axisAngle2Quat(quaternion, np.eye(3)[axis], -angle)
    mujoco.mju_rotVecQuat(other.opt.gravity, np.array(model.opt.gravity), quaternion)
    return other


def weightless(model: Any) -> Any:
    """Give the same robot without gravity."""
    other = copy(model)
    other.opt.gravity[:] = 0.0
    return other


def loaded(model: Any, mass: float) -> Any:
    """Give the same robot with some mass more at the last link's centre of mass, kg."""
    import mujoco

    other = copy(model)
    other.body_mass[-1] += mass
    mujoco.mj_setConst(other, mujoco.MjData(other))
    return other


def gravity_of(model: Any, tilt: tuple[float, float]) -> Real:
    """Give gravity in the frame of a base that is turned about its x, then its y axis, m/s^2."""
    for axis, angle in enumerate(tilt):
        model = tilted(model, axis, angle)
    return np.array(model.opt.gravity)


def inertials(model: Any) -> Iterator[tuple[float, Real, Real]]:
    """Give mass, centre of mass and inertia about it of each link, in the link's own axes."""
    import mujoco

    for link in range(1, model.nbody):
        turned = np.zeros(9)
        mujoco.mju_quat2Mat(turned, model.body_iquat[link])
        axes = turned.reshape(3, 3)
        yield (
            float(model.body_mass[link]),
            model.body_ipos[link].copy(),
            axes @ np.diag(model.body_inertia[link]) @ axes.T,
        )


def _quiet(model: Any) -> tuple[Any, Any]:
    """The model without drives and constraints: friction and stops aren't the motion's need."""
    import mujoco

    quiet = copy(model)
    quiet.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    return quiet, mujoco.MjData(quiet)
