"""How far a cause stands out of what the log can't tell: encoders, and inertias inside their tolerance."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfiltfilt

from chladni_withheld.case import Matrix
from chladni_withheld.robots.afloat import let_float
from chladni_withheld.robots.machine import Motion
from chladni_withheld.robots.scene import Scene

#: Torques are compared below this, Hz: about where robots are identified.
BAND_HZ = 8.0
#: Share of a joint's torque that no one can tell, whose encoders are however good.
FLOOR = 0.02
_ENOUGH_HZ = 100.0
#: Inertias may be as far off as that.
_MOST_SIGMAS = 3.0


def lacking(scene: Scene, model: pin.Model, motion: Motion) -> Matrix:
    """Torque that the motion needs and a servo without what is hidden doesn't give, ``[joint, sample]``."""
    needed = _inverse(model, motion, motion.reading, motion.speed, motion.acceleration)
    return needed - _asked(scene, motion.t_s, motion.reading, motion.speed)


def _inverse(model: pin.Model, motion: Motion, *course: Matrix) -> Matrix:
    whole, all_three = _on_base(model, motion, course)
    data = whole.createData()
    found = np.array([pin.rnea(whole, data, *each) for each in zip(*all_three, strict=True)]).T
    return np.asarray(found[-course[0].shape[0] :])


def _on_base(model: pin.Model, motion: Motion, course: Sequence[Matrix]) -> tuple[pin.Model, tuple[Matrix, ...]]:
    """The model, and positions, velocities, accelerations ``[sample, number]``, with those of a base that floats."""
    if not motion.base.size:
        return model, tuple(one.T for one in course)
    base = motion.base[:7], motion.base[7:13], motion.base[13:]
    return let_float(model), tuple(np.vstack(both).T for both in zip(base, course, strict=True))


def _asked(scene: Scene, t_s: Matrix, q: Matrix, v: Matrix) -> Matrix:
    servo, commands = scene.machine.servo, scene.commands
    held = commands.values[:, np.searchsorted(commands.t_s, t_s + 1e-9, "right") - 1]
    return np.clip(
        servo.kp[:, None] * (held - q) - servo.kd[:, None] * v, -servo.limit[:, None], servo.limit[:, None]
    )


def smooth(signals: Matrix, rate_hz: float) -> Matrix:
    """Below `BAND_HZ`, without a shift."""
    sections = butter(4, BAND_HZ, fs=rate_hz, output="sos")
    found: Matrix = sosfiltfilt(sections, signals, axis=-1)
    return found


def noise_of(scene: Scene, motion: Motion) -> Matrix:
    """Torque of each joint that encoders, differentiated, make up: RMS, with the floor beside it."""
    rate_hz, step = scene.recorder.state_hz, scene.recorder.resolution
    told = np.rint(motion.reading / step) * step
    errors = []
    for reading in (told, motion.reading):
        q = smooth(reading, rate_hz)
        v = np.gradient(q, 1.0 / rate_hz, axis=1)
        a = np.gradient(v, 1.0 / rate_hz, axis=1)
        errors.append(_inverse(scene.robot.model, motion, q, v, a) - _asked(scene, motion.t_s, q, v))
    made_up = np.sqrt(np.mean((errors[0] - errors[1]) ** 2, axis=1))
    floor = FLOOR * motion.given.std(axis=1)
    found: Matrix = np.hypot(made_up, floor)
    return found


def severity(scene: Scene, difference: Matrix, motion: Motion, *, but: int = -1) -> tuple[float, float]:
    """Torque of a cause over what can't be told, and the same when inertias take what their tolerances allow.

    RMS over the log of the whitened torques' length over the joints: a cause at one joint is as large as there.

    Parameters
    ----------
    difference
        What `lacking` gives.
    but
        A link whose numbers stay: they are the cause.
    """
    noise = noise_of(scene, motion)
    # What is smooth needs no more.
    stride = max(1, int(scene.recorder.state_hz // _ENOUGH_HZ))
    rate_hz = scene.recorder.state_hz / stride
    lacks = (smooth(difference[:, ::stride], rate_hz) / noise[:, None]).ravel()
    columns = _inertia_columns(scene, motion.every(stride), but) / noise[:, None, None]
    table = smooth(columns, rate_hz).transpose(0, 2, 1).reshape(lacks.size, -1)
    q, r = np.linalg.qr(table)
    within = lsq_linear(r, q.T @ lacks, bounds=(-_MOST_SIGMAS, _MOST_SIGMAS)).x
    samples = lacks.size / noise.size
    left = lacks - table @ within
    return float(np.linalg.norm(lacks) / np.sqrt(samples)), float(np.linalg.norm(left) / np.sqrt(samples))


def _inertia_columns(scene: Scene, motion: Motion, but: int) -> Matrix:
    """Torque of one sigma of every link's mass, centre and inertia: ``[joint, number, sample]``."""
    model, sigma = scene.robot.model, scene.tolerance["inertia"]
    whole, course = _on_base(model, motion, (motion.reading, motion.speed, motion.acceleration))
    data = whole.createData()
    tables = np.array([pin.computeJointTorqueRegressor(whole, data, *each) for each in zip(*course, strict=True)])
    # Rows and columns of a base that floats come first.
    tables = tables[:, -model.nv :, -10 * model.nv :]
    columns = []
    for link in set(range(model.nv)) - {but}:
        inertia = model.inertias[link + 1]
        mass, lever, around = inertia.mass, inertia.lever, inertia.inertia
        off = [pin.Inertia(mass * (1.0 + sigma), lever, around * (1.0 + sigma)),
               *(pin.Inertia(mass, lever * (1.0 + sigma * axis), around) for axis in np.eye(3)),
               pin.Inertia(mass, lever, around * (1.0 + sigma))]  # fmt: skip
        here = inertia.toDynamicParameters()
        columns += [tables[:, :, 10 * link : 10 * link + 10] @ (each.toDynamicParameters() - here) for each in off]
    found: Matrix = np.array(columns).transpose(2, 0, 1)
    return found
