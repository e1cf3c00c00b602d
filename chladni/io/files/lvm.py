"""LabVIEW measurement files (``.lvm``): a header, then segments of rows, each with a header of its own.

After National Instruments' "Specification for the LabVIEW Measurement File". Where files in the field differ from it
they are followed: the count of samples is often wrong, and so is the step where the rows have an axis of times.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np

from chladni.io.clock.clock_verdict import round_rate
from chladni.io.files.bounds import read_whole
from chladni.io.files.columns import Column, distinct, parse_titles
from chladni.io.files.contents import FileContents, with_notes
from chladni.io.files.csv import read_csv
from chladni.io.files.csv_cells import CellReader
from chladni.io.files.csv_dialect import CsvDialect, split_cells
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_reading import NO_TIMES, NS_OF, UNIT_OF, TimeOptions, Times, spelled, times_of_numbers
from chladni.io.files.time_text import read_time_text
from chladni.signals.errors import LogError, SetupError
from chladni.signals.text_reading import lines_of, real_number
from chladni.signals.time_series import NS_PER_S, is_sample_rate

_MAGIC: Final = "LabVIEW Measurement"
_END: Final = "***End_of_Header***"
_SPECIAL: Final = ("***Start_Special***", "***End_Special***")
_AXIS: Final = "X_Value"
_COMMENT: Final = "Comment"
# Tags that a segment's header may begin with; other text at the start of a line is a damaged row.
_TAGS: Final = frozenset(
    {"Channels", "Samples", "Date", "Time", "X_Dimension", "X0", "Delta_X", "X_Unit_Label", "Y_Dimension"}
    | {"Y_Unit_Label", "Notes", "Test_Name", "Test_Numbers", "Test_Series", "Model_Number", "Serial_Number"}
    | {"UUT_Name", "UUT_M/N", "UUT_S/N"}
)
# Absolute times count from 1904-01-01; what counts from a start is shorter.
_NS_FROM_1904_TO_1970: Final = 2_082_844_800 * NS_PER_S
_LONGEST_RUN_NS: Final = 10**18
# A step known no better doesn't tell the rate: 0.000020 s is 48 or 51.2 kHz.
_UNKNOWN_STEP: Final = 0.01


def read_lvm(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
) -> FileContents:
    """Read a LabVIEW measurement file; one without a header is read as a table, by `read_csv`.

    Units are those of ``Y_Unit_Label``. Rows have the times of their axis (``X_Value``) where there's one, else those
    that ``Delta_X`` makes; both count from ``Date`` and ``Time``, which have no zone and are taken as UTC.

    Parameters
    ----------
    sample_rate_hz
        Rate of the rows, where the file has no axis of times and ``Delta_X`` too few digits to tell it.
    time
        ``none`` to leave the axis of times out; of a table see `read_csv`.
    time_unit
        Of a table, see `read_csv`.
    units
        Unit by channel name, instead of those in the file.

    Raises
    ------
    LogError
        When the file is damaged or holds no channel over time.
    SetupError
        When nothing says the rate, or a unit that is stated is unknown.
    """
    path = Path(path)
    lines, encoding = _lines(path)
    if not lines or not lines[0].startswith(_MAGIC):
        return read_csv(path, sample_rate_hz=sample_rate_hz, time=time, time_unit=time_unit, units=units)
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    tables = _tables(path, lines, encoding)
    parts, unread = [], []
    for table in tables:
        own, left_out = _parts(path, table, options)
        parts += own
        unread += left_out
    if not parts:
        raise LogError(f"{path}: holds no channel over time{''.join(f'; {name}: {why}' for name, why in unread[:5])}")
    # Where a name gives the column of times there's none to be looked for.
    found = series_of_parts(
        parts,
        TimeOptions(column=NO_TIMES, rate_hz=sample_rate_hz),
        where=str(path),
        units=units,
        unread=tuple(unread),
    )
    notes = [note for table in tables for note in table.reader.notes()]
    if any(segment.start_ns(1) for table in tables for segment in table.segments):
        notes.append(f"{path}: its dates are without zone, taken as UTC.")
    return with_notes(found, notes)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Segment:
    """One stretch of rows: the cells behind each tag of its header, the file's tags, and how many rows there are."""

    tags: Mapping[str, Sequence[str]]
    of_file: Mapping[str, str]
    rows: int

    def cell(self, tag: str, column: int) -> str:
        """Give what a tag says of a column; of the file where the segment doesn't have it."""
        cells = self.tags.get(tag)
        if cells is None:
            return self.of_file.get(tag, "")
        return cells[column] if column < len(cells) else ""

    def start_ns(self, column: int) -> int:
        """Give when the segment began, nanoseconds since 1970; 0 when nothing says it."""
        import pyarrow as pa

        text = f"{self.cell('Date', column)} {self.cell('Time', column)}"
        times = read_time_text(pa.array([text])) if text.strip() else None
        if times is None or not (times.dated and times.known.all()):
            return 0
        return int(times.stamps_ns[0])


