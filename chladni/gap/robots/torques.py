"""The torque that a robot's description lacks: what its drives gave, less what its motion needed."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np
from scipy.ndimage import correlate1d
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from chladni.gap.robots.joint_noise import imu_noise, steps_and_noise, torque_noise, upper_density
from chladni.robots.dynamics import Needed, carried_columns, gravity_columns, needed_torque
from chladni.robots.floating_base import BaseMotion, FloatingBase, at_origin, floating_base, place_on_base
from chladni.robots.joint_log import JointLog
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Index, Mask, Real
from chladni.signals.errors import LogError, ModelError
from chladni.signals.visible import visible

#: Up to which frequency torques are compared, Hz: joints of arms and legs move below it, and differentiated encoder
#: steps grow with its square (Swevers, Verdonck & De Schutter 2007 take 10 Hz).
CUTOFF_HZ = 8.0
#: Of the sample rate: highest cutoff.
_MOST = 1.0 / 6.0
#: Signs of velocities follow up to so many cutoffs.
_FAST = 4.0
#: Periods of the cutoff that both ends of a stretch lose to the filter.
_ENDS = 3.0
#: Least periods of the cutoff in a stretch.
LEAST = 12.0
#: Of the usual torque: what a rigid description is right to, unless a fit leaves less.
_RIGHT = 0.02
#: Of its usual speed: within this a joint could move either way, however fine its encoder.
_STILL = 0.002
_ORDER = 4
#: Lines on which the noise is summed up, and its share of a signal that stands clear of it.
_LINES, _CLEAR = 64, 0.02
ALL_COMMANDS = "all commands"
#: Share of rest within the filter's length up to which a sample counts as moving.
_MIXED = 0.5
#: Central difference of eighth order (Fornberg 1988): exact up to a third of the sample rate but for 2 %.
_SLOPE = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


@dataclass(frozen=True, kw_only=True, eq=False)
class Torques:
    """Torques of one log, smoothed alike, on a coarse grid.

    Attributes
    ----------
    robot, log
        The log's joints are the rows of all arrays.
    late_s
        Delays that were guessed, by site: what their columns are exact for.
    centre_m
        Centres of payloads that were guessed, by link: their own inertia is that of a point there.
    level
        ``[joint]``: share of the highest noise's power that the noise has; all of it when None.
    cutoff_hz
        Of the filter, whose phase is zero.
    """

    robot: Robot
    log: JointLog
    cutoff_hz: float
    late_s: Mapping[str, float] = field(default_factory=dict)
    centre_m: Mapping[str, Real] = field(default_factory=dict)
    level: Real | None = None

    @cached_property
    def joints(self) -> tuple[RobotJoint, ...]:
        """Those of the log."""
        return tuple(self.robot.joint(name) for name in self.log.joints)

    @cached_property
    def stretches(self) -> tuple[tuple[int, int], ...]:
        """First and last sample of the stretches that are long enough."""
        bounds = [0, *self.log.breaks, self.log.position.shape[1]]
        least = LEAST / self.cutoff_hz * self.log.sample_rate_hz
        found = tuple((a, b) for a, b in pairwise(bounds) if b - a >= least)
        if not found:
            raise LogError(
                f"{self.log.log}: no stretch of {LEAST / self.cutoff_hz:.2g} s without a gap; record a longer one"
            )
        return found

    @cached_property
    def kept(self) -> Index:
        """Samples of the coarse grid."""
        rate = self.log.sample_rate_hz
        ends = round(_ENDS / self.cutoff_hz * rate)
        return np.concatenate([np.arange(a + ends, b - ends, self._stride) for a, b in self.stretches])

    @property
    def _stride(self) -> int:
        return max(int(self.log.sample_rate_hz / (4.0 * self.cutoff_hz)), 1)

    @property
    def rate_hz(self) -> float:
        """Of the coarse grid."""
        return self.log.sample_rate_hz / self._stride

    @property
    def numbers_a_sample(self) -> float:
        """Independent numbers that a sample of the coarse grid stands for."""
        return min(2.0 * self.cutoff_hz / self.rate_hz, 1.0)

    def smooth(self, fast: Real) -> Real:
        """Filter ``[..., sample]`` of the log's grid, and give it on the coarse one."""
        return self._filtered(fast, self.cutoff_hz)[..., self.kept]

    @cached_property
    def loop(self) -> Real:
        """``[joint, coarse]``: missing torque a second that the servos' feedback comes late.

        Of kp q' + kd q'', which is what the command's motion asks less the rate of what is needed. Only up to where
        that stands above the noise of q, which is in the missing torque, too.
        """
        found = self.late(self.late_s.get(ALL_COMMANDS, 0.0), 0.0)
        frequency_hz = np.linspace(0.0, self.cutoff_hz, _LINES)[1:]
        omega = 2.0 * np.pi * frequency_hz
        for row, own in enumerate(found):
            gain = np.abs(1j * omega * (self.kp[row] + 1j * omega * self.kd[row])) ** 2
            noise = np.cumsum(gain * self._steps[1][row]) * frequency_hz[0]
            clear = np.searchsorted(noise, (_CLEAR * np.std(own)) ** 2)
            cutoff_hz = frequency_hz[min(clear, len(frequency_hz) - 1)]
            sections = butter(_ORDER, cutoff_hz, fs=self.rate_hz, output="sos")
            for a, b in self._coarse:
                rate = np.gradient(self.wanted[row, a:b], 1.0 / self.rate_hz)
                found[row, a:b] = sosfiltfilt(sections, own[a:b] - rate)
        return found

    @cached_property
    def _coarse(self) -> list[tuple[int, int]]:
        """Bounds of the stretches on the coarse grid."""
        first = np.searchsorted(self.kept, [a for a, _ in self.stretches])
        return list(pairwise([*first.tolist(), self.kept.size]))

    def _filtered(self, values: Real, cutoff_hz: float) -> Real:
        found = np.array(values, dtype=np.float64)
        sections = butter(_ORDER, cutoff_hz, fs=self.log.sample_rate_hz, output="sos")
        for a, b in self.stretches:
            found[..., a:b] = sosfiltfilt(sections, found[..., a:b], axis=-1)
        return found

    def _rate(self, values: Real) -> Real:
        """Time derivative on the log's grid."""
        found = np.zeros_like(values)
        for a, b in self.stretches:
            found[..., a:b] = correlate1d(values[..., a:b], _SLOPE, axis=-1, mode="nearest") * self.log.sample_rate_hz
        return found

    @property
    def fast_hz(self) -> float:
        """A few cutoffs."""
        return min(_FAST * self.cutoff_hz, 0.4 * self.log.sample_rate_hz)

    @cached_property
    def fast_position(self) -> Real:
        """``[joint, sample]`` of the log's grid, below a few cutoffs."""
        return self._filtered(self.log.position, self.fast_hz)

    @cached_property
    def fast_velocity(self) -> Real:
        """Its derivative."""
        return self._rate(self.fast_position)

    @cached_property
    def _motion(self) -> tuple[Real, Real, Real]:
        position = self._filtered(self.log.position, self.cutoff_hz)
        velocity = self._rate(position)
        acceleration = self._rate(velocity)
        return position[:, self.kept], velocity[:, self.kept], acceleration[:, self.kept]

    @property
    def position(self) -> Real:
        """``[joint, coarse]``."""
        return self._motion[0]

    @property
    def velocity(self) -> Real:
        """``[joint, coarse]``."""
        return self._motion[1]

    @property
    def acceleration(self) -> Real:
        """``[joint, coarse]``."""
        return self._motion[2]

    @cached_property
    def base(self) -> FloatingBase | None:
        """The base, where it floats."""
        return floating_base(self.robot)

    def base_motion(self, cutoff_hz: float, turned: Sequence[float] = (0.0, 0.0, 0.0)) -> BaseMotion | None:
        """Give the motion of a base that floats, as its IMU tells it below a cutoff.

        Parameters
        ----------
        turned
            By which the IMU is turned from how it's described, a rotation vector in its own axes, rad.
        """
        if self.base is None or self.log.imu is None:
            return None
        imu = self.log.imu
        described, place = place_on_base(self.robot, self.base, imu.site)
        axes = described @ Rotation.from_rotvec(turned).as_matrix()
        force, turning = (
            self._filtered(axes @ one, cutoff_hz) for one in (imu.linear_acceleration, imu.angular_velocity)
        )
        felt = BaseMotion(force=force, angular_velocity=turning, angular_acceleration=self._rate(turning))
        return at_origin(place, felt)

    @cached_property
    def all_positions(self) -> Real:
        """``[qpos, coarse]`` of the whole robot: joints that the log lacks rest where the description has them."""
        rest = np.asarray(self.robot.model.qpos0, dtype=np.float64).copy()
        if self.base is not None:
            # Everything is told in the axes of the base.
            rest[self.base.position : self.base.position + 7] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        return _laid(self.position, [one.position for one in self.joints], rest)

    @cached_property
    def _rates(self) -> tuple[Real, Real]:
        """``[dof, coarse]``: velocities and accelerations."""
        return self._rates_by(np.zeros(3))

    def _rates_by(self, turned: Real) -> tuple[Real, Real]:
        """Give them for an IMU that is turned."""
        still, places = np.zeros(self.robot.model.nv), [one.dof for one in self.joints]
        velocity, acceleration = (_laid(one, places, still) for one in (self.velocity, self.acceleration))
        motion = self.base_motion(self.cutoff_hz, turned.tolist())
        if self.base is not None and motion is not None:
            linear, angular = (slice(a, a + 3) for a in (self.base.dof, self.base.dof + 3))
            velocity[angular] = motion.angular_velocity[:, self.kept]
            gravity = np.array(self.robot.model.opt.gravity)
            acceleration[linear] = motion.force[:, self.kept] + gravity[:, None]
            acceleration[angular] = motion.angular_acceleration[:, self.kept]
        return velocity, acceleration

    @cached_property
    def need(self) -> Needed:
        """What the motion needs, of every degree of freedom."""
        return needed_torque(self.robot, self.all_positions, *self._rates)

    @cached_property
    def carried(self) -> Real:
        """``[6, joint, coarse]``: torque a unit of the acceleration of a base that floats, linear, then angular."""
        if self.base is None:
            return np.zeros((0, *self.position.shape))
        return self.of_joints(carried_columns(self.robot, self.base, self.all_positions))

    @cached_property
    def late_base(self) -> Real:
        """``[joint, coarse]``: missing torque a second that the IMU of a base that floats comes late."""
        motion = self.base_motion(self.cutoff_hz)
        if motion is None:
            return np.zeros_like(self.position)
        rate = self._rate(np.concatenate([motion.force, motion.angular_acceleration]))
        return np.asarray(np.einsum("ajk,ak->jk", self.carried, rate[:, self.kept]))

    @cached_property
    def held(self) -> Real | None:
        """``[6, coarse]``: force and moment at a base that floats that its motion needs, in its own axes, N and N m.

        Zero in free flight.
        """
        return None if self.base is None else self.need.torque[self.base.dof : self.base.dof + 6]

    def of_joints(self, dofs: Real) -> Real:
        """Rows of the log's joints among ``[..., dof, coarse]``."""
        return dofs[..., [one.dof for one in self.joints], :]

    @cached_property
    def tilt(self) -> Real:
        """``[2, joint, coarse]``: torque a radian of tilt about x and y."""
        return self.of_joints(gravity_columns(self.robot, self.all_positions))

    @cached_property
    def offset(self) -> Real:
        """``[joint, joint, coarse]``: torque at the second a radian that the reading of the first is too large by."""
        step, columns = 1e-4, []
        for one in self.joints:
            moved = self.all_positions.copy()
            moved[one.position] += step
            columns.append(-(needed_torque(self.robot, moved, *self._rates).torque - self.need.torque) / step)
        return self.of_joints(np.array(columns))

    @cached_property
    def turned(self) -> Real:
        """``[3, joint, coarse]``: torque a radian that the IMU of a base that floats is turned by about its axes."""
        step, needed = 1e-3, self.need.torque
        moved = (needed_torque(self.robot, self.all_positions, *self._rates_by(step * one)) for one in np.eye(3))
        return self.of_joints(np.array([(one.torque - needed) / step for one in moved]))

    def command(self, later_s: float = 0.0) -> Real:
        """``[joint, sample]`` of the log's grid: the command as it arrives, and later still; NaN without any."""
        log = self.log
        if log.command is None or log.command_messages is None:
            raise LogError(f"{log.log}: holds no command; record the commands of the drives, or their efforts")
        half, found = 0.5 / log.sample_rate_hz, np.full_like(log.command, np.nan)
        for row, (starts, values) in enumerate(log.command_messages):
            if not starts.size:
                continue
            # What a smooth signal does about a sample: the held command's mean over one interval around it.
            sums = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(starts))])
            at = log.time_s - self.robot.delay_s - later_s
            before, after = (_integral(at + side, starts, values, sums) for side in (-half, half))
            found[row] = (after - before) / (2.0 * half)
        return found

    @cached_property
    def error(self) -> Real:
        """``[joint, sample]``: command less position."""
        return self.command() - self.fast_position

    def by_row(self, name: str) -> Real:
        """``[joint]`` of a servo's number; NaN where nothing says."""
        found = [None if one.servo is None else getattr(one.servo, name) for one in self.joints]
        return np.array([np.nan if one is None else float(one) for one in found])

    @cached_property
    def by_effort(self) -> bool:
        """Whether the log tells what the drives gave."""
        return self.log.effort is not None and self.log.effort_kind in ("measured", "current")

    @cached_property
    def kp(self) -> Real:
        """``[joint]``: gain of the servos; 0 where nothing says."""
        return np.nan_to_num(self.by_row("kp"))

    @cached_property
    def kd(self) -> Real:
        """``[joint]``: the same of the speed."""
        return np.nan_to_num(self.by_row("kd"))

    @property
    def rows(self) -> list[tuple[int, RobotJoint]]:
        """Joints whose drive's torque is known, with their rows."""
        return [(row, joint) for row, joint in enumerate(self.joints) if self.driven[row]]

    @cached_property
    def driven(self) -> Mask:
        """``[joint]``: whether the torque of its drive is known."""
        return np.asarray(np.all(np.isfinite(self.unlimited), axis=1))

    @cached_property
    def unlimited(self) -> Real:
        """``[joint, sample]``: torque of the drives, before their limits."""
        if self.by_effort and self.log.effort is not None:
            return self.log.effort
        kp, kd = self.by_row("kp")[:, None], self.kd[:, None]
        if self.log.command_kind == "effort":
            return self.command()
        if self.log.command_kind == "velocity":
            return self.by_row("kd")[:, None] * (self.command() - self.fast_velocity)
        return kp * self.error - kd * self.fast_velocity

    @cached_property
    def fast_drive(self) -> Real:
        """``[joint, sample]``: torque of the drives."""
        limit = self.by_row("limit")[:, None]
        bound = np.where(np.isfinite(limit), limit, np.inf)
        known = np.where(self.driven[:, None], self.unlimited, 0.0)
        return known if self.by_effort else np.clip(known, -bound, bound)

    @cached_property
    def drive(self) -> Real:
        """``[joint, coarse]``."""
        return self.smooth(self.fast_drive)

    @cached_property
    def slow(self) -> Real:
        """``[joint]``: speed within which the encoder doesn't tell which way a joint moves."""
        return 2.0 * self.noise_of_speed

    @cached_property
    def fast_sign(self) -> Real:
        """``[joint, sample]``: direction of motion, -1 to 1."""
        return np.tanh(self.fast_velocity / self.slow[:, None])

    @cached_property
    def sign(self) -> Real:
        """``[joint, coarse]``."""
        return self.smooth(self.fast_sign)

    @cached_property
    def wanted(self) -> Real:
        """``[joint, coarse]``: what the motion and the described friction need."""
        friction = np.array([one.friction for one in self.joints])[:, None]
        return self.of_joints(self.need.torque) + friction * self.sign

    @cached_property
    def missing(self) -> Real:
        """``[joint, coarse]``: what the drives gave beyond what the motion and the described friction needed."""
        return self.drive - self.wanted

    @cached_property
    def _steps(self) -> tuple[Real, Real]:
        return steps_and_noise(self.log.position, self.log.sample_rate_hz, self.stretches)

    @property
    def resolution(self) -> Real:
        """``[joint]``: steps of the encoders; 0 where none show."""
        return self._steps[0]

    @property
    def reading_noise(self) -> Real:
        """``[joint]``: standard deviation of the readings' noise."""
        return np.asarray(np.sqrt(self._steps[1] * self.log.sample_rate_hz / 2.0))

    @cached_property
    def noise_of_speed(self) -> Real:
        """``[joint]``: standard deviation of the fast velocity's noise."""
        noise = np.sqrt(self._steps[1] * (2.0 * np.pi) ** 2 * self.fast_hz**3 / 3.0)
        usual = np.std(self.fast_velocity, axis=1)
        return np.asarray(np.maximum(noise, _STILL * usual) + 1e-12)

    @cached_property
    def sensed_noise(self) -> Real:
        """``[joint]``: standard deviation that the noise of sensors gives the missing torque."""
        inertia = self.need.inertia[[one.dof for one in self.joints]]
        damping = np.array([one.damping for one in self.joints])
        by_position = not self.by_effort and self.log.command_kind == "position"
        kp, kd = (one * by_position for one in (self.kp, self.kd))
        found = torque_noise(self._steps[1], self.cutoff_hz, stiffness=kp, damping=kd + damping, inertia=inertia)
        if self.by_effort:
            found += steps_and_noise(self.fast_drive, self.log.sample_rate_hz, self.stretches)[1] * self.cutoff_hz
        return np.sqrt(found + self._noise_of_base)

    @property
    def _noise_of_base(self) -> Real | float:
        """``[joint]``: variance that the noise of the IMU gives the missing torque."""
        if self.base is None or self.log.imu is None:
            return 0.0
        imu, place = self.log.imu, place_on_base(self.robot, self.base, self.log.imu.site)[1]
        force, turning = (
            float(np.mean(upper_density(one, self.log.sample_rate_hz, self.stretches, imu.sample_rate_hz)))
            for one in (imu.linear_acceleration, imu.angular_velocity)
        )
        return imu_noise(force, turning, self.cutoff_hz, carried=self.carried, place=place)

    @cached_property
    def highest_noise(self) -> Real:
        """``[joint]``: the same with what a rigid description rounds."""
        usual = np.mean(self.of_joints(self.need.torque) ** 2 + self.drive**2, axis=1) / 2.0
        return np.asarray(np.sqrt(self.sensed_noise**2 + _RIGHT**2 * usual) + 1e-12)

    @property
    def noise(self) -> Real:
        """``[joint]``: standard deviation of the missing torque where nothing is missing."""
        return self.highest_noise * np.sqrt(1.0 if self.level is None else self.level)

    def with_level(self, over_noise: Real) -> Self:
        """Give the same with noise as low as a fit says by what it leaves, but no lower than the sensors'."""
        other = copy(self)
        least = (self.sensed_noise / self.highest_noise) ** 2
        level = np.ones_like(least) if self.level is None else self.level
        object.__setattr__(other, "level", np.clip(over_noise * level, least, 1.0))
        return other

    @cached_property
    def moving(self) -> Mask:
        """``[joint, coarse]``: where a joint isn't stuck: then friction is anything between its two values."""
        rests = np.abs(self.fast_velocity) < self.slow[:, None]
        # Whatever the filter mixes in.
        return (self.smooth(rests.astype(np.float64)) < _MIXED) & self.driven[:, None]

    def with_guesses(self, late_s: Mapping[str, float], centre_m: Mapping[str, Real]) -> Self:
        """Give the same with delays and centres of payloads guessed: nothing but their columns changes."""
        other = copy(self)
        object.__setattr__(other, "late_s", dict(late_s))
        object.__setattr__(other, "centre_m", dict(centre_m))
        # Made for other delays.
        vars(other).pop("loop", None)
        return other

    def late(self, from_s: float, by_s: float) -> Real:
        """``[joint, coarse]``: missing torque a second, of commands that come so much later than some delay."""
        step = 1.0 / self.log.sample_rate_hz
        first, last = (from_s, from_s + by_s) if abs(by_s) > step else (from_s - 0.5 * step, from_s + 0.5 * step)
        # Where nobody commands a joint nothing comes late.
        earlier = np.nan_to_num(self.command(first) - self.command(last))
        return self.kp[:, None] * self.smooth(earlier) / (last - first)


