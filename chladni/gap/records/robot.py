"""What pictures of a diagnosed robot are made from: how its joints moved, and what their torques follow."""

from dataclasses import dataclass
from typing import Literal

from chladni.signals.arrays import Real
from chladni.signals.value import Value, require_shape

Over = Literal["velocity", "position"]


def site_words(site: str) -> str:
    """Say a site in a sentence, a pair by both of its names; tables show it as documents have it.

    Examples
    --------
    >>> site_words("elbow"), site_words("joint_5~joint_6")
    ('elbow', 'joint_5 with joint_6')
    """
    return site.replace("~", " with ")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMotion(Value):
    """Positions of a robot's joints, as measured and as simulated from the log's poses, on few samples.

    Attributes
    ----------
    joints, units
        Names; ``rad`` or ``m``.
    time_s
        ``[sample]`` of the log, rising; not even where it has gaps.
    measured, before, after
        ``[joint, sample]``: measured; simulated as described; simulated with what was found (or with the best
        parameters, where nothing is named). Both are None where no simulation holds.
    gaps
        Samples after which nothing is known until the next.
    horizon_s
        How long a simulation runs before it starts from the log's pose again; None without one.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    time_s: Real
    measured: Real
    before: Real | None
    after: Real | None
    gaps: tuple[int, ...] = ()
    horizon_s: float | None = None

    def __post_init__(self) -> None:
        shape = (len(self.joints), self.time_s.size)
        for name, one in (("measured", self.measured), ("before", self.before), ("after", self.after)):
            if one is not None:
                require_shape(name, one, shape, "joints and samples")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueMap(Value):
    """Torque at a joint over its speed or its position, with all taken out that doesn't follow that.

    Attributes
    ----------
    site
        Joint, or two joints whose gears run in one another.
    over
        ``velocity``: the friction, of the description included. ``position``: what is missing beside friction.
    motion, torque, load
        ``[sample]``: velocity or position; the torque; the torque that the motion needs. Only where the joint moves.
    motion_unit, torque_unit
        SI.
    centre, mean, error
        ``[bin]``: mean motion, mean torque, and the standard error of the latter.
    described, law, spread
        ``[bin]``: what the description has; what was found, and by how much that varies within a bin, one sigma, as
        friction does with load. `law` and `spread` are None where no law was found.
    is_named
        Whether the law is of causes that are named.
    ratio
        Of a pair: `motion` is that of the first joint and `ratio` times that of the second. None of a single joint.
    """

    site: str
    over: Over
    motion: Real
    torque: Real
    load: Real
    motion_unit: str
    torque_unit: str
    centre: Real
    mean: Real
    error: Real
    described: Real
    law: Real | None
    spread: Real | None
    is_named: bool
    ratio: float | None = None

    def __post_init__(self) -> None:
        for name in ("torque", "load"):
            require_shape(name, getattr(self, name), self.motion.shape, "the motion")
        for name in ("mean", "error", "described", "law", "spread"):
            if (one := getattr(self, name)) is not None:
                require_shape(name, one, self.centre.shape, "the bins")
        self._freeze()
