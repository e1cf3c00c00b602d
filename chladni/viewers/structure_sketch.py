"""A structure as points and lines, each with the share of the gap that it can explain."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StructureSketch(Value):
    """Bodies, joints, and the places of inputs and outputs.

    Attributes
    ----------
    body_names, joint_names, signal_names
        Of rows.
    bodies, signals
        ``[body, axis]``, ``[signal, axis]``: places in m.
    joints
        ``[joint, end, axis]``.
    body_share, joint_share, signal_share
        Share of the gap that each can explain, 0 to 1; NaN where it wasn't asked.
    """

    body_names: tuple[str, ...]
    bodies: Real
    body_share: Real
    joint_names: tuple[str, ...]
    joints: Real
    joint_share: Real
    signal_names: tuple[str, ...]
    signals: Real
    signal_share: Real

    def __post_init__(self) -> None:
        require_shape("bodies", self.bodies, (len(self.body_names), 3), "bodies and axes")
        require_shape("joints", self.joints, (len(self.joint_names), 2, 3), "joints, ends and axes")
        require_shape("signals", self.signals, (len(self.signal_names), 3), "signals and axes")
        self._freeze()

    @property
    def size(self) -> float:
        """Diagonal of the box around everything, in m."""
        return float(np.linalg.norm(np.ptp(self._all(), axis=0))) or 1.0

    @property
    def centre(self) -> Real:
        """Middle of that box."""
        places = self._all()
        return np.asarray((places.min(axis=0) + places.max(axis=0)) / 2)

    def _all(self) -> Real:
        return np.vstack([self.bodies, self.joints.reshape(-1, 3), self.signals])
