"""What the drives of a robot's joints gave in a log, and what their loops asked for."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import correlate1d

from chladni.gap.robots.motion import Motion
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import LogError

#: Values from means over cells, of fourth order: 1 - d^2/24 + 3 d^4/640.
_FROM_MEANS = np.array([9.0, -116.0, 2134.0, -116.0, 9.0]) / 1920.0
#: A stamp that is just reached counts.
TIE_S = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class Drives(Motion):
    """Commands of one log as they arrive, and torques of the drives by them or by measured efforts."""

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
        at = self.log.time_s - self.robot.delay_s - later_s + TIE_S
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
