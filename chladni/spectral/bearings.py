"""Rolling element bearings: geometry, and the frequencies at which faults are struck (BPFO, BPFI, BSF, FTF)."""

from dataclasses import dataclass
from math import cos, radians

from chladni.signals.errors import EstimateError, SetupError


@dataclass(frozen=True, slots=True, kw_only=True)
class Bearing:
    """Geometry of a rolling element bearing.

    Attributes
    ----------
    elements
        Balls or rollers in one row.
    element_diameter, pitch_diameter
        Of a ball or roller, and of the circle of their centres, in one unit; only their ratio counts.
    contact_angle_deg
        Angle of contact, from the radial plane.

    Raises
    ------
    EstimateError
        When it is no bearing.
    """

    elements: int
    element_diameter: float
    pitch_diameter: float
    contact_angle_deg: float = 0.0

    def __post_init__(self) -> None:
        if self.elements < 2 or not 0 < self.element_diameter < self.pitch_diameter < float("inf"):
            raise EstimateError(
                f"a bearing of {self.elements} elements, {self.element_diameter:g} on a circle of "
                f"{self.pitch_diameter:g}: there must be 2 or more, smaller than the circle of their centres"
            )
        if not 0 <= self.contact_angle_deg < 90:
            raise EstimateError(f"a contact angle of {self.contact_angle_deg:g} degrees must be from 0 to below 90")

    def frequencies_hz(self, shaft_hz: float) -> dict[str, float]:
        """Give the frequencies at which faults are struck while the inner ring turns and nothing slips.

        Notes
        -----
        With n elements of diameter d on a circle D, contact angle phi and f_r of the shaft (Randall & Antoni 2011,
        Mech. Syst. Signal Process. 25, eq. 1 to 4): BPFO = n f_r/2 (1 - d/D cos phi), BPFI = n f_r/2 (1 + d/D cos
        phi), FTF = f_r/2 (1 - d/D cos phi), BSF = D f_r/(2 d) (1 - (d/D cos phi)^2). A fault of an element strikes
        both rings, at 2 BSF. Slip makes all but the shaft's frequency 1 to 2 % other than this.

        Examples
        --------
        >>> found = Bearing(elements=9, element_diameter=7.94, pitch_diameter=39.04).frequencies_hz(1.0)
        >>> {name: round(value, 3) for name, value in found.items()}  # SKF 6205, as published by its users
        {'BPFO': 3.585, 'BPFI': 5.415, 'BSF': 2.357, 'FTF': 0.398}
        """
        if not 0 < shaft_hz < float("inf"):
            raise EstimateError(f"a shaft at {shaft_hz:g} Hz must turn; give its revolutions a second")
        ratio = self.element_diameter / self.pitch_diameter * cos(radians(self.contact_angle_deg))
        return {
            "BPFO": self.elements * shaft_hz / 2 * (1 - ratio),
            "BPFI": self.elements * shaft_hz / 2 * (1 + ratio),
            "BSF": self.pitch_diameter / (2 * self.element_diameter) * shaft_hz * (1 - ratio**2),
            "FTF": shaft_hz / 2 * (1 - ratio),
        }


def fault_frequencies_hz(bearing: Bearing | None, shaft_hz: float | None) -> dict[str, float]:
    """Give the bearing's frequencies, nothing without one; `SetupError` when only one of both is known."""
    if (bearing is None) != (shaft_hz is None):
        missing = "the bearing's geometry" if bearing is None else "the shaft's revolutions a second"
        raise SetupError(f"a bearing's frequencies need its geometry and the shaft's speed; give {missing}, too")
    return {} if bearing is None or shaft_hz is None else bearing.frequencies_hz(shaft_hz)
