"""The records of an MCAP file and their fields, every access checked against the bytes there are.

Layout: https://mcap.dev/spec. A record is an opcode byte, the length of its content (uint64) and
the content; all numbers are little-endian; strings and blobs are preceded by their length.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"
RECORD_PREFIX = struct.Struct("<BQ")
PREFIX_BYTES = RECORD_PREFIX.size
FOOTER_BYTES = PREFIX_BYTES + 20
DATA_END_BYTES = PREFIX_BYTES + 4
MESSAGE_FIELDS_BYTES = 22
KNOWN_COMPRESSIONS = frozenset(["", "lz4", "zstd"])
LONGEST_COMPRESSION_NAME = 64
# Prefix, start and end time, uncompressed size and checksum, length of the compression's name.
_CHUNK_START = struct.Struct("<BQQQQII")
# Enough bytes to parse the header of any chunk that names its compression in a sane way.
CHUNK_HEADER_BYTES = _CHUNK_START.size + LONGEST_COMPRESSION_NAME + 8
INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])


class Opcode(IntEnum):
    """Kinds of record."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record_name(opcode: int) -> str:
    """Return the specification's name of a record: ``MessageIndex`` for 7, ``record 0x9A`` for an unknown one.

    >>> record_name(7), record_name(0x9A)
    ('MessageIndex', 'record 0x9A')
    """
    try:
        return Opcode(opcode).name.title().replace("_", "")
    except ValueError:
        return f"record 0x{opcode:02X}"


class MalformedRecordError(ValueError):
    """The content of a record contradicts itself; never leaves this package."""


class FieldReader:
    """Takes field after field from the content of a record."""

    def __init__(self, content: bytes | memoryview) -> None:
        self._content = memoryview(content)
        self._position = 0

    @property
    def position(self) -> int:
        """Bytes taken so far."""
        return self._position

    def _number(self, size: int) -> int:
        return int.from_bytes(self._take(size), "little")

    def _take(self, size: int) -> memoryview:
        end = self._position + size
        if end > len(self._content):
            raise MalformedRecordError(f"a field of {size} bytes runs over the record's end")
        taken = self._content[self._position : end]
        self._position = end
        return taken

    def uint16(self) -> int:
        """Take two bytes."""
        return self._number(2)

    def uint32(self) -> int:
        """Take four bytes."""
        return self._number(4)

    def uint64(self) -> int:
        """Take eight bytes."""
        return self._number(8)

    def blob(self) -> memoryview:
        """Take a uint32 length and so many bytes."""
        return self._take(self.uint32())

    def string(self) -> str:
        """Take a text in UTF-8."""
        try:
            return str(self.blob(), "utf-8")
        except UnicodeDecodeError as error:
            raise MalformedRecordError("a text is not UTF-8") from error

    def string_map(self) -> dict[str, str]:
        """Take a map from text to text."""
        entries = FieldReader(self.blob())
        result: dict[str, str] = {}
        while not entries.at_end:
            key = entries.string()
            result[key] = entries.string()
        return result

    def table(self, dtype: np.dtype[np.void]) -> NDArray[np.void]:
        """Take an array of fixed-size entries, without copying."""
        content = self.blob()
        if len(content) % dtype.itemsize:
            raise MalformedRecordError("an array ends within an entry")
        return np.frombuffer(content, dtype)

    @property
    def at_end(self) -> bool:
        """Whether all bytes are taken."""
        return self._position == len(self._content)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChunkHeader:
    """The fields of a Chunk before its data; ``data_offset`` is the data's first byte in the file."""

    start_time_ns: int
    end_time_ns: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    data_offset: int
    compressed_size: int


def parse_chunk_header(prefix: bytes, *, offset: int) -> ChunkHeader:
    """Parse the first bytes of a Chunk record at ``offset``, its own prefix included.

    Raises
    ------
    MalformedRecordError
        When the lengths inside contradict the record's length: then none of them can be trusted.
    """
    if len(prefix) < _CHUNK_START.size:
        raise MalformedRecordError("the chunk's header is cut off")
    opcode, length, start_ns, end_ns, size, crc, name_bytes = _CHUNK_START.unpack_from(prefix)
    data_at = _CHUNK_START.size + name_bytes + 8
    name = prefix[_CHUNK_START.size : data_at - 8]
    compressed_size = int.from_bytes(prefix[data_at - 8 : data_at], "little")
    lengths_agree = PREFIX_BYTES + length == data_at + compressed_size
    if opcode != Opcode.CHUNK or data_at > len(prefix) or not lengths_agree or not name.isascii():
        raise MalformedRecordError("the fields of the chunk's header contradict each other")
    return ChunkHeader(
        start_time_ns=start_ns,
        end_time_ns=end_ns,
        uncompressed_size=size,
        uncompressed_crc=crc,
        compression=name.decode("ascii"),
        data_offset=offset + data_at,
        compressed_size=compressed_size,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MessageIndex:
    """Where the messages of one channel lie in a chunk: ``entries["offset"]``, ``entries["log_time"]``."""

    channel_id: int
    entries: NDArray[np.void]


def parse_message_index(content: bytes | memoryview) -> MessageIndex:
    """Parse the content of a MessageIndex record."""
    fields = FieldReader(content)
    return MessageIndex(channel_id=fields.uint16(), entries=fields.table(INDEX_ENTRY))
