"""Decoder of protobuf messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from chladni.io.decoding.assemble import joined, scattered
from chladni.io.decoding.columns import Column, Decoded, outside_buffer, require_known
from chladni.io.decoding.found import Found, found_of, joined_column, nothing
from chladni.io.decoding.piece import Piece
from chladni.io.decoding.protobuf_schema import load_descriptor, record_of, zero_is_default
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
    from collections.abc import Callable, Iterable, Sequence

    from google.protobuf.descriptor import Descriptor
    from google.protobuf.message import Message
    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages
    from chladni.io.decoding.schema import FieldInfo, Leaf

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
        self._without_defaults = zero_is_default(descriptor)
        self.fields: tuple[FieldInfo, ...] = tuple(leaf.info for leaf in self._leaves.values())

    @classmethod
    def of_schema(cls, name: str, data: bytes) -> ProtobufDecoder:
        """Make a decoder from a serialised FileDescriptorSet."""
        return cls(load_descriptor(name, data))

    def informed_by(self, messages: EncodedMessages) -> ProtobufDecoder:
        """Give this decoder: the descriptors tell all fields."""
        del messages
        return self

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named; see `chladni.io.decoding.columns.Decoder`. What a message leaves out is 0."""
        require_known(paths, self.fields, schema_name=self.name)
        batch = _Batch(messages, [self._leaves[path] for path in paths], self._message_class)
        if self._templates_serve(batch.chosen):
            return batch.by_templates(self._descriptor)
        return batch.by_library()

    def _templates_serve(self, chosen: Sequence[Leaf]) -> bool:
        plain = self._without_defaults and all(is_plain(leaf) for leaf in chosen)
        return plain and packed_in_fixed_width(chosen, self._descriptor)


class _Batch:
    """Messages of one call and what was found wrong with them."""

    def __init__(self, messages: EncodedMessages, chosen: Sequence[Leaf], message_class: type[Message]) -> None:
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
            for leaf, one in zip(self.chosen, found, strict=True)
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
        for leaf, some, one in zip(self.chosen, pieces, alone, strict=True):
            some.append(Piece(rows=rows, values=np.asarray(one.values), counts=one.counts))
            columns[leaf.info.path] = self._column(leaf, some)
        return Decoded(columns=columns, bad=self.bad, reasons=dict(self.reasons))

    def _column(self, leaf: Leaf, pieces: list[Piece]) -> Column:
        if not isinstance(leaf.type, Array):
            return Column(values=scattered(pieces, len(self.bad)))
        values, counts = joined(pieces, self.bad, empty=np.empty(0, leaf.info.dtype))
        return Column(values=values, counts=counts)

    def _by_template(
        self, rows: NDArray[np.intp], descriptor: Descriptor, pieces: list[list[Piece]]
    ) -> NDArray[np.bool_]:
        """Read all messages that have the layout of the first one; tells which those are."""
        done = np.zeros(len(rows), np.bool_)
        content = self._content(int(rows[0]))
        wanted = {names: isinstance(leaf.type, Array) for leaf in self.chosen for names in _slots_of(leaf)}
        try:
            self.message_class.FromString(content)
            template = Template(content, descriptor, wanted)
        except (self._decode_error(), UnfitError):
            return done
        alike = np.flatnonzero(self.messages.lengths[rows] == len(content))
        table = self._table(self.messages.offsets[rows[alike]], len(content))
        fits = template.fitting(table)
        for leaf in self.chosen:
            if isinstance(leaf.type, Stamp):
                # Exact arithmetic, which finds an overflow, is the library's way.
                seconds = read_slot(table, template.slots.get((*leaf.names, "seconds")), leaf.type.seconds).astype(
                    np.int64
                )
                fits &= (seconds > -LARGEST_TIME_S) & (seconds < LARGEST_TIME_S)
        done[alike[fits]] = True
        table, taken = table[fits], rows[done]
        for leaf, some in zip(self.chosen, pieces, strict=True):
            some.append(Piece(rows=taken, values=_from_template(table, template, leaf)))
        return done

    def _table(self, offsets: NDArray[np.int64], length: int) -> NDArray[np.uint8]:
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

    def _read(self, rows: NDArray[np.intp]) -> list[Found]:
        """Read messages one by one; bad ones are marked and give nothing."""
        decode_error = self._decode_error()
        readers = [_reader(leaf) for leaf in self.chosen]
        values = []
        for index in rows.tolist():
            try:
                message = self.message_class.FromString(self._content(index))
                values.append([read(message) for read in readers])
            except decode_error:
                self._mark(index, "not a protobuf message of this type")
            except OverflowError:
                self._mark(index, _TIME_OVERFLOW)
        return [found_of(leaf, [one[i] for one in values]) for i, leaf in enumerate(self.chosen)]

    def _mark(self, index: int, reason: str) -> None:
        self.bad[index] = True
        self.reasons[reason] += 1


def _slots_of(leaf: Leaf) -> list[tuple[str, ...]]:
    if isinstance(leaf.type, Stamp):
        return [(*leaf.names, "seconds"), (*leaf.names, "nanos")]
    return [leaf.names]


def _from_template(table: NDArray[np.uint8], template: Template, leaf: Leaf) -> NDArray[np.generic]:
    slots = [template.slots.get(names) for names in _slots_of(leaf)]
    if isinstance(leaf.type, Stamp):
        seconds = read_slot(table, slots[0], leaf.type.seconds)
        nanoseconds = read_slot(table, slots[1], leaf.type.nanoseconds)
        total: NDArray[np.int64] = seconds.astype(np.int64) * 1_000_000_000 + nanoseconds.astype(np.int64)
        return total
    dtype = leaf.info.dtype or np.dtype(np.uint8)
    return (read_block if isinstance(leaf.type, Array) else read_slot)(table, slots[0], dtype)


def _reader(leaf: Leaf) -> Callable[[Message], Sequence[object]]:
    """Function that gives the values of a leaf in one message: one, or, below a list of messages, any number."""
    if any(leaf.lists) or not isinstance(leaf.type, Primitive | Text):
        return partial(_values, leaf=leaf)
    # The common case: plain numbers, reached by attributes alone.
    reach = attrgetter(".".join(leaf.names))
    return lambda message: (reach(message),)


def _values(message: Message, leaf: Leaf) -> Sequence[object]:
    places: list[object] = [message]
    for name, lists in zip(leaf.names, leaf.lists, strict=True):
        below = [getattr(place, name) for place in places]
        places = [element for one in below for element in _elements(one)] if lists else below
    return [_value(place, leaf.type) for place in places]


class _Entry(NamedTuple):
    """Entry of a map; its names are the ones that the wire and the schema give."""

    key: object
    value: object


def _elements(field: Iterable[object]) -> Iterable[object]:
    if isinstance(field, Mapping):
        return [_Entry(key, value) for key, value in field.items()]
    return field


def _value(found: object, kind: FieldType) -> object:
    match kind:
        case Array() if isinstance(found, bytes):
            return np.frombuffer(found, np.uint8)
        case Array(element=element):
            return tuple(_value(one, element) for one in cast("Iterable[object]", found))
        case Stamp():
            return _nanoseconds(found)
        case _:
            return found


def _nanoseconds(stamp: Any) -> int:
    whole: int = stamp.seconds * 1_000_000_000 + stamp.nanos
    if whole not in _INT64:
        raise OverflowError(whole)
    return whole
