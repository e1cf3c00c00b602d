"""TOML files of users, read against a pydantic model: all mistakes at once, each with its line."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Final, TypeVar

from chladni.signals.wording import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from pydantic import BaseModel

    from chladni.signals.errors import ChladniError

    Loc = tuple[str | int, ...]

ModelT = TypeVar("ModelT", bound="BaseModel")

MAX_BYTES: Final = 1 << 20
"""Largest file that is read; a setup of a thousand sensors takes a tenth."""

MAX_MISTAKES: Final = 50
"""Mistakes that are told; one wrong habit can repeat in every table."""

# Lines inside of one table's values that begin like a header, before its lines are looked for the long way.
_MOST_FALSE_HEADERS = 20

_LINE_IN_MESSAGE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")
_RULES: dict[str, str] = {
    "string_type": "must be text in quotes",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "list_type": "must be a list in brackets",
    "tuple_type": "must be a list in brackets",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "finite_number": "must be finite, not inf or nan",
}


class TomlMistakes:
    """Collects mistakes found in one file, and turns them into one error."""

    def __init__(self, document: TomlDocument) -> None:
        self._document = document
        self._told: list[tuple[int, str]] = []

    def add(self, loc: Loc, text: str) -> None:
        """Note a mistake at a place such as ``("channel", 2, "unit")``."""
        line = self._document.line_of(loc)
        self._told.append((line, f"{self._document.name}:{line}: {_place(loc)}{text}"))

    def __bool__(self) -> bool:
        return bool(self._told)

    def error(self, kind: type[ChladniError]) -> ChladniError:
        """Give one error with a line for each mistake, in the order of the file."""
        lines = list(dict.fromkeys(text for _, text in sorted(self._told)))
        more = len(lines) - MAX_MISTAKES
        told = [f"... and {counted(more, 'more mistake')}"] if more > 0 else []
        return kind(*lines[:MAX_MISTAKES], *told)


class TomlDocument:
    """A parsed TOML file that knows in which line each of its values stands.

    Parameters
    ----------
    text
        The file's content.
    name
        What messages call the file.

    Raises
    ------
    ChladniError
        Of the kind given, when the text is no TOML; the message names the line.
    """

    def __init__(self, text: str, *, name: str, kind: type[ChladniError]) -> None:
        self.name = name
        self._lines = text.replace("\r\n", "\n").split("\n")
        self._kind = kind
        self._tables: dict[Loc, tuple[int, int]] | None = None
        try:
            self.content: dict[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise kind(_syntax_message(str(error), name, self._lines)) from None
        except RecursionError:
            raise kind(f"{name}:1: tables or lists are nested too deeply for a file of this kind") from None

    def place(self, loc: Loc) -> str:
        """``file:line`` of a value or table."""
        return f"{self.name}:{self.line_of(loc)}"

    def line_of(self, loc: Loc) -> int:
        """Line, from 1, in which the value at `loc` starts; for a missing value the line of its table."""
        while loc and not _holds(self.content, loc):
            loc = loc[:-1]
        if not loc:
            return 1
        if self._tables is None:
            self._tables = _table_lines(self._lines, self.content)
        span = self._tables.get(loc[:2])
        if span is None:
            return self._bisected(loc)
        # A file may have thousands of mistakes: each is looked for in the few lines of its own table.
        table = TomlDocument("\n".join(self._lines[span[0] : span[1]]), name=self.name, kind=self._kind)
        return span[0] + table._bisected((loc[0], 0, *loc[2:]))

    def _bisected(self, loc: Loc) -> int:
        """Line of a value that is there.

        The prefixes of a file that end at a whole line are TOML themselves (unless the cut is inside a value), and
        a value stands in the first prefix that has it.
        """
        low, high = 0, len(self._lines)
        while high - low > 1:
            middle = (low + high) // 2
            cut, content = self._prefix(middle, low)
            if cut > low and _holds(content, loc):
                high = cut
            else:
                # Nothing between `cut` and `middle` parses: a value goes over several lines.
                low = middle
        return self._first_line(loc, high)

    def _prefix(self, lines: int, at_least: int) -> tuple[int, dict[str, Any]]:
        """Longest prefix of at most `lines` and more than `at_least` lines that parses."""
        while lines > at_least:
            try:
                return lines, tomllib.loads("\n".join(self._lines[:lines]))
            except tomllib.TOMLDecodeError:
                lines -= 1
        return at_least, {}

    def _first_line(self, loc: Loc, last: int) -> int:
        """A value that ends in line `last` starts behind the longest shorter prefix that parses."""
        start, _ = self._prefix(last - 1, 0)
        key = str(next(part for part in reversed(loc) if isinstance(part, str)))
        for line in range(start + 1, last + 1):
            text = self._lines[line - 1].strip()
            if key in text and not text.startswith("#"):
                return line
        return last


def read_toml(
    path: Path,
    model: type[ModelT],
    *,
    kind: type[ChladniError],
    check: Callable[[dict[str, Any], TomlMistakes], None] | None = None,
) -> tuple[ModelT, TomlDocument]:
    """Read a TOML file against a model.

    Parameters
    ----------
    path
        The file, at most `MAX_BYTES` long.
    model
        Pydantic model; give it ``extra="forbid"`` and ``allow_inf_nan=False``.
    kind
        Error to raise.
    check
        Adds mistakes that no single table shows, such as a name that nothing defines. It's called with the raw
        content, also when that doesn't fit the model, so that all mistakes are told at once.

    Returns
    -------
    content
        Validated.
    document
        Knows the line of each value.

    Raises
    ------
    ChladniError
        Of the kind given, one line for each mistake: ``file:line: table key: found, rule``.
    """
    document = TomlDocument(_text(path, kind), name=str(path), kind=kind)
    mistakes = TomlMistakes(document)
    content = _validated(document.content, model, mistakes)
    if content is None and not document.content:
        # Rather than a list of all that it should hold.
        raise kind(f"{path}: is empty, or holds comments alone; write the file, or name another")
    if check is not None:
        check(document.content, mistakes)
    if content is None or mistakes:
        raise mistakes.error(kind)
    return content, document


def tables(content: dict[str, Any], name: str) -> list[tuple[int, dict[str, Any]]]:
    """Give the tables ``[[name]]`` of raw content with their index, leaving out what isn't a table."""
    listed = content.get(name)
    return (
        [(i, table) for i, table in enumerate(listed) if isinstance(table, dict)] if isinstance(listed, list) else []
    )


