"""The torque that a robot's description lacks: what its drives gave, less what its motion needed."""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from scipy.ndimage import correlate1d
from scipy.signal import sosfiltfilt

from chladni.gap.robots.joint_noise import steps_and_noise, torque_noise
from chladni.gap.robots.motion import TURN, Motion, low_pass, rms
from chladni.robots.joint_log import JointLog
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import LogError
from chladni.signals.visible import visible

#: Up to which frequency torques are compared, Hz: joints of arms and legs move below it, and differentiated encoder
#: steps grow with its square (Swevers, Verdonck & De Schutter 2007 take 10 Hz).
CUTOFF_HZ = 8.0
#: Of the sample rate: highest cutoff.
_MOST = 1.0 / 6.0
#: Of the usual torque: what a rigid description is right to, unless a fit leaves less.
RIGHT = 0.02
#: Lines on which the noise is summed up, and its share of a signal that stands clear of it.
_LINES, _CLEAR = 64, 0.02
#: One over a gain, at least: a drive gives at most ten times what it's asked for.
LEAST_OVER = 0.1
#: Of a gain that nobody says, over what was guessed.
_UNKNOWN_GAIN = 0.5
#: Values from means over cells, of fourth order: 1 - d^2/24 + 3 d^4/640.
_FROM_MEANS = np.array([9.0, -116.0, 2134.0, -116.0, 9.0]) / 1920.0
#: A stamp that is just reached counts.
_TIE_S = 1e-7
ALL_COMMANDS = "all commands"


