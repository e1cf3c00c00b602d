"""Decoder of JSON messages."""

from __future__ import annotations

import json
import sys
from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.columns import Decoded, outside_buffer, require_known
from chladni.io.decoding.found import Found, found_of, joined_column, nothing
from chladni.io.decoding.json_arrow import read_by_arrow
from chladni.io.decoding.json_schema import discovered_record, parse_json_schema
from chladni.io.decoding.json_stream import Span
from chladni.io.decoding.json_values import extract, load_message
from chladni.io.decoding.schema import leaves

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages
    from chladni.io.decoding.json_values import Value
    from chladni.io.decoding.schema import FieldInfo, Leaf, Record

FIRST_MESSAGES: Final = 32
"""Messages that tell the fields of a channel whose schema doesn't."""

FEW_MESSAGES: Final = 2048
"""Below this, loading Arrow (0.2 s) costs more than it saves."""

SMALLEST_SPLIT: Final = 256
"""Where a block can't be read as a whole, blocks of this size and less are read message by message."""

LARGEST_STREAM: Final = 1 << 28
"""Most bytes that are parsed at once: Arrow's blocks have 31-bit sizes, and its arrays come on top."""

_SYNTAX: Final = (json.JSONDecodeError, UnicodeDecodeError)


class JsonDecoder:
    """Reads columns out of JSON messages.

    Parameters
    ----------
    name : str
        Name of the schema, for messages.
    record : Record or None
        The fields; None where only messages can tell them (see `informed_by`).
    """

    def __init__(self, name: str, record: Record | None) -> None:
        self.name = name
        self._leaves = {leaf.info.path: leaf for leaf in leaves(record)} if record is not None else {}
        self._known = record is not None
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in self._leaves.values())

    @classmethod
    def of_schema(cls, name: str, data: bytes) -> JsonDecoder:
        """Make a decoder from a JSON Schema, or from none (empty data)."""
        return cls(name, parse_json_schema(name, data))

    def informed_by(self, messages: EncodedMessages) -> JsonDecoder:
        """Give a decoder that knows the fields: from the schema, else from the first messages."""
        if self._known:
            return self
        outside = outside_buffer(messages)
        first = []
        for content in _span(messages, np.flatnonzero(~outside)[:FIRST_MESSAGES]).contents():
            try:
                first.append(load_message(content))
            except ValueError:
                continue  # `columns` reports it; a damaged first message must not hide the fields of the others
        return JsonDecoder(self.name, discovered_record(self.name, first))

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
        return Decoded(columns=columns, bad=bad, reasons=dict(block.reasons))


class _Block:
    """What messages gave so far: values of sound ones, and which were bad."""

    def __init__(self, chosen: Sequence[Leaf]) -> None:
        self.leaves = chosen
        self.found: list[list[Found]] = [[] for _ in chosen]
        self.bad: list[NDArray[np.bool_]] = []
        self.reasons: Counter[str] = Counter()

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
        rows: list[list[list[Value]]] = []
        for index, content in enumerate(contents):
            try:
                rows.append(extract(load_message(content), self.leaves))
            except ValueError as error:
                bad[index] = True
                self.reasons["not JSON" if isinstance(error, _SYNTAX) else str(error)] += 1
        self._add([found_of(leaf, [row[i] for row in rows]) for i, leaf in enumerate(self.leaves)], bad)

    def _add(self, found: Sequence[Found], bad: NDArray[np.bool_]) -> None:
        for column, one in zip(self.found, found, strict=True):
            column.append(one)
        self.bad.append(bad)


def _span(messages: EncodedMessages, index: NDArray[np.intp]) -> Span:
    starts = messages.offsets[index]
    return Span(buffer=messages.buffer, starts=starts, ends=starts + messages.lengths[index])
