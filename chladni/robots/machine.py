"""The machine that a robot's description stands for: its numbers as they are believed, or as a log tells them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.robots.dynamics import inertial_numbers

if TYPE_CHECKING:
    from chladni.robots.robot import Robot, RobotJoint, Servo
    from chladni.signals.arrays import Real

_ROUNDING: Final = 1e-9
#: Of its lowest described eigenvalue: what is left of it.
_LEAST: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """Friction that builds up over a way to its level: ``dF = force / yields (1 - F / force sgn s) dq`` (Dahl 1968).

    Attributes
    ----------
    force, yields
        N m (N); rad (m).
    """

    force: float
    yields: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Uneven:
    """Friction beyond the constant part, linear between places.

    Attributes
    ----------
    places, beyond
        rad (m), rising; N m (N) at each.
    """

    places: tuple[float, ...]
    beyond: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ripple:
    """Torque that resists by ``sine sin(2 pi q / period) + cosine cos(2 pi q / period)``; N m (N), rad (m)."""

    sine: float
    cosine: float
    period: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Spring beyond a place: above it where `side` is 1, below where it's -1.

    Attributes
    ----------
    stiffness, clearance
        N m/rad (N/m); the place times `side`, rad (m).
    """

    stiffness: float
    clearance: float
    side: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Transmission:
    """Spring and play between a motor and its link; the drive's loop works on the motor's angle.

    Attributes
    ----------
    stiffness, gap, inertia
        N m/rad (N/m), infinite for teeth that don't give; whole play, rad (m); of the motor beyond the description's,
        at the joint, kg m^2 (kg).
    logs_motor
        Whether the log reads the motor's angle, not the link's.
    """

    stiffness: float
    gap: float
    inertia: float
    logs_motor: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineJoint:
    """A joint of the machine, in SI units.

    Attributes
    ----------
    joint
        As described.
    servo
        Its drive: gains and limit as the machine has them, but for `gain`; None for a passive joint.
    friction, load, rise, fading
        Dry friction ``friction + load |torque| + rise exp(-(speed / fading)^2)``: N m (N), 1, N m (N), rad/s (m/s).
    damping, quadratic
        Friction in proportion to the speed, and to its square.
    armature
        Rotor inertia at the joint.
    stiffness, torque
        Of what pulls back beyond the description's own springs: ``stiffness q + torque``.
    gain
        Torque that arrives over torque that the drive was asked for.
    lag_s
        Time constant of the torque.
    delay_s
        By which commands arrive late.
    dead, rate
        Torque below which the drive gives none, N m (N), and speed that its reference doesn't exceed, rad/s (m/s).
    loop, uneven, ripple, stops, transmission
        Further laws; None and empty without.
    reading, drive_reading
        What the log reads, and what the drive reads beyond the log, minus the truth; rad (m).
    """

    joint: RobotJoint
    servo: Servo | None
    friction: float
    damping: float
    armature: float
    load: float = 0.0
    rise: float = 0.0
    fading: float = 1.0
    quadratic: float = 0.0
    stiffness: float = 0.0
    torque: float = 0.0
    gain: float = 1.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    dead: float = 0.0
    rate: float = np.inf
    loop: Loop | None = None
    uneven: Uneven | None = None
    ripple: Ripple | None = None
    stops: tuple[Stop, ...] = ()
    transmission: Transmission | None = None
    reading: float = 0.0
    drive_reading: float = 0.0

    def with_share(self, share: float) -> MachineJoint:
        """Give the same with laws that were found in units of torque that was asked, where a share of it arrives."""
        loop, wave, way = self.loop, self.ripple, self.uneven
        return replace(
            self, rise=share * self.rise, quadratic=share * self.quadratic, load=share * self.load,
            stiffness=share * self.stiffness, torque=share * self.torque,
            loop=None if loop is None else replace(loop, force=share * loop.force),
            uneven=None if way is None else replace(way, beyond=tuple(share * one for one in way.beyond)),
            ripple=None if wave is None else replace(wave, sine=share * wave.sine, cosine=share * wave.cosine),
            stops=tuple(replace(one, stiffness=share * one.stiffness) for one in self.stops),
        )  # fmt: skip

    def gains(self) -> tuple[float, float, float]:
        """Give kp, kd and limit as they act at the joint; zeros and an infinite limit where nothing says."""
        servo = self.servo
        if servo is None:
            return 0.0, 0.0, np.inf
        limit = np.inf if servo.limit is None else servo.limit
        return self.gain * (servo.kp or 0.0), self.gain * (servo.kd or 0.0), self.gain * limit


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """What acts on ``position of the first joint + ratio times that of the second``: gears, a cable over both.

    Attributes
    ----------
    joints, ratio
        Names; 1 or -1 of gears that run in one another.
    friction, damping
        N m; N m s/rad.
    stiffness, torque
        A spring's, N m/rad, and what it pulls back with where both joints are at zero, N m.
    """

    joints: tuple[str, str]
    ratio: float
    friction: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    torque: float = 0.0

    @property
    def rest(self) -> float:
        """Of a spring: where it pulls nothing."""
        return -self.torque / self.stiffness

    def stiffness_at(self, joint: str) -> float:
        """Of a spring: what a joint feels of it alone; zero at any other."""
        return self.stiffness * float(dict(zip(self.joints, (1.0, self.ratio), strict=True)).get(joint, 0.0)) ** 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Machine:
    """A robot with the numbers of its machine.

    Attributes
    ----------
    robot
        As described.
    joints
        All of them, in the robot's order.
    inertial
        ``[link, 10]`` as `chladni.robots.dynamics.INERTIAL` lists them.
    tilt
        Angles by which the base is turned about its x and y axes, rad.
    couplings
        Between two joints of a chain.
    imu_turned
        Rotation vector in its own axes by which the IMU of a base that floats is turned from how it's described, rad.
    """

    robot: Robot
    joints: tuple[MachineJoint, ...]
    inertial: Real
    tilt: tuple[float, float] = (0.0, 0.0)
    couplings: tuple[Coupling, ...] = ()
    imu_turned: tuple[float, float, float] = (0.0, 0.0, 0.0)


