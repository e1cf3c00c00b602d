"""Channels and schemas of a log, as its records define them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from chladni.io.mcap.limits import Limits
from chladni.io.mcap.records import FieldReader, MalformedRecordError, Opcode


@dataclass(frozen=True, slots=True, kw_only=True)
class McapSchema:
    """How the messages of a channel are laid out: ``data`` is text or binary after ``encoding``."""

    id: int
    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class McapChannel:
    """A stream of messages of one schema on one topic; several channels may share a topic."""

    id: int
    topic: str
    message_encoding: str
    metadata: Mapping[str, str]
    schema: McapSchema | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _ChannelRecord:
    """A Channel as recorded, before its schema is looked up."""

    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: Mapping[str, str]


def _parse_schema(content: bytes) -> McapSchema:
    fields = FieldReader(content)
    return McapSchema(id=fields.uint16(), name=fields.string(), encoding=fields.string(), data=bytes(fields.blob()))


def _parse_channel(content: bytes) -> _ChannelRecord:
    fields = FieldReader(content)
    return _ChannelRecord(
        id=fields.uint16(),
        schema_id=fields.uint16(),
        topic=fields.string(),
        message_encoding=fields.string(),
        metadata=MappingProxyType(fields.string_map()),
    )


class ChannelRegistry:
    """Collects Schema and Channel records; the first definition of an id stands."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._bytes = 0
        self._schemas: dict[int, McapSchema] = {}
        self._records: dict[int, _ChannelRecord] = {}
        self._channels: dict[int, McapChannel] = {}
        # Logs repeat their definitions in many chunks; the same bytes need no second look.
        self._known: set[bytes] = set()

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """The channels by id."""
        return MappingProxyType(self._channels)

    def undefined_schemas(self) -> dict[int, int]:
        """Return the schema id that each channel names but the log doesn't define."""
        return {
            record.id: record.schema_id
            for record in self._records.values()
            if record.schema_id and record.schema_id not in self._schemas
        }

    def define(self, opcode: int, content: bytes) -> frozenset[int]:
        """Add a Schema or Channel record.

        Returns
        -------
        frozenset
            Ids of the channels that this record defines otherwise than an earlier one did.

        Raises
        ------
        MalformedRecordError
            When the record contradicts itself or the definitions grow beyond the limit.
        """
        key = bytes([opcode]) + content
        if key in self._known:
            return frozenset()
        excess = self._limits.excess("definition_bytes", self._bytes + len(content))
        if excess is not None:
            raise MalformedRecordError(f"with it the definitions of channels and schemas {excess}")
        conflicts = self._define_schema(content) if opcode == Opcode.SCHEMA else self._define_channel(content)
        # What contradicts is looked at again each time, so that each pass over the log meets it.
        if not conflicts:
            self._bytes += len(content)
            self._known.add(key)
        return conflicts

    def _define_schema(self, content: bytes) -> frozenset[int]:
        schema = _parse_schema(content)
        if schema.id == 0:
            raise MalformedRecordError("schema id 0 is reserved for 'no schema'")
        users = [record for record in self._records.values() if record.schema_id == schema.id]
        if self._schemas.setdefault(schema.id, schema) != schema:
            return frozenset(record.id for record in users)
        for record in users:
            self._resolve(record)
        return frozenset()

    def _define_channel(self, content: bytes) -> frozenset[int]:
        record = _parse_channel(content)
        if self._records.setdefault(record.id, record) != record:
            return frozenset([record.id])
        self._resolve(record)
        return frozenset()

    def _resolve(self, record: _ChannelRecord) -> None:
        self._channels[record.id] = McapChannel(
            id=record.id,
            topic=record.topic,
            message_encoding=record.message_encoding,
            metadata=record.metadata,
            schema=self._schemas.get(record.schema_id),
        )
