"""The hidden robot: links by Pinocchio, each joint with its motor, its transmission, its friction and its servo."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields

import numpy as np
import pinocchio as pin

from chladni_withheld.case import Matrix
from chladni_withheld.robots.afloat import Afloat, felt, let_float

#: Torque that the world adds at the joints: ``load(model, data, t, q, v) -> N m``.
Load = Callable[[pin.Model, pin.Data, float, Matrix, Matrix], Matrix]


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """LuGre friction of every joint, at its motor.

    ``F = s0 z + s1 dz/dt + viscous s + square s|s|``, ``dz/dt = s - s0 |s| z/g``, where
    ``g = level(s)(coulomb + (static - coulomb) exp(-|s/speed|^exponent) + per_load |torque|)``; C. Canudas de Wit and
    others, IEEE Transactions on Automatic Control 40 (1995). Zeros are a joint without.
    """

    coulomb: Matrix
    static: Matrix
    speed: Matrix
    exponent: Matrix
    per_load: Matrix
    bristle: Matrix
    damping: Matrix
    viscous: Matrix
    square: Matrix

    @classmethod
    def none(cls, count: int) -> "Friction":
        """Give what doesn't rub."""
        zero, one = np.zeros(count), np.ones(count)
        return cls(coulomb=zero, static=zero, speed=0.05 * one, exponent=2.0 * one, per_load=zero, bristle=one,
                   damping=zero, viscous=zero, square=zero)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Transmission:
    """Spring, damper and play between motor and link; `stiffness` is infinite where the joint is rigid.

    Attributes
    ----------
    stiffness, damping
        N m/rad and N m s/rad.
    gap
        Whole width of the play, rad.
    inertia
        Of the motor, seen at the joint, kg m^2.
    logs_motor
        Whether the encoder whose reading is logged sits at the motor, as that of the loop does.
    """

    stiffness: Matrix
    damping: Matrix
    gap: Matrix
    inertia: Matrix
    logs_motor: bool = False

    @classmethod
    def rigid(cls, count: int) -> "Transmission":
        """Give joints whose motor is the link's."""
        zero = np.zeros(count)
        return cls(stiffness=np.full(count, np.inf), damping=zero, gap=zero, inertia=np.ones(count))


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """Position loop of every joint: ``kp (reference - reading) - kd speed``, limited, times `gain`.

    Attributes
    ----------
    period_s
        The loop works once so often, and holds its torque between.
    delay_s
        From a command's stamp to its being used, of each joint.
    lag_s
        First-order time constant that the reference passes, zero for none.
    limit, dead
        Largest torque, and the torque that a drive must be asked for before it gives any, N m.
    most
        Torque at which the motor saturates, which its loop doesn't know.
    gain
        Torque that arrives over torque that was asked for.
    """

    kp: Matrix
    kd: Matrix
    limit: Matrix
    dead: Matrix
    period_s: float
    delay_s: Matrix
    lag_s: Matrix
    most: Matrix
    gain: Matrix


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """All that moves.

    Attributes
    ----------
    model
        Pinocchio's, with true inertias, gravity (of a base that may not be level) and rotor inertias.
    offset
        Reading of each encoder minus the truth, rad.
    loads
        Further torques at the joints.
    base
        What holds it; None of one that is fixed.
    """

    model: pin.Model
    servo: Servo
    friction: Friction
    transmission: Transmission
    offset: Matrix
    loads: tuple[Load, ...] = field(default=())
    base: Afloat | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What a machine did, ``[joint, sample]``.

    Attributes
    ----------
    t_s
        Stamps, from the log's start.
    reading, speed, acceleration
        Of what the encoder sits at, without its resolution: rad, rad/s, rad/s^2.
    asked, given
        Torque that the loop asked for, and that arrived, N m.
    link, link_speed
        Where the links truly were.
    base
        Place, quaternion, velocity and acceleration of a base that floats, the latter two in its own axes
        ``[19, sample]``; no rows of one that is fixed.
    imu
        What an IMU on it feels, at its own stamps: these, s, turning and acceleration less gravity ``[7, message]``.
    """

    t_s: Matrix
    reading: Matrix
    speed: Matrix
    acceleration: Matrix
    asked: Matrix
    given: Matrix
    link: Matrix
    link_speed: Matrix
    base: Matrix
    imu: Matrix

    def every(self, stride: int) -> "Motion":
        """Fewer samples of it."""
        return Motion(**{each.name: getattr(self, each.name)[..., ::stride] for each in fields(self)})


@dataclass(frozen=True, slots=True, kw_only=True)
class Commands:
    """Messages with references, held until the next: stamps from the log's start, s, and ``[joint, message]``."""

    t_s: Matrix
    values: Matrix


