"""The motion of a log's joints in one band, and what inverse dynamics makes of it."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import accumulate, pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import correlate1d
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from chladni.gap.robots.joint_noise import imu_noise, steps_and_noise, upper_density
from chladni.robots.dynamics import (
    Needed,
    carried_columns,
    gravity_columns,
    inertia_columns_of_links,
    inertial_numbers,
    motion_torque,
    needed_torque,
)
from chladni.robots.floating_base import BaseMotion, FloatingBase, at_origin, floating_base, place_on_base
from chladni.robots.joint_log import JointLog
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Index, Mask, Real
from chladni.signals.errors import LogError

#: Signs of velocities follow up to so many cutoffs.
_FAST = 4.0
#: Periods of the cutoff that both ends of a stretch lose to the filter.
_ENDS = 3.0
#: Least periods of the cutoff in a stretch.
LEAST = 12.0
#: Of its usual speed: within this a joint could move either way, however fine its encoder.
_STILL = 0.002
_ORDER = 4
#: Poses at which the inertia between joints is asked for.
_POSES = 16
#: By how much a joint is turned to tell what that changes, rad (m), RMS.
TURN = 1e-4
#: Share of rest within the filter's length up to which a sample counts as moving.
_MIXED = 0.5
#: Central difference of eighth order (Fornberg 1988): exact up to a third of the sample rate but for 2 %.
_SLOPE = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Motion of one log, smoothed alike, on a coarse grid.

    Attributes
    ----------
    robot, log
        The log's joints are the rows of all arrays.
    cutoff_hz
        Of the filter, whose phase is zero.
    memory
        Of what stays as it is whatever is guessed.
    """

    robot: Robot
    log: JointLog
    cutoff_hz: float
    memory: dict[str, Any] = field(default_factory=dict)

    def moving_as(self, other: "Motion") -> Self:
        """Give the same with what was made of another's motion, which is the same."""
        found, made = copy(self), vars(other)
        own = [name for name, one in vars(Motion).items() if isinstance(one, cached_property)]
        vars(found).update({name: made[name] for name in own if name in made})
        return found

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
            damage = f" ({self.log.damage[0]})" if self.log.damage else ""
            raise LogError(
                f"{self.log.log}: no stretch of {LEAST / self.cutoff_hz:.2g} s without a gap{damage}; "
                "record a longer one"
            )
        return found

    @cached_property
    def kept(self) -> Index:
        """Samples of the coarse grid."""
        return np.concatenate(self._kept)

    @property
    def begins(self) -> tuple[int, ...]:
        """Where on the coarse grid stretches begin."""
        return tuple(accumulate((one.size for one in self._kept[:-1]), initial=0))

    @cached_property
    def _kept(self) -> list[Index]:
        ends = round(_ENDS / self.cutoff_hz * self.log.sample_rate_hz)
        return [np.arange(a + ends, b - ends, self._stride) for a, b in self.stretches]

    def at_s(self, grid_s: ArrayLike) -> Real:
        """Give the log's time of times on the coarse grid, whose samples follow one another without a break."""
        times = self.log.time_s[self.kept]
        return np.interp(np.asarray(grid_s) * self.rate_hz, np.arange(times.size), times)

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

    def waves(self, row: int, waves: Real) -> Real:
        """``[wave, coarse]``: what the filter makes of ``exp(i wave q)``, rad/rad."""
        stride = self._stride
        # Twice as dense as the coarse grid at least, so that what is beyond the cutoff goes.
        step = max((each for each in range(1, stride // 2 + 1) if stride % each == 0), default=1)
        sections, found = low_pass(self.cutoff_hz, self.log.sample_rate_hz / step), []
        for (a, b), (first, last) in zip(self.stretches, self._coarse, strict=True):
            begin = int(self.kept[first])
            dense = self.fast_position[row, begin - (begin - a) // step * step : b : step]
            turns = waves[:, None] * dense
            smooth = [sosfiltfilt(sections, part(turns)) for part in (np.cos, np.sin)]
            places = (begin - a) // step + np.arange(last - first) * (stride // step)
            found.append(smooth[0][:, places] + 1j * smooth[1][:, places])
        return np.concatenate(found, axis=1)

    @cached_property
    def _coarse(self) -> list[tuple[int, int]]:
        """Bounds of the stretches on the coarse grid."""
        first = np.searchsorted(self.kept, [a for a, _ in self.stretches])
        return list(pairwise([*first.tolist(), self.kept.size]))

    def _filtered(self, values: Real, cutoff_hz: float) -> Real:
        found = np.array(values, dtype=np.float64)
        sections = low_pass(cutoff_hz, self.log.sample_rate_hz)
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

    def coarse_rate(self, values: Real) -> Real:
        """Time derivative of ``[coarse]``."""
        found = correlate1d(values, _SLOPE, mode="nearest") * self.rate_hz
        half = _SLOPE.size // 2
        for a, b in self._coarse:
            # The filter must not see beyond a stretch.
            ends = np.gradient(values[a:b], 1.0 / self.rate_hz)
            found[a : a + half], found[max(b - half, a) : b] = ends[:half], ends[-half:]
        return found

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
    def inertia_of_links(self) -> Real:
        """``[link, 10, joint, joint, pose]``: inertia a unit of the links' inertial numbers, at some poses."""
        poses = self.all_positions[:, :: max(self.position.shape[1] // _POSES, 1)]
        return inertia_columns_of_links(self.robot, poses, [one.dof for one in self.joints])

    @cached_property
    def inertia(self) -> Real:
        """``[joint, joint, pose]``: as described, kg m^2 (kg)."""
        links = np.einsum("lp,lp...->...", inertial_numbers(self.robot), self.inertia_of_links)
        return np.asarray(links + np.diag([one.armature for one in self.joints])[..., None])

    @cached_property
    def usual_inertia(self) -> Real:
        """``[joint]``: RMS of a joint's own."""
        return np.asarray(np.sqrt(np.mean(np.diagonal(self.inertia) ** 2, axis=0)))

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

    def turned(self, row: int, position: Real, velocity: Real, acceleration: Real, step: float | None = None) -> Real:
        """``[joint, coarse]``: needed torque a unit by which a joint is elsewhere than it reads, by so many units."""
        step = step or TURN / rms(position)
        one = self.joints[row]
        moved = self.all_positions.copy(), *(each.copy() for each in self._rates)
        for whole, part, place in zip(
            moved, (position, velocity, acceleration), (one.position, one.dof, one.dof), strict=True
        ):
            whole[place] += step * part
        return (self.of_joints(motion_torque(self.robot, *moved)) - self.of_joints(self.need.torque)) / step

    @cached_property
    def turned_imu(self) -> Real:
        """``[3, joint, coarse]``: torque a radian that the IMU of a base that floats is turned by about its axes."""
        step, needed = 1e-3, self.need.torque
        moved = (needed_torque(self.robot, self.all_positions, *self._rates_by(step * one)) for one in np.eye(3))
        return self.of_joints(np.array([(one.torque - needed) / step for one in moved]))

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
    def moves(self) -> Mask:
        """``[joint, coarse]``: where a joint isn't stuck."""
        rests = np.abs(self.fast_velocity) < self.slow[:, None]
        # Whatever the filter mixes in.
        return np.asarray(self.smooth(rests.astype(np.float64)) < _MIXED)


@lru_cache
def low_pass(cutoff_hz: float, rate_hz: float) -> Real:
    """Second-order sections of the filter that all signals pass, forth and back."""
    return np.asarray(butter(_ORDER, cutoff_hz, fs=rate_hz, output="sos"))


def rms(values: Real) -> float:
    """Root of the mean square, above zero."""
    return float(np.sqrt(np.mean(values**2))) + 1e-12


def _laid(rows: Real, places: list[int], rest: Real) -> Real:
    """Give rows at their places among those that rest."""
    found = np.repeat(rest[:, None], rows.shape[1], axis=1)
    found[places] = rows
    return found
