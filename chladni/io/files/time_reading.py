"""What the numbers of a time count, and the times in nanoseconds: from what is said, or from type, name and size.

Where two readings are possible, the option that settles it is asked for; nothing is guessed.
"""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.columns import Column
from chladni.io.files.time_text import NS_PER_DAY, TextTimes
from chladni.signals.arrays import Mask, Whole
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import NS_PER_S, is_sample_rate

if TYPE_CHECKING:
    import pyarrow as pa

NO_TIMES: Final = "none"
"""In place of a column's name: the rows have the given rate, whatever a column of times says."""
TIME_UNITS: Final = ("s", "ms", "us", "ns", "min", "h", "days", "excel", "datenum")
"""What the numbers of a time column may count; the last two are days since 1899-12-30 and since year 0."""

_SPELLINGS: Final = {
    "seconds": ("s", "sec", "secs", "second", "seconds", "sek", "sekunden"),
    "milliseconds": ("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"),
    "microseconds": ("us", "usec", "usecs", "micros", "microsecond", "microseconds"),
    "nanoseconds": ("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecond", "nanoseconds"),
    "minutes": ("min", "mins", "minute", "minutes"),
    "hours": ("h", "hr", "hrs", "hour", "hours"),
    "days": ("d", "day", "days", "excel", "datenum"),
}
UNIT_OF: Final = {text: unit for unit, texts in _SPELLINGS.items() for text in texts}
"""The unit that a spelling in small letters, with u for micro, stands for."""
NS_OF: Final = {
    "seconds": NS_PER_S,
    "milliseconds": 1_000_000,
    "microseconds": 1_000,
    "nanoseconds": 1,
    "minutes": 60 * NS_PER_S,
    "hours": 3600 * NS_PER_S,
    "days": NS_PER_DAY,
}
"""Nanoseconds in each unit."""
DATE_WORDS: Final = frozenset({"date", "datum", "datetime", "datenum", "serial"})
"""Words in the name of a column that counts days."""

