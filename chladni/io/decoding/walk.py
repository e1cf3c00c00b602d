"""The walk through a message definition, for all messages of a batch at once.

Fields are laid one after another on the wire, so a field's place is known once everything before it has been
measured. The walk visits members in order, measures what isn't wanted as cheaply as it can (a part of fixed size
costs one addition), reads what is wanted as whole columns, and stops after the last wanted field.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.cursor import Cursor, uniform
from chladni.io.decoding.element_span import ElementPlaces, ElementSpan
from chladni.io.decoding.layout import Layouts, element_offset
from chladni.io.decoding.piece import Piece
from chladni.io.decoding.schema import (
    Array,
    Delimited,
    FieldType,
    Leaf,
    Primitive,
    Record,
    Stamp,
    Text,
    Tree,
    smallest_size,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from chladni.signals.arrays import Mask, Whole

MAX_ELEMENT_STEPS: Final = 20_000
"""Most elements of varying size (strings, messages with strings) that a batch is walked through one after another.

Each step costs some hundred microseconds whatever the number of messages; a file made to hold millions of them in one
message would otherwise stop the reader for hours.
"""

MAX_MEASURED_STEPS: Final = 1000
"""The same where first messages are only measured, a tenth of a second for one topic."""

UINT32: Final = np.dtype(np.uint32)
UINT8: Final = np.dtype(np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class WireRules:
    """What distinguishes the encodings that lay fields one after another.

    Parameters
    ----------
    max_alignment : int
        8 in CDR, 4 in XCDR2, 1 (no padding) in ROS 1.
    terminated : bool
        Strings end with a zero byte, counted in their length (CDR).
    spare : int
        Most bytes that a message may have behind its last field.
    origin : int
        Bytes in front of the first field that alignment counts, too.
    """

    max_alignment: int
    terminated: bool
    spare: int
    origin: int = 0


class Walk:
    """One pass over a batch.

    Parameters
    ----------
    cursor : Cursor
        At the first byte of the bodies.
    rules : WireRules
    layouts : Layouts
        Made for the same rules.
    """

    def __init__(self, cursor: Cursor, *, rules: WireRules, layouts: Layouts) -> None:
        self.cursor = cursor
        self.rules = rules
        self.layouts = layouts
        self.pieces: dict[str, list[Piece]] = {}
        # Of leaves in lists in lists, by path: lengths of the lists of each level.
        self.lengths: dict[str, list[list[Piece]]] = {}
        self.level = 0
        self.smallest: dict[FieldType, int] = {}
        self.steps_left = MAX_ELEMENT_STEPS
        self.strict = False
        # Whether everything was passed over, so that the cursor stands at the end of the messages.
        self.complete = True

    def drop_other_lengths(self) -> None:
        """Drop messages that are longer or shorter than their fields: their definition isn't the one that is read."""
        cursor = self.cursor
        if self.complete:
            # As an unsigned number one that is too short by a byte is longer than any.
            left = (cursor.size - cursor.position).view(np.uint64)
            cursor.drop(left > self.rules.spare, "its length isn't that of its definition")

    def measure(self, kind: FieldType, *, delimited: bool) -> None:
        """Pass over everything, and look at each delimiter on the way where there are such."""
        self.strict = delimited
        self.steps_left = MAX_MEASURED_STEPS
        self.skip(kind)
        self.drop_other_lengths()

    def record(self, record: Record, wanted: Tree, *, last: bool) -> None:
        """Read the wanted members of a message; with `last`, measure what follows them only where that is cheap."""
        missing = len(wanted)
        for member in record.members:
            if last and not missing:
                if not self._passed(member.type):
                    return
                continue
            below = wanted.get(member.name)
            if below is None:
                self.skip(member.type)
            else:
                missing -= 1
                self.read(member.type, below, last=last and not missing)

    def _passed(self, kind: FieldType) -> bool:
        """Pass over a value of fixed size; False where this isn't one, or one before it wasn't."""
        layout = self.layouts.of(kind) if self.complete else None
        self.complete = layout is not None
        if layout is not None:
            self.cursor.pass_over(layout)
        return self.complete

    def read(self, kind: FieldType, wanted: Tree | Leaf, *, last: bool = False) -> None:
        """Read one value, or the wanted leaves in it, from each message."""
        match kind:
            case Delimited():
                self._delimiter()
                self.read(kind.content, wanted, last=last)
            case Record():
                self.record(kind, _below(wanted), last=last)
            case Primitive(dtype=dtype):
                self._settle(dtype.itemsize, 1)
                self._put(wanted, self.cursor.take(dtype))
                self.cursor.advance(dtype.itemsize)
            case Stamp():
                self._settle(4, 2)
                self._put(wanted, self._nanoseconds(kind))
                self.cursor.advance(8)
            case Text():
                position, content = self._text(kind)
                start = self.cursor.base + position
                self._put(wanted, np.stack([start, np.broadcast_to(content, start.shape)], axis=1))
            case Array():
                self._array(kind, wanted)

    def skip(self, kind: FieldType) -> None:
        """Move over one value in each message."""
        layout = None if self.strict and not isinstance(kind, Primitive | Stamp) else self.layouts.of(kind)
        if layout is not None:
            self.cursor.pass_over(layout)
            return
        match kind:
            case Delimited():
                self._measured_content(kind)
            case Text():
                self._text(kind)
            case Record(members=members):
                for member in members:
                    self.skip(member.type)
            case Array():
                self._array(kind, None)

    def _settle(self, width: int, count: int) -> None:
        self.cursor.align(self.layouts.alignment(width))
        self.cursor.claim(width * count, "a field")

    def _put(self, wanted: Tree | Leaf, values: NDArray[np.generic], counts: Whole | None = None) -> None:
        self.pieces.setdefault(_path(wanted), []).append(Piece(rows=self.cursor.rows, values=values, counts=counts))

    def _nanoseconds(self, stamp: Stamp) -> Whole:
        return _to_ns(self.cursor.take(stamp.seconds), self.cursor.take(stamp.nanoseconds, at=4))

    def _length(self) -> int | Whole:
        self._settle(4, 1)
        length = uniform(self.cursor.take(UINT32).astype(np.int64))
        self.cursor.advance(4)
        return length

    def _delimiter(self) -> int | Whole:
        length = self._length()
        return _kept(length, self.cursor.claim(length, "a delimited value"))

    def _measured_content(self, kind: Delimited) -> None:
        """Pass over a delimited value, of the messages whose delimiter counts its bytes."""
        length = self._delimiter()
        before, end = self.cursor.rows, np.broadcast_to(self.cursor.position + length, len(self.cursor))
        self.skip(kind.content)
        end = end[np.searchsorted(before, self.cursor.rows)]
        self.cursor.drop(end != self.cursor.position, "a delimiter contradicts the definition")

    def _text(self, text: Text) -> tuple[int | Whole, int | Whole]:
        """Move over a string; gives the place and the number of bytes of its characters."""
        if text.wide:
            raise AssertionError("fields behind a wstring can't be located, and aren't offered")
        cursor = self.cursor
        length = self._length()
        length = _kept(length, cursor.claim(length, "a string"))
        if self.rules.terminated:
            # An empty length field is taken as an empty string: the byte before its end is then its own zero.
            end = cursor.take(UINT8, at=length - 1)
            length = _kept(length, cursor.drop(end != 0, "a string lacks its terminating zero"))
        content = length - (length > 0) if self.rules.terminated else length
        if text.bound is not None:
            kept = cursor.drop(np.broadcast_to(content > text.bound, len(cursor)), "a string exceeds its bound")
            length, content = _kept(length, kept), _kept(content, kept)
        place = cursor.position
        cursor.advance(length)
        return place, content

    def _array(self, array: Array, wanted: Tree | Leaf | None) -> None:
        counts = self._counts(array)
        if wanted is not None:
            self._note_lengths(array, counts, wanted)
        self.level += len(array.dims)
        match array.element:
            case Primitive(dtype=dtype):
                self._numbers(dtype, counts, wanted)
            case Text() if wanted is not None:
                self._texts(array.element, counts, wanted)
            case _ if not self.strict and self._fixed_elements(array.element, counts, wanted):
                pass
            case _:
                self._each_element(array.element, counts, wanted)
        self.level -= len(array.dims)

    def _note_lengths(self, array: Array, counts: int | Whole, wanted: Tree | Leaf) -> None:
        """Keep the lengths of the lists that are about to be read, for leaves that lie in several."""
        rows = self.cursor.rows
        each = [np.broadcast_to(np.asarray(counts), rows.shape)]
        if array.shape:
            lists = np.cumprod((1, *array.shape[:-1]))
            each = [np.full((len(rows), many), size) for many, size in zip(lists, array.shape, strict=True)]
        for _, leaf in _leaves(wanted):
            if leaf.depth > 1:
                known = self.lengths.setdefault(leaf.info.path, [[] for _ in range(leaf.depth)])
                for level, values in zip(range(self.level, leaf.depth), each, strict=False):
                    known[level].append(Piece(rows=rows, values=values))

    def _counts(self, array: Array) -> int | Whole:
        """Elements in each message; what can't fit into the message is dropped before anything is allocated."""
        if array.length is not None:
            return array.length
        counts = self._length()
        if array.bound is not None:
            too_many = np.broadcast_to(counts > array.bound, len(self.cursor))
            counts = _kept(counts, self.cursor.drop(too_many, "an array exceeds its bound"))
        least = smallest_size(array.element, self.smallest)
        return _kept(counts, self.cursor.claim(counts * least, "an array"))

    def _numbers(self, dtype: np.dtype[np.generic], counts: int | Whole, wanted: Tree | Leaf | None) -> None:
        cursor = self.cursor
        self._align_nonempty(counts, dtype.itemsize)
        counts = _kept(counts, cursor.claim(counts * dtype.itemsize, "an array"))
        if wanted is not None and isinstance(counts, int):
            self._put(wanted, cursor.take_block(dtype, counts))
        elif wanted is not None:
            self._put(wanted, cursor.take_ragged(dtype, np.asarray(counts)), np.asarray(counts))
        cursor.advance(counts * dtype.itemsize)

    def _align_nonempty(self, counts: int | Whole, width: int) -> None:
        # Padding stands before an element, so an empty array has none.
        before = self.cursor.position
        self.cursor.align(self.layouts.alignment(width))
        if isinstance(counts, int):
            self.cursor.position = self.cursor.position if counts else before
        else:
            self.cursor.position = uniform(np.where(counts > 0, self.cursor.position, before))

    def _fixed_elements(self, element: FieldType, counts: int | Whole, wanted: Tree | Leaf | None) -> bool:
        """Read leaves out of an array whose elements all have one size; False where this isn't such a one."""
        layout = self.layouts.of(element)
        leaves = [] if wanted is None else list(_leaves(wanted))
        offsets = [element_offset(self.layouts, element, names) for names, _ in leaves]
        if layout is None or None in offsets:
            return False
        span = ElementSpan.of(self.cursor.position, layout, counts)
        kept = self.cursor.claim(span.total, "an array")
        if kept is not None:
            counts = _kept(counts, kept)
            span = ElementSpan.of(self.cursor.position, layout, counts)
        for (_, leaf), offset in zip(leaves, offsets, strict=True):
            if offset is not None:
                self._leaf_of_elements(leaf, span.leaf(offset), counts)
        self.cursor.advance(span.total)
        return True

    def _leaf_of_elements(self, leaf: Leaf, places: ElementPlaces, counts: int | Whole) -> None:
        kind = leaf.type.element if isinstance(leaf.type, Array) else leaf.type
        if isinstance(kind, Stamp):
            seconds = self._from_elements(kind.seconds, places, counts, 0)
            values: NDArray[np.generic] = _to_ns(seconds, self._from_elements(kind.nanoseconds, places, counts, 4))
        else:
            dtype = leaf.info.dtype or UINT8
            values = self._from_elements(dtype, places, counts, 0)
        self._put(leaf, values, None if isinstance(counts, int) else counts)

    def _from_elements(
        self, dtype: np.dtype[np.generic], places: ElementPlaces, counts: int | Whole, plus: int
    ) -> NDArray[np.generic]:
        first, later, step = places.first + plus, places.later + plus, places.step
        if isinstance(counts, int) and isinstance(first, int) and isinstance(step, int) and places.evenly_spaced:
            return self.cursor.take_block(dtype, counts, step=step, at=first)
        rows = len(self.cursor)
        each = np.full(rows, counts) if isinstance(counts, int) else counts
        values = self.cursor.take_ragged(dtype, each, step=step, first=first, later=later)
        return values.reshape(rows, counts) if isinstance(counts, int) else values

    def _texts(self, text: Text, counts: int | Whole, wanted: Tree | Leaf) -> None:
        """Measure an array of strings; it is put as one block of bytes, so equal lists are decoded once."""
        cursor = self.cursor
        cursor.align(self.layouts.alignment(4))
        before, start = cursor.rows, cursor.base + cursor.position
        self._each_element(text, counts, None)
        end = cursor.base + cursor.position
        start = start[np.searchsorted(before, cursor.rows)]
        self._put(wanted, np.stack([start, end - start], axis=1))

    def _each_element(self, element: FieldType, counts: int | Whole, wanted: Tree | Leaf | None) -> None:
        """Go through the elements one after another: element k of all messages that have one, at once."""
        for k in range(counts if isinstance(counts, int) else int(counts.max(initial=0))):
            if not len(self.cursor):
                return  # all were found bad on the way
            if self.steps_left == 0:
                wrong = np.broadcast_to(np.asarray(counts) > k, len(self.cursor))
                self.cursor.drop(wrong, f"more than {MAX_ELEMENT_STEPS} elements of varying size in a batch")
                return
            self.steps_left -= 1
            if isinstance(counts, int):
                self._element(element, wanted)
            else:
                counts = self._element_of_some(element, counts, k, wanted)

    def _element(self, element: FieldType, wanted: Tree | Leaf | None) -> None:
        if wanted is None:
            self.skip(element)
        else:
            self.read(element, wanted)

    def _element_of_some(self, element: FieldType, counts: Whole, k: int, wanted: Tree | Leaf | None) -> Whole:
        """Go through element `k` of the messages that have one; gives the counts of the messages still sound."""
        whole = self.cursor
        self.cursor = whole.subset(np.flatnonzero(counts > k))
        self._element(element, wanted)
        part, self.cursor = self.cursor, whole
        moved = np.broadcast_to(whole.position, len(whole)).copy()
        moved[np.searchsorted(whole.rows, part.rows)] = part.position
        whole.position = moved
        kept = whole.drop_bad()
        return counts if kept is None else counts[kept]


def _leaves(wanted: Tree | Leaf, names: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Leaf]]:
    """Leaves of a tree, each with the names that lead to it from there."""
    if isinstance(wanted, Leaf):
        yield names, wanted
    else:
        for name, below in wanted.items():
            yield from _leaves(below, (*names, name))


def _below(wanted: Tree | Leaf) -> Tree:
    return {} if isinstance(wanted, Leaf) else wanted


def _path(wanted: Tree | Leaf) -> str:
    return wanted.info.path if isinstance(wanted, Leaf) else ""


def _kept(values: int | Whole, kept: Mask | None) -> int | Whole:
    return values if kept is None or isinstance(values, int) else uniform(values[kept])


def _to_ns(seconds: NDArray[np.generic], nanoseconds: NDArray[np.generic]) -> Whole:
    return seconds.astype(np.int64) * 1_000_000_000 + nanoseconds.astype(np.int64)
