"""Text datasets of a universal file: their lines, and the fixed columns in them."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path

from chladni.signals.errors import LogError

_DELIMITER = re.compile(rb"^ {4}-1[ \t]*\r?$", re.MULTILINE)
# Binary values may end anywhere, and the delimiter follows without a line break.
_AFTER_BINARY = re.compile(rb" {4}-1[ \t]*(?=\r?\n|\r?\Z)")
_BINARY_HEADER_LINES = 11
# Bytes of a number and numbers of a value, by ordinate type.
_BINARY_VALUES = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}
_SIZE_COLUMN = 31
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
    first_line
        Number of the first line in the file, from 1; 0 when binary values stand before it.
    lines
        Without line breaks.
    """

    where: str
    kind: int
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
            numbers = [int(text) for text in texts]
        except ValueError:
            numbers = []
        if len(numbers) != count or any(abs(number) >= _LARGEST_INTEGER for number in numbers):
            raise self.mistake(index, f"found {self.line(index)[:60]!r} where {count} integers are due")
        return numbers

    def reals(self, index: int, count: int, *, width: int = _REAL_WIDTH) -> list[float]:
        """Read `count` numbers of a line, up to 1e100 (below 1e-100: zero); `LogError` when they aren't there."""
        texts = _fields(self.line(index), width, count)
        try:
            numbers = [_believable(float(text.replace("D", "E").replace("d", "e"))) for text in texts]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(isfinite, numbers)):
            raise self.mistake(index, f"found {self.line(index)[:90]!r} where {count} numbers up to 1e100 are due")
        return numbers

    def mistake(self, index: int, what: str) -> LogError:
        """Make the error that names file, line and dataset."""
        place = f"line {self.first_line + index}" if self.first_line else f"line {index + 1} of its body"
        return LogError(f"{self.where}: {place}: dataset {self.kind} {what}")


def text_blocks(path: Path, kinds: Iterable[int]) -> tuple[TextBlock, ...]:
    """Find the text datasets of the given numbers.

    Binary values are stepped over by their announced size. What isn't closed by a -1 is left out; `cut_off_note`
    says so.
    """
    wanted = frozenset(kinds)
    content = path.read_bytes()
    blocks = []
    line, counted_to, binary_seen = 1, 0, False
    for span in _spans(content):
        binary_seen = binary_seen or span.binary
        if span.kind not in wanted or span.binary:
            continue
        line += content.count(b"\n", counted_to, span.body)
        counted_to = span.body
        lines = content[span.body : span.end].decode("ascii", "replace").splitlines()
        blocks.append(
            TextBlock(where=str(path), kind=span.kind, first_line=0 if binary_seen else line, lines=tuple(lines))
        )
    return tuple(blocks)


def state_binary_sizes(path: Path) -> None:
    """Correct the size of the values in the headers of binary functions.

    Pyuff states half of it for complex values, which readers that go by the size would cut short.
    """
    content = path.read_bytes()
    with path.open("r+b") as file:
        for span in _spans(content):
            if span.binary:
                file.seek(span.kind_line + _SIZE_COLUMN)
                file.write(b"%12d" % (span.values_end - span.values))


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


def _kind(line: bytes) -> int:
    try:
        return int(line[:6])
    except ValueError:
        return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Span:
    """Offsets of one dataset in a file; those of its values are the body's when it's text."""

    kind: int
    binary: bool
    kind_line: int
    body: int
    values: int
    values_end: int
    end: int


def _spans(content: bytes) -> Iterator[_Span]:
    position = 0
    while (opening := _DELIMITER.search(content, position)) is not None:
        start = _next_line(content, opening.end())
        body = _next_line(content, start)
        line = content[start:body]
        binary = line[6:7].lower() == b"b"
        values, values_end = _binary_values(content, body) if binary else (body, body)
        closing = (_AFTER_BINARY if binary else _DELIMITER).search(content, values_end)
        if closing is None:
            return
        yield _Span(
            kind=_kind(line),
            binary=binary,
            kind_line=start,
            body=body,
            values=values,
            values_end=values_end,
            end=closing.start(),
        )
        position = closing.end()


def _binary_values(content: bytes, body: int) -> tuple[int, int]:
    """Where the values of a binary function begin and end, by what its header announces.

    Both are the body when that can't be read, or the file ends before.
    """
    position, header = body, []
    for _ in range(_BINARY_HEADER_LINES):
        following = _next_line(content, position)
        header.append(content[position:following])
        position = following
    try:
        kind, count, even = (int(header[6][10 * n : 10 * (n + 1)]) for n in range(3))
    except ValueError:
        return body, body
    bytes_each, parts = _BINARY_VALUES.get(kind, (0, 0))
    end = position + bytes_each * (parts + (0 if even else 1)) * max(count, 0)
    return (position, end) if end <= len(content) else (body, body)
