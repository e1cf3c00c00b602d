"""Datasets of a universal file: where they lie, their lines, and the fixed columns in them."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path

from chladni.io.files.bounds import read_whole
from chladni.io.files.uff_values import fortran_number, layout_of
from chladni.io.regular_file import require_regular
from chladni.signals.errors import LogError
from chladni.signals.text_reading import whole_number

_DELIMITER = re.compile(rb"^ {4}-1[ \t]*\r?$", re.MULTILINE)
# Binary values may end anywhere, and the delimiter follows without a line break, or behind one.
_AFTER_BINARY = re.compile(rb"(?:\r?\n)? {4}-1[ \t]*(?=\r?\n|\r?\Z)")
_LAST_OR_NEXT = re.compile(rb"(?:\r?\n)? {4}-1[ \t]*(?=[\s\0\x1a]*\Z|\r?\n *-1[ \t]*\r?\n)")
_HEADER_LINES = 11
_DATA_FORM_LINE = 6
_SIZE_COLUMN = 31
_SIZE_WIDTH = 12
_INTEGER_WIDTH = 10
_REAL_WIDTH = 13
_ID_LENGTH = 80
# Labels of nodes have ten columns.
_LARGEST_INTEGER = 10**10
_SMALLEST = 1e-100


@dataclass(frozen=True, slots=True, kw_only=True)
class TextBlock:
    """The lines of one dataset between its type and the closing -1.

    Attributes
    ----------
    where
        File name, for messages.
    kind
        Number of the dataset.
    number
        Its place among the datasets of the file, from 0.
    first_line
        Number of the first line in the file, from 1; 0 when binary values stand before it.
    lines
        Without line breaks.
    """

    where: str
    kind: int
    number: int = 0
    first_line: int
    lines: tuple[str, ...]

    def line(self, index: int) -> str:
        """One line; `LogError` when the dataset ends before it."""
        if not 0 <= index < len(self.lines):
            raise self.mistake(len(self.lines), "ends before all that it announces; was the file cut off?")
        return self.lines[index]

    def integers(self, index: int, count: int) -> list[int]:
        """Read `count` integers of a line in columns of ten; `LogError` when they aren't there."""
        texts = _fields(self.line(index), _INTEGER_WIDTH, count)
        try:
            numbers = [whole_number(text) for text in texts]
        except ValueError:
            numbers = []
        if len(numbers) != count or any(abs(number) >= _LARGEST_INTEGER for number in numbers):
            raise self.mistake(index, f"found {self.line(index)[:60]!r} where {count} integers are due")
        return numbers

    def reals(self, index: int, count: int, *, width: int = _REAL_WIDTH) -> list[float]:
        """Read `count` numbers of a line, up to 1e100 (below 1e-100: zero); `LogError` when they aren't there."""
        texts = _fields(self.line(index), width, count)
        try:
            numbers = [_believable(fortran_number(text)) for text in texts]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(isfinite, numbers)):
            raise self.mistake(index, f"found {self.line(index)[:90]!r} where {count} numbers up to 1e100 are due")
        return numbers

    def mistake(self, index: int, what: str) -> LogError:
        """Make the error that names file, line and dataset."""
        place = f"line {self.first_line + index}" if self.first_line else f"line {index + 1} of its body"
        return LogError(f"{self.where}: {place}: dataset {self.kind} {what}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Offsets of one dataset in a file.

    Attributes
    ----------
    kind
        Number of the dataset; 0 when the line behind the opening -1 holds none.
    binary
        Whether values follow its header in binary.
    kind_line, body, end
        Where its number and what follows begin, and where it's closed.
    """

    kind: int
    binary: bool
    kind_line: int
    body: int
    end: int


@dataclass(frozen=True, slots=True, kw_only=True)
class UniversalFile:
    """A universal file in memory, and where its datasets lie."""

    path: Path
    content: bytes
    spans: tuple[Span, ...]

    def header(self, number: int) -> list[str]:
        """Text of the first lines of a dataset: that with its number, and the eleven of a function's header."""
        span = self.spans[number]
        end = behind_header(self.content, span.body)
        return _lines(self.content[span.kind_line : min(end, span.end)])

    def values(self, number: int) -> bytes:
        """What follows the header of a function."""
        span = self.spans[number]
        return self.content[behind_header(self.content, span.body) : span.end]


def open_uff(path: Path) -> UniversalFile:
    """Read a universal file and find its datasets.

    Binary values are stepped over by the size that their header announces, so that a delimiter among them is none.
    What isn't closed by a -1 is left out; `cut_off_note` says so.

    Raises
    ------
    LogError
        When there is no file, or no dataset in it.
    """
    require_regular(path, LogError)
    content = read_whole(path)
    spans = tuple(_spans(content))
    if not spans:
        raise LogError(
            f"{path}: holds no whole dataset between lines of -1; is it a universal file, or was it cut off?"
        )
    return UniversalFile(path=path, content=content, spans=spans)


def text_blocks(file: UniversalFile, kinds: Iterable[int]) -> tuple[TextBlock, ...]:
    """Give the text datasets of the given numbers."""
    wanted = frozenset(kinds)
    blocks = []
    line, counted_to, binary_seen = 1, 0, False
    for number, span in enumerate(file.spans):
        binary_seen = binary_seen or span.binary
        if span.kind not in wanted or span.binary:
            continue
        line += file.content.count(b"\n", counted_to, span.body)
        counted_to = span.body
        lines = _lines(file.content[span.body : span.end])
        blocks.append(
            TextBlock(
                where=str(file.path),
                kind=span.kind,
                number=number,
                first_line=0 if binary_seen else line,
                lines=tuple(lines),
            )
        )
    return tuple(blocks)


def _lines(text: bytes) -> list[str]:
    """Lines of text: UTF-8 where it is that, else Latin-1, in which exporters on Windows write m/s²."""
    try:
        whole = text.decode("utf-8")
    except UnicodeDecodeError:
        whole = text.decode("latin-1")
    # Not splitlines, for which some Latin-1 characters end a line.
    return [line.removesuffix("\r") for line in whole.removesuffix("\n").split("\n")]


def state_binary_sizes(path: Path) -> None:
    """Correct the size of the values in the headers of binary functions.

    Pyuff states half of it for complex values, which readers that go by the size would cut short.
    """
    file = open_uff(path)
    with path.open("r+b") as written:
        for number, span in enumerate(file.spans):
            if span.binary:
                written.seek(span.kind_line + _SIZE_COLUMN)
                written.write(b"%12d" % len(file.values(number)))


def integer_line(*numbers: int) -> str:
    """Write integers in columns of ten."""
    return "".join(f"{number:10d}" for number in numbers)


def real_lines(numbers: Sequence[float]) -> list[str]:
    """Write numbers with six digits in columns of thirteen, six a line."""
    texts = [f"{_believable(number):13.5e}" for number in numbers]
    return ["".join(texts[start : start + 6]) for start in range(0, len(texts), 6)]


def id_line(text: str) -> str:
    """Write an identification line: 80 ASCII characters, ``NONE`` when there's nothing to say.

    The line is filled with blanks, so that none ends like the delimiter of a dataset.
    """
    plain = re.sub(r"[^ -~]", "?", text)[:_ID_LENGTH]
    return f"{plain.strip() or 'NONE':<80}"


def block_text(kind: int, lines: Iterable[str]) -> str:
    """Write a dataset between its delimiters."""
    return "\n".join([f"{-1:6d}", f"{kind:6d}{'':74}", *lines, f"{-1:6d}", ""])


def _believable(number: float) -> float:
    """Give zero for what is far below any motion, and infinity for what is far above: squares must not overflow."""
    if abs(number) < _SMALLEST:
        return 0.0
    return number if abs(number) <= 1 / _SMALLEST else inf


def _fields(line: str, width: int, count: int) -> list[str]:
    # Exporters that don't keep to the columns separate by blanks; those that do may leave none between two fields.
    words = line.split()
    return words if len(words) == count else [line[width * n : width * (n + 1)] for n in range(count)]


def _next_line(content: bytes, position: int) -> int:
    found = content.find(b"\n", position)
    return len(content) if found < 0 else found + 1


def _integer(field: bytes) -> int:
    try:
        return whole_number(field.decode("latin-1"))
    except ValueError:
        return 0


def behind_header(content: bytes, body: int) -> int:
    """Where the values of a function begin, behind the eleven lines of its header."""
    for _ in range(_HEADER_LINES):
        body = _next_line(content, body)
    return body


def _spans(content: bytes) -> Iterator[Span]:
    position = 0
    while (opening := _DELIMITER.search(content, position)) is not None:
        start = _next_line(content, opening.end())
        body = _next_line(content, start)
        line = content[start:body]
        binary = line[6:7].lower() == b"b"
        closing = _behind_binary(content, line, body) if binary else _DELIMITER.search(content, body)
        if closing is None:
            return
        yield Span(kind=_integer(line[:6]), binary=binary, kind_line=start, body=body, end=closing.start())
        position = closing.end()


def _behind_binary(content: bytes, kind_line: bytes, body: int) -> re.Match[bytes] | None:
    """The delimiter behind binary values: where a size that the header announces ends at one.

    Some exporters state another size than they write, and a text-mode transfer changes it: then it's the first
    delimiter that the next dataset follows, or nothing.
    """
    values = behind_header(content, body)
    stated = _integer(kind_line[_SIZE_COLUMN : _SIZE_COLUMN + _SIZE_WIDTH])
    for size in (stated, *_announced(content, body)):
        closing = _AFTER_BINARY.match(content, values + size) if 0 < size <= len(content) - values else None
        if closing is not None:
            return closing
    return _LAST_OR_NEXT.search(content, values)


def _announced(content: bytes, body: int) -> tuple[int, ...]:
    """Bytes that the values may take by their type and count; none when the header can't be read."""
    for _ in range(_DATA_FORM_LINE):
        body = _next_line(content, body)
    kind, count, even = (_integer(content[body + 10 * n : body + 10 * (n + 1)]) for n in range(3))
    layout = layout_of(kind, count, even=even != 0)
    return () if layout is None else layout.binary_sizes()
