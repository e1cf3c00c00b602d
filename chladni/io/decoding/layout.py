"""Sizes of types that take the same number of bytes in each message, for every alignment of their start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chladni.io.decoding.schema import Array, Delimited, FieldType, Primitive, Record, Stamp, Text

if TYPE_CHECKING:
    from chladni.signals.arrays import Whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FixedLayout:
    """Size of a type without strings or counted arrays.

    In CDR the padding depends on where a value starts; only the start modulo the largest alignment inside matters.

    Parameters
    ----------
    sizes : tuple of int
        Bytes from a start at ``phase`` (modulo the length of this tuple) to the end, leading padding included.
    table : int64 array
        The same, to be indexed by many phases at once.
    """

    sizes: tuple[int, ...]
    table: Whole

    @property
    def alignment(self) -> int:
        """Largest alignment of anything inside."""
        return len(self.sizes)

    def at(self, position: int | Whole) -> int | Whole:
        """Bytes taken by a value that may start at `position`, for one position or for many."""
        phase = position & (len(self.sizes) - 1)
        return self.sizes[phase] if isinstance(phase, int) else self.table[phase]


class Layouts:
    """Layouts under one alignment rule, each computed once.

    Parameters
    ----------
    max_alignment : int
        8 for CDR; 1 where values follow each other without padding (ROS 1).
    """

    def __init__(self, max_alignment: int) -> None:
        self.max_alignment = max_alignment
        self._known: dict[FieldType, FixedLayout | None] = {}

    def of(self, kind: FieldType) -> FixedLayout | None:
        """Layout of a type, or None where its size differs from message to message."""
        if kind not in self._known:
            self._known[kind] = self._compute(kind)
        return self._known[kind]

    def alignment(self, width: int) -> int:
        """Alignment of a primitive `width` bytes wide."""
        return min(width, self.max_alignment)

    def _compute(self, kind: FieldType) -> FixedLayout | None:
        match kind:
            case Primitive(dtype=dtype):
                return self._padded(dtype.itemsize, self.alignment(dtype.itemsize))
            case Stamp():
                return self._padded(8, self.alignment(4))
            case Array(element=element, length=int() as length):
                layout = self.of(element)
                return None if layout is None else _repeated(layout, length)
            case Delimited(content=content):
                layout = self.of(content)
                return None if layout is None else _sequence([self._padded(4, self.alignment(4)), layout])
            case Record(members=members):
                parts = [self.of(member.type) for member in members]
                whole = [part for part in parts if part is not None]
                return _sequence(whole) if len(whole) == len(parts) else None
            case Text() | Array():
                return None

    def _padded(self, width: int, alignment: int) -> FixedLayout:
        return _fixed([-phase % alignment + width for phase in range(alignment)])


def element_offset(layouts: Layouts, kind: FieldType, names: tuple[str, ...]) -> FixedLayout | None:
    """Where a leaf lies inside a fixed type.

    Parameters
    ----------
    layouts : Layouts
    kind : FieldType
        A type with a fixed layout.
    names : tuple of str
        Member names from `kind` down to the leaf.

    Returns
    -------
    FixedLayout or None
        Its `sizes` are the offsets of the leaf's first byte for each phase of the start; None where an array lies
        on the way.
    """
    whole = layouts.of(kind)
    if whole is None:
        return None
    offsets = [_offset_from(layouts, kind, names, phase) for phase in range(whole.alignment)]
    known = [offset for offset in offsets if offset is not None]
    return _fixed(known) if len(known) == len(offsets) else None


def _offset_from(layouts: Layouts, kind: FieldType, names: tuple[str, ...], start: int) -> int | None:
    position = start
    kind, position = _past_delimiters(layouts, kind, position)
    for name in names:
        if not isinstance(kind, Record):
            return None
        for member in kind.members:
            if member.name == name:
                kind = member.type
                break
            part = layouts.of(member.type)
            position += part.sizes[position % part.alignment] if part is not None else 0
        kind, position = _past_delimiters(layouts, kind, position)
    if not isinstance(kind, Primitive | Stamp):
        return None
    width = 4 if isinstance(kind, Stamp) else kind.dtype.itemsize
    return position + -position % layouts.alignment(width) - start


def _past_delimiters(layouts: Layouts, kind: FieldType, position: int) -> tuple[FieldType, int]:
    while isinstance(kind, Delimited):
        kind, position = kind.content, position + -position % layouts.alignment(4) + 4
    return kind, position


def _fixed(sizes: list[int]) -> FixedLayout:
    return FixedLayout(sizes=tuple(sizes), table=np.array(sizes, np.int64))


def _sequence(parts: list[FixedLayout]) -> FixedLayout:
    alignment = max((part.alignment for part in parts), default=1)
    sizes = []
    for phase in range(alignment):
        position = phase
        for part in parts:
            position += part.sizes[position % part.alignment]
        sizes.append(position - phase)
    return _fixed(sizes)


def _repeated(element: FixedLayout, length: int) -> FixedLayout:
    # What follows the widest member inside an element has the same size in each, so all elements but the first
    # start at the same phase: a product replaces the loop over elements.
    sizes = []
    for phase in range(element.alignment):
        first = element.sizes[phase]
        later = element.sizes[(phase + first) % element.alignment]
        sizes.append(first + (length - 1) * later if length else 0)
    return _fixed(sizes)
