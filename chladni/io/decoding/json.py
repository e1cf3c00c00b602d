"""Decoder of JSON messages."""

from __future__ import annotations

import json
import sys
from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.columns import Decoded, Strings, outside_buffer, require_known
from chladni.io.decoding.found import Found, Row, found_of, joined_column, nothing
from chladni.io.decoding.json_arrow import read_by_arrow
from chladni.io.decoding.json_schema import Settled, is_unicode, parse_json_schema
from chladni.io.decoding.json_stream import Span
from chladni.io.decoding.json_values import Extractor, load_message
from chladni.io.decoding.schema import MAX_NESTING, Primitive, leaves
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from chladni.io.decoding.columns import Column, EncodedMessages
    from chladni.io.decoding.schema import FieldInfo, Leaf, Record
    from chladni.signals.arrays import Index, Mask

FIRST_MESSAGES: Final = 32
"""Messages that tell the fields of a channel whose schema doesn't."""

FEW_MESSAGES: Final = 2048
"""Below this, loading Arrow (0.2 s) costs more than it saves."""

SMALLEST_SPLIT: Final = 256
"""Where a block can't be read as a whole, blocks of this size and less are read message by message."""

LARGEST_STREAM: Final = 1 << 28
"""Most bytes that are parsed at once: Arrow's blocks have 31-bit sizes, and its arrays come on top."""

_CONTRADICTED: Final = "the schema calls {} {}, which its values aren't; they are read as they are"
_SYNTAX: Final = (json.JSONDecodeError, UnicodeDecodeError)


class JsonDecoder:
    """Reads columns out of JSON messages.

    Parameters
    ----------
    name : str
        Name of the schema, for messages.
    stated : Record or None
        The fields as the schema states them.
    note : str
        What is wrong with the schema; empty for a sound one, or none.
    heads : sequence of EncodedMessages
        First messages, for what the schema doesn't tell.

    Raises
    ------
    LogError
        If there are too many fields, or first messages of which none is a JSON object.
    """

    def __init__(
        self, name: str, stated: Record | None, *, note: str = "", heads: Sequence[EncodedMessages] = ()
    ) -> None:
        self.name = name
        self._stated, self._note = stated, note
        settled = Settled(name, stated, self._first(heads))
        self._contradicted = settled.contradicted
        known = {leaf.info.path: leaf for leaf in leaves(settled.record)}
        self._leaves = {path: leaf for path, leaf in known.items() if is_unicode(path)}
        self.unread = {
            path.encode("utf-8", "backslashreplace").decode(): "can't be read: its name holds half a character"
            for path, leaf in known.items()
            if path not in self._leaves and leaf.info.kind == "number"
        } | dict.fromkeys(settled.too_deep, f"is nested deeper than {MAX_NESTING}, and isn't read")
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in self._leaves.values())

    @classmethod
    def of_schema(cls, name: str, data: bytes) -> JsonDecoder:
        """Make a decoder from a JSON Schema, or from none (empty data).

        Messages tell their own fields, so one whose schema can't be used is read without it, with a word.
        """
        try:
            return cls(name, parse_json_schema(name, data))
        except LogError as error:
            return cls(name, None, note=f"{error}; the fields are those of the first messages")

    def informed_by(self, heads: Sequence[EncodedMessages]) -> JsonDecoder:
        """Give a decoder that knows the fields: from the schema and from the first messages."""
        return JsonDecoder(self.name, self._stated, note=self._note, heads=heads)

    def _first(self, heads: Sequence[EncodedMessages]) -> list[object]:
        spans = [_span(head, np.flatnonzero(~outside_buffer(head))) for head in heads]
        contents = [content for span in spans for content in span.part(0, FIRST_MESSAGES).contents()][:FIRST_MESSAGES]
        found = []
        for content in contents:
            try:
                found.append(load_message(content))
            except ValueError:
                continue  # `columns` reports it; a damaged first message must not hide the fields of the others
        if contents and not any(isinstance(value, dict) for value in found):
            what = "JSON that names its values, as in an object" if found else "JSON"
            raise LogError(f"none of the first {len(contents)} messages is {what}, so there is no field to read")
        return found

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named; see `chladni.io.decoding.columns.Decoder`."""
        require_known(paths, self.fields, schema_name=self.name)
        block = _Block([self._leaves[path] for path in paths])
        outside = outside_buffer(messages)
        if outside.any():
            block.reasons["the message lies outside the data"] += int(outside.sum())
        inside = np.flatnonzero(~outside)
        block.read(_span(messages, inside))
        bad = outside.copy()
        bad[inside] = np.concatenate([np.empty(0, np.bool_), *block.bad])
        columns = {
            leaf.info.path: joined_column(found, bad, empty=nothing(leaf))
            for leaf, found in zip(block.leaves, block.found, strict=True)
        }
        told = block.told + self._contradictions(columns, int(np.count_nonzero(~bad)))
        return Decoded(columns=columns, bad=bad, reasons=dict(block.reasons), told=dict(told))

    def _contradictions(self, columns: Mapping[str, Column], sound: int) -> Counter[str]:
        """Say where the schema calls a field what its values aren't."""
        told = Counter({self._note: sound} if self._note else {})
        for path, column in columns.items():
            for stated, word in self._contradicted.items():
                if path == stated or path.startswith((f"{stated}.", f"{stated}[]")):
                    told[_CONTRADICTED.format(stated, word)] = sound
            if self._leaves[path].info.dtype == np.int64 and not isinstance(column.values, Strings):
                numbers = column.values
                whole = numbers.dtype.kind != "f" or bool((np.isnan(numbers) | (numbers == np.floor(numbers))).all())
                if not whole and self._stated is not None:
                    told[_CONTRADICTED.format(path, "an integer")] = sound
        return told


