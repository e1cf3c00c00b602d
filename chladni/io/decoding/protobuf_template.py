"""Protobuf messages that share one layout, read as columns.

A sensor's messages mostly carry the same fields in the same order, so tags and lengths stand at the same places and
hold the same bytes in all of them. The first message gives a template: which bytes must be equal (tags, lengths),
of which only the top bit must be (varints: it sets their length), and which are free (values). Messages that fit it
are read by strided views; all others are left to the protobuf library.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.schema import Array, Leaf, Primitive, Stamp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from google.protobuf.descriptor import Descriptor, FieldDescriptor
    from numpy.typing import NDArray

    from chladni.signals.arrays import Bytes, Mask

VARINT: Final = 0
LENGTH: Final = 2
_FIXED: Final = {1: 8, 5: 4}
# Which wire type a singular field of each type has (types by the numbers of descriptor.proto).
_WIRE_OF: Final = {
    1: 1, 6: 1, 16: 1, 2: 5, 7: 5, 15: 5, 3: 0, 4: 0, 5: 0, 8: 0, 13: 0, 14: 0, 17: 0, 18: 0, 9: 2, 11: 2, 12: 2,
}  # fmt: skip
_ZIGZAG: Final = (17, 18)
_BYTES: Final = 12
_TOP_BIT: Final = 0x80


class UnfitError(Exception):
    """A message, or what is asked of it, that no template can describe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """Where a value stands: first byte, number of bytes, and the field it belongs to."""

    at: int
    width: int
    field: FieldDescriptor


def is_plain(leaf: Leaf) -> bool:
    """Whether templates can serve a leaf: a number, a time, or an array of numbers that isn't within a list."""
    kind = leaf.type.element if isinstance(leaf.type, Array) else leaf.type
    return not any(leaf.lists) and (isinstance(kind, Primitive) or isinstance(leaf.type, Stamp))


class Template:
    """Layout of one message.

    Parameters
    ----------
    content : bytes
        The message.
    descriptor : google.protobuf.descriptor.Descriptor
    wanted : dict of tuple of str to bool
        Names that lead to the fields asked for, and whether each is an array.

    Attributes
    ----------
    slots : dict
        Where each field asked for stands, by its names; those that the message leaves out have none.
    entered : set of tuple of str
        Names that lead to the messages inside this one, of those that may hold a field asked for.

    Raises
    ------
    UnfitError
        If the message is malformed, repeats a field asked for, or has it in an unusual form.
    """

    def __init__(self, content: bytes, descriptor: Descriptor, wanted: dict[tuple[str, ...], bool]) -> None:
        self.content = np.frombuffer(content, np.uint8)
        self.mask = np.zeros(len(content), np.uint8)
        self.slots: dict[tuple[str, ...], Slot] = {}
        self.entered: set[tuple[str, ...]] = set()
        self._bytes = content
        self._wanted = wanted
        self._above = {names[:depth] for names in wanted for depth in range(1, len(names))}
        self._scan(0, len(content), descriptor, ())

    def fitting(self, rows: Bytes) -> Mask:
        """Messages that have this layout.

        Parameters
        ----------
        rows : uint8 array [message, byte]
            Of the length of this one.
        """
        fixed = np.flatnonzero(self.mask)
        differing = (rows[:, fixed] ^ self.content[fixed]) & self.mask[fixed]
        fits: Mask = np.logical_not(differing.any(axis=1))
        return fits

    def _varint(self, place: int, end: int) -> tuple[int, int]:
        value = 0
        for used in range(10):
            if place + used >= end:
                raise UnfitError
            byte = self._bytes[place + used]
            value |= (byte & 0x7F) << (7 * used)
            if byte < _TOP_BIT:
                return value, place + used + 1
        raise UnfitError

    def _scan(self, place: int, end: int, descriptor: Descriptor, names: tuple[str, ...]) -> None:
        seen: set[int] = set()
        while place < end:
            start = place
            tag, place = self._varint(place, end)
            number, wire = tag >> 3, tag & 7
            field = descriptor.fields_by_number.get(number)
            place = self._value(start, place, end, wire, field, names, again=number in seen)
            seen.add(number)

    def _value(
        self, start: int, place: int, end: int, wire: int, field: FieldDescriptor | None,
        names: tuple[str, ...], *, again: bool,
    ) -> int:  # fmt: skip
        """Pass over one value; gives the place after it."""
        self.mask[start:place] = 0xFF
        first = place
        if wire == VARINT:
            _, place = self._varint(place, end)
            self.mask[first:place] = _TOP_BIT
            # A tenth byte may hold one bit only; equal to the first message's it is as sound as that.
            self.mask[first + 9 : place] = 0xFF
        elif wire in _FIXED:
            place += _FIXED[wire]
        elif wire == LENGTH:
            length, first = self._varint(place, end)
            self.mask[place:first] = 0xFF
            place = first + length
        else:
            raise UnfitError
        if place > end:
            raise UnfitError
        if field is not None:
            self._enter(Slot(at=first, width=place - first, field=field), (*names, field.name), wire, again=again)
        return place

    def _enter(self, slot: Slot, names: tuple[str, ...], wire: int, *, again: bool) -> None:
        if names not in self._wanted and names not in self._above:
            return
        packed = wire == LENGTH and _WIRE_OF.get(slot.field.type) in _FIXED and self._wanted.get(names, False)
        oneof = slot.field.containing_oneof
        if again or (oneof is not None and len(oneof.fields) > 1):
            raise UnfitError  # the last one of several counts
        if packed and slot.width % _FIXED[_WIRE_OF[slot.field.type]]:
            raise UnfitError
        if not packed and wire != _WIRE_OF.get(slot.field.type):
            raise UnfitError
        if names in self._wanted:
            self.slots[names] = slot
        else:
            self.entered.add(names)
            self._scan(slot.at, slot.at + slot.width, slot.field.message_type, names)


