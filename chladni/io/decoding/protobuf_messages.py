"""Decoder of protobuf messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from chladni.io.decoding.columns import Decoded, outside_buffer, require_known
from chladni.io.decoding.found import found_of, joined_column, nothing
from chladni.io.decoding.protobuf_schema import load_descriptor, record_of
from chladni.io.decoding.schema import Array, FieldType, Primitive, Stamp, Text, leaves

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from google.protobuf.descriptor import Descriptor
    from google.protobuf.message import Message
    from numpy.typing import NDArray

    from chladni.io.decoding.columns import EncodedMessages
    from chladni.io.decoding.schema import FieldInfo, Leaf

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
        self._new = message_factory.GetMessageClass(descriptor)
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
        bad = outside_buffer(messages)
        reasons: Counter[str] = Counter()
        if bad.any():
            reasons["the message lies outside the data"] += int(bad.sum())
        chosen = [self._leaves[path] for path in paths]
        rows = self._rows(messages, chosen, bad, reasons)
        columns = {
            leaf.info.path: joined_column([found_of(leaf, [row[i] for row in rows])], bad, empty=nothing(leaf))
            for i, leaf in enumerate(chosen)
        }
        return Decoded(columns=columns, bad=bad, reasons=dict(reasons))

    def _rows(
        self, messages: EncodedMessages, chosen: Sequence[Leaf], bad: NDArray[np.bool_], reasons: Counter[str]
    ) -> list[list[Sequence[object]]]:
        from google.protobuf.message import DecodeError

        readers = [_reader(leaf) for leaf in chosen]
        rows = []
        for index in np.flatnonzero(~bad).tolist():
            start, length = int(messages.offsets[index]), int(messages.lengths[index])
            try:
                message = self._new.FromString(messages.buffer[start : start + length].tobytes())
                rows.append([read(message) for read in readers])
            except DecodeError:
                bad[index] = True
                reasons["not a protobuf message of this type"] += 1
            except OverflowError:
                bad[index] = True
                reasons["a time exceeds 64 bits of nanoseconds"] += 1
        return rows


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
