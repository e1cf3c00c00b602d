"""The IMU of a robot's base, on the grid of its joints."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.message_path import topic_text
from chladni.robots.floating_base import floating_base
from chladni.signals.errors import LogError
from chladni.signals.join import join_resampled
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.visible import visible
from chladni.signals.wording import near_matches

if TYPE_CHECKING:
    from chladni.io.log import Log
    from chladni.robots.robot import Robot
    from chladni.signals.arrays import Index, Mask, Real

_GYRO: Final = "angular_velocity"
_ACCELEROMETER: Final = "linear_acceleration"
_ATTITUDE: Final = "orientation"
# What resampling needs beyond the states, at the lowest rates of IMUs.
_BEYOND_S: Final = 1.0
# Nearer to 1 than to what holds against gravity.
_LIKE_G: Final = sqrt(9.81)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImuLog:
    """What an IMU measured, at the samples of the joints; NaN where it has none.

    Attributes
    ----------
    topic, site
        Where it was read, and the site or link of the description where it sits.
    angular_velocity, linear_acceleration
        ``[axis, sample]`` rad/s and m/s^2, in the frame of the IMU; a level IMU at rest shows +9.81 along z.
    orientation
        ``[w x y z, sample]``, of the IMU in the world; None where nobody fills it.
    sample_rate_hz
        Its own.
    """

    topic: str
    site: str
    angular_velocity: Real
    linear_acceleration: Real
    orientation: Real | None
    sample_rate_hz: float

    def at(self, kept: Index) -> ImuLog:
        """Give some samples of it."""
        attitude = None if self.orientation is None else self.orientation[:, kept]
        return replace(
            self, angular_velocity=self.angular_velocity[:, kept],
            linear_acceleration=self.linear_acceleration[:, kept], orientation=attitude,
        )  # fmt: skip

    @property
    def there(self) -> Mask:
        """``[sample]``: where it has any."""
        return np.asarray(np.isfinite([*self.angular_velocity, *self.linear_acceleration]).all(axis=0))


def read_imu(robot: Robot, log: Log, states: TimeSeries) -> tuple[ImuLog | None, tuple[str, ...]]:
    """Read the IMU that the robot file names; of a base that floats the only one of the log, without a robot file.

    Parameters
    ----------
    robot, log
        As for `chladni.robots.joint_log.joint_log`.
    states
        Whose grid it's brought to.

    Returns
    -------
    imu : ImuLog or None
        None where none is named, and the base is fixed or the log has none or several.
    remarks
        How it was chosen and read.

    Raises
    ------
    LogError
        When the log doesn't have the one that is named, or its samples aren't uniform.
    """
    topics = {one.name.removesuffix(f".{_GYRO}.x") for one in log.channels if one.name.endswith(f".{_GYRO}.x")}
    topic, site, remarks = _chosen(robot, log, topics)
    if topic is None:
        return None, remarks
    known = {one.name for one in log.channels}
    turning, pushing = ([f"{topic}.{field}.{axis}" for axis in "xyz"] for field in (_GYRO, _ACCELEROMETER))
    attitude = [path for axis in "wxyz" if (path := f"{topic}.{_ATTITUDE}.{axis}") in known]
    wanted = [*turning, *pushing, *(attitude if len(attitude) == 4 else ())]
    begin_s = (states.start_time_ns - log.start_time_ns) / NS_PER_S
    groups = log.read_groups(wanted, start_s=begin_s - _BEYOND_S, end_s=begin_s + states.duration_s + _BEYOND_S)
    read = join_resampled(
        groups,
        sample_rate_hz=states.sample_rate_hz,
        start_time_ns=states.start_time_ns,
        samples=states.samples,
        method="band-limited",
    ).series.select(wanted)
    values = read.values.astype(np.float64)
    return (
        ImuLog(
            topic=topic,
            site=site,
            angular_velocity=values[:3],
            linear_acceleration=values[3:6],
            orientation=_filled_attitude(values[6:]),
            sample_rate_hz=min(one.sample_rate_hz for one in groups),
        ),
        (*remarks, *_tell_unit(values[3:6], topic)),
    )


def _tell_unit(force: Real, topic: str) -> tuple[str, ...]:
    """Say when an accelerometer feels as little as if it were in units of g."""
    felt = np.linalg.norm(force, axis=0)
    usual = float(np.median(felt[np.isfinite(felt)])) if np.isfinite(felt).any() else 0.0
    if not 1 / _LIKE_G < usual < _LIKE_G:
        return ()
    told = (
        f"{visible(topic)} feels {usual:.3g} m/s^2 at most times, as in a fall; if that is in g, say so in a setup "
        f'file (--setup): [[channel]] path = "{topic}.{_ACCELEROMETER}.x", unit = "g", and so for y and z'
    )
    return (told,)


def _chosen(robot: Robot, log: Log, topics: set[str]) -> tuple[str | None, str, tuple[str, ...]]:
    named = robot.log.imu
    if named is not None:
        topic = topic_text(named.topic)
        if topic not in topics:
            raise LogError(
                f"{log.path.name}: no topic {named.topic!r} with an {_GYRO}; {near_matches(named.topic, topics)}"
            )
        return topic, named.site, ()
    if robot.base == "fixed" or not topics:
        return None, "", ()
    if len(topics) > 1:
        told = ", ".join(map(visible, sorted(topics)))
        return None, "", (f"{told}: name the IMU of the base as imu in [log] of a robot file",)
    topic = next(iter(topics))
    base = floating_base(robot)
    usual = robot.links[0] if base is None else base.link
    site = next((one for one in (*robot.sites, *robot.links) if "imu" in one.lower()), usual)
    return topic, site, (f"{visible(topic)} is taken as the IMU of the base, at {visible(site)}",)


def _filled_attitude(values: Real) -> Real | None:
    """Quaternions of length one; None where they aren't, or stay the same, as where nobody fills them."""
    if not values.size:
        return None
    length = np.linalg.norm(values, axis=0)
    there = np.isfinite(length)
    if not there.any() or not np.ptp(values[:, there], axis=1).any() or np.median(length[there]) < 1 / 2:
        return None
    return np.asarray(values / length)
