"""Words on plots: units as printed, names of quantities."""

from chladni.signals.errors import SetupError
from chladni.signals.unit_text import printed_unit
from chladni.signals.units import si_factor

_QUANTITIES = {
    "m/s^2": "Acceleration",
    "m/s": "Velocity",
    "m": "Displacement",
    "N": "Force",
    "N m": "Moment",
    "rad/s": "Angular velocity",
    "rad/s^2": "Angular acceleration",
    "rad": "Angle",
    "Pa": "Pressure",
    "V": "Voltage",
    "A": "Current",
    "T": "Magnetic flux density",
    "K": "Temperature",
    "s": "Time",
}


def quantity(unit: str) -> str:
    """Name what is measured in a unit; ``Signal`` when the unit doesn't tell.

    Examples
    --------
    >>> quantity("m/s^2"), quantity("g"), quantity("1")
    ('Acceleration', 'Acceleration', 'Signal')
    """
    return _QUANTITIES.get(_in_si(unit), "Signal")


def response_quantity(response_unit: str, reference_unit: str) -> str:
    """Name a frequency response function by the field's word for it.

    Examples
    --------
    >>> response_quantity("m/s^2", "N"), response_quantity("m", "N"), response_quantity("V", "V")
    ('Accelerance', 'Receptance', 'Frequency response')
    """
    response_unit, reference_unit = _in_si(response_unit), _in_si(reference_unit)
    if reference_unit == "N":
        forms = {"m/s^2": "Accelerance", "m/s": "Mobility", "m": "Receptance"}
        return forms.get(response_unit, "Frequency response")
    return "Transmissibility" if response_unit == reference_unit == "m/s^2" else "Frequency response"


def _in_si(unit: str) -> str:
    """Give the SI unit of what is shown in another one; any text that is no unit as it is."""
    if unit in _QUANTITIES:
        return unit
    try:
        return si_factor(unit)[1]
    except SetupError:
        return unit


def amplitude_density_unit(unit: str) -> str:
    """Give the printed unit of the square root of a power spectral density.

    Examples
    --------
    >>> amplitude_density_unit("m/s^2"), amplitude_density_unit("N")
    ('(m/s²)/√Hz', 'N/√Hz')
    """
    return f"{printed_unit(unit)}/√Hz" if unit.isalnum() else f"({printed_unit(unit)})/√Hz"


def decibel_unit(unit: str) -> str:
    """Give the unit of a level, with its reference.

    Examples
    --------
    >>> decibel_unit("(m/s^2)^2/Hz"), decibel_unit("1/Hz"), decibel_unit("1")
    ('dB re 1 (m/s²)²/Hz', 'dB re 1/Hz', 'dB re 1')
    """
    return f"dB re {printed_unit(unit)}" if unit.startswith("1") else f"dB re 1 {printed_unit(unit)}"


def part_of_several(place: int, count: int, feature: str) -> str:
    """Tell the series (or spectra) of a study apart in plots' titles; nothing when there is only one.

    Examples
    --------
    >>> part_of_several(2, 3, "100 Hz"), part_of_several(1, 1, "100 Hz")
    (' · series 2, 100 Hz', '')
    """
    return f" · series {place}, {feature}" if count > 1 else ""


def thinned(stretch: int) -> str:
    """Say in a plot's title how a waveform was thinned for drawing; nothing when it wasn't."""
    return "" if stretch == 1 else f" · least and greatest of every {stretch} samples"


def reduction(slices: int, lines: int) -> str:
    """Say in a plot's title how a waterfall was shortened for drawing; nothing when it wasn't."""
    parts = [f"{count} {what}" for count, what in ((slices, "slices"), (lines, "lines")) if count > 1]
    return f" · greatest of every {' x '.join(parts)}" if parts else ""