def simulate(machine: Machine, commands: Commands, t_s: Matrix, *, step_s: float, resolution: float = 0.0) -> Motion:
    """Move a machine along its commands, from rest under the first of them.

    Semi-implicit steps: speeds first, then positions with the new speeds; bristles by the implicit rule, so that they
    can't swing.

    Parameters
    ----------
    t_s
        Stamps of the samples, increasing; the motion begins with the first command.
    step_s
        Of the integration; the servo's period is a whole number of them.
    resolution
        Of the encoder that the servo reads, rad; zero for a perfect one.
    """
    base = machine.base
    run = (
        _Run(machine, commands, step_s, resolution)
        if base is None
        else _AfloatRun(machine, base, commands, step_s, resolution)
    )
    begin = commands.t_s[0]
    wanted = np.rint((t_s - begin) / step_s).astype(int)
    rows: list[tuple[Matrix, ...]] = []
    for step in range(int(wanted[-1]) + 1):
        t = begin + step * step_s
        if step % run.steps_per_period == 0:
            run.control(t)
        state = run.state()
        run.advance(t)
        if step == wanted[len(rows)]:
            # What accelerates is known when the step has been made.
            rows.append(run.sample(state))
    found = [np.array(each).T for each in zip(*rows, strict=True)]
    return Motion(t_s=t_s, imu=run.sensed(begin), **dict(zip(_SAMPLED, found, strict=True)))


_SAMPLED = ("reading", "speed", "acceleration", "asked", "given", "link", "link_speed", "base")


class _Run:
    """A machine on its way: links `q`, `v`; motors `theta`, `omega`, which rigid joints share with them."""

    def __init__(self, machine: Machine, commands: Commands, step_s: float, resolution: float) -> None:
        self.machine, self.commands, self.h, self.resolution = machine, commands, step_s, resolution
        self.data = machine.model.createData()
        self.steps_per_period = max(1, round(machine.servo.period_s / step_s))
        self.soft = np.isfinite(machine.transmission.stiffness)
        self.any_soft = bool(self.soft.any())
        first = commands.values[:, 0]
        self.q, self.theta = self._resting(first)
        self.v, self.omega, self.alpha = np.zeros((3, first.size))
        self.reference, self.z = first.copy(), np.zeros(first.size)
        self.asked, self.given = np.zeros((2, first.size))
        friction = machine.friction
        self.rubs = bool(np.any(friction.coulomb) or np.any(friction.per_load))

    def _resting(self, reference: Matrix) -> tuple[Matrix, Matrix]:
        """Where gravity is balanced by the servo: a fixed point, since the servo is much stiffer."""
        machine = self.machine
        stiffness = machine.servo.gain * machine.servo.kp
        q, weight = reference, np.zeros(reference.size)
        for _ in range(100):
            weight = pin.computeGeneralizedGravity(machine.model, self.data, q)
            q = 0.5 * q + 0.5 * (reference - machine.offset - weight / stiffness)
        return q, q + weight / machine.transmission.stiffness

    def control(self, t: float) -> None:
        """Read encoders and commands, and ask for a torque."""
        servo, machine = self.machine.servo, self.machine
        reading, speed = self.theta + machine.offset, self.omega
        if self.resolution:
            reading = np.rint(reading / self.resolution) * self.resolution
        # A message whose stamp is just reached counts.
        sent = np.searchsorted(self.commands.t_s, t - servo.delay_s + 1e-9, "right")
        held = self.commands.values[np.arange(sent.size), np.maximum(sent - 1, 0)]
        self.reference = self.reference + (held - self.reference) * servo.period_s / (servo.lag_s + servo.period_s)
        self.asked = np.clip(servo.kp * (self.reference - reading) - servo.kd * speed, -servo.limit, servo.limit)
        given = self.asked - np.clip(self.asked, -servo.dead, servo.dead)
        # What saturates isn't told by the loop's own limit.
        self.given = servo.gain * np.clip(given, -servo.most, servo.most)

    def advance(self, t: float) -> None:
        """Go one step."""
        machine, h = self.machine, self.h
        joint = self.given
        if self.any_soft:
            passed = self._passed()
            turning = (joint - self._rubbing(passed) - passed) / machine.transmission.inertia
            joint = np.where(self.soft, passed, joint - self._rubbing(joint))
        else:
            turning = self.alpha
            joint = joint - self._rubbing(joint)
        for load in machine.loads:
            joint = joint + load(machine.model, self.data, t, self.q, self.v)
        self.alpha = self.accelerated(t, joint)
        self.v = self.v + h * self.alpha
        self.q = self.q + h * self.v
        if self.any_soft:
            self.turning = np.where(self.soft, turning, self.alpha)
            self.omega = np.where(self.soft, self.omega + h * turning, self.v)
            self.theta = np.where(self.soft, self.theta + h * self.omega, self.q)
        else:
            self.omega, self.theta, self.turning = self.v, self.q, self.alpha

    def accelerated(self, _t: float, joint: Matrix) -> Matrix:
        """Acceleration of the joints by their torques."""
        found: Matrix = pin.aba(self.machine.model, self.data, self.q, self.v, joint)
        return found

    def _passed(self) -> Matrix:
        """Torque in the transmissions: nothing inside the play, and no pull of the damper."""
        way = self.machine.transmission
        twist, rate = self.theta - self.q, self.omega - self.v
        pressed = twist - np.clip(twist, -0.5 * way.gap, 0.5 * way.gap)
        with np.errstate(invalid="ignore"):
            torque = np.where(self.soft, way.stiffness * pressed, 0.0)
        torque = torque + np.where(pressed != 0.0, way.damping * rate, 0.0)
        return np.where(torque * pressed > 0.0, torque, 0.0)

    def _rubbing(self, torque: Matrix) -> Matrix:
        """Friction at the motors; bristles take one implicit step."""
        law, s = self.machine.friction, self.omega
        fast = np.abs(s)
        force = (law.viscous + law.square * fast) * s
        if not self.rubs:
            return force
        level = law.coulomb + (law.static - law.coulomb) * np.exp(-((fast / law.speed) ** law.exponent))
        level = level + law.per_load * np.abs(torque) + 1e-9
        before = self.z
        self.z = (before + self.h * s) / (1.0 + self.h * law.bristle * fast / level)
        return force + law.bristle * self.z + law.damping * (self.z - before) / self.h

    def state(self) -> tuple[Matrix, ...]:
        """Reading and speed of the encoders, positions and speeds of the links, and the base's."""
        motor = self.machine.transmission.logs_motor
        reading, speed = (self.theta, self.omega) if motor else (self.q, self.v)
        return reading + self.machine.offset, speed, self.q, self.v, np.zeros(0)

    def sample(self, state: tuple[Matrix, ...]) -> tuple[Matrix, ...]:
        """What is logged of the state that a step began with, in the order of `_SAMPLED`."""
        reading, speed, q, v, base = state
        acceleration = self.turning if self.machine.transmission.logs_motor else self.alpha
        return reading, speed, acceleration, self.asked, self.given, q, v, base

    def sensed(self, _begin: float) -> Matrix:
        """What an IMU felt, of motions that began then; a base that is fixed has none."""
        return np.zeros((7, 0))