def read_slot(rows: Bytes, slot: Slot, dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    """Read a number a message.

    Parameters
    ----------
    rows : uint8 array [message, byte]
    slot : Slot
    dtype : numpy.dtype

    Returns
    -------
    ndarray [message]
    """
    if _WIRE_OF[slot.field.type] in _FIXED:
        return read_block(rows, slot, dtype)[:, 0]
    value = np.zeros(len(rows), np.uint64)
    for k in range(slot.width):
        value |= (rows[:, slot.at + k] & 0x7F).astype(np.uint64) << np.uint64(7 * k)
    if slot.field.type in _ZIGZAG:
        # The narrow type keeps the low 32 bits, as the library does.
        value = value if dtype.itemsize == 8 else value & np.uint64(0xFFFFFFFF)
        value = (value >> np.uint64(1)) ^ (~(value & np.uint64(1)) + np.uint64(1))
    return value.astype(np.bool_) if dtype == np.bool_ else value.view(np.int64).astype(dtype)


def read_block(rows: Bytes, slot: Slot, dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    """Read an array of numbers of fixed width from each message.

    Returns
    -------
    ndarray [message, element]
    """
    content = np.ascontiguousarray(rows[:, slot.at : slot.at + slot.width])
    return content.view(dtype.newbyteorder("<")).astype(dtype, copy=False)


def packed_in_fixed_width(leaves: Sequence[Leaf], descriptor: Descriptor) -> bool:
    """Whether all arrays asked for are ones of fixed-width numbers or bytes."""
    return all(_is_fixed(leaf, descriptor) for leaf in leaves if isinstance(leaf.type, Array))


def _is_fixed(leaf: Leaf, descriptor: Descriptor) -> bool:
    *above, last = leaf.names
    for name in above:
        descriptor = descriptor.fields_by_name[name].message_type
    kind = descriptor.fields_by_name[last].type
    return kind == _BYTES or _WIRE_OF[kind] in _FIXED
