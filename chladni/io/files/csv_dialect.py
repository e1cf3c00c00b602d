"""How a CSV file is written: its encoding, delimiter, decimal sign and header lines."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from chladni.io.files.columns import is_unit
from chladni.io.files.time_reading import UNIT_OF, spelled
from chladni.io.files.time_text import is_time_text
from chladni.signals.errors import LogError
from chladni.signals.text_reading import lines_of
from chladni.signals.wording import counted

# Enough for most heads; the larger one for tables of thousands of columns, and for long remarks.
_HEAD_BYTES: Final = (2**16, 2**22)
NUMBER: Final = r"(?i)^[+-]?(\d+([.,]\d*)?|[.,]\d+)([ed][+-]?\d+)?$|^[+-]?(nan|inf|infinity)$"
"""A number with either decimal sign, as a regular expression; Fortran writes 1.0D+00."""
_NUMBER: Final = re.compile(NUMBER, re.ASCII)
# Three digits behind a comma or point, and no zero before it, may as well be thousands.
_GROUPED: Final = re.compile(r"^[+-]?[1-9]\d{0,2}[.,]\d{3}$", re.ASCII)
_DELIMITERS: Final = (";", "\t", ",", " ")
# What parts names of several columns; within a name stands a comma with a blank behind it, as in "F, kN".
_BETWEEN_NAMES: Final = re.compile(r"(?<=[^\s;,])(?:;|\t|,(?=\S))(?=[^;,])")
LONE: Final = "\n"
"""In place of a delimiter: there's one column."""
_MARKS: Final = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}

