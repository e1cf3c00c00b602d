"""What became of a mode between two measurements, and how sure that is."""

from dataclasses import dataclass
from typing import Literal

ModeFate = Literal["changed", "unchanged", "appeared", "vanished"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeChange:
    """One mode before and after.

    Attributes
    ----------
    fate
        ``changed`` when the shift of frequency or of damping is significant.
    before, after
        Row of the mode in its set; None where it isn't there.
    before_hz, after_hz
        Natural frequency; None where it isn't there.
    shift_hz, shift_std_hz
        After minus before, and one sigma of it; None unless both are there.
    damping_change, damping_change_std
        The same of the damping ratio.
    mac
        Modal assurance criterion of both shapes over the shared channels; None unless both are there.
    """

    fate: ModeFate
    before: int | None = None
    after: int | None = None
    before_hz: float | None = None
    after_hz: float | None = None
    shift_hz: float | None = None
    shift_std_hz: float | None = None
    damping_change: float | None = None
    damping_change_std: float | None = None
    mac: float | None = None
