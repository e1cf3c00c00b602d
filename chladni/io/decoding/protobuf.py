"""Decoder of protobuf messages."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from functools import partial
from operator import attrgetter, itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from chladni.io.decoding.assemble import joined, scattered
from chladni.io.decoding.columns import Column, Decoded, outside_buffer, require_known
from chladni.io.decoding.found import Found, Row, found_of, joined_column, nothing
from chladni.io.decoding.piece import Piece
from chladni.io.decoding.protobuf_schema import fields_of, has_no_defaults, load_descriptor, record_of
from chladni.io.decoding.protobuf_template import (
    Template,
    UnfitError,
    is_plain,
    packed_in_fixed_width,
    read_block,
    read_slot,
)
from chladni.io.decoding.schema import Array, FieldType, Primitive, Stamp, Text, leaves

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from google.protobuf.descriptor import Descriptor, FieldDescriptor
    from google.protobuf.message import Message
    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages
    from chladni.io.decoding.protobuf_template import Slot
    from chladni.io.decoding.schema import FieldInfo, Leaf
    from chladni.signals.arrays import Bytes, Index, Mask, Whole

MAX_TEMPLATES: Final = 16
"""Layouts tried in a batch before the remaining messages are read one by one."""

LARGEST_TIME_S: Final = 9_000_000_000
"""Seconds (the year 2255) beyond which nanoseconds come near the end of 64 bits."""

_TIME_OVERFLOW: Final = "a time exceeds 64 bits of nanoseconds"
_INT64: Final = range(-(2**63), 2**63)


class ProtobufDecoder:
    """Reads columns out of protobuf messages.

    Parameters
    ----------
    descriptor : google.protobuf.descriptor.Descriptor
        The message type, in a pool of its own.
    """

    def __init__(self, descriptor: Descriptor) -> None:
        from google.protobuf import message_factory

        self.name = descriptor.full_name
        self._leaves = {leaf.info.path: leaf for leaf in leaves(record_of(descriptor))}
        self._descriptor = descriptor
        self._message_class: type[Message] = message_factory.GetMessageClass(descriptor)
        self._without_defaults = has_no_defaults(descriptor)
        self.unread: Mapping[str, str] = {}
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in self._leaves.values())

    @classmethod
    def of_schema(cls, name: str, data: bytes) -> ProtobufDecoder:
        """Make a decoder from a serialised FileDescriptorSet."""
        return cls(load_descriptor(name, data))

    def informed_by(self, heads: Sequence[EncodedMessages]) -> ProtobufDecoder:
        """Give this decoder: the descriptors tell all fields."""
        del heads
        return self

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named; see `chladni.io.decoding.columns.Decoder`.

        Of what a message leaves out, a field with presence (`optional`, in a oneof, of proto2, or inside a message
        that isn't there) is missing, NaN, unless the descriptor gives it a default. One without presence is 0: that
        is how proto3 writes zero.
        """
        require_known(paths, self.fields, schema_name=self.name)
        chosen = [_Chosen(self._leaves[path], fields_of(self._leaves[path], self._descriptor)) for path in paths]
        batch = _Batch(messages, chosen, self._message_class)
        if self._templates_serve([one.leaf for one in chosen]):
            return batch.by_templates(self._descriptor)
        return batch.by_library()

    def _templates_serve(self, chosen: Sequence[Leaf]) -> bool:
        plain = self._without_defaults and all(is_plain(leaf) for leaf in chosen)
        return plain and packed_in_fixed_width(chosen, self._descriptor)


class _Chosen(NamedTuple):
    """A leaf that is asked for, and the fields that lead to it."""

    leaf: Leaf
    fields: tuple[FieldDescriptor, ...]


