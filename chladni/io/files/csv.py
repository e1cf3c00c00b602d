"""CSV tables: a row for each sample, a column for each channel, and a column of times."""

import io
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_write
from chladni.io.files.contents import FileContents, one_series, placed_rows, series_of_rows, times_to_ns, unit_of
from chladni.io.files.csv_dialect import CsvDialect, sniff_csv, split_cells
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries

TIME_UNITS_NS = {"s": NS_PER_S, "ms": 1_000_000, "us": 1_000, "µs": 1_000, "μs": 1_000, "ns": 1, "min": 60 * NS_PER_S}
"""Nanoseconds in each unit that a time column may have."""

# Some ten MB of text at a time: the table grows, the text of it doesn't.
_LINES_AT_ONCE = 65536
_TITLE = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>.*)\))$")
_TIME_NAME = re.compile(r"^(time|t|timestamp|zeit|seconds|elapsed( time)?)$", re.IGNORECASE)
# Our own titles carry the start, so that a table keeps absolute time without a column of 19 digits.
_TIME_FROM = re.compile(r"^(?P<unit>\w+) from (?P<start>\d+(\.\d+)?)$")


def read_csv(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time_unit: str | None = None,
    names: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> FileContents:
    """Read a table of numbers.

    Encoding, delimiter (``;``, tab, ``,`` or blanks), decimal comma, a line of names and a line of units are found
    out from the file. A title is ``name``, ``name [unit]`` or ``name (unit)``. The time column is the one called
    ``time``, ``t`` or ``timestamp``; without such a name the first column, when it rises from row to row. Empty cells
    and cells that are no finite number are gaps of their channel, times that are left out are gaps of all.

    Parameters
    ----------
    sample_rate_hz
        Rate of the rows when there is no time column.
    time_unit
        ``s``, ``ms``, ``us`` or ``ns``, when the title of the time column doesn't say it.
    names
        Names of all columns, the time column included, instead of those in the file.
    units
        Unit by column name, instead of those in the file.

    Raises
    ------
    LogError
        For a cell that is no number (its line and column are named), a row of another length, and a table without
        rows.
    SetupError
        When the time base isn't said, is said twice, or a unit is unknown.
    """
    path = Path(path)
    dialect = sniff_csv(path)
    titles = _titles(path, dialect, names, units)
    table = _table(path, dialect, titles)
    time_column = _time_column(path, titles, table, sample_rate_hz)
    rows = [column for column in range(len(titles)) if column != time_column]
    if not rows:
        raise LogError(f"{path}: holds a time column and nothing else")
    channels = [Channel(name=titles[column].name, unit=titles[column].unit) for column in rows]
    columns = [table[:, column] for column in rows]
    if time_column is None:
        rate_hz = _known_rate(path, sample_rate_hz)
        return FileContents(series=(series_of_rows(columns, channels, sample_rate_hz=rate_hz),))
    stamps_ns = _stamps_ns(path, titles[time_column], table[:, time_column], time_unit)
    return placed_rows(stamps_ns, columns, channels, where=str(path))


def write_csv(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write a table: titles ``name [unit]``, times in seconds from the first sample, every digit of every number.

    The start is in the title of the time column: ``time [s from 1700000000.5]``. A missing value is an empty cell,
    a sample missing in all channels is left out.

    Returns
    -------
    losses
        Sentences on what the table doesn't hold.

    Raises
    ------
    LogError
        When there are channels of several rates, or the file can't be written.
    """
    table = one_series((series,) if isinstance(series, TimeSeries) else series, "a CSV table")
    present = np.isfinite(table.values) if table.valid is None else table.valid & np.isfinite(table.values)
    with atomic_write(path, overwrite=overwrite) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        text.write(",".join(_quoted(title) for title in _written_titles(table)) + "\r\n")
        for first in range(0, table.samples, _LINES_AT_ONCE):
            text.writelines(_lines(table, present, slice(first, first + _LINES_AT_ONCE)))
        text.flush()
        text.detach()
    return _losses(table, present)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Title:
    name: str
    unit: str
    said: bool
    start_ns: int = 0


def _titles(
    path: Path, dialect: CsvDialect, names: Sequence[str] | None, units: Mapping[str, str] | None
) -> list[_Title]:
    count = dialect.columns
    if names is not None and len(names) != count:
        raise SetupError(f"{path}: has {count} columns, but {len(names)} names were given; name each column")
    found = dialect.header or tuple(f"column_{number + 1}" for number in range(count))
    titles = [_title(text, unit) for text, unit in zip(found, dialect.units or ("",) * count, strict=True)]
    if names is not None:
        titles = [
            _Title(name=name, unit=title.unit, said=title.said, start_ns=title.start_ns)
            for name, title in zip(names, titles, strict=True)
        ]
    _require_distinct(path, titles, units)
    return [
        _Title(
            name=title.name,
            unit=unit_of(title.name, title.unit, units),
            said=title.said or title.name in (units or {}),
            start_ns=title.start_ns,
        )
        for title in titles
    ]


def _require_distinct(path: Path, titles: list[_Title], units: Mapping[str, str] | None) -> None:
    names = [title.name for title in titles]
    for column, name in enumerate(names):
        if not name or name in names[:column]:
            what = f"the name {name!r} again" if name else "no name"
            raise LogError(f"{path}: column {column + 1} has {what}; give each column a name of its own")
    for name in units or {}:
        if name not in names:
            raise SetupError(f"{path}: has no column {name!r} to give a unit; columns: {', '.join(names)}")


def _title(text: str, unit_below: str) -> _Title:
    match = _TITLE.match(text)
    if match is None or not match["name"] or not _is_unit(text, match):
        return _Title(name=text, unit=unit_below.strip("[]()") or "1", said=bool(unit_below))
    # An empty pair of brackets is how some tools write "no unit".
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    started = _TIME_FROM.match(unit)
    if started is None:
        return _Title(name=match["name"], unit=unit or "1", said=True)
    start_ns = int(Decimal(started["start"]) * NS_PER_S)
    return _Title(name=match["name"], unit=started["unit"], said=True, start_ns=start_ns)


def _is_unit(text: str, match: re.Match[str]) -> bool:
    """Whether the brackets at the end of a title hold a unit: not an index of a message path, not a remark."""
    from chladni.signals.units import si_factor

    # In a message path [0] is an index; a unit stands apart from it by a blank.
    if match["square"] is not None:
        return not text.startswith("/") or text[match.start("square") - 2].isspace()
    try:
        si_factor(match["round"])
    except SetupError:
        return False
    return True


def _table(path: Path, dialect: CsvDialect, titles: list[_Title]) -> NDArray[np.float64]:
    parts = []
    with path.open(encoding=dialect.encoding, errors="replace", newline=None) as file:
        for _ in range(dialect.first_data_line):
            next(file)
        line = dialect.first_data_line
        while lines := list(islice(file, _LINES_AT_ONCE)):
            parts.append(_numbers(path, dialect, titles, lines, line + 1))
            line += len(lines)
    return np.concatenate(parts)


def _numbers(
    path: Path, dialect: CsvDialect, titles: list[_Title], lines: list[str], first_line: int
) -> NDArray[np.float64]:
    """Read a stretch of lines, fast when every cell is a number, else cell by cell."""
    plain = [line.replace(",", ".") for line in lines] if dialect.decimal_comma else lines
    delimiter = None if dialect.delimiter == " " else dialect.delimiter
    try:
        with warnings.catch_warnings():
            # A stretch of blank lines is no reason to warn.
            warnings.simplefilter("ignore", UserWarning)
            table = np.loadtxt(plain, delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
    except ValueError:
        return _numbers_by_cell(path, dialect, titles, lines, first_line)
    # A stretch that is wrong throughout agrees with itself: only the head tells how many columns are right.
    if table.size and table.shape[1] != dialect.columns:
        return _numbers_by_cell(path, dialect, titles, lines, first_line)
    return table.reshape(-1, dialect.columns)


def _numbers_by_cell(
    path: Path, dialect: CsvDialect, titles: list[_Title], lines: list[str], first_line: int
) -> NDArray[np.float64]:
    table = []
    for number, line in enumerate(lines, start=first_line):
        cells = split_cells(line, dialect.delimiter)
        if not any(cells) and len(cells) <= 1:
            continue
        if len(cells) != dialect.columns:
            raise LogError(
                f"{path}: line {number} has {len(cells)} cells where the table has {dialect.columns} columns"
            )
        table.append([_cell(path, dialect, number, title, cell) for title, cell in zip(titles, cells, strict=True)])
    return np.array(table, dtype=np.float64).reshape(-1, dialect.columns)


def _cell(path: Path, dialect: CsvDialect, line: int, title: _Title, cell: str) -> float:
    try:
        return dialect.number(cell)
    except ValueError:
        raise LogError(
            f"{path}: line {line}, column {title.name!r}: {cell[:40]!r} is no number; correct it, or leave the cell "
            "empty to mark a gap"
        ) from None


def _time_column(
    path: Path, titles: list[_Title], table: NDArray[np.float64], sample_rate_hz: float | None
) -> int | None:
    named = [column for column, title in enumerate(titles) if _TIME_NAME.match(title.name)]
    # Two time bases that disagree would leave it to chance which one the spectra are on.
    if sample_rate_hz is not None:
        if named:
            raise SetupError(
                f"{path}: has a time column, {titles[named[0]].name!r}; leave the sample rate out, or take the "
                "column out"
            )
        return None
    if named:
        return named[0]
    return 0 if len(table) > 2 and bool((np.diff(table[:, 0]) > 0).all()) else None


def _known_rate(path: Path, sample_rate_hz: float | None) -> float:
    if sample_rate_hz is None:
        raise SetupError(
            f"{path}: no column is called time, and the first isn't one; give the sample rate (--rate HZ)"
        )
    return sample_rate_hz


def _stamps_ns(path: Path, title: _Title, times: NDArray[np.float64], time_unit: str | None) -> NDArray[np.int64]:
    unit = time_unit or (title.unit if title.said else None)
    # "timestamp" without a unit may be seconds, milliseconds or nanoseconds: that one is asked for.
    if unit is None and title.name.lower() in ("time", "t", "seconds"):
        unit = "s"
    if unit not in TIME_UNITS_NS:
        said = f"the unit {unit!r}" if unit else "no unit"
        raise SetupError(
            f"{path}: column {title.name!r} rises like a time but has {said}; give time_unit "
            f"(--read time_unit=ms), one of {', '.join(TIME_UNITS_NS)}, or name the column time [s]"
        )
    bad = np.flatnonzero(~np.isfinite(times))
    if bad.size:
        raise LogError(f"{path}: column {title.name!r}: row {bad[0] + 1} has no time")
    where = f"{path}: column {title.name!r}"
    return times_to_ns(times, unit_ns=TIME_UNITS_NS[unit], start_ns=title.start_ns, where=where)


def _written_titles(series: TimeSeries) -> Iterator[str]:
    start = Decimal(series.start_time_ns) / NS_PER_S
    yield f"time [s from {start:f}]" if series.start_time_ns else "time [s]"
    for channel in series.channels:
        yield f"{channel.name} [{channel.unit}]"


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text


def _lines(series: TimeSeries, present: NDArray[np.bool_], part: slice) -> Iterator[str]:
    times = series.times_s()[part].tolist()
    columns = series.values[:, part].T.tolist()
    # Whole stretches are the rule, and take half the time without a test of every cell.
    if present[:, part].all():
        for time_s, numbers in zip(times, columns, strict=True):
            yield f"{time_s!r},{','.join(map(repr, numbers))}\r\n"
        return
    for time_s, numbers, good in zip(times, columns, present[:, part].T.tolist(), strict=True):
        if any(good):
            cells = [repr(number) if ok else "" for number, ok in zip(numbers, good, strict=True)]
            yield f"{time_s!r},{','.join(cells)}\r\n"


def _losses(series: TimeSeries, present: NDArray[np.bool_]) -> tuple[str, ...]:
    losses = []
    if any(channel.point or channel.direction or channel.overload for channel in series.channels):
        losses.append("A CSV table holds no points, directions and overload limits; keep them in a setup file.")
    if series.samples and not present[:, [0, -1]].any(axis=0).all():
        losses.append("Samples missing in all channels at the start or end are left out.")
    return tuple(losses)
