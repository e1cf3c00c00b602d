"""A base that nobody fixed: it hangs or is carried, and an IMU on it tells how it moves."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from chladni_withheld.case import Matrix
from chladni_withheld.robots.excitation import Rng

Way = Literal["hangs", "carried"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """An IMU on the base: its place, its axes, and what spoils its readings.

    Attributes
    ----------
    pose
        In the base's axes.
    rate_hz, begin_s
        Of its messages.
    gyro, accelerometer
        Constant errors ``[3]`` and standard deviations of the noise, rad/s and m/s^2.
    """

    pose: pin.SE3
    rate_hz: float
    begin_s: float
    gyro: tuple[Matrix, float]
    accelerometer: tuple[Matrix, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Afloat:
    """What holds the base: a spring and a damper to a hand that may move.

    Attributes
    ----------
    linear, angular
        Stiffness and damping: N/m, N s/m; N m/rad, N m s/rad.
    way, omega, phase
        ``[6, term]`` of the hand's motion, m and rad, by sines.
    sag
        By which the spring is longer than at rest, m.
    """

    word: Way
    linear: tuple[float, float]
    angular: tuple[float, float]
    way: Matrix
    omega: Matrix
    phase: Matrix
    sag: float
    sensor: Sensor

    def force(self, t: float, pose: pin.SE3, velocity: Matrix) -> Matrix:
        """Force and moment on the base at its origin, in its own axes ``[6]``; `velocity` in these, too."""
        hand = np.sum(self.way * np.sin(self.omega * t + self.phase), axis=1)
        pull = self.linear[0] * (hand[:3] + np.array([0.0, 0.0, self.sag]) - pose.translation)
        turn = self.angular[0] * pin.log3(pose.rotation.T @ pin.exp3(hand[3:]))
        linear = pose.rotation.T @ pull - self.linear[1] * velocity[:3]
        return np.concatenate([linear, turn - self.angular[1] * velocity[3:]])


def let_float(model: pin.Model) -> pin.Model:
    """The same robot on a base with all its freedom, whose joints come after six of its own."""
    found = pin.Model()
    found.gravity = model.gravity
    root = found.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    found.appendBodyToJoint(root, model.inertias[0], pin.SE3.Identity())
    for index in range(1, model.njoints):
        placed = found.addJoint(
            root + model.parents[index], model.joints[index], model.jointPlacements[index], model.names[index]
        )
        found.appendBodyToJoint(placed, model.inertias[index], pin.SE3.Identity())
    found.armature = np.concatenate([np.zeros(6), model.armature])
    return found


def draw_afloat(rng: Rng, model: pin.Model) -> Afloat:
    """A base that hangs from a soft spring, or that a hand carries about."""
    word: Way = "hangs" if rng.random() < 0.5 else "carried"
    mass = sum(inertia.mass for inertia in model.inertias)
    inertia = np.trace(pin.crba(let_float(model), let_float(model).createData(), _rest(model))[3:6, 3:6]) / 3.0
    # A cord hangs softly; hands are stiffer, and damp more.
    hz, ratio = (rng.uniform(0.7, 1.5, 2), 0.1) if word == "hangs" else (rng.uniform(1.5, 3.0, 2), 0.4)
    linear, angular = (size * (2.0 * np.pi * own) ** 2 for size, own in zip((mass, inertia), hz, strict=True))
    size = float(word == "carried") * np.array([0.1] * 3 + [0.25] * 3)
    return Afloat(
        word=word, linear=(linear, 2.0 * ratio * float(np.sqrt(linear * mass))),
        angular=(angular, 2.0 * ratio * float(np.sqrt(angular * inertia))),
        way=size[:, None] * rng.normal(size=(6, 3)) / np.sqrt(3.0), omega=2.0 * np.pi * rng.uniform(0.1, 1.0, (6, 3)),
        phase=rng.uniform(0.0, 2.0 * np.pi, (6, 3)), sag=mass * 9.81 / linear,
        sensor=_draw_sensor(rng),
    )  # fmt: skip


def _rest(model: pin.Model) -> Matrix:
    return np.concatenate([[0.0] * 6, [1.0], pin.neutral(model)])


def _draw_sensor(rng: Rng) -> Sensor:
    rate_hz = float(rng.choice([100.0, 125.0, 200.0, 250.0, 500.0]))
    return Sensor(
        pose=pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.1, 0.1, 3)), rate_hz=rate_hz,
        begin_s=float(rng.uniform(0.0, 1.0 / rate_hz)),
        gyro=(0.005 * rng.normal(size=3), 0.005), accelerometer=(0.05 * rng.normal(size=3), 0.05),
    )  # fmt: skip


def felt(sensor: Sensor, velocity: Matrix, acceleration: Matrix, upright: Matrix) -> Matrix:
    """What an IMU on the base feels ``[6]``: its turning, then its acceleration less gravity, in its own axes.

    Parameters
    ----------
    velocity, acceleration
        Spatial, of the base in its own axes ``[6]``.
    upright
        Gravity in the base's axes.
    """
    motion, change = (sensor.pose.actInv(pin.Motion(one)) for one in (velocity, acceleration))
    # A spatial acceleration is not that of a point.
    point = change.linear + np.cross(motion.angular, motion.linear)
    return np.concatenate([motion.angular, point - sensor.pose.rotation.T @ upright])
