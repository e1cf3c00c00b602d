"""CSV tables: a row for each sample, a column for each channel, and times."""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np

from chladni.io.atomic import atomic_write
from chladni.io.files.columns import Column, Title, distinct, parse_titles
from chladni.io.files.contents import FileContents, one_series, with_notes
from chladni.io.files.csv_cells import CellReader, Cells
from chladni.io.files.csv_dialect import sniff_csv
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_column import UNNAMED, is_time_name
from chladni.io.files.time_reading import UNIT_OF, TimeOptions, spelled
from chladni.signals.arrays import Mask
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.visible import cell_meant, cell_text
from chladni.signals.wording import counted

# Some ten MB of text at a time: the table grows, the text of it doesn't.
_LINES_AT_ONCE: Final = 65536


def read_csv(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    names: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    decimal: str | None = None,
) -> FileContents:
    """Read a table of numbers.

    Encoding, delimiter (``;``, tab, ``,`` or blanks), decimal comma, remarks, a line of names and a line of units are
    found out from the file. A title is ``name``, ``name [unit]`` or ``name (unit)``; an apostrophe that marks text
    for spreadsheets is none of the name (see `chladni.signals.visible.cell_text`). Cells that are blank or no finite
    number are gaps of their channel, times that are left out are gaps of all. Columns of text are left out.

    The time column is the one called ``time``, ``t``, ``timestamp``, ``Zeit`` or alike, alone or with a unit, or the
    one of dates or times of day; see `chladni.io.files.time_reading` for what its numbers count.

    Parameters
    ----------
    sample_rate_hz
        Rate of the rows when there is no time column, or what the times are too coarse to tell.
    time
        Name of the time column; ``none`` when there's none whatever it's called.
    time_unit
        What the numbers of the time column count: ``s``, ``ms``, ``us``, ``ns``, ``min``, ``h``, ``days``, ``excel``
        or ``datenum``.
    names
        Names of all columns, the time column included, instead of those in the file.
    units
        Unit by column name, instead of those in the file.
    decimal
        The decimal sign, ``.`` or ``,``, where the file leaves it open.

    Raises
    ------
    LogError
        For a row that is too long, numbers that can be read in two ways, and a table without rows.
    SetupError
        When the time base isn't said, is said twice, or a unit that is stated is unknown.
    """
    path = Path(path)
    if decimal not in (None, ".", ","):
        raise SetupError(f"{path}: the decimal sign is . or , not {decimal!r}")
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    dialect = sniff_csv(path, decimal=decimal)
    found = parse_titles(dialect.header or ("",) * dialect.columns)
    titles = [replace(title, name=cell_meant(title.name)) for title in found]
    titled = names if names is not None and len(names) == len(titles) else [title.name for title in titles]
    keep_text = [
        # Of times, whose digits count, and of what is text.
        not numeric or place == 0 or is_time_name(name) or name == time or spelled(title.unit or "") in UNIT_OF
        for place, (numeric, name, title) in enumerate(zip(dialect.numeric, titled, titles, strict=True))
    ]
    reader = CellReader(path, dialect, keep_text)
    with path.open(encoding=dialect.encoding, errors="replace", newline=None) as file:
        line = sum(1 for _ in islice(file, dialect.first_data_line))
        while lines := list(islice(file, _LINES_AT_ONCE)):
            reader.take(lines, line + 1)
            line += len(lines)
    columns, notes = _columns(path, titles, dialect.units, reader.columns, names)
    contents = series_of_parts([Part(columns=columns)], options, where=str(path), units=units)
    if above := dialect.rows_above:
        told = f"{counted(len(above), 'line')} of numbers above the titles left out, the first is line {above[0]}"
        notes.append(f"{path}: {told}.")
    return with_notes(contents, (*reader.notes(), *notes))


def _columns(
    path: Path, titles: Sequence[Title], units: Sequence[str], cells: Sequence[Cells], names: Sequence[str] | None
) -> tuple[list[Column], list[str]]:
    """Give the columns that have a name or content, and notes on cells and names."""
    # What stands behind the last delimiter of each line, and a column that parts two blocks, is none.
    places = [place for place, title in enumerate(titles) if title.name or cells[place].filled]
    titled = any(title.name for title in titles)
    found = [titles[place].name or (UNNAMED if titled and place == 0 else f"column_{place + 1}") for place in places]
    if names is not None and len(names) != len(places):
        raise SetupError(f"{path}: has {len(places)} columns, but {len(names)} names were given; name each column")
    own = distinct(names if names is not None else found)
    notes = [
        f"{path}: a further column {old!r} is called {new!r}."
        for old, new in zip(names or found, own, strict=True)
        if old != new
    ]
    columns = []
    for place, name in zip(places, own, strict=True):
        title, column = titles[place], cells[place]
        below = units[place].strip("[]()") if units else ""
        columns.append(
            Column(
                name=name,
                numbers=None if column.is_text else np.concatenate(column.numbers),
                text=column.whole_text(),
                unit=title.unit if title.unit is not None else below or None,
                start_ns=title.start_ns,
            )
        )
        if column.bad and not column.is_text:
            line, text = column.first_bad
            what = f"{counted(column.bad, 'cell')} no number, the first {text[:40]!r} in line {line}"
            notes.append(f"{path}: column {name!r}: {what}; left as gaps.")
    return columns, notes


def write_csv(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write a table: titles ``name [unit]``, times in seconds from the first sample, every digit of every number.

    The start is in the title of the time column: ``time [s from 1700000000.5]``. A name that a spreadsheet would take
    for a formula, or that holds what isn't seen, stands behind an apostrophe, with escapes. A missing value is an
    empty cell, a sample missing in all channels is left out.

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


def _written_titles(series: TimeSeries) -> Iterator[str]:
    start = Decimal(series.start_time_ns) / NS_PER_S
    yield f"time [s from {start:f}]" if series.start_time_ns else "time [s]"
    for channel in series.channels:
        yield f"{cell_text(channel.name)} [{channel.unit}]"


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text


def _lines(series: TimeSeries, present: Mask, part: slice) -> Iterator[str]:
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


def _losses(series: TimeSeries, present: Mask) -> tuple[str, ...]:
    losses = []
    if any(channel.point or channel.direction or channel.overload for channel in series.channels):
        losses.append("A CSV table holds no points, directions and overload limits; keep them in a setup file.")
    if series.samples and not present[:, [0, -1]].any(axis=0).all():
        losses.append("Samples missing in all channels at the start or end are left out.")
    return tuple(losses)
