"""Torque that a robot's description doesn't explain, while samples come."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from chladni.robots.dynamics import motion_torque
from chladni.robots.joint_topics import JointTopic, topics_of_joints
from chladni.robots.robot import Robot
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.io.number_lists import NumberLists

#: Positions are smoothed, and differentiated, over so long; motions of a robot are slower.
SMOOTHED_S: Final = 0.05
#: ... by polynomials of this order, over so many samples at least.
ORDER: Final = 4
FEWEST_SAMPLES: Final = 9
#: Speeds below this share of the largest so far tell no direction of friction.
STILL_SHARE: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rows:
    """Rows of a block that hold a robot's joints, in the robot's order."""

    position: tuple[str, ...]
    velocity: tuple[str, ...] | None
    effort: tuple[str, ...]


class TorqueResidual:
    """Measured torque less what the description needs for the motion; mutable.

    The motion is that of polynomials of fourth order fitted to the positions around each sample, 50 ms of them
    (Savitzky & Golay 1964). Its acceleration is taken from measured velocities where there are any. The measured
    torque is smoothed in the same way, so that both have one band.

    Parameters
    ----------
    robot
        With a base that stands still.
    rows
        Channels of its joints.
    sample_rate_hz
        Of the blocks.
    """

    def __init__(self, robot: Robot, rows: _Rows, sample_rate_hz: float) -> None:
        from scipy.signal import savgol_coeffs

        self._robot, self._rows, self._rate_hz = robot, rows, sample_rate_hz
        self._joints = tuple(joint for joint in robot.joints)
        half = max(FEWEST_SAMPLES // 2, round(SMOOTHED_S * sample_rate_hz / 2))
        self._length = 2 * half + 1
        # As weights of a sliding product, in the order of time.
        self._weights = [
            savgol_coeffs(self._length, ORDER, deriv=order, delta=1 / sample_rate_hz, use="dot") for order in range(3)
        ]
        self._held: TimeSeries | None = None
        self._fastest = np.zeros((len(self._joints), 1))
        self.channels = tuple(
            Channel(name=f"torque_residual.{joint.name}", unit="N m" if joint.kind == "hinge" else "N")
            for joint in self._joints
        )

    @classmethod
    def of(cls, robot: Robot, lists: "Sequence[NumberLists]", block: TimeSeries) -> Self | None:
        """Give it for blocks that hold the states of all joints; None for other blocks.

        Raises
        ------
        SetupError
            When the robot's base moves, or the states hold no torque.
        """
        if robot.base != "fixed":
            raise SetupError(f"robot {robot.name!r}: the torque residual needs a base that stands still")
        names = {channel.name for channel in block.channels}
        for topic in topics_of_joints(robot, lists):
            rows = _rows(robot, topic, names)
            if rows is not None:
                return cls(robot, rows, block.sample_rate_hz)
        return None

    def take(self, block: TimeSeries) -> TimeSeries | None:
        """Take the next block; give the residuals that are certain, later by half of what is smoothed over."""
        held = self._held
        if held is not None and abs(block.start_time_ns - _end_ns(held)) > 0.5 / self._rate_hz * NS_PER_S:
            held = None
        wanted = (*self._rows.position, *(self._rows.velocity or ()), *self._rows.effort)
        fresh = block.select(list(wanted))
        whole = fresh if held is None else _joined(held, fresh)
        count = whole.samples - self._length + 1
        if count < 1:
            self._held = whole
            return None
        self._held = _part(whole, count, whole.samples)
        return self._residual(whole, count)

    def _residual(self, whole: TimeSeries, count: int) -> TimeSeries:
        values = whole.values.astype(np.float64)
        if whole.valid is not None:
            values[~whole.valid] = np.nan
        joints = len(self._joints)
        measured = values[-joints:]
        position, velocity = self._smooth(values[:joints], 0), self._smooth(values[:joints], 1)
        acceleration = self._smooth(values[:joints], 2)
        if self._rows.velocity is not None:
            velocity, acceleration = (self._smooth(values[joints : 2 * joints], order) for order in (0, 1))
        known = np.isfinite(position + velocity + acceleration).all(axis=0)
        residual = np.full((joints, count), np.nan)
        if known.any():
            moved = [self._laid(one[:, known]) for one in (position, velocity, acceleration)]
            needed = motion_torque(self._robot, *moved)[[joint.dof for joint in self._joints]]
            needed += self._friction(velocity[:, known])
            residual[:, known] = self._smooth(measured, 0)[:, known] - needed
        valid = np.isfinite(residual)
        half_ns = round(self._length // 2 / self._rate_hz * NS_PER_S)
        return TimeSeries(
            values=residual,
            sample_rate_hz=self._rate_hz,
            start_time_ns=whole.start_time_ns + half_ns,
            channels=self.channels,
            valid=None if valid.all() else valid,
        )

    def _smooth(self, values: Real, order: int) -> Real:
        windows = np.lib.stride_tricks.sliding_window_view(values, self._length, axis=1)
        smoothed: Real = windows @ self._weights[order]
        return smoothed

    def _laid(self, values: Real) -> Real:
        """Lay joints in the order of MuJoCo's degrees of freedom."""
        laid = np.zeros((int(self._robot.model.nv), values.shape[1]))
        laid[[joint.dof for joint in self._joints]] = values
        return laid

    def _friction(self, velocity: Real) -> Real:
        self._fastest = np.maximum(self._fastest, np.abs(velocity).max(axis=1, keepdims=True))
        moving = np.abs(velocity) > STILL_SHARE * self._fastest
        friction = np.array([[joint.friction] for joint in self._joints])
        return np.asarray(np.where(moving, np.sign(velocity), 0.0) * friction, dtype=np.float64)


def _rows(robot: Robot, topic: JointTopic, names: set[str]) -> _Rows | None:
    """Channels of all joints in a topic; None unless it has states of all of them in the block."""
    fields = topic.fields()
    joints = [joint.name for joint in robot.joints]
    if not topic.may_be_state or "position" not in fields:
        return None
    paths = {kind: topic.paths(field, joints) for kind, field in fields.items()}
    if not all(joint in paths["position"] and paths["position"][joint] in names for joint in joints):
        return None
    if not all(paths.get("effort", {}).get(joint) in names for joint in joints):
        raise SetupError(
            f"robot {robot.name!r}: {topic.label} has no effort of all joints, so there is no torque to compare; log "
            "measured torques, or leave --robot out"
        )
    velocity = paths.get("velocity", {})
    measured = all(velocity.get(joint) in names for joint in joints)
    return _Rows(
        position=tuple(paths["position"][joint] for joint in joints),
        velocity=tuple(velocity[joint] for joint in joints) if measured else None,
        effort=tuple(paths["effort"][joint] for joint in joints),
    )


def _end_ns(series: TimeSeries) -> int:
    return series.start_time_ns + round(series.duration_s * NS_PER_S)


def _part(series: TimeSeries, first: int, last: int) -> TimeSeries:
    return replace(
        series,
        values=series.values[:, first:last],
        valid=None if series.valid is None else series.valid[:, first:last],
        start_time_ns=series.start_time_ns + round(first / series.sample_rate_hz * NS_PER_S),
    )


def _joined(first: TimeSeries, second: TimeSeries) -> TimeSeries:
    valid = None
    if first.valid is not None or second.valid is not None:
        valid = np.concatenate(
            [np.ones(one.values.shape, bool) if one.valid is None else one.valid for one in (first, second)], axis=1
        )
    return replace(first, values=np.concatenate((first.values, second.values), axis=1), valid=valid)