def as_described(robot: Robot) -> Machine:
    """Give the machine that the description believes in."""
    joints = tuple(
        MachineJoint(
            joint=one, servo=one.servo, friction=one.friction, damping=one.damping, armature=one.armature,
            delay_s=robot.delay_s,
        )
        for one in robot.joints
    )  # fmt: skip
    return Machine(robot=robot, joints=joints, inertial=inertial_numbers(robot))


def physical(described: Real, wanted: Real) -> Real:
    """Give the inertial numbers nearest to the wanted ones that a body of their mass and centre can have.

    A body can have numbers whose pseudo-inertia ``[[S, h], [h', m]]``, S the second moments of its mass, is positive
    semi-definite (Wensing, Kim & Slotine 2018): those are S about the centre without negative eigenvalues. Mass and
    centre, which gravity tells of, stay.

    Parameters
    ----------
    described, wanted
        ``[10]``; what is described counts as a body, but for rounding.
    """
    if wanted[0] <= 0:
        return described
    # Near the bounds a body is a point, a rod or a plate, which no tolerance makes of another.
    lowest = float(np.linalg.eigvalsh(_about_centre(described))[0])
    least = _LEAST * lowest if lowest > 0 else lowest
    moments, axes = np.linalg.eigh(_about_centre(wanted))
    if moments[0] >= least:
        return wanted
    more = axes * np.maximum(least - moments, 0.0) @ axes.T
    grown = np.trace(more) * np.eye(3) - more
    return np.concatenate([wanted[:4], wanted[4:] + grown[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


def _about_centre(numbers: Real) -> Real:
    """``[3, 3]``: second moments of mass about the centre."""
    inertia = _inertia(numbers)
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.asarray(second - np.outer(numbers[1:4], numbers[1:4]) / numbers[0])


def about_centre(numbers: Real) -> tuple[float, Real, Real]:
    """Give mass, centre of mass and inertia about it ``[3, 3]`` of the ten numbers of a link with a mass."""
    mass, moment = float(numbers[0]), numbers[1:4]
    centre = moment / mass
    inertia = _inertia(numbers) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    low, middle, high = np.linalg.eigvalsh(inertia)
    # MuJoCo takes the sum of two principal moments for less than the third if it is so by rounding alone.
    short = high * (1.0 + _ROUNDING) - low - middle
    return mass, centre, inertia + np.eye(3) * (short if 0.0 < short < 1e3 * _ROUNDING * high else 0.0)


def _inertia(numbers: Real) -> Real:
    xx, yy, zz, xy, xz, yz = numbers[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