def _validated(content: dict[str, Any], model: type[ModelT], mistakes: TomlMistakes) -> ModelT | None:
    """Validate content against a model; None when `mistakes` were added."""
    from pydantic import ValidationError

    try:
        return model.model_validate(content)
    except ValidationError as error:
        for one in error.errors(include_url=False):
            loc = tuple(part for part in one["loc"] if isinstance(part, int) or not part.startswith("function-"))
            mistakes.add(loc, _mistake(one["type"], one["msg"], one["input"], loc, model))
        return None


def _text(path: Path, kind: type[ChladniError]) -> str:
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise kind(f"{path}: can't be read: {error.strerror or error}") from None
    if len(raw) > MAX_BYTES:
        raise kind(f"{path}: is larger than {MAX_BYTES} bytes, the most that a file of this kind may have")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise kind(f"{path}:{line}: byte {raw[error.start]:#04x} isn't UTF-8; save the file as UTF-8") from None


def _syntax_message(message: str, name: str, lines: list[str]) -> str:
    found = _LINE_IN_MESSAGE.search(message)
    line = int(found[1]) if found and found[1] else len(lines)
    what = _LINE_IN_MESSAGE.sub("", message)
    # Python says what it expected, not what it met: the line itself names the key.
    met = lines[line - 1].strip()
    return f"{name}:{line}: not TOML: {what[:1].lower()}{what[1:]}{f', in {_shown(met)}' if met else ''}"