@dataclass(slots=True, kw_only=True)
class _Table:
    """Segments with the same titles, their rows one after the other."""

    titles: Sequence[str]
    reader: CellReader
    segments: list[_Segment] = field(default_factory=list)


def _lines(path: Path) -> tuple[list[str], str]:
    raw = read_whole(path)
    try:
        text, encoding = raw.decode("utf-8-sig"), "utf-8-sig"
    except UnicodeDecodeError:
        text, encoding = raw.decode("cp1252", errors="replace"), "cp1252"
    return [f"{line}\n" for line in lines_of(text)], encoding


def _tables(path: Path, lines: Sequence[str], encoding: str) -> list[_Table]:
    """Read the rows of all segments, by their titles."""
    delimiter, body, of_file = _file_header(path, lines)
    comma = of_file.get("Decimal_Separator") == ","
    tables: dict[tuple[str, ...], _Table] = {}
    for tags, titles, first, last in _segments(lines, body, delimiter):
        table = tables.get(titles)
        if table is None:
            dialect = CsvDialect(
                encoding=encoding,
                delimiter=delimiter,
                decimal_commas=(comma,) * len(titles),
                header=(),
                units=(),
                first_data_line=0,
                numeric=(True,) * len(titles),
                blank_ends=int(titles[-1] == _COMMENT),
            )
            keep_text = [title in (_AXIS, _COMMENT) for title in titles]
            table = tables[titles] = _Table(titles=titles, reader=CellReader(path, dialect, keep_text))
        before = table.reader.rows
        table.reader.take(list(lines[first:last]), first + 1)
        table.segments.append(_Segment(tags=tags, of_file=of_file, rows=table.reader.rows - before))
    if not tables:
        raise LogError(f"{path}: holds a header and no rows")
    return list(tables.values())


def _file_header(path: Path, lines: Sequence[str]) -> tuple[str, int, dict[str, str]]:
    """Give the delimiter, the line behind the header, and its tags."""
    tagged = next((line for line in lines[:100] if line.startswith("Separator")), "Separator\tTab")
    # The tag itself is followed by what it names.
    named = {"tab": "\t", "comma": ","}.get(tagged[len("Separator") :].strip(" \t,;\r\n").lower())
    delimiter = named or next((mark for mark in "\t,;" if tagged[len("Separator") :].startswith(mark)), "\t")
    tags: dict[str, str] = {}
    for number, line in enumerate(lines):
        tag, *cells = split_cells(line, delimiter)
        if tag == _END:
            return delimiter, number + 1, tags
        tags[tag] = cells[0] if cells else ""
    raise LogError(f"{path}: its header has no end ({_END}); the file is cut short")


def _segments(
    lines: Sequence[str], body: int, delimiter: str
) -> Iterator[tuple[dict[str, list[str]], tuple[str, ...], int, int]]:
    """Give each segment's tags and titles, and the lines from its first row to behind its last."""
    place = body
    while place < len(lines):
        tags: dict[str, list[str]] = {}
        while place < len(lines) and (cells := split_cells(lines[place], delimiter))[0] != _END:
            tags[cells[0]] = cells
            place += 1
        if place + 1 >= len(lines):
            return
        titles = split_cells(lines[place + 1], delimiter)
        first = place = place + 2
        while place < len(lines) and lines[place].partition(delimiter)[0].strip() not in _TAGS:
            place += 1
        yield tags, tuple(titles), first, place


def _parts(path: Path, table: _Table, options: TimeOptions) -> tuple[list[Part], list[tuple[str, str]]]:
    """Part the channels of a table by their axis of times, or by step and start."""
    titles = parse_titles(table.titles)
    names = distinct([title.name for title in titles])
    parts: dict[tuple[object, ...], list[Column]] = {}
    made: dict[tuple[object, ...], Part] = {}
    unread = []
    axis: int | None = None
    for place, cells in enumerate(table.reader.columns):
        if table.titles[place] == _AXIS:
            axis = _axis(table, place) if cells.good and options.column != NO_TIMES else None
            continue
        dimension = table.segments[0].cell("X_Dimension", place)
        if not cells.filled:
            continue
        if cells.is_text or dimension not in ("", "Time"):
            unread.append((names[place], "text" if cells.is_text else f"against {dimension}, not time"))
            continue
        unit = table.segments[0].cell("Y_Unit_Label", place) or titles[place].unit
        column = Column(name=names[place], numbers=np.concatenate(cells.numbers), unit=unit)
        key = (axis, *(_clock(segment, place) for segment in table.segments))
        if key not in made:
            made[key] = _part(path, table, axis, place, options)
        parts.setdefault(key, []).append(column)
    return [replace(made[key], columns=columns) for key, columns in parts.items()], unread