class _AfloatRun(_Run):
    """A machine whose base moves: `pose`, with spatial velocity `twist` and acceleration `push` in its own axes."""

    def __init__(self, machine: Machine, base: Afloat, commands: Commands, step_s: float, resolution: float) -> None:
        super().__init__(machine, commands, step_s, resolution)
        self.holder = base
        self.whole = let_float(machine.model)
        self.all = self.whole.createData()
        self.pose, self.twist, self.push = pin.SE3.Identity(), np.zeros(6), np.zeros(6)
        self.felt: list[Matrix] = []

    def accelerated(self, t: float, joint: Matrix) -> Matrix:
        """Acceleration of the joints; the base goes its step."""
        force = self.holder.force(t, self.pose, self.twist)
        q = np.concatenate([pin.SE3ToXYZQUAT(self.pose), self.q])
        found: Matrix = pin.aba(
            self.whole, self.all, q, np.concatenate([self.twist, self.v]), np.concatenate([force, joint])
        )
        upright = self.pose.rotation.T @ self.whole.gravity.linear
        self.felt.append(felt(self.holder.sensor, self.twist, found[:6], upright))
        self.push, self.twist = found[:6], self.twist + self.h * found[:6]
        self.pose = self.pose * pin.exp6(pin.Motion(self.h * self.twist))
        return found[6:]

    def state(self) -> tuple[Matrix, ...]:
        """With the base."""
        return (*super().state()[:-1], np.concatenate([pin.SE3ToXYZQUAT(self.pose), self.twist]))

    def sample(self, state: tuple[Matrix, ...]) -> tuple[Matrix, ...]:
        """With the base."""
        return (*super().sample(state)[:-1], np.concatenate([state[-1], self.push]))

    def sensed(self, begin: float) -> Matrix:
        """Means over the sensor's periods, stamped at their ends."""
        sensor = self.holder.sensor
        count = round(1.0 / sensor.rate_hz / self.h)
        first = round((sensor.begin_s - begin) / self.h) % count
        steps = np.array(self.felt[first:])
        means = steps[: len(steps) // count * count].reshape(-1, count, 6).mean(axis=1)
        stamps = begin + self.h * (first + count * np.arange(1, len(means) + 1))
        return np.vstack([stamps, means.T])
