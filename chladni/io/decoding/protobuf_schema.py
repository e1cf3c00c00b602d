"""Protobuf message types: from a serialised FileDescriptorSet to the types of `schema`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.schema import MAX_NESTING, Array, FieldType, Member, Primitive, Record, Stamp, Text
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from google.protobuf.descriptor import Descriptor, FieldDescriptor
    from google.protobuf.descriptor_pb2 import FileDescriptorProto
    from google.protobuf.descriptor_pool import DescriptorPool

    from chladni.io.decoding.schema import Leaf

_INT64: Final = np.dtype(np.int64)
_INT32: Final = np.dtype(np.int32)
STAMPS: Final = {
    "google.protobuf.Timestamp": Stamp(kind="time", seconds=_INT64, nanoseconds=_INT32),
    "google.protobuf.Duration": Stamp(kind="duration", seconds=_INT64, nanoseconds=_INT32),
}
# By the numbers that descriptor.proto gives to types (FieldDescriptorProto.Type).
_PRIMITIVES: Final = {
    1: np.float64, 2: np.float32, 3: np.int64, 4: np.uint64, 5: np.int32, 6: np.uint64, 7: np.uint32, 8: np.bool_,
    13: np.uint32, 14: np.int32, 15: np.int32, 16: np.int64, 17: np.int32, 18: np.int64,
}  # fmt: skip
_STRING: Final = 9
_BYTES: Final = 12
_REPEATED: Final = 3
MAX_FILES: Final = 2000
"""Most files in a descriptor set."""


def load_descriptor(name: str, data: bytes) -> Descriptor:
    """Find a message type in a serialised FileDescriptorSet.

    Parameters
    ----------
    name : str
        Full name, such as ``foxglove.Vector3``.
    data : bytes

    Raises
    ------
    LogError
        If the set is malformed, incomplete, or doesn't hold the type.
    """
    from google.protobuf import descriptor_pb2, descriptor_pool
    from google.protobuf.message import DecodeError

    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(data).file
    except DecodeError as error:
        raise LogError(f"schema {name!r}: not a protobuf FileDescriptorSet ({error})") from error
    if len(files) > MAX_FILES:
        raise LogError(f"schema {name!r}: {len(files)} files in the descriptor set, more than {MAX_FILES}")
    pool = descriptor_pool.DescriptorPool()
    waiting = {file.name: file for file in files}
    try:
        while waiting:
            _add(pool, waiting, next(iter(waiting)), ())
        descriptor: Descriptor = pool.FindMessageTypeByName(name)
    except (TypeError, KeyError, ValueError) as error:
        raise LogError(f"schema {name!r}: the descriptor set can't be used ({str(error).strip()[:200]})") from error
    return descriptor


def _add(
    pool: DescriptorPool, waiting: dict[str, FileDescriptorProto], file_name: str, above: tuple[str, ...]
) -> None:
    """Add a file after those it imports; sets should come in that order, but don't always."""
    if file_name in above or len(above) > MAX_NESTING:
        raise ValueError(f"{file_name} imports itself, or imports are nested deeper than {MAX_NESTING}")
    file = waiting[file_name]
    for needed in file.dependency:
        if needed in waiting:
            _add(pool, waiting, needed, (*above, file_name))
    pool.Add(waiting.pop(file_name))


def record_of(descriptor: Descriptor) -> Record:
    """Translate a message type.

    A field through which a type holds itself (as google.protobuf.Value does) has no finite list of leaves: it is
    left out, and everything beside it stays readable.

    Parameters
    ----------
    descriptor : google.protobuf.descriptor.Descriptor

    Returns
    -------
    Record
    """
    return _Translator().record(descriptor, ())


def _repeated(descriptor: Descriptor) -> set[str]:
    # The descriptors of protobuf 5 and 7 have no attribute in common that tells this; their serialised form does.
    from google.protobuf.descriptor_pb2 import DescriptorProto

    proto = DescriptorProto()
    descriptor.CopyToProto(proto)
    return {field.name for field in proto.field if field.label == _REPEATED}


def fields_of(leaf: Leaf, descriptor: Descriptor) -> tuple[FieldDescriptor, ...]:
    """Fields that lead from a message to a leaf, that of the leaf included."""
    found: list[FieldDescriptor] = []
    for name in leaf.names:
        found.append(descriptor.fields_by_name[name])
        descriptor = found[-1].message_type
    return tuple(found)


def has_no_defaults(descriptor: Descriptor) -> bool:
    """Whether no field of this message, or of a message in it, has a default other than zero, and none is required.

    That is so in proto3; elsewhere only the library knows what an absent field means.
    """
    from google.protobuf.descriptor_pb2 import FileDescriptorProto

    waiting, seen = [descriptor], set()
    while waiting:
        one = waiting.pop()
        if one.full_name in seen:
            continue
        seen.add(one.full_name)
        file = FileDescriptorProto()
        one.file.CopyToProto(file)
        if file.syntax != "proto3":
            return False
        waiting += [field.message_type for field in one.fields if field.message_type is not None]
    return True


class _Translator:
    def __init__(self) -> None:
        self.done: dict[str, Record] = {}

    def record(self, descriptor: Descriptor, above: tuple[str, ...]) -> Record:
        # What is left out depends on the way down only for types that hold themselves, and those are cut at the
        # first return; one record a type is enough.
        if descriptor.full_name not in self.done:
            inside = (*above, descriptor.full_name)
            repeated = _repeated(descriptor)
            found = [(one.name, self.member(one, one.name in repeated, inside)) for one in descriptor.fields]
            members = tuple(Member(name=name, type=kind) for name, kind in found if kind is not None)
            self.done[descriptor.full_name] = Record(name=descriptor.full_name, members=members)
        return self.done[descriptor.full_name]

    def member(self, field: FieldDescriptor, repeated: bool, above: tuple[str, ...]) -> FieldType | None:
        kind = self.single(field, above)
        return Array(element=kind) if kind is not None and repeated else kind

    def single(self, field: FieldDescriptor, above: tuple[str, ...]) -> FieldType | None:
        if field.type in _PRIMITIVES:
            return Primitive(dtype=np.dtype(_PRIMITIVES[field.type]))
        if field.type == _STRING:
            return Text()
        if field.type == _BYTES:
            return Array(element=Primitive(dtype=np.dtype(np.uint8)))
        name = field.message_type.full_name
        if name in STAMPS:
            return STAMPS[name]
        return None if name in above or len(above) > MAX_NESTING else self.record(field.message_type, above)
