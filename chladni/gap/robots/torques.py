"""The torque that a robot's description lacks: what its drives gave, less what its motion needed."""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from scipy.signal import sosfiltfilt

from chladni.gap.robots.drives import TIE_S, Drives
from chladni.gap.robots.joint_noise import steps_and_noise, torque_noise
from chladni.gap.robots.motion import TURN, low_pass, rms
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
class Torques(Drives):
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

    @property
    def told_rows(self) -> list[tuple[int, RobotJoint]]:
        """The same without those whose gains nobody says: what they do otherwise than they should can't be told."""
        return [(row, joint) for row, joint in self.rows if joint.name not in self.guessed]

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
        at = self.log.time_s - self.robot.delay_s - late_s + TIE_S
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