_Kind = Literal["number", "time", "blank", "text"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvDialect:
    """How a CSV file is written.

    Attributes
    ----------
    encoding
        Name of a Python codec.
    delimiter
        Character between cells; a blank means any run of blanks, a line feed that there's one column.
    decimal_commas
        For each column, whether its numbers are written ``1,5``.
    header
        Cells of the line of names; empty when the file has none.
    units
        Cells of a line of units under the names; empty when the file has none.
    first_data_line
        Lines before the first row.
    numeric
        For each column, whether most of its cells in the head are numbers.
    blank_ends
        Columns at the end that are blank in the head: delimiters behind the last cell, which lines may lack.
    rows_above
        Numbers of the lines above the titles that hold as many numbers as a row.
    """

    encoding: str
    delimiter: str
    decimal_commas: tuple[bool, ...]
    header: tuple[str, ...]
    units: tuple[str, ...]
    first_data_line: int
    numeric: tuple[bool, ...]
    blank_ends: int = 0
    rows_above: tuple[int, ...] = ()

    @property
    def columns(self) -> int:
        """Number of cells in a row."""
        return len(self.decimal_commas)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rows:
    """The longest run of lines that look like rows of one table."""

    delimiter: str
    lines: list[list[str]]
    first: int

    @property
    def numeric(self) -> bool:
        """Whether the first row has no text."""
        return all(_kind(cell) != "text" for cell in self.lines[0])

    @property
    def blank(self) -> list[bool]:
        """For each column, whether nothing stands in it."""
        return [not any(cells) for cells in zip(*self.lines, strict=True)]

    @property
    def blank_ends(self) -> int:
        """Columns at the end where nothing stands."""
        return next((place for place, empty in enumerate(reversed(self.blank)) if not empty), 0)


def sniff_csv(path: Path, *, decimal: str | None = None) -> CsvDialect:
    """Find out how a file is written from its start.

    Parameters
    ----------
    decimal
        ``.`` or ``,`` where the numbers leave open which is the decimal sign.

    Raises
    ------
    LogError
        When there are no rows of numbers, the names don't fit the columns, or a number can be read in two ways.
    """
    for size in _HEAD_BYTES:
        encoding, lines = _head(path, size)
        runs = [run for delimiter in (*_DELIMITERS, LONE) if (run := _longest_run(lines, delimiter)) is not None]
        if runs:
            break
    else:
        if not any(line.strip() for line in lines):
            raise LogError(f"{path}: the file is empty; expected lines of numbers")
        where = "its only line" if len(lines) == 1 else f"its first {len(lines)} lines"
        raise LogError(f"{path}: no line of numbers in {where}; is it a CSV file?")
    longest = max(len(run.lines) for run in runs)
    # Rows of numbers alone are surer than rows with text, and "1,5" is two cells before it's one.
    rows = max(
        (run for run in runs if 2 * len(run.lines) >= longest), key=lambda run: (run.numeric, run.delimiter != LONE)
    )
    first = _first_row(lines, rows)
    header, units, titled = _titles(path, lines[:first], rows)
    return CsvDialect(
        encoding=encoding,
        delimiter=rows.delimiter,
        decimal_commas=_decimal_commas(path, rows, decimal),
        header=header,
        units=units,
        # What stands between the titles and the first line that looks like a row is one that doesn't.
        first_data_line=titled or first,
        rows_above=_rows_above(lines[:titled], rows),
        numeric=tuple(
            2 * sum(is_number(cell) for cell in cells) > len(cells) for cells in zip(*rows.lines, strict=True)
        ),
        blank_ends=rows.blank_ends,
    )


def split_cells(line: str, delimiter: str) -> list[str]:
    """Split a line at a delimiter, with quotes respected; a blank stands for any run of blanks."""
    line = line.rstrip("\r\n")
    if '"' in line:
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except csv.Error:
            # No table has a cell of more than 128 KiB: an open quotation in a file that is none.
            return [line]
        return [cell for cell in cells if cell] if delimiter == " " else cells
    return line.split() if delimiter == " " else [cell.strip() for cell in line.split(delimiter)]


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with either decimal sign."""
    return _NUMBER.match(cell) is not None


def _kind(cell: str) -> _Kind:
    if not cell:
        return "blank"
    return "number" if is_number(cell) else "time" if is_time_text(cell) else "text"


def _head(path: Path, size: int) -> tuple[str, list[str]]:
    with path.open("rb") as file:
        head = file.read(size)
        whole = len(head) < size
    # Analysers on Windows write m/s² in cp1252, spreadsheets mark UTF-8 and UTF-16 at the start.
    encoding = next((codec for mark, codec in _MARKS.items() if head.startswith(mark)), "utf-8")
    if encoding != "utf-16" and b"\0" in head:
        raise LogError(f"{path}: holds bytes that are no text; is it a CSV file?")
    try:
        text = head.decode(encoding, errors="strict" if whole else "ignore")
        if not whole and encoding == "utf-8":
            # Cutting may have split a character, which is no reason to doubt the encoding.
            head[: head.rfind(b"\n") + 1].decode(encoding)
    except UnicodeDecodeError:
        encoding, text = "cp1252", head.decode("cp1252", errors="replace")
    lines = lines_of(text)
    return encoding, lines if whole or len(lines) == 1 else lines[:-1]


def _longest_run(lines: Sequence[str], delimiter: str) -> _Rows | None:
    """Give the longest run of lines with as many cells, of which one at least is a number or time in all."""
    best: list[list[str]] = []
    run: list[list[str]] = []
    at = start = 0
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        cells = split_cells(line, delimiter)
        if run and not _alike(run[-1], cells):
            run = []
        if (len(cells) > 1 or delimiter == LONE) and _alike(cells, cells):
            if not run:
                start = number
            run.append(cells)
            if len(run) > len(best):
                best, at = run, start
    # A lone row with text in it is a remark with a number in it.
    if not best or (len(best) == 1 and any(_kind(cell) == "text" for cell in best[0])):
        return None
    return _Rows(delimiter=delimiter, lines=best, first=at)


def _alike(above: list[str], below: list[str]) -> bool:
    return len(above) == len(below) and any(
        _kind(one) == _kind(other) and _kind(one) in ("number", "time")
        for one, other in zip(above, below, strict=True)
    )


def _first_row(lines: Sequence[str], rows: _Rows) -> int:
    """Give the table's first row: the first line like its rows, below a line of names where there's one."""
    pattern = [_kind(cell) for cell in rows.lines[0]]
    leading = next(column for column, kind in enumerate(pattern) if kind in ("number", "time"))
    alike: list[int] = []
    for number, line in enumerate(lines):
        cells = split_cells(line, rows.delimiter)
        kinds = [_kind(cell) for cell in cells]
        if len(cells) == len(pattern) and kinds[leading] == pattern[leading]:
            alike.append(number)
            if rows.first <= number:
                break
        elif (
            alike and "text" in kinds and not {"number", "time"} & set(kinds) and not _titled(lines[: alike[0]], rows)
        ):
            # What came before the names was a remark, however much it looks like a row.
            alike.clear()
    return alike[0]


def _rows_above(lines: Sequence[str], rows: _Rows) -> tuple[int, ...]:
    pattern = [_kind(cell) for cell in rows.lines[0]]
    return tuple(
        number
        for number, line in enumerate(lines, start=1)
        if len(pattern) > 1 and [_kind(cell) for cell in split_cells(line, rows.delimiter)] == pattern
    )


def _titled(lines: Sequence[str], rows: _Rows) -> bool:
    """Whether any of the lines names all columns."""
    return any(_names_all(_fitted(split_cells(line.lstrip("# "), rows.delimiter), rows), rows) for line in lines)


def _names_all(cells: Sequence[str], rows: _Rows) -> bool:
    return bool(cells) and all(
        empty or (cell and _kind(cell) == "text") for cell, empty in zip(cells, rows.blank, strict=True)
    )


def _titles(path: Path, lines: Sequence[str], rows: _Rows) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Find the names, the units where the line below holds them, and how many lines end with them."""
    columns = len(rows.lines[0])
    # np.savetxt puts # before the titles; some writers end only the rows, others only the titles, with a delimiter.
    # Spreadsheets write the delimiter itself into the first line.
    lines = ["" if line.startswith("sep=") else line for line in lines]
    titles = [
        []
        if rows.delimiter == LONE and '"' not in line and _BETWEEN_NAMES.search(line.strip())
        else _fitted(split_cells(line.lstrip("# "), rows.delimiter), rows)
        for line in lines
    ]
    found = [(cells, place) for place, cells in enumerate(titles, start=1) if any(cells)]
    if not found:
        if any(line.strip() and not line.startswith("#") for line in lines):
            raise LogError(
                f"{path}: line {len(lines) + 1} has {counted(columns, 'column')}, but none of the lines above it has "
                "as many names; give each column a name (in quotes where it holds a delimiter), or take the lines out"
            )
        return (), (), 0
    units: list[str] = []
    end = 0
    if len(found) > 1 and _are_units(found[-1][0]):
        units, end = found.pop()
    # Remarks above the titles may have as many cells; the titles are the nearest line that names all columns.
    full = [one for one in found if _names_all(one[0], rows)]
    header, place = (full or found)[-1]
    return tuple(header), tuple(units), max(place, end)


def _fitted(cells: list[str], rows: _Rows) -> list[str]:
    """Give as many cells as there are columns; none when they don't fit."""
    columns = len(rows.blank)
    while len(cells) > columns and not cells[-1]:
        cells = cells[:-1]
    return cells + [""] * (columns - len(cells)) if columns - rows.blank_ends <= len(cells) <= columns else []


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    known = [cell for cell in filled if _bracketed(cell) or spelled(cell) in UNIT_OF or is_unit(cell)]
    return 2 * len(known) > len(filled)


def _bracketed(cell: str) -> bool:
    return (cell[0], cell[-1]) in (("[", "]"), ("(", ")"))


def _decimal_commas(path: Path, rows: _Rows, decimal: str | None) -> tuple[bool, ...]:
    """Tell the decimal sign of each column; one that may group thousands as well is asked for."""
    columns = [[cell for cell in cells if is_number(cell)] for cells in zip(*rows.lines, strict=True)]
    if decimal is not None:
        return (decimal == ",",) * len(columns)
    with_comma = any("," in cell and not _GROUPED.match(cell) for cells in columns for cell in cells)
    commas = []
    for number, cells in enumerate(columns, start=1):
        signs = {sign for sign in ",." for cell in cells if sign in cell}
        doubtful = next((cell for cell in cells if _GROUPED.match(cell)), "")
        only_doubtful = all(_GROUPED.match(cell) for cell in cells if signs & set(cell))
        # In a file of decimal points 1,234 groups thousands, in one of decimal commas 1.234 may.
        if len(signs) == 2 or (
            only_doubtful and doubtful and ("," in doubtful) != with_comma and (with_comma or "," in signs)
        ):
            seen = doubtful or next(cell for cell in cells if "," in cell)
            say = "say that it is the decimal sign (--read decimal=,), or " if signs == {","} else ""
            raise LogError(
                f"{path}: column {number}: {seen!r} can be read with a decimal sign or one between thousands; {say}"
                "write numbers with one decimal sign and no other"
            )
        commas.append("," in signs or (with_comma and not signs))
    return tuple(commas)
