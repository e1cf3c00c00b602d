"""How a CSV file is written: its encoding, delimiter, decimal sign and header lines."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from chladni.signals.errors import LogError

_HEAD_BYTES = 65536
_NUMBER = re.compile(r"^[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?$|^[+-]?(nan|inf|infinity)$", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"^[+-]?\d*,\d+([eE][+-]?\d+)?$")
# Delimiter, fewest cells, and whether the next lines must have as many. A lone column comes last: "1,5" is two cells
# before it's one with a decimal comma.
_CANDIDATES = [
    *((delimiter, 2, agreeing) for agreeing in (True, False) for delimiter in (";", "\t", ",", " ")),
    (",", 1, True),
]
_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvDialect:
    """How a CSV file is written.

    Attributes
    ----------
    encoding
        Name of a Python codec.
    delimiter
        Character between cells; a blank means any run of blanks.
    decimal_comma
        Whether numbers are written ``1,5``.
    header
        Cells of the line of names; empty when the file has none.
    units
        Cells of a line of units under the names; empty when the file has none.
    first_data_line
        Lines before the first line of numbers.
    columns
        Number of cells in a line of numbers.
    """

    encoding: str
    delimiter: str
    decimal_comma: bool
    header: tuple[str, ...]
    units: tuple[str, ...]
    first_data_line: int
    columns: int

    def number(self, cell: str) -> float:
        """Read a cell; an empty one is NaN. Raises `ValueError` when it's no number."""
        if not cell:
            return float("nan")
        return float(cell.replace(",", ".") if self.decimal_comma else cell)


def sniff_csv(path: Path) -> CsvDialect:
    """Find out how a file is written from its first 64 KiB.

    Raises
    ------
    LogError
        When there is no line of numbers, or the names don't fit the columns.
    """
    encoding, lines = _head(path)
    numbered = [(number, line) for number, line in enumerate(lines) if line.strip()]
    for delimiter, least, agreeing in _CANDIDATES:
        place = _first_numbers(numbered, delimiter, least, 2 if agreeing else 0)
        if place is not None:
            return _dialect(path, encoding, lines, place, delimiter)
    raise LogError(f"{path}: no line of numbers within the first {len(lines)} lines; is it a CSV file?")


def split_cells(line: str, delimiter: str) -> list[str]:
    """Split a line at a delimiter, with quotes respected; a blank stands for any run of blanks."""
    if delimiter == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.rstrip("\r\n").split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter))]


def _head(path: Path) -> tuple[str, list[str]]:
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        whole = len(head) < _HEAD_BYTES
    # Analysers on Windows write m/s² in cp1252, spreadsheets mark UTF-8 and UTF-16 at the start.
    encoding = next((codec for mark, codec in _MARKS.items() if head.startswith(mark)), "utf-8")
    try:
        text = head.decode(encoding, errors="strict" if whole else "ignore")
        if not whole and encoding == "utf-8":
            # Cutting may have split a character, which is no reason to doubt the encoding.
            head[: head.rfind(b"\n") + 1].decode(encoding)
    except UnicodeDecodeError:
        encoding, text = "cp1252", head.decode("cp1252", errors="replace")
    lines = text.splitlines()
    return encoding, lines if whole or len(lines) == 1 else lines[:-1]


def _first_numbers(numbered: list[tuple[int, str]], delimiter: str, least: int, agreeing: int) -> int | None:
    """Give the first line that splits into at least so many numbers, as many as the lines after it have cells."""
    for index, (number, line) in enumerate(numbered):
        cells = split_cells(line, delimiter)
        if len(cells) < least or not _numeric(cells):
            continue
        following = numbered[index + 1 : index + 1 + agreeing]
        if all(len(split_cells(text, delimiter)) == len(cells) for _, text in following):
            return number
    return None


def _numeric(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return bool(filled) and all(_NUMBER.match(cell) for cell in filled)


def _dialect(path: Path, encoding: str, lines: list[str], place: int, delimiter: str) -> CsvDialect:
    columns = len(split_cells(lines[place], delimiter))
    # Remarks above the titles have another number of cells; np.savetxt puts # before the titles themselves.
    titles = [
        cells
        for line in lines[:place]
        if len(cells := split_cells(line.lstrip("# "), delimiter)) == columns and any(cells)
    ]
    if not titles and any(line.strip() and not line.startswith("#") for line in lines[:place]):
        raise LogError(
            f"{path}: line {place + 1} has {columns} columns, but none of the lines above it has as many names; "
            "give each column a name, or take the lines out"
        )
    # A comma is a decimal sign only where it can't be a delimiter, and a number shows it.
    samples = [cell for line in lines[place : place + 50] for cell in split_cells(line, delimiter)]
    return CsvDialect(
        encoding=encoding,
        delimiter=delimiter,
        decimal_comma=delimiter != "," and any(_DECIMAL_COMMA.match(cell) for cell in samples),
        header=tuple(titles[0]) if titles else (),
        units=tuple(titles[1]) if len(titles) > 1 else (),
        first_data_line=place,
        columns=columns,
    )