class _Batch:
    """Messages of one call and what was found wrong with them."""

    def __init__(self, messages: EncodedMessages, chosen: Sequence[_Chosen], message_class: type[Message]) -> None:
        self.messages = messages
        self.chosen = chosen
        self.message_class = message_class
        self.bad = outside_buffer(messages)
        self.reasons: Counter[str] = Counter()
        if self.bad.any():
            self.reasons["the message lies outside the data"] += int(self.bad.sum())

    def by_library(self) -> Decoded:
        """Decode message by message."""
        found = self._read(np.flatnonzero(~self.bad))
        columns = {
            leaf.info.path: joined_column([one], self.bad, empty=nothing(leaf))
            for (leaf, _), one in zip(self.chosen, found, strict=True)
        }
        return Decoded(columns=columns, bad=self.bad, reasons=dict(self.reasons))

    def by_templates(self, descriptor: Descriptor) -> Decoded:
        """Decode messages that share a layout at once, and the rest one by one."""
        pieces: list[list[Piece]] = [[] for _ in self.chosen]
        rows, aside = np.flatnonzero(~self.bad), []
        for _ in range(MAX_TEMPLATES):
            if not len(rows):
                break
            done = self._by_template(rows, descriptor, pieces)
            if not done[0]:
                aside.append(int(rows[0]))
                done[0] = True
            rows = rows[~done]
        rows = np.sort(np.append(rows, np.array(aside, rows.dtype)))
        alone = self._read(rows)
        rows = rows[~self.bad[rows]]
        columns = {}
        for (leaf, _), some, one in zip(self.chosen, pieces, alone, strict=True):
            some.append(Piece(rows=rows, values=np.asarray(one.values), counts=one.counts))
            columns[leaf.info.path] = self._column(leaf, some)
        return Decoded(columns=columns, bad=self.bad, reasons=dict(self.reasons))

    def _column(self, leaf: Leaf, pieces: list[Piece]) -> Column:
        if not isinstance(leaf.type, Array):
            return Column(values=scattered(pieces, len(self.bad)))
        values, counts = joined(pieces, self.bad, empty=np.empty(0, leaf.info.dtype))
        return Column(values=values, counts=counts)

    def _by_template(self, rows: Index, descriptor: Descriptor, pieces: list[list[Piece]]) -> Mask:
        """Read all messages that have the layout of the first one; tells which those are."""
        done = np.zeros(len(rows), np.bool_)
        content = self._content(int(rows[0]))
        wanted = {names: isinstance(leaf.type, Array) for leaf, _ in self.chosen for names in _slots_of(leaf)}
        try:
            self.message_class.FromString(content)
            template = Template(content, descriptor, wanted)
        except (self._decode_error(), UnfitError):
            return done
        alike = np.flatnonzero(self.messages.lengths[rows] == len(content))
        table = self._table(self.messages.offsets[rows[alike]], len(content))
        fits = template.fitting(table)
        for leaf, _ in self.chosen:
            slot = template.slots.get((*leaf.names, "seconds"))
            if isinstance(leaf.type, Stamp) and slot is not None:
                # Exact arithmetic, which finds an overflow, is the library's way.
                seconds = read_slot(table, slot, leaf.type.seconds).astype(np.int64)
                fits &= (seconds > -LARGEST_TIME_S) & (seconds < LARGEST_TIME_S)
        done[alike[fits]] = True
        table, taken = table[fits], rows[done]
        for one, some in zip(self.chosen, pieces, strict=True):
            some.append(Piece(rows=taken, values=_from_template(table, template, one)))
        return done

    def _table(self, offsets: Whole, length: int) -> Bytes:
        if not length:
            return np.empty((len(offsets), 0), np.uint8)
        buffer = self.messages.buffer
        everywhere = np.ndarray((buffer.size - length + 1,), f"V{length}", buffer, 0, (1,))
        return everywhere[offsets].view(np.uint8).reshape(len(offsets), length)

    def _content(self, index: int) -> bytes:
        start, length = int(self.messages.offsets[index]), int(self.messages.lengths[index])
        return self.messages.buffer[start : start + length].tobytes()

    @staticmethod
    def _decode_error() -> type[Exception]:
        from google.protobuf.message import DecodeError

        error: type[Exception] = DecodeError
        return error

    def _read(self, rows: Index) -> list[Found]:
        """Read messages one by one; bad ones are marked and give nothing."""
        decode_error = self._decode_error()
        readers = [_reader(one) for one in self.chosen]
        values = []
        for index in rows.tolist():
            try:
                message = self.message_class.FromString(self._content(index))
                values.append([read(message) for read in readers])
            except decode_error:
                self._mark(index, "not a protobuf message of this type")
            except UnicodeError:
                self._mark(index, "a string isn't UTF-8")
            except OverflowError:
                self._mark(index, _TIME_OVERFLOW)
        return [found_of(leaf, [one[i] for one in values]) for i, (leaf, _) in enumerate(self.chosen)]

    def _mark(self, index: int, reason: str) -> None:
        self.bad[index] = True
        self.reasons[reason] += 1


def _slots_of(leaf: Leaf) -> list[tuple[str, ...]]:
    if isinstance(leaf.type, Stamp):
        return [(*leaf.names, "seconds"), (*leaf.names, "nanos")]
    return [leaf.names]


