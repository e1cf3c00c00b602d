"""What tells whether modes can be trusted."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.value import Coordinate, Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeValidation(Value):
    """Checks of a set of modes.

    Attributes
    ----------
    auto_mac
        ``[mode, mode]`` modal assurance criterion between the modes themselves, 0 to 1.
    mpc
        ``[mode]`` modal phase collinearity, 1 for a shape that moves in one phase; NaN for shapes of one component,
        as the two that follow.
    mpd_deg
        ``[mode]`` mean phase deviation, 0 for such a shape.
    mean_phase_deg
        ``[mode]`` direction of that phase, -90 to 90 degrees.
    alike
        Pairs of modes (rows) whose shapes these sensors can't tell apart.
    findings
        Sentences for whoever must rely on the modes, the gravest first.
    """

    AXES: ClassVar = dict.fromkeys(("mpc", "mpd_deg", "mean_phase_deg"), ("mode",))
    ROWS: ClassVar = "mode"

    auto_mac: Real
    mpc: Real
    mpd_deg: Real
    mean_phase_deg: Real
    alike: tuple[tuple[int, int], ...]
    findings: tuple[str, ...]

    def __post_init__(self) -> None:
        require_shape("auto_mac", self.auto_mac, (self.mpc.size, self.mpc.size), "modes x modes")
        for name in ("mpd_deg", "mean_phase_deg"):
            require_shape(name, getattr(self, name), self.mpc.shape, "modes")
        self._freeze()

    def coordinate(self, axis: str) -> Coordinate:
        """Give the modes' numbers from 1 on."""
        return np.arange(1, self.mpc.size + 1) if axis == "mode" else Value.coordinate(self, axis)
