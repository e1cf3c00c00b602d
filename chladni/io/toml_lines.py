"""In which line each value of a TOML file stands, which Python's parser doesn't tell; one pass over the text."""

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

# Of a text that is TOML. Three quotes end a text of several lines; up to two more belong to it.
_TOKEN: Final = re.compile(
    r"""(?P<line>\n)|(?P<blank>[ \t\r]+|\#[^\n]*)|(?P<mark>[][{}=,])|(?P<quoted>\"{3}(?:[^\\]|\\.)*?\"{3,5}"""
    r"""|'{3}.*?'{3,5}|"(?:[^"\\]|\\.)*"|'[^']*')|(?P<bare>[^\s\[\]{}=,#"']+)""",
    re.DOTALL,
)


@dataclass(slots=True)
class Place:
    """A key, value or table: the line, from 1, in which it first stands, and what lies in it."""

    line: int
    inner: dict[str | int, "Place"] = field(default_factory=dict)
    # Tables [[name]] so far; what follows belongs to the last one.
    tables: int = 0

    def within(self, key: str | int, line: int) -> "Place":
        """Give what lies at a key, and make it where it's new."""
        place = self.inner.setdefault(key, Place(line))
        return place.inner[place.tables - 1] if place.tables else place

    def next_table(self, key: str, line: int) -> "Place":
        """Begin one more table [[key]]."""
        listed = self.inner.setdefault(key, Place(line))
        listed.tables += 1
        return listed.inner.setdefault(listed.tables - 1, Place(line))

    def line_of(self, loc: Iterable[str | int]) -> int:
        """Line of what lies at `loc`; of the innermost around it where there is no such thing."""
        place = self
        for part in loc:
            if part not in place.inner:
                break
            place = place.inner[part]
        return place.line


def places_of(text: str) -> Place:
    """Find the places of all that a text, which is TOML, holds."""
    scan = _Scan()
    for token in _TOKEN.finditer(text):
        scan.take(token.lastgroup or "", token.group())
    return scan.root


@dataclass(slots=True)
class _Open:
    """What is being filled: a table by keys, or a list (`count` values so far)."""

    place: Place
    count: int = -1
    # Of a table, the parts of the key before the equals sign, and the place of the value behind it.
    key: list[str] = field(default_factory=list)
    value: Place | None = None
    # Of a list, whether a comma or its bracket has announced one more value.
    fresh: bool = True


class _Scan:
    def __init__(self) -> None:
        self.root = Place(1)
        self._line = 1
        self._stack = [_Open(self.root)]
        # Brackets of a header that is being read.
        self._header = 0

    def take(self, kind: str, text: str) -> None:
        """Go on by one token."""
        if kind == "line":
            self._line += 1
            if len(self._stack) == 1:
                self._stack = [_Open(self._stack[0].place)]
        elif kind == "mark":
            self._mark(text)
        elif kind in ("quoted", "bare"):
            self._word(text, quoted=kind == "quoted")
            self._line += text.count("\n")

    def _word(self, text: str, *, quoted: bool) -> None:
        top = self._stack[-1]
        if top.count < 0 and top.value is None:
            top.key += [_unquoted(text)] if quoted else [part for part in text.split(".") if part]
        else:
            self._begun()

    def _begun(self) -> Place:
        """Place of the value that begins here."""
        top = self._stack[-1]
        if top.count < 0:
            return top.value or top.place
        if top.fresh:
            # A date and its time of day are two words of one value.
            top.fresh, top.count = False, top.count + 1
        return top.place.within(top.count - 1, self._line)

    def _mark(self, mark: str) -> None:
        top = self._stack[-1]
        match mark:
            case "[" if len(self._stack) == 1 and top.value is None:
                self._header += 1
            case "]" if self._header:
                self._close_header(top)
            case "=":
                top.value = self._named(top.place, top.key)
            case ",":
                top.key, top.value, top.fresh = [], None, True
            case "[":
                self._stack.append(_Open(self._begun(), count=0))
            case "{":
                self._stack.append(_Open(self._begun()))
            case _:
                self._stack.pop()

    def _close_header(self, top: _Open) -> None:
        # The second bracket of [[name]] finds no key any more.
        if top.key:
            *outer, last = top.key
            table = self._named(self.root, outer)
            begun = table.within if self._header == 1 else table.next_table
            self._stack = [_Open(begun(last, self._line))]
        else:
            self._stack = [_Open(top.place)]
        self._header -= 1

    def _named(self, place: Place, key: list[str]) -> Place:
        for part in key:
            place = place.within(part, self._line)
        return place


def _unquoted(text: str) -> str:
    return text[1:-1] if text.startswith("'") else str(tomllib.loads(f"key={text}")["key"])