# 1970-01-01 in days: spreadsheets count from 1899-12-30, MATLAB's datenum from year 0; and LabVIEW's seconds.
_DAYS: Final = {"excel": (25_569, "days of a spreadsheet"), "datenum": (719_529, "days of MATLAB's datenum")}
_SINCE_1904_S: Final = 2_082_844_800
# From 1990 to 2050, in days since 1970: the date that a measurement may have.
_RECENT_DAYS: Final = (7_305, 29_220)
# Rates at which vibration is sampled. A reading outside of them is as likely as one in another unit.
_USUAL_HZ: Final = (1.0, 1e6)
# Up to a month: what counts seconds from the start of a measurement or a machine.
_LONGEST_RUN_S: Final = 31 * 86_400
# A stated rate agrees with a unit when it's this near; the units are a factor of 24 and more apart.
_SAME_RATE: Final = 0.05
_MICRO: Final = str.maketrans({"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u"})
_WORD: Final = re.compile(r"[A-Z]?[^\W\d_A-Z]+|[A-Z]+(?![^\W\d_A-Z])")
_REMEDY: Final = (
    f"say what they count with time_unit (--time-unit {'|'.join(TIME_UNITS)}), take another column with time "
    f"(--time NAME), or give the rate of the rows (--time {NO_TIMES} --rate HZ)"
)
_PLAIN: Final = r"^(?P<sign>[+-]?)(?P<whole>\d{1,19})(?:[.,](?P<part>\d{0,18}))?$"


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeOptions:
    """What the caller says of the times of a file, and the rate that the file states.

    Attributes
    ----------
    column
        Name of the column that holds them, `NO_TIMES` for none; None to find out.
    unit
        What its numbers count, see `TIME_UNITS`; None to find out.
    rate_hz
        Samples a second as the caller has it, None when the file says it.
    stated_rate_hz
        Samples a second as the file states it beside the times, which settles a unit that nothing else tells.
    """

    column: str | None = None
    unit: str | None = None
    rate_hz: float | None = None
    stated_rate_hz: float | None = None

    def __post_init__(self) -> None:
        if self.unit is not None and spelled(self.unit) not in UNIT_OF:
            raise SetupError(f"the time unit {self.unit!r} is none of {', '.join(TIME_UNITS)}")
        if self.rate_hz is not None and not is_sample_rate(self.rate_hz):
            raise SetupError(
                f"the sample rate {self.rate_hz} Hz must be finite and positive, its period no centuries"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Times:
    """The times of the rows.

    Attributes
    ----------
    columns
        Names of the columns that they come from.
    stamps_ns
        ``[row]`` nanoseconds since 1970, or since a start that nobody knows.
    known
        ``[row]`` whether the row has a time.
    told
        What was understood, as the end of "times from ..."; empty when the file or the caller says it.
    """

    columns: tuple[str, ...]
    stamps_ns: Whole
    known: Mask
    told: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """A unit, what counts as 1970 in it, and how it's said."""

    unit: str
    zero: int = 0
    told: str = ""


def spelled(unit: str) -> str:
    """Give the spelling of a unit that `UNIT_OF` knows, if any: small letters, without brackets, u for micro."""
    return unit.strip(" []().").translate(_MICRO).lower()


def words_of(name: str) -> list[str]:
    """Take a name apart at case, digits and signs, in small letters.

    Examples
    --------
    >>> words_of("timeStamp_ns"), words_of("Zeit (ms)")
    (['time', 'stamp', 'ns'], ['zeit', 'ms'])
    """
    return [word.lower() for word in _WORD.findall(name.translate(_MICRO))]


def times_of_text(columns: tuple[str, ...], day: TextTimes | None, clock: TextTimes) -> Times:
    """Give the times of a column of text, or of a column of days and one of times of day."""
    if day is None:
        return Times(columns=columns, stamps_ns=clock.stamps_ns, known=clock.known, told=clock.told)
    # The date already turns at midnight: what the clock has run on past it doesn't count twice.
    stamps_ns = day.stamps_ns + clock.stamps_ns % NS_PER_DAY
    return Times(columns=columns, stamps_ns=stamps_ns, known=day.known & clock.known, told=day.told)


def times_of_remainder(whole: Column, part: Column) -> Times:
    """Give the times of a column of seconds since 1970 and one of what is left of them, both whole numbers."""
    seconds, rest = (_numbers_of(column) for column in (whole, part))
    known = np.isfinite(seconds) & np.isfinite(rest) & (np.abs(seconds) < 2**62 / NS_PER_S)
    unit = UNIT_OF[words_of(part.name)[-1]]
    stamps_ns = np.zeros(known.size, dtype=np.int64)
    stamps_ns[known] = seconds[known].astype(np.int64) * NS_PER_S + rest[known].astype(np.int64) * NS_OF[unit]
    return Times(columns=(whole.name, part.name), stamps_ns=stamps_ns, known=known, told=f"seconds and {unit}")


def times_of_numbers(column: Column, options: TimeOptions, *, where: str) -> Times:
    """Give the times of a column of numbers.

    Raises
    ------
    LogError
        When they lie beyond what nanoseconds hold.
    SetupError
        When what they count can't be told.
    """
    numbers = _numbers_of(column)
    if numbers.dtype.kind in "Mm":
        known = ~np.isnat(numbers)
        stamps_ns = np.where(known, numbers.astype(f"{numbers.dtype.kind}8[ns]").astype(np.int64), 0)
        return Times(columns=(column.name,), stamps_ns=stamps_ns, known=known, told="")
    known = np.isfinite(numbers)
    where = f"{where}: {column.name!r}"
    reading = _reading(column, numbers[known], options, where)
    stamps_ns = np.zeros(numbers.size, dtype=np.int64)
    stamps_ns[known] = _stamps_ns(column, numbers, known, reading, where)
    return Times(columns=(column.name,), stamps_ns=stamps_ns + column.start_ns, known=known, told=reading.told)


def _numbers_of(column: Column) -> NDArray[Any]:
    if column.numbers is None:
        raise SetupError(f"column {column.name!r} holds text that is no time; name another column (--time NAME)")
    numbers = column.numbers
    # What times are compared with, and a count of nanoseconds, is beyond the narrow kinds of floating point.
    with np.errstate(over="ignore"):
        return numbers.astype(np.float64) if numbers.dtype.kind == "f" else numbers


def _reading(column: Column, numbers: NDArray[Any], options: TimeOptions, where: str) -> _Reading:
    said = spelled(options.unit or column.unit or "")
    if said in UNIT_OF:
        return _stated(said, numbers)
    if said not in ("", "1"):
        raise SetupError(f"{where} is a time in {column.unit!r}; {_REMEDY}")
    last = words_of(column.name)[-1:]
    if last and last[0] in UNIT_OF:
        reading = _stated(last[0], numbers)
        return _Reading(unit=reading.unit, zero=reading.zero, told=f"{reading.told or reading.unit} by its name")
    return _bare(column, numbers, options, where)


def _stated(unit: str, numbers: NDArray[Any]) -> _Reading:
    """Take a unit that is said; days may count from a year that their size tells."""
    if UNIT_OF[unit] != "days":
        return _Reading(unit=UNIT_OF[unit])
    key = unit if unit in _DAYS else next((name for name in _DAYS if _is_recent_day(name, numbers)), None)
    return _Reading(unit="days") if key is None else _Reading(unit="days", zero=_DAYS[key][0], told=_DAYS[key][1])


def _bare(column: Column, numbers: NDArray[Any], options: TimeOptions, where: str) -> _Reading:
    """Take the one reading of numbers without unit that makes a usual rate; ask where there are two, or none."""
    step = _typical_step(numbers)
    rates_hz = {unit: NS_PER_S / (step * ns) if step > 0 else np.inf for unit, ns in NS_OF.items()}
    rate_hz = options.rate_hz or options.stated_rate_hz
    agreeing = [unit for unit in rates_hz if rate_hz and abs(rates_hz[unit] / rate_hz - 1) < _SAME_RATE]
    if agreeing:
        reading = _stated(spelled(agreeing[0]), numbers)
        return _Reading(unit=reading.unit, zero=reading.zero, told=f"{reading.unit}, as {rate_hz:g} Hz says")
    dates = DATE_WORDS.intersection(words_of(column.name))
    readings = [*_since_an_epoch(numbers, rates_hz), *_recent_days(numbers, rates_hz)]
    lowest_hz, highest_hz = _USUAL_HZ
    # Seconds in whole numbers may be milliseconds as well; with a fraction they're what a bare time is by custom.
    in_seconds = lowest_hz < rates_hz["seconds"] <= highest_hz and np.abs(numbers).max(initial=0) < _LONGEST_RUN_S
    if in_seconds and not (dates and readings):
        readings.append(_Reading(unit="seconds", told="taken for seconds"))
    if len(readings) == 1:
        return readings[0]
    possible = [
        f"{float(f'{rate:.4g}'):.10g} Hz if they count {unit}" for unit, rate in rates_hz.items() if 1e-2 < rate < 1e8
    ]
    raise SetupError(f"{where} has no unit: its numbers make {', '.join(possible[:4]) or 'no usual rate'}; {_REMEDY}")


def _since_an_epoch(numbers: NDArray[Any], rates_hz: dict[str, float]) -> list[_Reading]:
    """Read numbers as long as those that count from 1970, or LabVIEW's 1904, to a date of our days."""
    epochs = [
        *((unit, 0, f"{unit} since 1970") for unit in ("seconds", "milliseconds", "microseconds", "nanoseconds")),
        ("seconds", _SINCE_1904_S, "seconds since 1904"),
    ]
    return [
        _Reading(unit=unit, zero=zero, told=told)
        for unit, zero, told in epochs
        if _within(numbers, *(zero + days * NS_PER_DAY // NS_OF[unit] for days in _RECENT_DAYS))
        and _USUAL_HZ[0] * (1 - _SAME_RATE) < rates_hz[unit] <= _USUAL_HZ[1]
    ]


def _recent_days(numbers: NDArray[Any], rates_hz: dict[str, float]) -> list[_Reading]:
    """Read numbers as large as those that count days to a date of ours."""
    return [
        _Reading(unit="days", zero=zero, told=told)
        for name, (zero, told) in _DAYS.items()
        if _is_recent_day(name, numbers) and rates_hz["days"] <= _USUAL_HZ[1]
    ]


def _is_recent_day(name: str, numbers: NDArray[Any]) -> bool:
    return _within(numbers, *(_DAYS[name][0] + day for day in _RECENT_DAYS))


def _within(numbers: NDArray[Any], low: float, high: float) -> bool:
    return bool(numbers.size and numbers.min() >= low and numbers.max() <= high)


def _typical_step(numbers: NDArray[Any]) -> float:
    """Median of the mean step over 32 rows, which neither repeats nor gaps nor steps back change."""
    # Differences of the numbers themselves: nanoseconds of our days are too long for double precision.
    lag = max(1, min(32, (numbers.size - 1) // 2))
    with np.errstate(over="ignore"):
        steps = np.abs((numbers[lag:] - numbers[:-lag]).astype(np.float64))
    return float(np.median(steps)) / lag if steps.size else 0.0


def _stamps_ns(column: Column, numbers: NDArray[Any], known: Mask, reading: _Reading, where: str) -> Whole:
    ns = NS_OF[reading.unit]
    kept = numbers[known]
    largest = float(np.abs(kept.astype(np.float64) - reading.zero).max(initial=0.0)) * ns + abs(column.start_ns)
    if not largest < 2**62:
        raise LogError(
            f"{where}: the times aren't all within 146 years of 1970 when they count {reading.unit}; {_REMEDY}"
        )
    if kept.dtype.kind in "iu":
        return (kept.astype(np.int64) - reading.zero) * ns
    exact = None if column.text is None or reading.zero else _exact_ns(column.text, known, ns)
    return exact if exact is not None else np.rint((kept - reading.zero) * ns).astype(np.int64)


def _exact_ns(text: "pa.Array", known: Mask, ns: int) -> Whole | None:
    """Read plain decimal numbers digit by digit: double precision tells nanoseconds of our days apart by 256 only."""
    import pyarrow as pa
    import pyarrow.compute as pc

    digits = len(str(ns)) - 1
    if ns != 10**digits:
        return None
    parts = pc.extract_regex(text.filter(pa.array(known)), _PLAIN)
    if parts.null_count:
        return None
    # One digit more than a nanosecond, to round by.
    fraction = pc.utf8_slice_codeunits(pc.utf8_rpad(pc.struct_field(parts, "part"), digits + 1, "0"), 0, digits + 1)
    whole, below = (np.asarray(pc.cast(part, pa.int64())) for part in (pc.struct_field(parts, "whole"), fraction))
    negative = np.asarray(pc.equal(pc.struct_field(parts, "sign"), "-"))
    magnitude = whole * ns + (below + 5) // 10
    exact: Whole = np.where(negative, -magnitude, magnitude)
    return exact
