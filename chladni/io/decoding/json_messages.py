"""Decoder of JSON messages."""

from __future__ import annotations

import json
import sys
from collections import Counter
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from chladni.io.decoding.columns import Decoded, Strings, outside_buffer, require_known
from chladni.io.decoding.found import Found, interned, joined_column
from chladni.io.decoding.json_arrow import read_by_arrow
from chladni.io.decoding.json_schema import discovered_record, parse_json_schema
from chladni.io.decoding.json_values import extract, load_message
from chladni.io.decoding.schema import Array, leaves

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages, StringValue
    from chladni.io.decoding.json_values import Scalar, Value
    from chladni.io.decoding.schema import FieldInfo, Leaf, Record

FIRST_MESSAGES: Final = 32
"""Messages that tell the fields of a channel whose schema doesn't."""

FEW_MESSAGES: Final = 2048
"""Below this, loading Arrow (0.2 s) costs more than it saves."""

SMALLEST_SPLIT: Final = 256
"""Where a block can't be read as a whole, blocks of this size and less are read message by message."""

WHITE_SPACE: Final = b" \t\r\n"
"""What JSON counts as white space; `bytes.strip` alone would take more."""

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
        for index in np.flatnonzero(~outside)[:FIRST_MESSAGES].tolist():
            try:
                first.append(load_message(_content(messages, index)))
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
        block.read(_contents(messages, inside))
        bad = outside.copy()
        bad[inside] = np.concatenate([np.empty(0, np.bool_), *block.bad])
        columns = {
            leaf.info.path: joined_column(found, bad, empty=_nothing(leaf))
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

    def read(self, contents: list[bytes]) -> None:
        """Read messages: all at once where they are sound, the fewer at once the nearer an unsound one."""
        arrow = len(contents) >= FEW_MESSAGES or ("pyarrow" in sys.modules and len(contents) > SMALLEST_SPLIT)
        if not arrow:
            self._one_by_one(contents)
            return
        if sum(map(len, contents)) < LARGEST_STREAM:
            found = read_by_arrow(contents, self.leaves)
            if found is not None:
                self._add(found, np.zeros(len(contents), np.bool_))
                return
        quarter = -(-len(contents) // 4)
        for first in range(0, len(contents), quarter):
            self.read(contents[first : first + quarter])

    def _one_by_one(self, contents: Sequence[bytes]) -> None:
        bad = np.zeros(len(contents), np.bool_)
        rows: list[list[list[Value]]] = []
        for index, content in enumerate(contents):
            try:
                rows.append(extract(load_message(content), self.leaves))
            except ValueError as error:
                bad[index] = True
                self.reasons["not JSON" if isinstance(error, _SYNTAX) else str(error)] += 1
        self._add([_found(leaf, [row[i] for row in rows]) for i, leaf in enumerate(self.leaves)], bad)

    def _add(self, found: Sequence[Found], bad: NDArray[np.bool_]) -> None:
        for column, one in zip(self.found, found, strict=True):
            column.append(one)
        self.bad.append(bad)


def _found(leaf: Leaf, rows: Sequence[Sequence[Value]]) -> Found:
    """Values of one leaf: `rows` has the values of each message, several where lists lie on the way."""
    values = [value for row in rows for value in row]
    counts = np.array([len(row) for row in rows], np.int64) if any(leaf.lists) else None
    if leaf.info.kind == "string":
        return Found(values=interned(cast("list[StringValue]", values)), counts=counts)
    if isinstance(leaf.type, Array):
        # Elements of all lists of a message belong to it.
        lists = cast("Sequence[Sequence[tuple[Scalar, ...]]]", rows)
        counts = np.array([sum(map(len, row)) for row in lists], np.int64)
        values = [element for row in lists for one in row for element in one]
    return Found(values=np.array(values, leaf.info.dtype), counts=counts)


def _nothing(leaf: Leaf) -> NDArray[np.generic] | Strings:
    if leaf.info.kind == "string":
        return Strings(codes=np.empty(0, np.int32), table=())
    return np.empty(0, leaf.info.dtype)


def _content(messages: EncodedMessages, index: int) -> bytes:
    start, length = int(messages.offsets[index]), int(messages.lengths[index])
    return messages.buffer[start : start + length].tobytes().strip(WHITE_SPACE)


def _contents(messages: EncodedMessages, index: NDArray[np.intp]) -> list[bytes]:
    """Messages as bytes, from one copy of the stretch of buffer that they lie in."""
    if not len(index):
        return []
    starts = messages.offsets[index]
    ends = starts + messages.lengths[index]
    first = int(starts.min())
    stretch = messages.buffer[first : int(ends.max())].tobytes()
    return [
        stretch[start:end].strip(WHITE_SPACE)
        for start, end in zip((starts - first).tolist(), (ends - first).tolist(), strict=True)
    ]
