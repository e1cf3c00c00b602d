"""CDR of ROS 2, and ROS 1: fields one after another without tags, read out of many messages at once."""

from __future__ import annotations

import struct
from collections import Counter
from copy import copy
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.assemble import gathered, joined, scattered
from chladni.io.decoding.cdr_forms import ENCAPSULATIONS, HEADER_BYTES, FormsOf, forms_of, ros1_form
from chladni.io.decoding.columns import Column, Decoded, Strings, outside_buffer, require_known
from chladni.io.decoding.cursor import Cursor, uniform
from chladni.io.decoding.interned import intern_blocks
from chladni.io.decoding.schema import Array, Text, leaves, tree_of
from chladni.io.decoding.walk import Walk
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.cdr_forms import Encapsulation, Form
    from chladni.io.decoding.columns import EncodedMessages, StringValue
    from chladni.io.decoding.schema import FieldInfo, Leaf, Record, Tree
    from chladni.io.decoding.walk import WireRules
    from chladni.signals.arrays import Bytes, Whole

COMPACT_BYTES: Final = 256
"""Bytes a message for each column asked for, up to which irregular messages are first copied side by side."""

_UINT16: Final = np.dtype(np.uint16)
_EIGHT_BYTES: Final = (np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.uint64))
_BEHIND_WIDE_TEXT: Final = (
    "can't be decoded: numbers behind a wstring can't be found, since writers give a character 2 bytes or 4; "
    "record it as a string"
)