def _axis(table: _Table, place: int) -> int:
    """Give the first axis of times that is equal to one; channels that share one share a series."""
    numbers = np.concatenate(table.reader.columns[place].numbers)
    earlier = [other for other in range(place) if table.titles[other] == _AXIS]
    equal = (
        other for other in earlier if np.array_equal(np.concatenate(table.reader.columns[other].numbers), numbers)
    )
    return next(equal, place)


def _clock(segment: _Segment, column: int) -> tuple[str, ...]:
    """Give what a segment says of a column's times; columns that agree share a series."""
    return tuple(segment.cell(tag, column) for tag in ("Date", "Time", "X0", "Delta_X", "X_Unit_Label"))


def _part(path: Path, table: _Table, axis: int | None, column: int, options: TimeOptions) -> Part:
    """Give the times of the rows of a column, or its rate and start, without columns yet."""
    starts_ns = np.repeat(
        np.array([segment.start_ns(column) for segment in table.segments], dtype=np.int64),
        [segment.rows for segment in table.segments],
    )
    if axis is not None:
        cells = table.reader.columns[axis]
        unit = table.segments[0].cell("X_Unit_Label", column) or "s"
        source = Column(name=_AXIS, numbers=np.concatenate(cells.numbers), text=cells.whole_text(), unit=unit)
        times = times_of_numbers(source, TimeOptions(), where=str(path))
        absolute = bool((np.abs(times.stamps_ns) > _LONGEST_RUN_NS).any())
        stamps_ns = times.stamps_ns + (-_NS_FROM_1904_TO_1970 if absolute else starts_ns)
        return Part(columns=(), times=Times(columns=(_AXIS,), stamps_ns=stamps_ns, known=times.known, told=""))
    steps = {(segment.cell("Delta_X", column), segment.cell("X_Unit_Label", column)) for segment in table.segments}
    rate_hz, told = _rate_hz(path, steps, options)
    offsets_ns = [_offset_ns(path, segment, column) for segment in table.segments]
    if len(table.segments) == 1 or options.column == NO_TIMES:
        return Part(columns=(), stated_rate_hz=rate_hz, stated_by=told, start_ns=int(starts_ns[0]) + offsets_ns[0])
    counts = np.concatenate([np.arange(segment.rows) for segment in table.segments])
    stamps_ns = starts_ns + np.repeat(np.array(offsets_ns), [segment.rows for segment in table.segments])
    stamps_ns = stamps_ns + np.rint(counts * (NS_PER_S / rate_hz)).astype(np.int64)
    known = np.ones(counts.size, dtype=np.bool_)
    return Part(columns=(), times=Times(columns=("Delta_X",), stamps_ns=stamps_ns, known=known, told=""))


def _offset_ns(path: Path, segment: _Segment, column: int) -> int:
    text = segment.cell("X0", column)
    offset_ns = round((_decimal(text) or 0) * NS_OF[_axis_unit(segment.cell("X_Unit_Label", column))])
    if not abs(offset_ns) < 2**62:
        raise LogError(f"{path}: begins at X0 = {text}, which isn't within 146 years")
    return offset_ns


def _axis_unit(label: str) -> str:
    return UNIT_OF.get(spelled(label), "seconds")


def _decimal(text: str) -> Decimal | None:
    plain = text.strip().replace(",", ".")
    try:
        number = real_number(plain)
    except ValueError:
        return None
    # No clock steps by decades.
    if not abs(number) < 1e9:
        return None
    # What a double can't tell from 0 is 0: a decimal may have no room for its exponent.
    return Decimal(plain) if number else Decimal(0)


def _decimals(number: Decimal) -> int:
    exponent = number.as_tuple().exponent
    return -exponent if isinstance(exponent, int) else 0


def _rate_hz(path: Path, steps: set[tuple[str, str]], options: TimeOptions) -> tuple[float, str]:
    """Give the rate that the step makes, as round as its digits allow, and what it stands on."""
    if len(steps) > 1:
        raise LogError(
            f"{path}: the step differs from segment to segment: {', '.join(sorted(step for step, _ in steps))}"
        )
    text, label = next(iter(steps))
    step = _decimal(text)
    # Half of the last digit that is written is what the step may be off by.
    doubt = float(Decimal(5).scaleb(-_decimals(step) - 1) / step) if step else np.inf
    rate_hz = NS_PER_S / (float(step) * NS_OF[_axis_unit(label)]) if step else 0.0
    if not (0 < doubt < _UNKNOWN_STEP and is_sample_rate(rate_hz)):
        if options.rate_hz is None:
            raise SetupError(
                f"{path}: has no axis of times, and the step {text!r} has too few digits to tell the rate; give the "
                "sample rate (--rate HZ)"
            )
        return options.rate_hz, ""
    return round_rate(rate_hz, max(doubt / 2, 4e-16) * rate_hz) or rate_hz, f"its step of {text}"
