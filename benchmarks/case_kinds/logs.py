"""MCAP logs made with the `mcap` library, message by message, and read back by it."""

import contextlib
import json
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

START_NS = 1_700_000_000_000_000_000
NS = 1_000_000_000
_RULE = "=" * 80
HEADER = f"""{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@dataclass(frozen=True, slots=True)
class Topic:
    """A channel to be written; two with one topic are two publishers."""

    topic: str
    schema: str
    text: bytes
    schema_encoding: str = "ros2msg"
    encoding: str = "cdr"
    publisher: int = 0


@dataclass(frozen=True, slots=True)
class Entry:
    """One message: its channel, its log time, its bytes, and its number where the file's order differs."""

    topic: Topic
    log_ns: int
    data: bytes
    sequence: int | None = None


def plain(topic: str = "/s", publisher: int = 0) -> Topic:
    """Give a topic with one double ``x``."""
    return Topic(topic, "p/msg/S", b"float64 x\n", publisher=publisher)


def stamped(topic: str = "/s") -> Topic:
    """Give a topic with a header and one double ``x``."""
    return Topic(topic, "p/msg/H", f"std_msgs/Header header\nfloat64 x\n{HEADER}".encode())


def json_topic(topic: str, properties: dict[str, Any] | None, publisher: int = 0) -> Topic:
    """Give a topic in JSON; without properties it has no schema."""
    if properties is None:
        return Topic(topic, "", b"", schema_encoding="", encoding="json", publisher=publisher)
    schema = json.dumps({"type": "object", "properties": properties}).encode()
    return Topic(topic, "S", schema, schema_encoding="jsonschema", encoding="json", publisher=publisher)


def double(value: float) -> bytes:
    """Encode a message of one double, CDR little endian."""
    return b"\0\1\0\0" + struct.pack("<d", value)


def stamped_double(stamp_ns: int, value: float) -> bytes:
    """Encode a message with a header and one double, CDR little endian; the frame is ``f``."""
    seconds, nanoseconds = divmod(stamp_ns, NS)
    # 'f' and its zero end at 14 of the body; the double begins at 16.
    return b"\0\1\0\0" + struct.pack("<iII2s2xd", seconds, nanoseconds, 2, b"f\0", value)


def as_json(**fields: Any) -> bytes:
    """Encode a message in JSON."""
    return json.dumps(fields).encode()


def write_log(
    path: Path, entries: Iterable[Entry], *, chunk_size: int = 1024 * 1024, compress: bool = False, close: bool = True
) -> Path:
    """Write messages in the order given; without `close` the log ends where a recorder was killed."""
    with path.open("wb") as stream:
        compression = CompressionType.ZSTD if compress else CompressionType.NONE
        writer = Writer(stream, chunk_size=chunk_size, compression=compression, use_chunking=close)
        writer.start()
        schemas: dict[tuple[str, bytes], int] = {}
        channels: dict[Topic, int] = {}
        for place, entry in enumerate(entries):
            topic = entry.topic
            if topic not in channels:
                schema = _schema(writer, schemas, topic)
                channels[topic] = writer.register_channel(topic.topic, topic.encoding, schema)
            number = place if entry.sequence is None else entry.sequence
            writer.add_message(channels[topic], entry.log_ns, entry.data, entry.log_ns, number)
        if close:
            writer.finish()
    return path


def _schema(writer: Writer, schemas: dict[tuple[str, bytes], int], topic: Topic) -> int:
    if not topic.schema_encoding:
        return 0
    key = (topic.schema, topic.text)
    if key not in schemas:
        schemas[key] = writer.register_schema(topic.schema, topic.schema_encoding, topic.text)
    return schemas[key]


def read_back(path: Path) -> list[tuple[str, int, bytes]]:
    """Topic, log time and bytes of every message in the file's order, by the `mcap` library."""
    topics: dict[int, str] = {}
    found = []
    # A log that was never closed ends without a footer.
    with path.open("rb") as stream, contextlib.suppress(EndOfFile):
        for record in StreamReader(stream).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                found.append((topics[record.channel_id], record.log_time, bytes(record.data)))
    return found


def last_doubles(path: Path, topic: str) -> tuple[np.ndarray, np.ndarray]:
    """Log times in seconds from the start, and the double at each message's end."""
    rows = [(log_ns, data) for name, log_ns, data in read_back(path) if name == topic]
    times = np.array([(log_ns - START_NS) / NS for log_ns, _ in rows])
    return times, np.array([struct.unpack("<d", data[-8:])[0] for _, data in rows])


def assert_sine(times_s: np.ndarray, values: np.ndarray, hz: float, amplitude: float, *, error: float = 1e-6) -> None:
    """Fit a sine and an offset by least squares: the generator's own truth, read from its file."""
    phase = 2 * np.pi * hz * times_s
    basis = np.column_stack([np.cos(phase), np.sin(phase), np.ones_like(phase)])
    solution, *_ = np.linalg.lstsq(basis, values, rcond=None)
    assert abs(np.hypot(*solution[:2]) - amplitude) <= error * amplitude + error, (np.hypot(*solution[:2]), amplitude)
    assert np.sqrt(np.mean((values - basis @ solution) ** 2)) <= error * amplitude + error


def proto_file(name: str, text: Sequence[tuple[str, Sequence[tuple[str, int, str, str]]]], syntax: str) -> bytes:
    """Serialise a descriptor set of messages, each a name and fields (name, number, type, presence).

    A type is a scalar's (``double``) or a message's name; presence is ``implicit``, ``optional``, ``oneof`` or
    ``repeated``.
    """
    file = descriptor_pb2.FileDescriptorProto(name=name, package="t")
    if syntax == "proto3":
        file.syntax = syntax
    for message_name, fields in text:
        message = file.message_type.add(name=message_name)
        for field_name, number, kind, presence in fields:
            _add_field(message, field_name, number, kind, presence, syntax)
    return descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


def _add_field(message: Any, name: str, number: int, kind: str, presence: str, syntax: str) -> None:
    proto = descriptor_pb2.FieldDescriptorProto
    label = proto.LABEL_REPEATED if presence == "repeated" else proto.LABEL_OPTIONAL
    field = message.field.add(name=name, number=number, label=label)
    scalar = f"TYPE_{kind.upper()}"
    if hasattr(proto, scalar):
        field.type = getattr(proto, scalar)
    else:
        field.type, field.type_name = proto.TYPE_MESSAGE, f".t.{kind}"
    if presence == "oneof" or (presence == "optional" and syntax == "proto3"):
        field.oneof_index = len(message.oneof_decl)
        message.oneof_decl.add(name="choice" if presence == "oneof" else f"_{name}")
        field.proto3_optional = presence == "optional"


def proto_class(descriptors: bytes, name: str) -> Any:
    """Give the class of one message of a descriptor set, by the `protobuf` library."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptors).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"t.{name}"))


def proto_topic(topic: str, name: str, descriptors: bytes) -> Topic:
    """Give a topic in protobuf."""
    return Topic(topic, f"t.{name}", descriptors, schema_encoding="protobuf", encoding="protobuf")
