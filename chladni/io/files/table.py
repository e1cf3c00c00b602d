"""From the columns of a table to time series: times or a rate, units, and what is left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stray_stamps import untimed
from chladni.io.files.columns import Column, channels_of, distinct, with_units
from chladni.io.files.contents import FileContents, joined, placed_rows, series_of_rows
from chladni.io.files.time_column import find_times, is_row_number, rises
from chladni.io.files.time_reading import NO_TIMES, TimeOptions, Times
from chladni.signals.arrays import Mask, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.time_series import NS_PER_S
from chladni.signals.wording import counted

MOST_TOLD = 5
# Rows that tell a rate of their own; fewer are events.
LEAST_RECORDED = 8

# A rate that is given and one that the times tell are the same when they're this near; clocks are far truer.
_SAME_RATE = 0.01

Rows = list[NDArray[np.floating]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """Columns of a file that share times or a rate.

    Attributes
    ----------
    columns
        All as long; names that stand twice in a file get a number.
    stated_rate_hz
        What the file states for their rows, None when it states nothing.
    stated_by
        What states it, where that was inferred from a name.
    start_ns
        Time of the first row, where a rate is stated.
    times
        Times of the rows, where they are known already.
    """

    columns: Sequence[Column]
    stated_rate_hz: float | None = None
    stated_by: str = ""
    start_ns: int = 0
    times: Times | None = None

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]


def series_of_parts(
    parts: Sequence[Part],
    options: TimeOptions,
    *,
    where: str,
    units: Mapping[str, str] | None = None,
    unread: tuple[tuple[str, str], ...] = (),
) -> FileContents:
    """Make a series of each part of a file; a part that can't be one doesn't cost the others.

    Arguments are those of `series_of_columns`; `unread` is what is left out already.

    Raises
    ------
    ChladniError
        When no part makes a series.
    """
    columns = [column for part in parts for column in part.columns]
    names = distinct([column.name for column in columns])
    own = [replace(column, name=name) for column, name in zip(columns, names, strict=True)]
    waiting = iter(with_units(own, units, where=where))
    parts = [replace(part, columns=[next(waiting) for _ in part.columns]) for part in parts]
    if options.column not in (None, NO_TIMES, *names):
        raise SetupError(f"{where}: has no column {options.column!r} to be the time; columns: {', '.join(names)}")
    found: list[FileContents] = []
    failed: list[tuple[Part, ChladniError]] = []
    for part in parts:
        try:
            found.append(_series_of_part(part, _options_of(part, parts, options), where, units))
        except ChladniError as error:
            failed.append((part, error))
    if failed and not found:
        first = failed[0][1]
        # What could have said it may be among what isn't read.
        told = "".join(f"; {name!r} isn't read: {reason}" for name, reason in unread[:3])
        raise type(first)(f"{where}: {str(first).removeprefix(f'{where}: ')}{told}") from first
    reasons = [(name, str(error).removeprefix(f"{where}: ")) for part, error in failed for name in part.names]
    contents = joined(found)
    return replace(contents, unread=(*unread, *contents.unread, *reasons))


def _options_of(part: Part, parts: Sequence[Part], options: TimeOptions) -> TimeOptions:
    """Give the options that are about this part: the column that it holds, the rate when it states none itself."""
    elsewhere = options.column not in (NO_TIMES, *part.names)
    for_others = part.stated_rate_hz is not None and any(other.stated_rate_hz is None for other in parts)
    return replace(
        options,
        column=None if elsewhere else options.column,
        rate_hz=None if for_others else options.rate_hz,
        stated_rate_hz=part.stated_rate_hz,
    )


def _series_of_part(part: Part, options: TimeOptions, where: str, units: Mapping[str, str] | None) -> FileContents:
    if part.times is not None:
        return series_of_rows_at(part.columns, part.times, options, where=where, units=units)
    contents = series_of_columns(part.columns, options, where=where, units=units)
    if contents.time_bases != (None,) or options.stated_rate_hz is None:
        return contents
    note = f"{where}: the sample rate is {options.stated_rate_hz:g} Hz by {part.stated_by}."
    return replace(
        contents,
        series=tuple(replace(series, start_time_ns=part.start_ns) for series in contents.series),
        notes=((note,) if part.stated_by else ()) + contents.notes,
    )


def series_of_columns(
    columns: Sequence[Column], options: TimeOptions, *, where: str, units: Mapping[str, str] | None = None
) -> FileContents:
    """Make a time series of the columns of numbers.

    Parameters
    ----------
    columns
        All as long, their names distinct.
    where
        File and part, for messages.
    units
        Unit by column name, instead of what the file says; the columns have them already.

    Raises
    ------
    LogError
        When there's no column of numbers besides times, or the times have no rate.
    SetupError
        When nothing says the times of the rows, or two things do.
    """
    times, unread = find_times(columns, options, where=where)
    return series_of_rows_at(columns, times, options, where=where, units=units, unread=unread)


def series_of_rows_at(
    columns: Sequence[Column],
    times: Times | None,
    options: TimeOptions,
    *,
    where: str,
    units: Mapping[str, str] | None = None,
    unread: tuple[tuple[str, str], ...] = (),
) -> FileContents:
    """Make a time series of columns whose rows have the given times, or a rate where `times` is None.

    Arguments and errors are those of `series_of_columns`; columns named in `unread` are left out already.
    """
    signals, left_out = _signals(columns, {name for name, _ in unread} | set(times.columns if times else ()))
    unread += left_out
    if not signals:
        held = "no numbers besides a time column" if times else "no numbers"
        others = "; ".join(f"{name}: {reason}" for name, reason in unread[:MOST_TOLD])
        raise LogError(f"{where}: holds {held}; {others or 'record at least one channel'}")
    channels, notes = channels_of(signals, units, where=where)
    rows = [column.numbers for column in signals if column.numbers is not None]
    if times is None:
        series = series_of_rows(rows, channels, sample_rate_hz=_rate_hz(columns, options, where))
        return FileContents(series=(series,), notes=notes, unread=unread, time_bases=(None,))
    floating = [_floating(row) for row in rows]
    placed = _placed_apart(floating, channels, times, options, where)
    return replace(placed, notes=tuple(dict.fromkeys(notes + placed.notes)), unread=unread)


def _placed_apart(
    rows: Rows, channels: list[Channel], times: Times, options: TimeOptions, where: str
) -> FileContents:
    """Place columns on the grid of the rows that they fill: a table may join what was recorded at several rates.

    Columns that fill few rows, among blank ones all along, are placed by these where they make a sampled signal.
    """
    groups: dict[bytes, list[int]] = {}
    filled = [np.isfinite(row) for row in rows]
    for place, mask in enumerate(filled):
        groups.setdefault(mask.tobytes() if _is_scattered(mask) else b"", []).append(place)

    def of(places: list[int], kept: Mask) -> FileContents:
        # All rows stay where they are: a large table isn't copied.
        chosen = slice(None) if kept.all() else kept
        some = replace(times, stamps_ns=times.stamps_ns[chosen], known=times.known[chosen])
        own_channels = [channels[place] for place in places]
        return _placed([rows[place][chosen] for place in places], own_channels, some, options, where)

    together = groups.pop(b"", [])
    found: list[FileContents] = []
    theirs = np.zeros(times.known.size, np.bool_)
    for places in groups.values():
        mask = filled[places[0]]
        try:
            found.append(of(places, mask))
            theirs |= mask
        except ChladniError:
            # Events, which stay among the gaps of the table's own grid.
            together += places
    if together:
        # A row that others alone fill is none of these; one that nobody fills is a gap.
        own = np.logical_or.reduce([filled[place] for place in together])
        found.insert(0, of(sorted(together), own | ~theirs))
    return joined(found)


def _is_scattered(filled: Mask) -> bool:
    """Whether at most half of the rows are filled, and most of these stand alone among blank ones."""
    count = int(np.count_nonzero(filled))
    runs = int(np.count_nonzero(np.diff(filled.astype(np.int8), prepend=0) == 1))
    return LEAST_RECORDED <= count <= filled.size / 2 and runs > count / 2


def _signals(columns: Sequence[Column], apart: set[str]) -> tuple[list[Column], tuple[tuple[str, str], ...]]:
    """Give the columns of numbers besides `apart`, and why the others are none."""
    signals, unread = [], []
    for place, column in enumerate(columns):
        if column.name in apart:
            continue
        reason = _why_no_signal(column)
        if not reason and len(columns) > 1 and is_row_number(column, first=place == 0):
            reason = "it numbers the rows"
        if reason:
            unread.append((column.name, reason))
        else:
            signals.append(column)
    return signals, tuple(unread)


def _why_no_signal(column: Column) -> str:
    if column.numbers is None:
        first = next((cell for cell in (column.text or ()) if str(cell)), None)
        return "empty" if first is None else f"text, such as {str(first)[:40]!r}"
    kind = column.numbers.dtype.kind
    if kind not in "fiub":
        return "times that weren't asked for" if kind in "mM" else f"{column.numbers.dtype} numbers"
    return "empty" if kind == "f" and not np.isfinite(column.numbers).any() else ""


def _floating(numbers: NDArray[Any]) -> NDArray[np.floating]:
    # Integers become double, which holds 53 bits of them.
    return numbers if numbers.dtype in (np.float32, np.float64) else numbers.astype(np.float64)


def _rate_hz(columns: Sequence[Column], options: TimeOptions, where: str) -> float:
    """Give the rate of rows without times."""
    given, stated = options.rate_hz, options.stated_rate_hz
    if given is not None and stated is not None and abs(given / stated - 1) > _SAME_RATE:
        raise SetupError(f"{where}: says {stated:g} Hz, {given:g} Hz was given; leave the sample rate out")
    rate_hz = given if given is not None else stated
    if rate_hz is None:
        rising = next(
            (f"; {column.name!r} rises like a time but has no unit" for column in columns if rises(column)), ""
        )
        take = " or take a column for the time (--time NAME --time-unit s)" if rising else ""
        raise SetupError(
            f"{where}: nothing says the sample rate{rising}; give the sample rate (--rate HZ){take}; it has "
            f"{', '.join(column.name for column in columns[:12])}"
        )
    return rate_hz


def _placed(rows: Rows, channels: list[Channel], times: Times, options: TimeOptions, where: str) -> FileContents:
    """Put rows on the grid of their times, with notes on what was understood and left out."""
    notes = []
    if times.told:
        notes.append(f"{where}: times from {' and '.join(times.columns)!r}: {times.told}.")
    stamps_ns = times.stamps_ns
    if not times.known.all():
        unknown = int(np.count_nonzero(~times.known))
        notes.append(f"{where}: {counted(unknown, 'row')} without a time left out.")
        stamps_ns, rows = stamps_ns[times.known], [row[times.known] for row in rows]
    away = untimed(stamps_ns, None)
    if away is not None:
        notes.append(f"{where}: {counted(int(np.count_nonzero(away)), 'row')} left out, whose time is no time.")
        stamps_ns, rows = stamps_ns[~away], [row[~away] for row in rows]
    if stamps_ns.size > 2 and (np.diff(stamps_ns) < 0).all():
        notes.append(f"{where}: its rows stand in falling order of time, and were put in order.")
        stamps_ns, rows = stamps_ns[::-1], [row[::-1] for row in rows]
    placed = _at_rate(stamps_ns, rows, channels, options, where)
    found_hz, stated_hz = placed.series[0].sample_rate_hz, options.stated_rate_hz
    if stated_hz is not None and abs(found_hz / stated_hz - 1) > _SAME_RATE:
        notes.append(f"{where}: states {stated_hz:g} Hz, its times run at {found_hz:g} Hz, which is taken.")
    return replace(placed, notes=(*notes, *placed.notes))


def _at_rate(stamps_ns: Whole, rows: Rows, channels: list[Channel], options: TimeOptions, where: str) -> FileContents:
    """Place rows by their times, at the given rate where there's one and the times run at it."""
    given_hz = options.rate_hz
    rate_hz = given_hz or options.stated_rate_hz
    ordered = None if rate_hz is None else _in_order(stamps_ns, rows, channels, rate_hz, where)
    # Equal times of many rows are coarse ones, and only the rate tells the rows apart.
    if ordered is not None and given_hz is not None and not np.diff(stamps_ns).all():
        return ordered
    try:
        placed = placed_rows(stamps_ns, rows, channels, where=where)
    except LogError as error:
        if ordered is None and stamps_ns.size < 2:
            raise LogError(
                f"{where}: one row alone has a time, and its times don't make a sampled signal: record longer; or, "
                "of many rows, leave the times out (--time none --rate HZ)"
            ) from error
        if ordered is None:
            raise LogError(f"{error}; or leave them out (--time none --rate HZ)") from error
        return ordered
    (series,), (base,) = placed.series, placed.time_bases
    if given_hz is None or base is None:
        return placed
    if abs(series.sample_rate_hz / given_hz - 1) > _SAME_RATE:
        raise SetupError(
            f"{where}: its times run at {series.sample_rate_hz:.6g} Hz, {given_hz:g} Hz was given; leave the sample "
            "rate out, or the times (--time none --rate HZ)"
        )
    differ = abs(base.rate_hz - given_hz) > max(3 * base.rate_std_hz, 1e-9 * given_hz)
    note = f"{where}: its times run at {series.sample_rate_hz:.9g} Hz; {given_hz:g} Hz as given is taken."
    return replace(
        placed,
        series=(replace(series, sample_rate_hz=given_hz),),
        notes=(*placed.notes, *([note] if differ else [])),
    )


def _in_order(
    stamps_ns: Whole, rows: Rows, channels: list[Channel], rate_hz: float, where: str
) -> FileContents | None:
    """Put rows one period after the other, where times that are coarser than it agree with that; else None."""
    period_ns = NS_PER_S / rate_hz
    steps = np.diff(stamps_ns)
    if not (steps > 0).any():
        return None
    resolution_ns = max(period_ns, float(steps[steps > 0].min()))
    departure_ns = stamps_ns - stamps_ns[0] - np.arange(stamps_ns.size) * period_ns
    if np.ptp(departure_ns) > 2 * resolution_ns:
        return None
    note = f"{where}: its times are coarser than the rows, which follow one another at {rate_hz:g} Hz."
    series = series_of_rows(rows, channels, sample_rate_hz=rate_hz, start_time_ns=int(stamps_ns[0]))
    return FileContents(series=(series,), notes=(note,), time_bases=(None,))
