"""Times written as text: ISO 8601, other dates, and times of day, with or without zone."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chladni.signals.arrays import Mask, Whole
from chladni.signals.time_series import NS_PER_S

if TYPE_CHECKING:
    import pyarrow as pa

NS_PER_DAY = 86_400 * NS_PER_S
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_CLOCK = (
    r"(?P<hour>\d{1,3}):(?P<minute>\d{2}):(?P<second>\d{2})"
    r"(?:[.,:](?P<fraction>\d{1,30}))?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
)
_ZONE = r"(?:\s*(?P<zone>[Zz]|UTC|GMT|[+-]\d{2}(?::?\d{2})?))?"
_DATES = (
    r"(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})",
    r"(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4}|\d{2})",
    r"(?P<day>\d{1,2})[- ](?P<month_name>[A-Za-z]{3})[- ](?P<year>\d{4})",
    r"(?P<left>\d{1,2})/(?P<right>\d{1,2})/(?P<year>\d{4}|\d{2})",
)
_BASIC = (
    r"^(?P<year>\d{4})(?P<month>\d{2})(?P<day>\d{2})[Tt](?P<hour>\d{2}):?(?P<minute>\d{2}):?(?P<second>\d{2})"
    rf"(?:[.,](?P<fraction>\d{{1,12}}))?{_ZONE}$"
)
# A time of day; dates with or without one; ISO 8601's basic form; minutes with a fraction, as in spreadsheets.
_PATTERNS = tuple(
    # As Arrow, which reads the columns, has it: digits are those of ASCII.
    re.compile(pattern, re.ASCII)
    for pattern in (
        rf"^{_CLOCK}{_ZONE}$",
        *(rf"^{date}(?:(?:[Tt]|,?\s+|-){_CLOCK}{_ZONE})?$" for date in _DATES),
        _BASIC,
        r"^(?P<minute>\d{1,3}):(?P<second>\d{2})[.,](?P<fraction>\d{1,12})$",
    )
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextTimes:
    """Times read from text.

    Attributes
    ----------
    stamps_ns
        ``[row]`` nanoseconds since 1970, or since midnight where `dated` is false.
    known
        ``[row]`` whether the row has a time.
    dated, clocked
        Whether there are dates, and times of day.
    told
        What the text was taken for, as the end of a sentence.
    """

    stamps_ns: Whole
    known: Mask
    dated: bool
    clocked: bool
    told: str


def is_time_text(cell: str) -> bool:
    """Whether a cell is a date, a time of day, or both.

    Examples
    --------
    >>> [is_time_text(cell) for cell in ("2024-05-01T12:00:00.005Z", "12:34:56,789", "1.5")]
    [True, True, False]
    """
    return any(pattern.match(cell) for pattern in _PATTERNS)


def read_time_text(cells: "pa.Array") -> TextTimes | None:
    """Read times; None when the first cell that isn't blank is none.

    Times of day without a date run on over midnight. A date with slashes has the day or the month first, as its
    numbers allow; where they allow both, the date isn't used.

    Parameters
    ----------
    cells
        ``[row]`` texts without blanks around them.
    """
    import pyarrow.compute as pc

    place = pc.index(pc.not_equal(cells, ""), True).as_py()
    first = cells[place].as_py() if place >= 0 else ""
    match = next((found for pattern in _PATTERNS if (found := pattern.match(first))), None)
    if match is None:
        return None
    found = pc.extract_regex(cells, match.re.pattern)
    parts = {name: pc.fill_null(pc.struct_field(found, name), "") for name in match.re.groupindex}
    clock_ns, good_clock = _clock_ns(parts, len(cells))
    days, good_days, told = _days(parts, len(cells))
    known = np.asarray(pc.is_valid(found)) & good_clock & good_days
    stamps_ns = _past_midnight(clock_ns, known) if days is None else clock_ns + days * NS_PER_DAY
    if "zone" in parts and match["zone"]:
        stamps_ns = stamps_ns - _zone_ns(parts["zone"])
    elif days is not None:
        told += " without zone, taken as UTC"
    return TextTimes(
        stamps_ns=np.where(known, stamps_ns, 0),
        known=known,
        dated=days is not None,
        clocked=bool(match.groupdict().get("second")),
        told=told,
    )


_Parts = dict[str, "pa.Array"]


def _numbers(parts: _Parts, name: str, rows: int) -> Whole:
    import pyarrow as pa
    import pyarrow.compute as pc

    if name not in parts:
        return np.zeros(rows, dtype=np.int64)
    filled = pc.if_else(pc.equal(parts[name], ""), "0", parts[name])
    return np.asarray(pc.cast(filled, pa.int64()))


def _clock_ns(parts: _Parts, rows: int) -> tuple[Whole, Mask]:
    hour, minute, second = (_numbers(parts, name, rows) for name in ("hour", "minute", "second"))
    # Minutes without hours run on past 60, hours of an elapsed time past 24; a second of 60 is a leap second.
    good = (second <= 60) & ((minute < 60) | ("hour" not in parts))
    if "half" in parts:
        half = np.strings.lower(np.asarray(parts["half"], dtype=str))
        hour = np.where(half == "a", hour % 12, np.where(half == "p", hour % 12 + 12, hour))
    return ((hour * 60 + minute) * 60 + second) * NS_PER_S + _fraction_ns(parts, rows), good


def _fraction_ns(parts: _Parts, rows: int) -> Whole:
    import pyarrow.compute as pc

    if "fraction" not in parts:
        return np.zeros(rows, dtype=np.int64)
    # Cut behind the ninth digit: below a nanosecond no clock is right.
    digits = pc.utf8_slice_codeunits(pc.utf8_rpad(parts["fraction"], 9, "0"), 0, 9)
    return _numbers({"fraction": digits}, "fraction", rows)


def _days(parts: _Parts, rows: int) -> tuple[Whole | None, Mask, str]:
    """Give days since 1970 (None without a date that can be told), which are days of the calendar, and a word."""
    everywhere = np.ones(rows, dtype=np.bool_)
    if "year" not in parts:
        return None, everywhere, "times of day"
    year, month, day = (_numbers(parts, name, rows) for name in ("year", "month", "day"))
    # Two digits are of this century but for those of the last one's end, as POSIX has it.
    year = year + np.where(year < 69, 2000, np.where(year < 100, 1900, 0))
    if "month_name" in parts:
        names = np.strings.lower(np.asarray(parts["month_name"], dtype=str))
        month = np.sum([(number + 1) * (names == name) for number, name in enumerate(_MONTHS)], axis=0)
    if "left" in parts:
        left, right = _numbers(parts, "left", rows), _numbers(parts, "right", rows)
        day_first, month_first = bool((left > 12).any()), bool((right > 12).any())
        if day_first == month_first:
            return None, everywhere, "times of day (its dates may have the day or the month first)"
        day, month = (left, right) if day_first else (right, left)
    in_calendar = (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31) & (year > 1823) & (year < 2116)
    months = (np.where(in_calendar, year, 1970) - 1970) * 12 + np.where(in_calendar, month, 1) - 1
    first_of_month = months.astype("M8[M]").astype("M8[D]").astype(np.int64)
    # 31 February would run over into March.
    length = (months + 1).astype("M8[M]").astype("M8[D]").astype(np.int64) - first_of_month
    return first_of_month + np.where(in_calendar, day, 1) - 1, in_calendar & (day <= length), "dates"


def _zone_ns(zones: "pa.Array") -> Whole:
    """Give what to take off local times for UTC."""
    offsets = {text: _offset_ns(text) for text in zones.unique().to_pylist()}
    texts = np.asarray(zones, dtype=str)
    total: Whole = np.sum([offset * (texts == text) for text, offset in offsets.items()], axis=0)
    return total


def _offset_ns(zone: str) -> int:
    if not zone.startswith(("+", "-")):
        return 0
    hours, minutes = int(zone[1:3]), int(zone[3:].lstrip(":") or 0)
    return (-1 if zone[0] == "-" else 1) * (hours * 60 + minutes) * 60 * NS_PER_S


def _past_midnight(clock_ns: Whole, known: Mask) -> Whole:
    """Let times of day run on over midnight: a step back by more than half a day is a new day."""
    run_on = clock_ns.copy()
    times = clock_ns[known]
    nights = np.cumsum(np.diff(times, prepend=times[:1]) < -NS_PER_DAY // 2)
    run_on[known] = times + nights * NS_PER_DAY
    return run_on
