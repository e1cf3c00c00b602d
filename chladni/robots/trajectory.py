"""Motions of joints as finite Fourier series, and a trajectory of them to be run on a machine."""

from dataclasses import asdict, dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.linalg import null_space

from chladni.io.files.csv import write_csv
from chladni.robots.motion_limits import UNIT
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value

FORMAT: Final = "chladni.excite/1"


@dataclass(frozen=True, kw_only=True)
class FourierSeries:
    """Periodic motion about a pose by a few harmonics (Swevers, Ganseman, Tukel, De Schutter & Van Brussel 1997).

    The displacement from the pose, with w = 2 pi base frequency, is

        sum over l = 1..harmonics of  a_l/(l w) sin(l w t) + b_l/(l w) (1 - cos(l w t)).

    With sum a_l = 0 and sum l b_l = 0 every period starts and ends in the pose with velocity and acceleration zero.

    Attributes
    ----------
    harmonics
        At least two.
    base_frequency_hz
        One over the period.
    """

    harmonics: int
    base_frequency_hz: float

    def basis(self, time_s: Real) -> Real:
        """Give ``[3, 2 harmonics, sample]``: displacement, velocity, acceleration a unit of a_1.., b_1.. (rad/s)."""
        omega = 2.0 * np.pi * self.base_frequency_hz * np.arange(1, self.harmonics + 1)[:, None]
        sine, cosine = np.sin(omega * time_s), np.cos(omega * time_s)
        return np.array(
            [
                np.concatenate([sine / omega, (1.0 - cosine) / omega]),
                np.concatenate([cosine, sine]),
                np.concatenate([-omega * sine, omega * cosine]),
            ]
        )

    @cached_property
    def at_rest(self) -> Real:
        """``[2 harmonics, 2 harmonics - 2]``: orthonormal; coefficients that start at rest, without acceleration."""
        _, velocity, acceleration = self.basis(np.zeros(1))[..., 0]
        return np.asarray(null_space(np.stack([velocity, acceleration / np.linalg.norm(acceleration)])))

    def period(self, samples: int) -> Real:
        """Give ``[sample]``: times that divide one period, s."""
        return np.arange(samples) / (samples * self.base_frequency_hz)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointUse:
    """What a trajectory uses of a joint's limits, SI.

    Attributes
    ----------
    low, high
        Of the position.
    range
        Stops of the description; None without.
    speed, torque
        Largest magnitudes.
    speed_limit, torque_limit
        The description's; None without.
    """

    joint: str
    unit: str
    low: float
    high: float
    range: tuple[float, float] | None
    speed: float
    speed_limit: float | None
    torque: float
    torque_limit: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory(Value):
    """A motion to be run on a robot, made by `chladni.excite`.

    Attributes
    ----------
    robot
        Its name.
    joints
        Of all rows, in the robot's order; those that don't move rest.
    moved
        Names of those that move.
    sample_rate_hz
        Of the rows; the first and the last sample are the start pose.
    position, velocity, acceleration
        ``[joint, sample]``, rad (m) and their rates.
    torque
        ``[joint, sample]`` that the motion needs by the description, N m (N).
    base_frequency_hz, harmonics
        Of the series.
    coefficients
        ``[joint, 2 harmonics]``: a, then b, of `FourierSeries`, rad/s (m/s).
    use
        Of the joints that move.
    condition, random_condition
        Condition number of the regressor of base parameters with this motion; median of random series in the same
        limits. Infinite where nothing was optimised.
    parameters
        How many base parameters.
    remarks
        Sentences on what isn't known or checked.
    """

    robot: str
    joints: tuple[RobotJoint, ...]
    moved: tuple[str, ...]
    sample_rate_hz: float
    position: Real
    velocity: Real
    acceleration: Real
    torque: Real
    base_frequency_hz: float
    harmonics: int
    coefficients: Real
    use: tuple[JointUse, ...]
    condition: float = inf
    random_condition: float = inf
    parameters: int = 0
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def duration_s(self) -> float:
        """From the first sample to the last."""
        return float((self.position.shape[1] - 1) / self.sample_rate_hz)

    def series(self) -> TimeSeries:
        """Give positions, called as the joints, then velocities, ``JOINT.velocity``."""
        units = [UNIT[one.kind] for one in self.joints]
        names = [one.name for one in self.joints]
        channels = [
            *(Channel(name=name, unit=unit) for name, unit in zip(names, units, strict=True)),
            *(Channel(name=f"{name}.velocity", unit=f"{unit}/s") for name, unit in zip(names, units, strict=True)),
        ]
        return TimeSeries(
            values=np.concatenate([self.position, self.velocity]), sample_rate_hz=self.sample_rate_hz,
            channels=tuple(channels),
        )  # fmt: skip

    def to_json(self) -> dict[str, Any]:
        """Give the document: all but the samples, which the coefficients tell."""
        return {
            "format": FORMAT,
            "robot": self.robot,
            "moved": list(self.moved),
            "duration_s": self.duration_s,
            "sample_rate_hz": self.sample_rate_hz,
            "base_frequency_hz": self.base_frequency_hz,
            "harmonics": self.harmonics,
            "pose": {one.name: start for one, start in zip(self.joints, self.position[:, 0].tolist(), strict=True)},
            "coefficients": {
                one.name: {"a": row[: self.harmonics], "b": row[self.harmonics :]}
                for one, row in zip(self.joints, self.coefficients.tolist(), strict=True)
                if one.name in self.moved
            },
            "base_parameters": self.parameters,
            "condition": self.condition,
            "random_condition": self.random_condition,
            "joints": [asdict(one) for one in self.use],
            "remarks": list(self.remarks),
        }


def require_csv(path: Path) -> None:
    """Refuse a name of another kind of file; `SetupError`."""
    if path.suffix.lower() != ".csv":
        raise SetupError(f"{path}: a trajectory is written as a table; give a name that ends with .csv")


def write_trajectory(trajectory: Trajectory, path: Path | str) -> None:
    """Write a table: ``time [s]``, a column ``JOINT [rad]`` for each joint, then ``JOINT.velocity [rad/s]``.

    Raises
    ------
    SetupError
        When the name doesn't end with ``.csv``.
    LogError
        When the file can't be written.
    """
    require_csv(Path(path))
    write_csv(trajectory.series(), path)
