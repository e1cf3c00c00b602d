"""What the header of a dataset 58 says of a channel: place, direction, unit, rate and start."""

import re
from datetime import UTC, datetime
from math import ceil, floor, log10
from typing import Any

from chladni.signals.channel import AXES, Channel, Vector
from chladni.signals.errors import LogError
from chladni.signals.time_series import NS_PER_S, TimeSeries, is_sample_rate
from chladni.signals.visible import visible

TIME_RESPONSE = 1
FUNCTION_TYPES = {
    0: "general function",
    1: "time response",
    2: "auto spectrum",
    3: "cross spectrum",
    4: "frequency response function",
    5: "transmissibility",
    6: "coherence",
    7: "auto correlation",
    8: "cross correlation",
    9: "power spectral density",
    10: "energy spectral density",
    12: "spectrum",
    26: "multiple coherence",
}
"""Names of the function types, for messages."""

# Codes 1 to 3 are translations along x, y, z, and 4 to 6 rotations about them.
DIRECTIONS: dict[int, Vector] = {
    code + turn: AXES[axis]
    for code, axis in ((1, "+x"), (-1, "-x"), (2, "+y"), (-2, "-y"), (3, "+z"), (-3, "-z"))
    for turn in (0, 3 if code > 0 else -3)
}
TYPE_OF_UNIT = {"m": 8, "m/s": 11, "m/s^2": 12, "Pa": 15}
#: How the fifth line begins in records and functions that chladni wrote.
OUR_LINES = ("start_time_ns=", "start_hz=")
# Our own fifth line: the fields of the record round rate and start to six digits.
_EXACT = re.compile(r"^start_time_ns=(?P<start>-?\d{1,19}) sample_rate_hz=(?P<rate>\d+(\.\d+)?(e[+-]\d+)?)$")
_EXCITATION_FORCE = 13
_ID_LENGTH = 80
_LABEL_LENGTH = 20
_ENTITY_LENGTH = 10
_INCREMENT_DIGITS = 6
_FARTHEST_S = 2**61 / NS_PER_S


def channel_of_header(header: dict[str, Any], name: str, unit: str) -> Channel:
    """Describe the channel of a record: its point is the response node, its direction the response direction."""
    entity, node = str(header["rsp_ent_name"]).strip(), int(header["rsp_node"])
    named = entity not in ("", "NONE")
    point = " ".join(text for text in (entity if named else "", str(node) if node else "") if text)
    return Channel(
        name=name,
        unit=unit,
        point=point or None,
        direction=DIRECTIONS.get(int(header["rsp_dir"])),
        role="reference" if int(header["ordinate_spec_data_type"]) == _EXCITATION_FORCE else "response",
    )


def rate_of_header(header: dict[str, Any], second: float = 1.0) -> float | None:
    """Give the sample rate in Hz, None when the increment is no interval.

    The field of the increment holds six digits, 1.52588e-05 s where 1/65536 s is meant. Of all rates that round to
    it the one with the fewest digits is taken, unless the increment itself has fewer, as 0.3 s, or the record says
    the rate in full, as ours do.

    Parameters
    ----------
    second
        What the unit of the abscissa is in seconds.

    Examples
    --------
    >>> rate_of_header({"abscissa_inc": 1.52588e-05, "id5": "NONE"})
    65536.0
    """
    increment = float(header["abscissa_inc"])
    if not (increment > 1e-15 and is_sample_rate(1 / (increment * second))):
        return None
    # Half a unit in the last of the six digits, which is how far the true increment may be.
    half = 0.5 * 10.0 ** (floor(log10(increment)) - _INCREMENT_DIGITS + 1)
    lowest, highest = 1 / ((increment + half) * second), 1 / ((increment - half) * second)
    exact = _EXACT.match(str(header["id5"]).strip())
    if exact is not None and lowest <= float(exact["rate"]) <= highest:
        return float(exact["rate"])
    rate_hz = _shortest(lowest, highest, 1.0 / (increment * second))
    return rate_hz if _digits(rate_hz) <= _digits(increment) else 1.0 / (increment * second)


def says_rate(header: dict[str, Any]) -> bool:
    """Whether the record says its rate and start in full, as those that chladni writes do."""
    return _EXACT.match(str(header["id5"]).strip()) is not None


