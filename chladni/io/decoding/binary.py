"""Decoder of encodings that lay fields one after another without tags: CDR (ROS 2) and ROS 1."""

from __future__ import annotations

import struct
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chladni.io.decoding.assemble import joined, scattered
from chladni.io.decoding.columns import Column, Decoded, Strings, outside_buffer, require_known
from chladni.io.decoding.cursor import Cursor, uniform
from chladni.io.decoding.interned import intern_blocks
from chladni.io.decoding.layout import Layouts
from chladni.io.decoding.schema import Array, leaves, tree_of
from chladni.io.decoding.walk import Walk, WireRules
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages, StringValue
    from chladni.io.decoding.piece import Piece
    from chladni.io.decoding.schema import FieldInfo, Leaf, Record, Tree

HEADER_BYTES: Final = 4
"""Bytes of the CDR encapsulation header; alignment counts from its end."""

COMPACT_BYTES: Final = 256
"""Bytes a message for each column asked for, up to which irregular messages are first copied side by side."""

_UINT16: Final = np.dtype(np.uint16)
_CDR: Final = WireRules(max_alignment=8, terminated=True)
_ROS1: Final = WireRules(max_alignment=1, terminated=False)

_PLAIN_FORMS: Final[dict[int, Literal["<", ">"]]] = {0: ">", 1: "<"}
_OTHER_FORMS: Final = {
    2: "PL_CDR (parameter list)", 3: "PL_CDR (parameter list)",
    6: "XCDR2", 7: "XCDR2", 8: "delimited XCDR2", 9: "delimited XCDR2",
    10: "parameter-list XCDR2", 11: "parameter-list XCDR2",
}  # fmt: skip


