"""A robot to look at: its shapes and joints, and where its links were and would have been."""

from dataclasses import dataclass

from chladni.robots.shapes import JointPlace, Poses, Shape
from chladni.signals.arrays import Real
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotScene(Value):
    """What pictures of a robot in motion are drawn from.

    Attributes
    ----------
    shapes, joints
        In the frames of their links.
    share
        ``[joint]``: of the torque that is missing, 0 to 1; NaN where it isn't known.
    time_s, gaps
        As of `JointMotion`.
    measured, before, after
        Poses of all links; the last two are None where no simulation holds.
    size, centre
        Length across the robot with its shapes, m, and its middle ``[3]``, for the eye.
    """

    shapes: tuple[Shape, ...]
    joints: tuple[JointPlace, ...]
    share: Real
    time_s: Real
    gaps: tuple[int, ...]
    measured: Poses
    before: Poses | None
    after: Poses | None
    size: float
    centre: Real

    def __post_init__(self) -> None:
        require_shape("share", self.share, (len(self.joints),), "the joints")
        self._freeze()