#: Word, site and variant.
FormKey = tuple[str, str, str | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Guesses:
    """Numbers that columns are made for, since they aren't linear in them.

    Attributes
    ----------
    late_s
        Delays, by site.
    centre_m
        Centres of payloads, by link: their own inertia is that of a point there.
    offset
        What joints read too much, rad (m), by joint.
    forms
        Numbers of laws that were found between those of their grids.
    """

    late_s: Mapping[str, float] = field(default_factory=dict)
    centre_m: Mapping[str, Real] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)
    forms: Mapping[FormKey, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Torques(Motion):
    """Torques of one log, smoothed alike, on a coarse grid.

    Attributes
    ----------
    guesses
        What columns are exact for.
    explained
        ``[row, coarse]``: missing torque that was explained already; nothing when None.
    level
        ``[row]``: share of the highest noise's power that the noise has; all of it when None.
    away
        Stretches that don't count, s from the log's start.
    guessed
        Joints whose gains nobody says.
    """

    guesses: Guesses = field(default_factory=Guesses)
    explained: Real | None = None
    level: Real | None = None
    away: tuple[tuple[float, float], ...] = ()
    guessed: frozenset[str] = frozenset()

    @cached_property
    def loop(self) -> Real:
        """``[joint, coarse]``: missing torque a second that the servos' feedback comes late.

        Of kp q' + kd q'', which is what the command's motion asks less the rate of what is needed. Only up to where
        that stands above the noise of q, which is in the missing torque, too.
        """
        found = self.late(self.guesses.late_s.get(ALL_COMMANDS, 0.0), 0.0)
        frequency_hz = np.linspace(0.0, self.cutoff_hz, _LINES)[1:]
        omega = 2.0 * np.pi * frequency_hz
        for row, own in enumerate(found):
            gain = np.abs(1j * omega * (self.kp[row] + 1j * omega * self.kd[row])) ** 2
            noise = np.cumsum(gain * self._steps[1][row]) * frequency_hz[0]
            clear = np.searchsorted(noise, (_CLEAR * np.std(own)) ** 2)
            cutoff_hz = frequency_hz[min(clear, len(frequency_hz) - 1)]
            sections = low_pass(float(cutoff_hz), self.rate_hz)
            for a, b in self._coarse:
                rate = np.gradient(self.answered[row, a:b], 1.0 / self.rate_hz)
                found[row, a:b] = sosfiltfilt(sections, own[a:b] - rate)
        return found

    def offset(self, row: int) -> Real:
        """``[joint, coarse]``: missing torque a radian that a joint reads too much, about the guessed offset."""
        guess, still = self.guesses.offset.get(self.joints[row].name, 0.0), np.zeros_like(self.position[0])
        key = f"offset {row} {guess:g}"
        if key not in self.memory:
            step = guess if abs(guess) > TURN else TURN
            self.memory[key] = self.turned(row, still - 1.0, still, still, step=step)
        return np.asarray(self.memory[key])

    def command(self, later_s: float = 0.0) -> Real:
        """``[joint, sample]`` of the log's grid: the command as it arrives, and later still; NaN without any.

        A motion answers to its mean over the sample's interval, an effort to what is held when it's sampled.
        """
        half = 0.5 / self.log.sample_rate_hz
        return self._held(later_s) if self.two_sided else self.mean_command(later_s, half)

    def mean_command(self, later_s: float, half_s: float) -> Real:
        """Give ``[joint, sample]``: what of a held command goes below half the sample rate.

        Means over the samples' intervals, without what a mean takes from slow signals, h^2/24 of their curvature, and
        so on: values of a function from the means of its cells.
        """
        found = np.full_like(self._commands, np.nan)
        for row, (starts, values) in self._messages():
            sums = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(starts))])
            at = self.log.time_s - self.robot.delay_s - later_s
            before, after = (_integral(at + side, starts, values, sums) for side in (-half_s, half_s))
            found[row] = (after - before) / (2.0 * half_s)
        for a, b in self.stretches:
            found[:, a:b] = correlate1d(found[:, a:b], _FROM_MEANS, axis=1, mode="nearest")
        return found

    def _held(self, later_s: float) -> Real:
        found = np.full_like(self._commands, np.nan)
        at = self.log.time_s - self.robot.delay_s - later_s + _TIE_S
        for row, (starts, values) in self._messages():
            found[row] = values[np.maximum(np.searchsorted(starts, at, "right") - 1, 0)]
        return found

    @property
    def _commands(self) -> Real:
        if self.log.command is None or self.log.command_messages is None:
            raise LogError(f"{self.log.log}: holds no command; record the commands of the drives, or their efforts")
        return self.log.command

    def _messages(self) -> list[tuple[int, tuple[Real, Real]]]:
        """Rows with commands, and their messages."""
        return [(row, each) for row, each in enumerate(self.log.command_messages or ()) if each[0].size]

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
        """Whether the log tells what the drives gave, or what they were asked for."""
        return self.log.effort is not None and self.log.effort_kind in ("measured", "current", "commanded")

    @cached_property
    def two_sided(self) -> bool:
        """Whether the log tells commands, efforts and motion: the loops are looked at apart from what they move."""
        servos = self.log.command is not None and self.log.command_kind == "position"
        return self.by_effort and servos and bool(np.any(np.isfinite(self.by_row("kp"))))

    @cached_property
    def gives(self) -> bool:
        """Whether efforts are what arrives at the joints, so that drives are told by what they were asked for."""
        return self.two_sided and self.log.effort_kind == "measured"

    def servo_row(self, row: int) -> int:
        """Row at which what a joint's loop does otherwise shows."""
        return row + len(self.joints) * self.two_sided

    def at_servos(self, values: Real) -> Real:
        """Give ``[row, coarse]`` of ``[joint, coarse]`` that acts at the loops."""
        return np.concatenate([np.zeros_like(values), values]) if self.two_sided else values

    def name_of(self, row: int) -> str:
        """What stands at a row."""
        return (
            self.joints[row].name
            if row < len(self.joints)
            else f"the drive of {self.joints[row % len(self.joints)].name}"
        )

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

    @property
    def told_rows(self) -> list[tuple[int, RobotJoint]]:
        """The same without those whose gains nobody says: what they do otherwise than they should can't be told."""
        return [(row, joint) for row, joint in self.rows if joint.name not in self.guessed]

    @cached_property
    def driven(self) -> Mask:
        """``[joint]``: whether the torque of its drive is known."""
        return np.asarray(np.all(np.isfinite(self.unlimited), axis=1))

    @cached_property
    def unlimited(self) -> Real:
        """``[joint, sample]``: torque of the drives, before their limits."""
        if self.by_effort and self.log.effort is not None:
            return self.log.effort
        if self.log.command_kind == "effort":
            return self.command()
        if self.log.command_kind == "velocity":
            return self.by_row("kd")[:, None] * (self.command() - self.fast_velocity)
        return self._served

    @property
    def _served(self) -> Real:
        """``[joint, sample]``: torque that position loops ask for, before their limits."""
        return self.by_row("kp")[:, None] * self.error - self.kd[:, None] * self.loop_velocity

    @property
    def loop_velocity(self) -> Real:
        """``[joint, sample]``: what the loops damp: of efforts at their instant, as the log reads it if that fits.

        Between held commands a joint trembles, which no difference of samples tells.
        """
        return self._loops[0] if self.two_sided else self.fast_velocity

    @cached_property
    def _loops(self) -> tuple[Real, Real]:
        """``[joint, sample]`` twice: velocities that loops damp, and what they ask for beyond the efforts.

        With commands as late as leaves least: at another delay neither velocity fits.
        """
        read, count = self.log.velocity, len(self.joints)
        velocities = (self.fast_velocity,) if read is None else (self.fast_velocity, read)
        damped, beyond = self.fast_velocity.copy(), -self.fast_drive
        least = np.full(count, np.inf)
        step_s = 1.0 / max(self.log.sample_rate_hz, self.log.command_rate_hz or 0.0)
        # What comes later than a quarter of a period belongs to another motion.
        for late_s in np.arange(0.0, 0.25 / self.cutoff_hz, step_s).tolist():
            pull = self.kp[:, None] * (self._held(late_s) - self.log.position) - self.fast_drive
            for velocity in velocities:
                rest = pull - self.kd[:, None] * velocity
                left = np.std(rest[:, self.kept], axis=1)
                better = left < least
                damped[better], beyond[better], least[better] = velocity[better], rest[better], left[better]
        return damped, beyond

    @cached_property
    def fast_drive(self) -> Real:
        """``[joint, sample]``: torque of the drives."""
        known = np.where(self.driven[:, None], self.unlimited, 0.0)
        return known if self.by_effort else self._limited(known)

    def _limited(self, torque: Real) -> Real:
        limit = self.by_row("limit")[:, None]
        bound = np.where(np.isfinite(limit), limit, np.inf)
        return np.clip(torque, -bound, bound)

    @cached_property
    def fast_asked(self) -> Real:
        """``[joint, sample]``: torque that the drives are asked for."""
        return self._limited(self.fast_served) if self.gives else self.fast_drive

    @cached_property
    def asked(self) -> Real:
        """``[joint, coarse]``: torque that the loops ask for; the drives' where no efforts stand beside them."""
        return self.smooth(self._limited(self.fast_served)) if self.two_sided else self.drive

    @cached_property
    def fast_served(self) -> Real:
        """``[joint, sample]``: torque that position loops would ask for without limits; zero where nobody says."""
        return np.nan_to_num(self._served)

    @cached_property
    def over_limit(self) -> Real:
        """``[joint, coarse]``: what limits keep of that."""
        return self.smooth(self.fast_served - self._limited(self.fast_served))

    @cached_property
    def asked_of(self) -> Real:
        """``[row, coarse]``: torque that is asked for at each row."""
        return np.concatenate([self.drive, self.asked]) if self.two_sided else self.drive

    @cached_property
    def answered(self) -> Real:
        """``[joint, coarse]``: what the loops' torque is held against."""
        return self.drive if self.two_sided else self.wanted

    @cached_property
    def drive(self) -> Real:
        """``[joint, coarse]``."""
        return self.smooth(self.fast_drive)

    @cached_property
    def within(self) -> Real:
        """``[joint, coarse]``: mean torque less that at the samples, by what the loops make of held commands.

        An effort is sampled somewhere within a held command, a motion answers to all of it.
        """
        half_s, between = 0.5 / self.log.sample_rate_hz, np.zeros_like(self.fast_drive)
        common = self.guesses.late_s.get(ALL_COMMANDS, 0.0)
        delays = [common + self.guesses.late_s.get(one.name, 0.0) for one in self.joints]
        for late_s in set(delays):
            rows = np.array(delays) == late_s
            between[rows] = (self.mean_command(late_s, half_s) - self._held(late_s))[rows]
        moved = self.by_row("kp")[:, None] * (between - self.fast_position + self.log.position)
        moved -= self.kd[:, None] * (self.fast_velocity - self.loop_velocity)
        return self.smooth(np.nan_to_num(moved))

    @cached_property
    def damped(self) -> Real:
        """``[joint, coarse]``: what the loops take for speeds."""
        return self.smooth(self.kd[:, None] * self.loop_velocity)

    @cached_property
    def wanted(self) -> Real:
        """``[joint, coarse]``: what the motion and the described friction need."""
        friction = np.array([one.friction for one in self.joints])[:, None]
        return self.of_joints(self.need.torque) + friction * self.sign

    def passed_at(self, time_s: Real) -> Real:
        """Give ``[2, joint, time]``: torque that moves the links at times of the log, and its rate."""
        at = self.log.time_s[self.kept]
        both = self.wanted, [self.coarse_rate(row) for row in self.wanted]
        return np.array([[np.interp(time_s, at, row) for row in rows] for rows in both])

    @cached_property
    def missing(self) -> Real:
        """``[row, coarse]``: what the drives gave beyond what the motion and the described friction needed.

        Where the log tells commands and efforts, further rows, one a joint, hold what the loops asked for beyond.
        """
        lacks = self.drive - self.wanted
        return np.concatenate([lacks, self.asked - self.drive]) if self.two_sided else lacks

    def whole(self, missing: Real) -> Real:
        """Give ``[joint, ...]`` of rows: what loops asked for beyond what was needed, where rows tell both parts."""
        count = len(self.joints)
        return np.asarray(missing[:count] + missing[count:] if self.two_sided else missing)

    @cached_property
    def rest(self) -> Real:
        """``[row, coarse]``: what is missing beyond what was explained already."""
        return self.missing if self.explained is None else self.missing - self.explained

    @cached_property
    def _held_by(self) -> tuple[Real, Real]:
        """``[joint]`` of stiffness and of damping at the joints."""
        damping = np.array([one.damping for one in self.joints])
        by_position = not self.by_effort and self.log.command_kind == "position"
        return self.kp * by_position, self.kd * by_position + damping

    def reading_noise_at(self, inertia: Real) -> Real:
        """Give ``[joint]``: variance of missing torque by readings, of an inertia ``[joint, joint, pose]``."""
        kp, kd = self._held_by
        return torque_noise(self._steps[1], self.cutoff_hz, stiffness=kp, damping=kd, inertia=inertia)

    @cached_property
    def described_reading_noise(self) -> Real:
        """``[joint]``: the same of the inertia as described; a search asks for it at every fit."""
        return self.reading_noise_at(self.inertia)

    @cached_property
    def sensed_noise(self) -> Real:
        """``[row]``: standard deviation that the noise of sensors gives the missing torque, as described."""
        found = self.described_reading_noise + self._noise_of_base
        if not self.by_effort:
            return np.sqrt(found)
        rate, stretches = self.log.sample_rate_hz, self.stretches
        effort = steps_and_noise(self.fast_drive, rate, stretches)[1] * self.cutoff_hz
        if not self.two_sided:
            return np.sqrt(found + effort)
        # Efforts step with their commands, which is no noise: what loops ask for does so, too.
        loops = steps_and_noise(self._loops[1], rate, stretches)[1] * self.cutoff_hz
        return np.asarray(np.sqrt(np.concatenate([found + np.minimum(effort, loops), loops])))

    @cached_property
    def highest_noise(self) -> Real:
        """``[row]``: the same with what a rigid description rounds."""
        return np.asarray(np.hypot(self.sensed_noise, self.rounding) + 1e-12)

    @cached_property
    def rounding(self) -> Real:
        """``[row]``: torque that no rigid description is right to."""
        usual = np.mean(self.of_joints(self.need.torque) ** 2 + self.drive**2, axis=1) / 2.0
        if self.two_sided:
            usual = np.concatenate([usual, np.mean(self.drive**2, axis=1)])
        return np.asarray(RIGHT * np.sqrt(usual))

    @property
    def noise(self) -> Real:
        """``[row]``: standard deviation of the missing torque where nothing is missing."""
        return self.highest_noise * np.sqrt(1.0 if self.level is None else self.level)

    def with_level(self, over_noise: Real) -> Self:
        """Give the same with noise as low as fits say by what they leave, but no lower than the sensors'."""
        other = copy(self)
        least = (self.sensed_noise / self.highest_noise) ** 2
        level = np.ones_like(least) if self.level is None else self.level
        object.__setattr__(other, "level", np.clip(over_noise * level, least, 1.0))
        return other

    def gain_doubts(self, row: int) -> tuple[float, float]:
        """Give standard deviations of kp over its value, and of ``kd/kp`` over its own, of a joint's loop."""
        if self.joints[row].name not in self.guessed:
            return self.robot.tolerance.gains, self.robot.tolerance.gains
        # As much as a usual torque at a usual speed.
        usual = float(np.std(self.drive[row])) / rms(self.velocity[row])
        return _UNKNOWN_GAIN, usual / max(float(self.kd[row]), 1e-12)

    def in_asked(self, word: str) -> bool:
        """Whether a joint's laws are in units of what its drive was asked for where this word was found there."""
        return not (self.gives if word == "gain_error" else self.two_sided)

    def gains(
        self, row: int, within: tuple[float, float], over_kp: float = 1.0, kd_over_kp: float = 0.0
    ) -> tuple[float, float]:
        """Give kp and kd of a joint's loop.

        Parameters
        ----------
        within
            Numbers of their doubts.
        over_kp, kd_over_kp
            What was found beside them, see `controller_gain`.
        """
        doubts = self.gain_doubts(row)
        over = max(over_kp + doubts[0] * within[0], LEAST_OVER)
        aside = kd_over_kp + doubts[1] * within[1]
        return float(self.kp[row]) / over, float(self.kd[row]) * (1.0 + aside / over)

    @cached_property
    def moving(self) -> Mask:
        """``[row, coarse]``: where a joint isn't stuck: then friction is anything between its two values."""
        moving = self.moves & self.driven[:, None]
        times = self.log.time_s[self.kept]
        for start_s, end_s in self.away:
            moving[:, (times >= start_s) & (times <= end_s)] = False
        if not self.two_sided:
            return moving
        # A loop asks for its torque whether its joint moves or not.
        served = np.all(np.isfinite(self._served), axis=1) & self.driven
        return np.concatenate([moving, np.broadcast_to(served[:, None], moving.shape)])

    def without(self, away: tuple[tuple[float, float], ...]) -> Self:
        """Give the same without some stretches."""
        other = copy(self)
        object.__setattr__(other, "away", away)
        vars(other).pop("moving", None)
        return other

    def with_guesses(self, guesses: Guesses, explained: Real) -> Self:
        """Give the same with other guesses, and what was explained with them."""
        other = copy(self)
        object.__setattr__(other, "guesses", guesses)
        object.__setattr__(other, "explained", explained)
        # Made for other guesses.
        for name in ("loop", "rest", "within", "later", "doubt_s"):
            vars(other).pop(name, None)
        return other

    def lacking(self, missing: Real) -> Self:
        """Give the same where ``[row, coarse]`` is missing."""
        other = copy(self)
        vars(other).pop("rest", None)
        vars(other)["missing"] = missing
        return other

    def same_commands(self, late_s: float) -> tuple[float, float]:
        """Give the shortest and the longest delay that hold the same commands as one when efforts are sampled.

        Commands in step with the samples tell a delay no closer. The delay itself, twice, where a motion answers.
        """
        starts = next((starts for _, (starts, _) in self._messages() if starts.size), None)
        if not self.two_sided or starts is None:
            return late_s, late_s
        at = self.log.time_s - self.robot.delay_s - late_s + _TIE_S
        newest = np.searchsorted(starts, at, "right") - 1
        inside = (newest >= 0) & (newest + 1 < starts.size)
        if not np.any(inside):
            return late_s, late_s
        at, newest = at[inside], newest[inside]
        return late_s - float(np.min(starts[newest + 1] - at)), late_s + float(np.min(at - starts[newest]))

    @cached_property
    def doubt_s(self) -> float:
        """Standard deviation of a delay of all between those that hold the same commands: a uniform distribution."""
        shortest, longest = self.same_commands(self.guesses.late_s.get(ALL_COMMANDS, 0.0))
        return float((longest - shortest) / np.sqrt(12.0))

    @cached_property
    def later(self) -> Real:
        """``[joint, coarse]``: mean torque a second by which held commands come later than efforts tell."""
        late_s, half = self.guesses.late_s.get(ALL_COMMANDS, 0.0), 0.5 / self.log.sample_rate_hz
        change = self.mean_command(late_s - half, half) - self.mean_command(late_s + half, half)
        return self.smooth(np.nan_to_num(self.by_row("kp")[:, None] * change)) / (2.0 * half)

    def late(self, from_s: float, by_s: float) -> Real:
        """``[joint, coarse]``: missing torque a second, of commands that come so much later than some delay."""
        half = 0.5 / self.log.sample_rate_hz
        # Efforts change by whole commands: a slope is that over a sample.
        first, last = (from_s, from_s + by_s) if by_s else (from_s - half, from_s + half)
        # Where nobody commands a joint nothing comes late.
        earlier = np.nan_to_num(self.command(first) - self.command(last))
        return self.kp[:, None] * self.smooth(earlier) / (last - first)


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
    return found
