"""The cells of a CSV file as columns of numbers and text."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.files.csv_dialect import LONE, NUMBER, CsvDialect, is_number, split_cells
from chladni.io.files.time_text import is_time_text
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import LogError
from chladni.signals.wording import counted

if TYPE_CHECKING:
    import pyarrow as pa

# What loggers and spreadsheets write for a missing number.
_MISSING: Final = ("", "-", "--", "---", "?", "na", "n/a", "#n/a", "null", "none", "nan")
# Numbers whose thousands are set apart: 1,234.5 and 1.234,5 and 1 234.5, whatever stands beside them.
_THOUSANDS: Final = r"^[+-]?(\d{1,3}(,\d{3})+\.\d+|\d{1,3}(\.\d{3})+,\d+|\d{1,3}([ '’]\d{3})+[.,]\d+)$"
# Beside numbers also 1,234 and 1 234, and another decimal sign than theirs; elsewhere that may be an address.
_DOUBTFUL: Final = r"^[+-]?(\d+([.,]\d+)+|\d{1,3}([ '’]\d{3})+)$"
# A table of which more rows are short isn't the one that its head tells.
_MOST_SHORT: Final = 0.1


@dataclass(slots=True, kw_only=True)
class Cells:
    """A column as it is read.

    Attributes
    ----------
    numbers
        Parts of ``[row]`` numbers, NaN where a cell is blank or no number.
    text
        Parts of ``[row]`` cells; empty where only the numbers are kept.
    numeric
        Whether most cells of the head are numbers.
    keep_text
        Whether the text is kept besides: of times, whose digits count, and of what is no number.
    good, bad
        Cells that are numbers, and those that are neither numbers nor blank.
    first_bad
        Line and text of the first of the latter.
    """

    numbers: list[Real] = field(default_factory=list)
    text: list["pa.Array"] = field(default_factory=list)
    numeric: bool
    keep_text: bool
    good: int = 0
    bad: int = 0
    first_bad: tuple[int, str] = (0, "")

    @property
    def filled(self) -> bool:
        """Whether anything stands in the column."""
        return bool(self.good or self.bad)

    @property
    def is_text(self) -> bool:
        """Whether it is a column of text, with a number in it now and then at most."""
        return self.bad > self.good

    def whole_text(self) -> "pa.Array | None":
        """Give the cells of all rows, where they were kept."""
        import pyarrow as pa

        return pa.concat_arrays(self.text) if self.text else None


class CellReader:
    """Reads the rows of a file, stretch by stretch.

    Parameters
    ----------
    path
        The file, for messages.
    dialect
        How it is written.
    keep_text
        For each column, whether its text is kept beside the numbers.

    Attributes
    ----------
    columns
        What was read.
    rows
        How many rows that are.
    """

    def __init__(self, path: Path, dialect: CsvDialect, keep_text: Sequence[bool]) -> None:
        self.columns = [
            Cells(numeric=numeric, keep_text=keep) for numeric, keep in zip(dialect.numeric, keep_text, strict=True)
        ]
        self.rows = 0
        self._path = path
        self._dialect = dialect
        self._short: list[tuple[int, int]] = []
        self._remarks: list[int] = []

    def take(self, lines: list[str], first_line: int) -> None:
        """Read some lines; the number of the first is for messages.

        Raises
        ------
        LogError
            For a row that is too long, and for thousands that are set apart.
        """
        kept = [number for number, text in enumerate(lines) if not text.isspace()]
        texts, numbers = [lines[number] for number in kept], np.array(kept, dtype=np.int64) + first_line
        columns = self._split(texts) if kept else []
        if len(columns) != self._dialect.columns:
            # Arrow says of one line only that its length is another; these are few, and looked at one by one.
            rows = [self._mended(line, int(number)) for line, number in zip(texts, numbers, strict=True)]
            numbers = numbers[[row is not None for row in rows]]
            columns = _transposed([row for row in rows if row is not None])
        if columns:
            self._convert(columns, numbers)

    def _split(self, lines: list[str]) -> list["pa.Array"]:
        """Split into columns of text; nothing when lines are of different length."""
        import pyarrow as pa
        import pyarrow.compute as pc
        from pyarrow import csv as arrow_csv

        delimiter = {" ": "\t", LONE: "\x1f"}.get(self._dialect.delimiter, self._dialect.delimiter)
        if self._dialect.delimiter == " ":
            lines = ["\t".join(split_cells(line, " ")) + "\n" for line in lines]
        raw = "".join(lines).encode("utf-8", errors="replace")
        try:
            table = arrow_csv.read_csv(
                io.BytesIO(raw),
                read_options=arrow_csv.ReadOptions(autogenerate_column_names=True, block_size=len(raw) + 1),
                parse_options=arrow_csv.ParseOptions(delimiter=delimiter),
                convert_options=arrow_csv.ConvertOptions(
                    column_types={f"f{column}": pa.string() for column in range(self._dialect.columns)},
                    strings_can_be_null=False,
                ),
            )
        except pa.ArrowInvalid:
            return []
        # An open quotation swallows lines.
        if table.num_rows != len(lines) or table.num_columns != self._dialect.columns:
            return []
        return [pc.utf8_trim_whitespace(column.combine_chunks()) for column in table.columns]

    def _mended(self, line: str, number: int) -> list[str] | None:
        """Give the cells of a line that may be of another length; None for a remark between rows."""
        cells, columns = split_cells(line, self._dialect.delimiter), self._dialect.columns
        while len(cells) > columns and not cells[-1]:
            cells = cells[:-1]
        if columns - self._dialect.blank_ends <= len(cells) <= columns:
            return cells + [""] * (columns - len(cells))
        if not any(is_number(cell) or is_time_text(cell) for cell in cells):
            self._remarks.append(number)
            return None
        if len(cells) > columns:
            raise LogError(
                f"{self._path}: line {number} has {len(cells)} cells where the table has {columns} columns"
            )
        # Which of its cells are missing can't be told: the row counts, its numbers don't.
        self._short.append((number, len(cells)))
        return [""] * columns

    def _convert(self, columns: list["pa.Array"], lines: Whole) -> None:
        import pyarrow as pa

        found = [_numbers(cells, comma) for cells, comma in zip(columns, self._dialect.decimal_commas, strict=True)]
        # A head that is repeated between rows is no row; a number that is none beside good ones is.
        measured = [
            part for part, cells in zip(found, self.columns, strict=True) if not cells.keep_text or cells.good
        ]
        rows = np.ones(len(lines), dtype=np.bool_)
        if any(bad.any() for _, bad in measured):
            some_good = np.any([np.isfinite(numbers) for numbers, _ in found], axis=0)
            rows = some_good | ~np.any([bad for _, bad in measured], axis=0)
            self._remarks.extend(lines[~rows].tolist())
        self.rows += int(rows.sum())
        for cells, text, (numbers, bad) in zip(self.columns, columns, found, strict=True):
            self._note_bad(cells, text, lines, bad & rows)
            cells.good += int(np.isfinite(numbers[rows]).sum())
            cells.numbers.append(numbers[rows])
            if cells.keep_text:
                cells.text.append(text.filter(pa.array(rows)))

    def _note_bad(self, cells: Cells, text: "pa.Array", lines: Whole, bad: Mask) -> None:
        import pyarrow.compute as pc

        wrong = np.flatnonzero(bad)
        if not wrong.size:
            return
        if not cells.bad:
            cells.first_bad = (int(lines[wrong[0]]), text[int(wrong[0])].as_py())
        cells.bad += wrong.size
        pattern = f"{_THOUSANDS}|{_DOUBTFUL}" if cells.numeric else _THOUSANDS
        grouped = np.flatnonzero(np.asarray(pc.match_substring_regex(text.take(wrong), pattern)))
        if grouped.size:
            place = int(wrong[grouped[0]])
            raise LogError(
                f"{self._path}: line {lines[place]}: {text[place].as_py()[:40]!r} has a sign between thousands, "
                "or another decimal sign than the rest; write numbers with one decimal sign and no other"
            )

    def notes(self) -> list[str]:
        """Give sentences on the lines that were left out; `LogError` when too many rows are short."""
        notes = []
        if len(self._short) > _MOST_SHORT * self.rows:
            line, count = self._short[0]
            raise LogError(
                f"{self._path}: line {line} has {count} cells where the table has {self._dialect.columns} columns"
            )
        if self._short:
            short = counted(len(self._short), "row")
            notes.append(f"{self._path}: {short} cut short, the first in line {self._short[0][0]}, left as a gap.")
        if self._remarks:
            remarks = counted(len(self._remarks), "line")
            notes.append(f"{self._path}: {remarks} without numbers left out, the first is line {min(self._remarks)}.")
        return notes


def _transposed(rows: list[list[str]]) -> list["pa.Array"]:
    import pyarrow as pa

    return [pa.array(cells, pa.string()) for cells in zip(*rows, strict=True)]


def _numbers(cells: "pa.Array", decimal_comma: bool) -> tuple[Real, Mask]:
    """Give the numbers of a column, NaN where there's none, and where a cell is neither blank nor a number."""
    import pyarrow as pa
    import pyarrow.compute as pc

    plain, foreign = cells, "," if not decimal_comma else "."
    if decimal_comma:
        # A point beside decimal commas would become a decimal sign too.
        plain = pc.if_else(pc.match_substring(cells, foreign), "point", pc.replace_substring(cells, ",", "."))
    try:
        numbers = pc.cast(pc.if_else(pc.equal(plain, ""), None, plain), pa.float64())
        return np.asarray(numbers.to_numpy(zero_copy_only=False)), np.zeros(len(cells), dtype=np.bool_)
    except pa.ArrowInvalid:
        pass
    good = pc.and_(pc.match_substring_regex(plain, NUMBER), pc.invert(pc.match_substring(plain, ",")))
    numbers = pc.cast(pc.if_else(good, pc.replace_substring_regex(plain, "[dD]", "e"), None), pa.float64())
    missing = pc.is_in(pc.utf8_lower(cells), value_set=pa.array(_MISSING))
    return np.asarray(numbers.to_numpy(zero_copy_only=False)), np.asarray(pc.invert(pc.or_(good, missing)))