def _laid(rows: Real, places: list[int], rest: Real) -> Real:
    """Give rows at their places among those that rest."""
    found = np.repeat(rest[:, None], rows.shape[1], axis=1)
    found[places] = rows
    return found


def _integral(at: Real, starts: Real, values: Real, sums: Real) -> Real:
    """Of a held signal from the first start to some times; before it the first value holds."""
    place = np.maximum(np.searchsorted(starts, at, "right") - 1, 0)
    return np.asarray(sums[place] + values[place] * (at - starts[place]))


def torques_of(robot: Robot, log: JointLog) -> Torques:
    """Give the torques of a log."""
    # What is slower of two tells up to where both do.
    imu_hz = np.inf if robot.base == "fixed" or log.imu is None else log.imu.sample_rate_hz
    cutoff = min(CUTOFF_HZ, _MOST * min(log.sample_rate_hz, imu_hz))
    found = Torques(robot=robot, log=log, cutoff_hz=cutoff)
    if found.base is not None and log.imu is None:
        raise LogError(
            f"{log.log}: {robot.name}'s base floats, and no IMU tells how it moves; record one (sensor_msgs/Imu) on "
            f"{visible(found.base.link)} and name it as imu in [log] of a robot file, or hold the base still and say "
            'base = "fixed" there'
        )
    if log.command is None and not found.by_effort:
        raise LogError(f"{log.log}: neither commands nor measured efforts; record one of them beside the states")
    if not np.any(found.driven):
        raise ModelError(
            f"{robot.name}: no gains of its drives, and {log.log} has no measured effort; give kp and kd under "
            "[control] of a robot file, or record efforts"
        )
    return found