class _Batch:
    """Messages of one call and what was found wrong with them."""

    def __init__(self, messages: EncodedMessages) -> None:
        self.messages = messages
        self.bad = outside_buffer(messages)
        self.reasons: Counter[str] = Counter()
        if self.bad.any():
            self.reasons["the message lies outside the data"] += int(self.bad.sum())

    def cursor(self, *, byte_order: Literal["<", ">"]) -> Cursor:
        """Cursor at the first byte of all messages that lie inside the data."""
        offsets, lengths = self.messages.offsets, self.messages.lengths
        rows = np.flatnonzero(~self.bad) if self.reasons else np.arange(len(self.bad))
        return Cursor(
            buffer=self.messages.buffer,
            base=offsets[rows] if self.reasons else offsets,
            size=lengths[rows] if self.reasons else lengths,
            rows=rows,
            bad=self.bad,
            reasons=self.reasons,
            byte_order=byte_order,
        )

    def strings(
        self,
        buffer: NDArray[np.uint8],
        blocks: NDArray[np.generic],
        counts: NDArray[np.int64] | None,
        decode: Callable[[bytes], StringValue],
    ) -> Strings:
        """Decode the strings in these places; messages with a malformed one become bad."""
        places = blocks.reshape(-1, 2).astype(np.int64, copy=False)
        owner = np.arange(len(self.bad)).repeat(len(places) // max(1, len(self.bad)) if counts is None else counts)
        codes = np.zeros(len(places), np.int32)
        sound = ~self.bad[owner]
        strings, malformed = intern_blocks(buffer, places[sound], decode)
        codes[sound] = strings.codes
        wrong = np.unique(owner[sound][malformed])
        self.bad[wrong] = True
        if len(wrong):
            self.reasons["a string isn't UTF-8"] += len(wrong)
        return Strings(codes=codes.reshape(blocks.shape[:-1]), table=strings.table)


class BinaryDecoder:
    """Reads columns out of CDR or ROS 1 messages by walking the definition for all messages at once.

    Parameters
    ----------
    record : Record
        The message definition.
    encapsulated : bool
        True for CDR: aligned, with a header that gives the byte order; False for ROS 1.

    Raises
    ------
    LogError
        If the definition has too many fields or its fixed part can't fit into a message.
    """

    def __init__(self, record: Record, *, encapsulated: bool) -> None:
        self.record = record
        self._leaves = {leaf.info.path: leaf for leaf in leaves(record)}
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in self._leaves.values())
        self._encapsulated = encapsulated
        self._rules = _CDR if encapsulated else _ROS1
        self._layouts = Layouts(self._rules.max_alignment)
        self._asked: tuple[tuple[str, ...], Tree] = ((), {})

    def informed_by(self, messages: EncodedMessages) -> BinaryDecoder:
        """Give this decoder: the definition tells all fields."""
        del messages
        return self

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named; see `chladni.io.decoding.columns.Decoder`."""
        tree = self._tree(tuple(paths))
        batch = _Batch(messages)
        # The header of CDR is big-endian, whatever comes behind it.
        cursor = batch.cursor(byte_order=">" if self._encapsulated else "<")
        cursor.compact(COMPACT_BYTES * len(paths))
        if self._encapsulated:
            self._pass_header(cursor)
        walk = Walk(cursor, rules=self._rules, layouts=self._layouts)
        walk.record(self.record, tree, last=True)
        columns = {path: self._column(self._leaves[path], walk.pieces.get(path, []), batch, cursor) for path in paths}
        return Decoded(columns=columns, bad=batch.bad, reasons=dict(batch.reasons))

    def _tree(self, paths: tuple[str, ...]) -> Tree:
        # Batch after batch is asked for the same.
        asked, tree = self._asked
        if paths != asked:
            require_known(paths, self.fields, schema_name=self.record.name)
            tree = tree_of([self._leaves[path] for path in paths])
            self._asked = (paths, tree)
        return tree

    def _pass_header(self, cursor: Cursor) -> None:
        """Move to the bodies of CDR messages; the header gives the byte order."""
        cursor.claim(HEADER_BYTES, "the CDR header")
        forms = uniform(cursor.take(_UINT16).astype(np.int64))
        if isinstance(forms, int):
            if forms in _OTHER_FORMS:
                raise LogError(
                    f"{self.record.name}: messages are in {_OTHER_FORMS[forms]}; plain CDR (little or big endian) is "
                    "supported, record with a middleware that writes it"
                )
            if forms in _PLAIN_FORMS:
                cursor.enter(HEADER_BYTES, _PLAIN_FORMS[forms])
                return
            forms = np.full(len(cursor), forms)
        kept = cursor.drop(forms > 1, "the header names no plain CDR")
        forms = forms if kept is None else forms[kept]
        # One writer has one byte order: a message that differs from most is damaged, not foreign.
        order = 1 if 2 * np.count_nonzero(forms) >= len(forms) else 0
        cursor.drop(forms != order, "the byte order differs from most messages")
        cursor.enter(HEADER_BYTES, _PLAIN_FORMS[order])

    def _column(self, leaf: Leaf, pieces: list[Piece], batch: _Batch, cursor: Cursor) -> Column:
        info, bad = leaf.info, batch.bad
        if info.kind != "string":
            if info.array is None:
                return Column(values=scattered(pieces, len(bad)))
            values, counts = joined(pieces, bad, empty=np.empty(0, info.dtype))
            return Column(values=values, counts=counts)
        # A list of strings is one value of a message; only a list of messages makes several of them.
        if "[]" in info.path:
            blocks, counts = joined(pieces, bad, empty=np.empty((0, 2), np.int64))
        else:
            blocks, counts = scattered(pieces, len(bad)), None
        listed = partial(_decoded_list, byte_order=cursor.byte_order, rules=self._rules)
        decode = listed if isinstance(leaf.type, Array) else _decoded
        return Column(values=batch.strings(cursor.buffer, blocks, counts, decode), counts=counts)


def _decoded(content: bytes) -> str:
    return content.decode("utf-8")


def _decoded_list(block: bytes, *, byte_order: str, rules: WireRules) -> tuple[str, ...]:
    """Strings of an array, from the bytes between its count and its end; the walk has checked the lengths."""
    position, found = 0, []
    length_format = struct.Struct(f"{byte_order}I")
    alignment = min(4, rules.max_alignment)
    while position < len(block):
        position += -position % alignment
        (length,) = length_format.unpack_from(block, position)
        position += length_format.size
        content = block[position : position + length]
        position += length
        found.append(_decoded(content[:-1] if rules.terminated else content))
    return tuple(found)