def _from_template(table: Bytes, template: Template, chosen: _Chosen) -> NDArray[np.generic]:
    leaf, fields = chosen
    above = leaf.names if isinstance(leaf.type, Stamp) else leaf.names[:-1]
    inside = all(above[:depth] in template.entered for depth in range(1, len(above) + 1))
    slots = [template.slots.get(names) for names in _slots_of(leaf)]
    dtype = leaf.info.dtype or np.dtype(np.uint8)
    if isinstance(leaf.type, Array):
        return np.zeros((len(table), 0), dtype) if slots[0] is None else read_block(table, slots[0], dtype)
    if slots[0] is None and _is_missing(leaf, fields[-1], inside=inside):
        return np.full(len(table), np.nan, np.promote_types(dtype, np.float32))
    if isinstance(leaf.type, Stamp):
        types = leaf.type.seconds, leaf.type.nanoseconds
        seconds, rest = (_read(table, slot, one).astype(np.int64) for slot, one in zip(slots, types, strict=True))
        total: Whole = seconds * 1_000_000_000 + rest
        return total
    return _read(table, slots[0], dtype)


def _is_missing(leaf: Leaf, field: FieldDescriptor, *, inside: bool) -> bool:
    """Whether a leaf that a message leaves out, or not `inside` of one that is there, isn't zero but missing."""
    if isinstance(leaf.type, Stamp):
        return leaf.type.kind == "duration" and not inside
    return field.has_presence or not inside


def _read(table: Bytes, slot: Slot | None, dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    return np.zeros(len(table), dtype) if slot is None else read_slot(table, slot, dtype)


def _reader(chosen: _Chosen) -> Callable[[Message], Row]:
    """Function that gives the values of a leaf in one message: one, or, below a list of messages, any number."""
    leaf, fields = chosen
    if any(leaf.lists) or not isinstance(leaf.type, Primitive):
        return partial(_values, chosen=chosen)
    # The common case: plain numbers, reached by attributes alone.
    if not any(map(_is_optional, fields)):
        reach = attrgetter(".".join(leaf.names))
        return lambda message: Row(values=[reach(message)])
    way = [(field.name, _is_optional(field)) for field in fields]
    missing = Row(values=[_value(None, leaf.type)])

    def read(message: Any) -> Row:
        for name, optional in way:
            if optional and not message.HasField(name):
                return missing
            message = getattr(message, name)
        return Row(values=[message])

    return read


def _is_optional(field: FieldDescriptor) -> bool:
    """Whether a field that a message leaves out has no value at all."""
    return field.has_presence and not field.has_default_value


def _values(message: Message, chosen: _Chosen) -> Row:
    row = Row(values=[message])
    for field, lists in zip(chosen.fields, chosen.leaf.lists, strict=True):
        row.values = [_member(place, field) for place in row.values]
        if lists:
            row.open([_elements(one) for one in row.values])
    row.values = [_value(place, chosen.leaf.type) for place in row.values]
    return row


def _member(place: Any, field: FieldDescriptor) -> object:
    """Value of a field; None where it's missing."""
    if place is None:
        return None
    # Entries of a map have a key and a value, always.
    absent = _is_optional(field) and not isinstance(place, _Entry) and not place.HasField(field.name)
    return None if absent else getattr(place, field.name)


class _Entry(NamedTuple):
    """Entry of a map; its names are the ones that the wire and the schema give."""

    key: object
    value: object


def _elements(field: object) -> Sequence[object]:
    if isinstance(field, Mapping):
        # The library gives them in any order.
        return [_Entry(key, value) for key, value in sorted(field.items(), key=itemgetter(0))]
    return () if field is None else cast("Sequence[object]", field)


def _value(found: object, kind: FieldType) -> object:
    match kind:
        case Array() if isinstance(found, bytes):
            return np.frombuffer(found, np.uint8)
        case Array(element=element):
            return tuple(_value(one, element) for one in _elements(found))
        case Stamp(kind="time") if found is None:
            return 0  # no time at all, as one that nobody set
        case Text() if found is None:
            return ""
        case Text() if isinstance(found, bytes):
            raise UnicodeError(found)  # proto2 lets any bytes pass for a string
        case _ if found is None:
            return math.nan
        case Stamp():
            return _nanoseconds(found)
        case _:
            return found


def _nanoseconds(stamp: Any) -> int:
    whole: int = stamp.seconds * 1_000_000_000 + stamp.nanos
    if whole not in _INT64:
        raise OverflowError(whole)
    return whole