def _mistake(kind: str, message: str, found: object, loc: Loc, model: type[BaseModel]) -> str:
    if kind == "missing":
        return "is missing, and is needed"
    if kind == "extra_forbidden":
        known = _known_keys(model, loc[:-1])
        near = get_close_matches(str(loc[-1]), known, n=1)
        advice = f"did you mean {near[0]}?" if near else f"known keys: {', '.join(known)}"
        return f"unknown key; {advice}"
    if kind == "value_error" and isinstance(found, dict):
        return message.removeprefix("Value error, ")
    rule = _RULES.get(kind, message.removeprefix("Value error, ").replace("Input should", "must", 1))
    return f"found {_shown(found)}; {rule}"


def _shown(found: object) -> str:
    text = repr(found)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _known_keys(model: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """Keys that the table at `loc` may have."""
    current: Any = model
    for part in loc:
        if isinstance(part, str):
            field = current.model_fields.get(part)
            current = None if field is None else _model_in(field.annotation)
        if current is None:
            return []
    return [field.alias or name for name, field in current.model_fields.items()]


def _model_in(annotation: Any) -> Any:
    """Model inside an annotation such as ``list[Point]``, or None."""
    if hasattr(annotation, "model_fields"):
        return annotation
    inner: Iterable[Any] = getattr(annotation, "__args__", ())
    return next((model for model in map(_model_in, inner) if model is not None), None)


def _table_lines(lines: list[str], content: dict[str, Any]) -> dict[Loc, tuple[int, int]]:
    """Lines ``[first, last)`` of the tables ``[[name]]``, by name and index.

    Lines that look like a header may stand inside of text or of a list over several lines, and a table may go on
    under ``[name.key]``. So only names are taken whose tables, each read by itself, are those of the whole file.
    """
    headers = [line for line, text in enumerate(lines) if text.lstrip().startswith("[")]
    spans: dict[Loc, tuple[int, int]] = {}
    counts: dict[str, int] = {}
    place = 0
    while place < len(headers):
        start, place, read = headers[place], *_one_table(lines, headers, place)
        for name, table in read.items():
            index = counts.get(name, 0)
            counts[name] = index + 1
            listed = content.get(name)
            # By their text, because nan is not equal to itself.
            if isinstance(listed, list) and repr([table]) == repr(listed[index : index + 1]):
                spans[name, index] = (start, headers[place] if place < len(headers) else len(lines))
    return {loc: span for loc, span in spans.items() if counts[str(loc[0])] == len(content[str(loc[0])])}


def _one_table(lines: list[str], headers: list[int], place: int) -> tuple[int, dict[str, Any]]:
    """Read the table ``[[name]]`` below a header; give the place of the next header, and the table by its name."""
    for following in range(place + 1, min(place + 1 + _MOST_FALSE_HEADERS, len(headers)) + 1):
        last = headers[following] if following < len(headers) else len(lines)
        try:
            read = tomllib.loads("\n".join(lines[headers[place] : last]))
        except tomllib.TOMLDecodeError:
            # What looked like the next header stands inside of a value.
            continue
        return following, {name: listed[0] for name, listed in read.items() if isinstance(listed, list)}
    return place + 1, {}


def _holds(content: Any, loc: Loc) -> bool:
    for part in loc:
        match content, part:
            case dict(), str() if part in content:
                content = content[part]
            case list(), int() if part < len(content):
                content = content[part]
            case _:
                return False
    return True


def _place(loc: Loc) -> str:
    """``("channel", 2, "unit")`` as people count: ``[[channel]] 3 unit: ``."""
    if not loc:
        return ""
    parts = []
    for part, following in zip(loc, (*loc[1:], None), strict=True):
        if isinstance(part, int):
            parts.append(str(part + 1))
        else:
            parts.append(f"[[{part}]]" if isinstance(following, int) and len(parts) == 0 else part)
    return f"{' '.join(parts)}: "
