"""Motion of one point relative to its neighbour at a resonance."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeMotion:
    """How far two neighbours move against each other in one mode.

    Attributes
    ----------
    mode
        Row of the mode.
    between
        The two points (channels where the log knows no points).
    ratio, ratio_std
        abs(phi_a - phi_b) along one common direction over the largest abs(phi) of the mode, and one sigma of it; None
        when the two have no common direction.
    damping_gain
        Added damping ratio for a damper of 1 N s/m put between the two, (delta phi)^2/(2 omega) with real shapes
        of unit modal mass; None when the modes are unscaled.
    stiffness_gain_hz
        Added natural frequency for a spring of 1 N/m put there, (delta phi)^2/(2 omega)/(2 pi); None likewise.
    """

    mode: int
    between: tuple[str, str]
    ratio: float | None
    ratio_std: float | None
    damping_gain: float | None = None
    stiffness_gain_hz: float | None = None