class _Block:
    """What messages gave so far: values of sound ones, and which were bad."""

    def __init__(self, chosen: Sequence[Leaf]) -> None:
        self.leaves = chosen
        self.found: list[list[Found]] = [[] for _ in chosen]
        self.bad: list[Mask] = []
        self.reasons: Counter[str] = Counter()
        self.told: Counter[str] = Counter()

    def read(self, span: Span) -> None:
        """Read messages: all at once where they are sound, the fewer at once the nearer an unsound one."""
        least = SMALLEST_SPLIT if "pyarrow" in sys.modules else FEW_MESSAGES
        if len(span) < least:
            self._one_by_one(span.contents())
            return
        small = int((span.ends - span.starts).sum()) < LARGEST_STREAM
        found = read_by_arrow(span, self.leaves) if small else None
        if found is not None:
            self._add(found, np.zeros(len(span), np.bool_))
            return
        quarter = -(-len(span) // 4)
        for first in range(0, len(span), quarter):
            self.read(span.part(first, first + quarter))

    def _one_by_one(self, contents: Sequence[bytes]) -> None:
        bad = np.zeros(len(contents), np.bool_)
        rows = _Rows(self.leaves, self.told)
        for index, content in enumerate(contents):
            try:
                rows.add(load_message(content))
            except ValueError as error:
                bad[index] = True
                self.reasons["not JSON" if isinstance(error, _SYNTAX) else str(error)] += 1
        self._add(rows.found(), bad)

    def _add(self, found: Sequence[Found], bad: Mask) -> None:
        for column, one in zip(self.found, found, strict=True):
            column.append(one)
        self.bad.append(bad)


class _Rows:
    """Values of leaves in one message after another; numbers that a message doesn't hold take no work."""

    def __init__(self, chosen: Sequence[Leaf], told: Counter[str]) -> None:
        self._leaves, self._told = chosen, told
        self._rows: list[list[Row]] = [[] for _ in chosen]
        self._places: list[list[int]] = [[] for _ in chosen]
        self._sound = 0
        self._always = [place for place, leaf in enumerate(chosen) if not _may_lack(leaf)]
        self._by_key: dict[str, list[int]] = {}
        for place, leaf in enumerate(chosen):
            if _may_lack(leaf):
                self._by_key.setdefault(leaf.names[0], []).append(place)
        self._keys: tuple[str, ...] | None = None
        self._present: list[int] = []
        self._extract = Extractor((), told)

    def add(self, message: object) -> None:
        """Take in a message; `ValueError` says why it can't be used."""
        keys = tuple(message) if isinstance(message, dict) else ()
        if keys != self._keys:
            # Message after message mostly has the same.
            self._keys = keys
            self._present = [*self._always, *(place for key in keys for place in self._by_key.get(key, ()))]
            self._extract = Extractor([self._leaves[place] for place in self._present], self._told)
        for place, row in zip(self._present, self._extract(message), strict=True):
            self._rows[place].append(row)
            self._places[place].append(self._sound)
        self._sound += 1

    def found(self) -> list[Found]:
        """Give the values of each leaf in all messages that could be used."""
        # One for all the leaves that no message holds: a schema may state thousands that nobody fills.
        absent = Found(values=np.full(self._sound, np.nan))
        return [
            self._spread(place, found_of(leaf, rows)) if rows or not (self._sound and _may_lack(leaf)) else absent
            for place, (leaf, rows) in enumerate(zip(self._leaves, self._rows, strict=True))
        ]

    def _spread(self, place: int, found: Found) -> Found:
        places = self._places[place]
        if len(places) == self._sound or isinstance(found.values, Strings):
            return found
        values = np.full(self._sound, np.nan)
        values[places] = found.values
        return Found(values=values)


def _may_lack(leaf: Leaf) -> bool:
    """Whether a message without the leaf has one NaN for it."""
    return leaf.info.kind == "number" and not any(leaf.lists) and isinstance(leaf.type, Primitive)


def _span(messages: EncodedMessages, index: Index) -> Span:
    starts = messages.offsets[index]
    return Span(buffer=messages.buffer, starts=starts, ends=starts + messages.lengths[index])
