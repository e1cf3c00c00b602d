"""Words on plots: short unambiguous channel names, units as printed, names of quantities."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from chladni.signals.errors import SetupError
from chladni.signals.units import si_factor
from chladni.signals.visible import visible

LONGEST_NAME = 48

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
_PIECE = re.compile(r"""(?:\[[^\]]*\]|\{[^}]*\}|"[^"]*"|'[^']*'|[^/.])+|[/.]""")


def printed_unit(unit: str) -> str:
    """Give a unit as it's printed.

    Examples
    --------
    >>> printed_unit("(m/s^2)^2/Hz")
    '(m/s²)²/Hz'
    """
    return unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴").replace("*", "·")


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


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Give every channel name a label as short as it can be without two channels sharing one.

    A label is the last part of the topic and the last field; where that is ambiguous all fields, then the whole
    name, then the whole name and a number. Characters that can't be seen are shown as escapes.

    Parameters
    ----------
    names
        Channel names; repeated ones count once.

    Returns
    -------
    dict
        Label of each name, all different, at most 48 characters and a number.

    Examples
    --------
    >>> list(short_names(["/imu/wrist.accel.linear.x", "/imu/base.accel.linear.x", "/f.force.z"]).values())
    ['wrist.x', 'base.x', 'f.z']
    """
    # In the order given, so that the same log always gets the same labels.
    pending = list(dict.fromkeys(names))
    labels: dict[str, str] = {}
    for shorten in (_leaf, _fields, _whole):
        candidates = {name: shorten(name) for name in pending}
        # Labels already given count too: a whole name may be the short form of another.
        uses = Counter([*candidates.values(), *labels.values()])
        labels |= {name: label for name, label in candidates.items() if uses[label] == 1}
        pending = [name for name in pending if name not in labels]
    for number, name in enumerate(pending, start=2):
        labels[name] = f"{_whole(name)} #{number}"
    return labels


def _split(name: str) -> tuple[Sequence[str], Sequence[str]]:
    """Parts of the topic and fields after it; separators inside brackets, braces and quotes don't count."""
    pieces = _PIECE.findall(name)
    last_slash = max((place for place, piece in enumerate(pieces) if piece == "/"), default=-1)
    after = [piece for piece in pieces[last_slash + 1 :] if piece != "."]
    before = [piece for piece in pieces[: max(last_slash, 0)] if piece not in "/."]
    return [*before, *after[:1]], after[1:]


def _leaf(name: str) -> str:
    topic, fields = _split(name)
    return _printable(".".join([*topic[-1:], *fields[-1:]]))


def _fields(name: str) -> str:
    topic, fields = _split(name)
    return _printable(".".join([*topic[-1:], *fields]))


def _whole(name: str) -> str:
    return _printable(name)


def _printable(text: str) -> str:
    shown = visible(text) or "(no name)"
    if len(shown) <= LONGEST_NAME:
        return shown
    # The end tells channels apart more often than the middle does.
    half = LONGEST_NAME // 2
    return f"{shown[: half - 1]}…{shown[-half:]}"