class _Batch:
    """Messages of one call and what was found wrong with them."""

    def __init__(self, messages: EncodedMessages) -> None:
        self.messages = messages
        self.bad = outside_buffer(messages)
        self.reasons: Counter[str] = Counter()
        if self.bad.any():
            self.reasons["the message lies outside the data"] += int(self.bad.sum())

    def cursor(self) -> Cursor:
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
            byte_order="<",
        )

    def strings(
        self,
        buffer: Bytes,
        blocks: NDArray[np.generic],
        counts: Whole | None,
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
        True for CDR: aligned, with a header that gives encapsulation and byte order; False for ROS 1.

    Raises
    ------
    LogError
        If the definition has too many fields or its fixed part can't fit into a message.
    """

    def __init__(self, record: Record, *, encapsulated: bool) -> None:
        self.record = record
        self._encapsulated = encapsulated
        # Channels that share the definition share its layouts, too.
        self._made = FormsOf(record)
        known = leaves(record)
        # Until messages tell another.
        self._form = next(forms_of(record, "plain")) if encapsulated else ros1_form(record)
        # Last bit of the number in the header; None until messages tell.
        self._order: int | None = None
        located = _before_wide_text(known)
        self._leaves = {leaf.info.path: leaf for leaf in located}
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in located)
        self.unread = {
            leaf.info.path: _BEHIND_WIDE_TEXT
            for leaf in known
            if leaf.info.path not in self._leaves and leaf.info.kind == "number"
        }
        self._whole = len(located) == len(known)
        self._asked: tuple[tuple[str, ...], Tree] = ((), {})

    def informed_by(self, heads: Sequence[EncodedMessages]) -> BinaryDecoder:
        """Give a decoder for the form that these messages have, as their headers and their lengths tell.

        Raises
        ------
        LogError
            If their form isn't one that can be decoded, or the definition isn't theirs: no form takes them up to
            their last byte.
        """
        informed = copy(self)
        informed.settle(heads)
        return informed

    def settle(self, heads: Sequence[EncodedMessages]) -> None:
        """Do what `informed_by` promises, on this decoder itself."""
        forms = self._forms(heads)
        # Nobody can measure a wide string, so only the header counts then.
        if not self._whole:
            self._form = next(forms)
            return
        most = sum(len(head.offsets) for head in heads)
        found: list[tuple[int, Form]] = []
        for form in forms:
            found.append((sum(_fitting(form, head) for head in heads), form))
            if found[-1][0] == most:
                break
        fitting, form = max(found, key=lambda one: one[0])
        # As with the byte order: a few that differ are damaged or foreign, most of them tell the form.
        if 2 * fitting < most:
            raise LogError(
                f"{self._misfit(heads, most - fitting, most)}; it isn't the one they were written with: record both "
                "from the same build"
            )
        if form.rules.origin and not self._is_borne_out(form, found[0][1], heads):
            raise LogError(
                f"{self._misfit(heads, most - found[0][0], most)}: either it lacks a member, or numbers are aligned "
                "from the encapsulation header on; the values of these messages don't show which"
            )
        self._form = form

    def _is_borne_out(self, form: Form, usual: Form, heads: Sequence[EncodedMessages]) -> bool:
        """Whether values speak for an alignment, too.

        Lengths alone would take a definition that lacks a last member of 4 bytes for alignment from the header.
        """
        numbers = [leaf for leaf in self._leaves.values() if leaf.info.kind == "number"]
        tree = tree_of([leaf for leaf in numbers if leaf.info.dtype in _EIGHT_BYTES])
        return _read_ordinarily(form, tree, heads) and not _read_ordinarily(usual, tree, heads)

    def _forms(self, heads: Sequence[EncodedMessages]) -> Iterator[Form]:
        if not self._encapsulated:
            return iter([self._form])
        numbers = Counter(number for head in heads for number in _header_numbers(head))
        if not numbers:
            return iter([self._form])
        ((number, _),) = Counter(number & ~1 for number in numbers.elements()).most_common(1)
        # One writer has one byte order: a message that differs from most is damaged, not foreign.
        self._order = int(numbers[number | 1] >= numbers[number])
        if number not in ENCAPSULATIONS:
            begin = f"{number >> 8:02x} {number & 0xFF:02x}"
            raise LogError(f"{self.record.name}: messages begin with {begin}, which no header of CDR does")
        return self._made.of(ENCAPSULATIONS[number])

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named; see `chladni.io.decoding.columns.Decoder`."""
        tree = self._tree(tuple(paths))
        batch = _Batch(messages)
        cursor = batch.cursor()
        cursor.compact(COMPACT_BYTES * len(paths))
        walk = _entered(cursor, self._form, self._order)
        walk.read(self._form.root, tree, last=True)
        walk.drop_other_lengths()
        columns = {path: self._column(self._leaves[path], walk, batch) for path in paths}
        told = {self._form.note: len(cursor)} if self._form.note else {}
        return Decoded(columns=columns, bad=batch.bad, reasons=dict(batch.reasons), told=told)

    def _tree(self, paths: tuple[str, ...]) -> Tree:
        # Batch after batch is asked for the same.
        asked, tree = self._asked
        if paths != asked:
            require_known(paths, self.fields, schema_name=self.record.name, unread=self.unread)
            tree = tree_of([self._leaves[path] for path in paths])
            self._asked = (paths, tree)
        return tree

    def _misfit(self, heads: Sequence[EncodedMessages], wrong: int, most: int) -> str:
        layout, lengths = self._form.layouts.of(self.record), ""
        if layout is not None:
            makes = layout.sizes[0] + (HEADER_BYTES if self._encapsulated else 0)
            lengths = f" (a message has {heads[0].lengths[0]}, its definition makes {makes})"
        return (
            f"{self.record.name}: {wrong} of the first {most} messages don't have the bytes that the definition gives"
            f" them{lengths}"
        )

    def _column(self, leaf: Leaf, walk: Walk, batch: _Batch) -> Column:
        pieces, is_text = walk.pieces.get(leaf.info.path, []), leaf.info.kind == "string"
        empty: NDArray[np.generic] = np.empty((0, 2), np.int64) if is_text else np.empty(0, leaf.info.dtype)
        counts: Whole | None = None
        nested: tuple[Whole, ...] = ()
        if leaf.depth == 0:
            values = scattered(pieces, len(batch.bad))
        elif leaf.depth == 1:
            values, counts = joined(pieces, batch.bad, empty=empty)
        else:
            values, counts = gathered(pieces, batch.bad, empty=empty)
            nested = self._nested(leaf, walk, batch)
        if not is_text:
            return Column(values=values, counts=counts, nested=nested)
        listed = partial(_decoded_list, byte_order=walk.cursor.byte_order, rules=self._form.rules)
        decode = listed if isinstance(leaf.type, Array) else _decoded
        return Column(values=batch.strings(walk.cursor.buffer, values, counts, decode), counts=counts, nested=nested)

    def _nested(self, leaf: Leaf, walk: Walk, batch: _Batch) -> tuple[Whole, ...]:
        levels = walk.lengths.get(leaf.info.path, [[]] * leaf.depth)
        outermost, *inner = (gathered(level, batch.bad, empty=np.empty(0, np.int64))[0] for level in levels)
        of_all = np.zeros(len(batch.bad), np.int64)
        of_all[~batch.bad] = outermost
        return (of_all, *(one.astype(np.int64, copy=False) for one in inner))


def _before_wide_text(known: Sequence[Leaf]) -> tuple[Leaf, ...]:
    """Leaves that can be located: writers give a character of a wstring 2 or 4 bytes, and nobody says which."""
    for place, leaf in enumerate(known):
        kind = leaf.type.element if isinstance(leaf.type, Array) else leaf.type
        if isinstance(kind, Text) and kind.wide:
            # Of a list of messages the second one already lies behind it.
            opened, mark, _ = leaf.info.path.partition("[]")
            before = known[:place]
            return tuple(one for one in before if not mark or not one.info.path.startswith(f"{opened}[]"))
    return tuple(known)


def _header_numbers(messages: EncodedMessages) -> list[int]:
    """What the headers of CDR messages name; the last bit is the byte order."""
    places = messages.offsets[~outside_buffer(messages) & (messages.lengths >= HEADER_BYTES)]
    numbers = messages.buffer[places].astype(int) << 8 | messages.buffer[places + 1]
    return [int(number) for number in numbers]


def _fitting(form: Form, messages: EncodedMessages) -> int:
    """How many messages have as many bytes as this form gives their fields."""
    batch = _Batch(messages)
    walk = _entered(batch.cursor(), form)
    walk.measure(form.root, delimited=form.encapsulation not in (None, "plain"))
    # What takes too long to be measured speaks neither for nor against.
    return len(batch.bad) if walk.steps_left == 0 else len(walk.cursor)


def _read_ordinarily(form: Form, tree: Tree, heads: Sequence[EncodedMessages]) -> bool:
    """Whether the numbers of 8 bytes are such as are measured, in most of the messages.

    Read from 4 bytes beside its place, a number has the half of another one, or padding, for its upper half: a
    floating-point number then has any exponent, and an integer nothing in its lower half.
    """
    read, most = 0, 0
    floats, integers = [np.empty(0)], [np.empty(0, np.int64)]
    for head in heads:
        walk = _entered(_Batch(head).cursor(), form)
        walk.read(form.root, tree)
        read, most = read + len(walk.cursor), most + len(head.offsets)
        for values in (piece.values.ravel() for pieces in walk.pieces.values() for piece in pieces):
            if values.dtype == np.float64:
                floats.append(values.view(np.float64))
            else:
                integers.append(values.view(np.int64))
    sizes, whole = np.abs(np.concatenate(floats)), np.concatenate(integers)
    sizes = sizes[np.isfinite(sizes) & (sizes != 0)]
    inside = (sizes >= np.finfo(np.float32).tiny) & (sizes <= np.finfo(np.float32).max)
    halved = bool(whole.any()) and not (whole & 0xFFFFFFFF).any()
    return 2 * read >= most and bool(inside.all()) and not halved


def _entered(cursor: Cursor, form: Form, order: int | None = None) -> Walk:
    """Move to the first field of messages that have this form's header, and this byte order or that of most."""
    if form.encapsulation is not None:
        _pass_header(cursor, form.encapsulation, form.rules.origin, order)
    return Walk(cursor, rules=form.rules, layouts=form.layouts)


def _pass_header(cursor: Cursor, encapsulation: Encapsulation, origin: int, order: int | None) -> None:
    """Move to the bodies of CDR messages; the last bit of the header's number gives the byte order."""
    # The header is big-endian, whatever comes behind it.
    cursor.byte_order = ">"
    cursor.claim(HEADER_BYTES, "the CDR header")
    numbers = uniform(cursor.take(_UINT16).astype(np.int64))
    alike = isinstance(numbers, int) and order in (None, numbers & 1)
    if isinstance(numbers, int) and alike and ENCAPSULATIONS.get(numbers & ~1) == encapsulation:
        order = numbers & 1
    else:
        numbers = np.broadcast_to(numbers, len(cursor))
        expected = [number for number, name in ENCAPSULATIONS.items() if name == encapsulation]
        kept = cursor.drop(~np.isin(numbers & ~1, expected), f"the header doesn't name {encapsulation} CDR")
        orders = (numbers if kept is None else numbers[kept]) & 1
        order = int(2 * np.count_nonzero(orders) >= len(orders)) if order is None else order
        cursor.drop(orders != order, "the byte order differs from most messages")
    cursor.enter(HEADER_BYTES - origin, "<" if order else ">")
    cursor.position = origin


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
