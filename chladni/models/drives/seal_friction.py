"""Measured friction of pneumatic seals, over pressure, as an effect for the pneumatic motor's piston."""

from math import isfinite, sqrt
from typing import Final

from chladni.models.drives.piston import JOINT
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.signals.errors import ModelError

#: Where the numbers come from.
ORIGIN: Final = (
    "three published logs (CC0) of a 3-D printed pneumatic cylinder pushed forward and back at 7 to 15 mm/s against "
    "1, 4 and 7 bar above ambient. F = A p + offset + Fc z with a Bouc-Wen bristle z at each pressure. A = 4.95 cm^2 "
    "is from force over pressure. Fc(p) is the straight line through the three"
)
#: N, and N/Pa: friction without pressure, and its gradient with it.
_PRELOAD: Final = 3.67
_GRADIENT: Final = 0.654e-5
#: N: scatter of the three pressures about the line, with the scatter along the stroke.
_STD: Final = 1.1
#: 0.11 to 0.15 mm; within a factor of two, since a sample of the position comes every 0.1 mm.
_YIELD_M: Final = 0.13e-3
#: Of the cylinder measured, m^2.
_AREA: Final = 4.95e-4
#: Pa above ambient up to which the line is given.
_HIGHEST_PA: Final = 10e5


def seal_friction_force(pressure_pa: float, *, active_area: float | None = None) -> tuple[float, float]:
    """Coulomb force of the seals and its standard deviation, N.

    Parameters
    ----------
    pressure_pa
        Above ambient. Measured from 1 to 7 bar, where the standard deviation holds (beyond it's twice as large);
        refused outside of 0 to 10 bar.
    active_area
        m^2, of another cylinder; the force then grows with the circumference of its piston, which is a guess: a seal
        of the same section, longer. None for the measured cylinder of 4.95 cm^2.

    Raises
    ------
    ModelError
        For a pressure too far from those measured, or an impossible area.

    Examples
    --------
    >>> force, std = seal_friction_force(4e5)
    >>> round(force, 1), round(std, 1)
    (6.3, 1.1)
    """
    if not 0.0 <= pressure_pa <= _HIGHEST_PA:
        raise ModelError(
            f"seal friction: {pressure_pa / 1e5:g} bar above ambient; it was measured from 1 to 7 bar and is given "
            "from 0 to 10 bar"
        )
    # Contact width and pressure on the lip stay, so the force goes with the length of the seal.
    around = _longer(_AREA if active_area is None else active_area)
    return around * (_PRELOAD + _GRADIENT * pressure_pa), around * _STD


def seal_friction(pressure_pa: float, *, joint: str = JOINT, active_area: float | None = None) -> AttachedEffect:
    """Make the measured friction an effect at a joint, the pneumatic motor's piston when not told.

    It's the ``hysteresis`` of the vocabulary: a Coulomb force that builds up over the seal's yield displacement. The
    motor's own pressure is absolute; give this one above ambient.

    Parameters
    ----------
    pressure_pa, active_area
        See `seal_friction_force`.
    joint
        Where it acts.

    Raises
    ------
    ModelError
        See `seal_friction_force`.

    Examples
    --------
    >>> friction = seal_friction(4e5)
    >>> friction.effect, friction.site
    ('hysteresis', 'piston')
    """
    force, _ = seal_friction_force(pressure_pa, active_area=active_area)
    return attached("hysteresis", joint, {"force": force, "yield": _YIELD_M, "shape": 1.0})


def _longer(area: float) -> float:
    """How much longer the seal of another piston is."""
    if not (area > 0 and isfinite(area)):
        raise ModelError(f"active_area: {area:g} m^2 is not possible; give a positive number")
    return sqrt(area / _AREA)
