"""TOML files of users, read against a pydantic model: all mistakes at once, each with its line."""

from __future__ import annotations

import re
import sys
import tomllib
from typing import TYPE_CHECKING, Any, Final

from chladni.io.regular_file import read_text
from chladni.io.toml_lines import Place, places_of
from chladni.io.validation import ModelT, place_words, validated
from chladni.signals.wording import counted, shown

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from chladni.io.validation import Loc
    from chladni.signals.errors import ChladniError

MAX_BYTES: Final = 1 << 20
"""Largest file that is read; a setup of a thousand sensors takes a tenth."""

MAX_MISTAKES: Final = 50
"""Mistakes that are told; one wrong habit can repeat in every table."""

# Deep enough for any setup or model; messages and checks go as deep as what they are about.
_MAX_DEPTH: Final = 32
_TOO_DEEP: Final = "nested too deeply for a file of this kind"
_NO_INTEGER: Final = (
    "a whole number has 64 bits, and must be finite, and within double precision; write one with a decimal point"
)

_LINE_IN_MESSAGE = re.compile(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$")


class _EnoughMistakes(Exception):  # noqa: N818  # no error: the search for mistakes ends
    """As many mistakes as are told have been found."""


class TomlMistakes:
    """Collects mistakes found in one file, and turns them into one error.

    What they cost is bounded: the search ends with the first mistake beyond those that are told.
    """

    def __init__(self, document: TomlDocument) -> None:
        self._document = document
        self._told: list[tuple[int, Callable[[], str]]] = []
        self._ended = False
        self._refused = 0

    def add(self, loc: Loc, text: str) -> None:
        """Note a mistake at a place such as ``("channel", 2, "unit")``."""
        self.require_search()
        self.add_later(loc, lambda: text)

    def add_later(self, loc: Loc, text: Callable[[], str]) -> None:
        """Note a mistake whose text is made only when it's told."""
        line = self._document.line_of(loc)
        self._told.append((line, lambda: f"{self._document.name}:{line}: {place_words(loc)}{text()}"))

    def require_search(self) -> None:
        """End the search when more mistakes are known than are told."""
        if self._ended or len(self._told) > MAX_MISTAKES:
            self._ended = True
            raise _EnoughMistakes

    def end_search(self) -> None:
        """Leave the rest of the file, which is of no sane size."""
        self._ended = True

    def may_refuse(self) -> bool:
        """Whether a validator still has to look: not when it has refused more than is told."""
        self._ended = self._ended or self._refused > MAX_MISTAKES
        return not self._ended

    def refuse(self) -> None:
        """Count what a validator refuses, which is told when all are done."""
        self._refused += 1

    def __bool__(self) -> bool:
        return bool(self._told)

    def error(self, kind: type[ChladniError]) -> ChladniError:
        """Give one error with a line for each mistake, in the order of the file."""
        told: dict[str, None] = {}
        found = sorted(self._told, key=lambda one: one[0])
        while found and len(told) < MAX_MISTAKES:
            told[found.pop(0)[1]()] = None
        # One slip may be found twice, by the table's model and by what refers to it.
        more = len({text() for _, text in found} - told.keys()) if len(found) < MAX_MISTAKES else len(found)
        least = "at least " if self._ended else ""
        return kind(*told, *([f"... and {least}{counted(more, 'more mistake')}"] if more else []))


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
        Of the kind given, when the text is no TOML, a whole number has more than the 64 bits of TOML's, or tables lie
        deeper in each other than any that are read; the message names the line.
    """

    def __init__(self, text: str, *, name: str, kind: type[ChladniError]) -> None:
        self.name = name
        self._text = text.replace("\r\n", "\n")
        self._places: Place | None = None
        try:
            self.content: dict[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            if text.lstrip("\ufeff \t\r\n").startswith("<"):
                raise kind(
                    f"{name}: is XML, and TOML is read here; a robot begins with <mujoco> or <robot>"
                ) from None
            raise kind(_syntax_message(str(error), name, self._text.split("\n"))) from None
        except RecursionError:
            raise kind(f"{name}:1: tables or lists are {_TOO_DEEP}") from None
        except ValueError:
            # The only one that is left to Python: more digits than it makes a number of.
            digits = re.compile(rf"[0-9_]{{{sys.get_int_max_str_digits()}}}")
            line = next((n for n, one in enumerate(self._text.split("\n"), 1) if digits.search(one)), 1)
            raise kind(f"{name}:{line}: found a number of thousands of digits; {_NO_INTEGER}") from None
        found = _impossible(self.content)
        if found is not None:
            loc, rule = found
            raise kind(f"{self.place(loc)}: {place_words(loc)}{rule}")

    def place(self, loc: Loc) -> str:
        """``file:line`` of a value or table."""
        return f"{self.name}:{self.line_of(loc)}"

    def line_of(self, loc: Loc) -> int:
        """Line, from 1, in which the value at `loc` starts; for a missing value the line of its table."""
        if self._places is None:
            self._places = places_of(self._text)
        return self._places.line_of(loc)


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
    document = TomlDocument(read_text(path, MAX_BYTES, kind), name=str(path), kind=kind)
    mistakes = TomlMistakes(document)
    content = _validated(document.content, model, mistakes)
    if content is None and not document.content:
        # Rather than a list of all that it should hold.
        raise kind(f"{path}: is empty, or holds comments alone; write the file, or name another")
    try:
        if check is not None:
            mistakes.require_search()
            check(document.content, mistakes)
    except _EnoughMistakes:
        raise mistakes.error(kind) from None
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
    read, found = validated(content, model, context=mistakes)
    for one in found:
        if one.too_long:
            mistakes.end_search()
        mistakes.add_later(one.loc, one.text)
    return read


def _syntax_message(message: str, name: str, lines: list[str]) -> str:
    found = _LINE_IN_MESSAGE.search(message)
    line = int(found[1]) if found and found[1] else len(lines)
    what = _LINE_IN_MESSAGE.sub("", message)
    # Python says what it expected, not what it met: the line itself names the key.
    met = lines[line - 1].strip()
    return f"{name}:{line}: not TOML: {what[:1].lower()}{what[1:]}{f', in {shown(met)}' if met else ''}"


def _impossible(content: dict[str, Any]) -> tuple[Loc, str] | None:
    """Where a value lies too deep, or is a whole number that TOML doesn't have; and what is wrong with it."""
    waiting: list[tuple[Loc, Any]] = [((), content)]
    while waiting:
        loc, found = waiting.pop()
        if isinstance(found, int) and not -(2**63) <= found < 2**63:
            return loc, f"found a whole number of {found.bit_length()} bits; {_NO_INTEGER}"
        entries = found.items() if isinstance(found, dict) else enumerate(found) if isinstance(found, list) else ()
        if entries and len(loc) >= _MAX_DEPTH:
            return loc, f"is {_TOO_DEEP}"
        waiting += [((*loc, key), inner) for key, inner in entries]
    return None