def start_of_header(header: dict[str, Any], second: float = 1.0) -> int:
    """Give the time of the first sample in ns since 1970: the date of line three, taken as UTC, and the abscissa.

    0 plus the abscissa when line three holds no date; `second` is what the unit of the abscissa is in seconds.

    Raises
    ------
    LogError
        When the abscissa begins at no time.
    """
    exact = _EXACT.match(str(header["id5"]).strip())
    if exact is not None and abs(int(exact["start"])) < 2**62:
        return int(exact["start"])
    offset_s = float(header["abscissa_min"]) * second if header["abscissa_spacing"] != 0 else 0.0
    if not abs(offset_s) < _FARTHEST_S:
        raise LogError(f"begins at {offset_s:g} s, which is no time within centuries")
    try:
        date = datetime.strptime(str(header["id3"]).strip(), "%d-%b-%y %H:%M:%S").replace(tzinfo=UTC)
    except ValueError:
        return round(offset_s * NS_PER_S)
    return max(0, round(date.timestamp())) * NS_PER_S + round(offset_s * NS_PER_S)


def header_of_channel(channel: Channel, series: TimeSeries) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Give the header fields of a record, and sentences on what doesn't fit them."""
    losses = []
    # On one line: a line feed in a name would begin a record of its own.
    name = re.sub(r"[^ -~]", "?", visible(channel.name))[:_ID_LENGTH]
    entity, node = _place(channel.point)
    direction = direction_code(channel)
    if name != channel.name:
        losses.append(f"{channel.name}: the name became {name!r}; a universal file holds 80 ASCII characters.")
    if channel.point and entity not in (channel.point, "NONE"):
        losses.append(f"{channel.name}: the point {channel.point!r} became {entity!r}.")
    if channel.direction is not None and direction == 0:
        losses.append(f"{channel.name}: the direction {channel.direction} is along no axis and isn't stored.")
    if channel.overload is not None:
        losses.append(f"{channel.name}: the overload limit isn't stored.")
    labelled = len(channel.unit) <= _LABEL_LENGTH and channel.unit.isascii() and channel.unit.isprintable()
    if not labelled:
        losses.append(f"{channel.name}: the unit {channel.unit!r} isn't stored; a label holds 20 ASCII characters.")
    header = {
        "id1": name or "NONE",
        "id3": _date(series.start_time_ns),
        "id5": f"start_time_ns={series.start_time_ns} sample_rate_hz={series.sample_rate_hz!r}",
        "rsp_ent_name": entity,
        "rsp_node": node,
        "rsp_dir": direction,
        "ref_node": 0,
        "ref_dir": 0,
        "abscissa_spec_data_type": 17,
        "abscissa_axis_lab": "Time",
        "abscissa_axis_units_lab": "s",
        "ordinate_spec_data_type": quantity_code(channel),
        "ordinate_axis_lab": "NONE",
        "ordinate_axis_units_lab": channel.unit if labelled else "NONE",
        "orddenom_spec_data_type": 0,
    }
    return header, tuple(losses)


def _digits(number: float) -> int:
    """Decimal digits of a number, without zeros at its ends."""
    return len(f"{number:.14e}".partition("e")[0].replace(".", "").rstrip("0"))


def _shortest(lowest: float, highest: float, middle: float) -> float:
    """Give the number between the bounds that needs the fewest decimal digits, the nearest to the middle of those."""
    # From the coarsest step to the finest: the first that has a multiple between the bounds is the shortest.
    for digits in range(-15, 16):
        step = 10.0**-digits
        first, last = ceil(lowest / step), floor(highest / step)
        if first <= last:
            return float(f"{min(max(round(middle / step), first), last)}e{-digits}")
    return middle


def _place(point: str | None) -> tuple[str, int]:
    if point is None:
        return "NONE", 0
    if point.isdecimal() and point.isascii() and 0 < int(point) < 10**9 and str(int(point)) == point:
        return "NONE", int(point)
    # A fixed column of ten characters: what is longer or not ASCII would shift all fields behind it.
    entity = re.sub(r"[^ -~]", "_", point.strip())[:_ENTITY_LENGTH]
    return entity, 0


def direction_code(channel: Channel) -> int:
    """Give the code of a direction, negative for the opposite one; 0 when it's unknown or along no axis."""
    # The same axis has another code for a rotation; only the unit tells which it is.
    turn = channel.unit.startswith("rad") or channel.unit == "N m"
    for code in (1, -1, 2, -2, 3, -3):
        if channel.direction == DIRECTIONS[code]:
            return code + ((3 if code > 0 else -3) if turn else 0)
    return 0


def quantity_code(channel: Channel) -> int:
    """Give the code of what a channel measures; 0 when it has none."""
    if channel.unit == "N":
        return _EXCITATION_FORCE if channel.role == "reference" else 9
    return TYPE_OF_UNIT.get(channel.unit, 0)


def _date(start_time_ns: int) -> str:
    return datetime.fromtimestamp(start_time_ns // NS_PER_S, tz=UTC).strftime("%d-%b-%y %H:%M:%S")
