"""The end of a log: footer, summary section, DataEnd; used only as far as it is sound."""

import zlib
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from chladni.io.mcap.channel_registry import ChannelRegistry
from chladni.io.mcap.damage import DamageList
from chladni.io.mcap.limits import Limits
from chladni.io.mcap.log_file import LogFile
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import (
    DATA_END_BYTES,
    FOOTER_BYTES,
    INDEX_ENTRY,
    MAGIC,
    PREFIX_BYTES,
    RECORD_PREFIX,
    FieldReader,
    MalformedRecordError,
    Opcode,
)

_COUNT = np.dtype([("channel_id", "<u2"), ("count", "<u8")])
# A MessageIndex that lists nothing: channel id and the length of the list.
_EMPTY_INDEX_BYTES = PREFIX_BYTES + 6
_LOOK_BYTES = 64 * 1024
_READ_FROM_START = "the log is read from its start instead"


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """Counts over the whole log, as its writer noted them."""

    message_count: int
    channel_count: int
    start_time_ns: int
    end_time_ns: int
    message_counts: Mapping[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChunkIndex:
    """Where the summary says that a chunk lies, and what it holds."""

    offset: int
    length: int
    start_time_ns: int
    end_time_ns: int
    channel_ids: frozenset[int]
    index_length: int
    compression: str
    compressed_size: int
    uncompressed_size: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LogEnd:
    """What the end of a log tells about the rest.

    Parameters
    ----------
    data_end
        End of the data section: where DataEnd starts, or the first byte that can't belong to the data.
    has_footer
        Whether the log was closed by its writer.
    data_end_found
        Whether ``data_end`` is where a DataEnd record starts; it is to be met on the way otherwise.
    data_crc
        CRC-32 of all bytes before ``data_end``; 0 when there is none.
    chunk_indexes
        By offset, without overlaps.
    statistics
        None when there are none.
    crc_checked
        Whether the summary carries a checksum and it is right.
    lists_all_channels
        Whether the registry read along with it is known to be complete.
    """

    data_end: int
    has_footer: bool
    data_end_found: bool = False
    data_crc: int = 0
    chunk_indexes: tuple[ChunkIndex, ...] = ()
    statistics: Statistics | None = None
    crc_checked: bool = False
    lists_all_channels: bool = False


class _UnsoundSummaryError(Exception):
    """The summary can't be used; the message says why."""


def read_log_end(
    file: LogFile, registry: ChannelRegistry, damage: DamageList, *, limits: Limits, check_crc: bool
) -> LogEnd:
    """Read footer and summary; what is unsound is noted as damage and left out.

    The registry is filled as far as the summary goes; it has to be started anew when the result
    neither lists all channels nor is proved by a checksum.
    """
    footer_offset = file.size - len(MAGIC) - FOOTER_BYTES
    footer = file.read(max(footer_offset, 0), FOOTER_BYTES + len(MAGIC))
    is_footer = footer[:PREFIX_BYTES] == RECORD_PREFIX.pack(Opcode.FOOTER, FOOTER_BYTES - PREFIX_BYTES)
    if footer_offset < len(MAGIC) or not is_footer or not footer.endswith(MAGIC):
        return LogEnd(data_end=file.size, has_footer=False)
    fields = FieldReader(footer[PREFIX_BYTES:])
    start, _offsets_start, crc = fields.uint64(), fields.uint64(), fields.uint32()
    # The specification's way of saying that there is no summary.
    if start == 0:
        return _with_data_end(file, footer_offset)
    try:
        content = _checked_content(file, start, footer_offset, footer, crc if check_crc else 0, limits)
        return _parse(file, start, content, registry, crc_checked=check_crc and crc != 0)
    except (_UnsoundSummaryError, MalformedRecordError) as problem:
        damage.add(f"{problem}; {_READ_FROM_START}", offset=start, record="Summary", lost_messages=0)
        # What the footer says of the summary's place may be right although the summary is not.
        before_summary = _with_data_end(file, min(start, footer_offset))
        if before_summary.data_end_found:
            return before_summary
        return LogEnd(data_end=footer_offset, has_footer=True)


def _with_data_end(file: LogFile, end: int) -> LogEnd:
    """Look for DataEnd right before ``end``."""
    offset = end - DATA_END_BYTES
    record = file.read(max(offset, 0), DATA_END_BYTES)
    if offset < len(MAGIC) or record[:PREFIX_BYTES] != RECORD_PREFIX.pack(Opcode.DATA_END, 4):
        return LogEnd(data_end=end, has_footer=True)
    crc = FieldReader(record[PREFIX_BYTES:]).uint32()
    return LogEnd(data_end=offset, has_footer=True, data_end_found=True, data_crc=crc)


def _checked_content(file: LogFile, start: int, footer_offset: int, footer: bytes, crc: int, limits: Limits) -> bytes:
    if not len(MAGIC) <= start <= footer_offset:
        raise _UnsoundSummaryError(f"the footer says that the summary starts at byte {start}, outside the log")
    excess = limits.excess("summary_bytes", footer_offset - start)
    if excess is not None:
        raise _UnsoundSummaryError(f"the summary {excess}")
    content = file.read(start, footer_offset - start)
    # The checksum covers the footer up to the checksum itself.
    if crc and zlib.crc32(footer[: FOOTER_BYTES - 4], zlib.crc32(content)) != crc:
        raise _UnsoundSummaryError("the summary's checksum is wrong")
    return content


def _parse(file: LogFile, start: int, content: bytes, registry: ChannelRegistry, *, crc_checked: bool) -> LogEnd:
    statistics = None
    indexes = []
    channels = []
    for opcode, record in _records(content):
        if opcode == Opcode.SCHEMA:
            _define(registry, opcode, record)
        elif opcode == Opcode.CHANNEL:
            channels.append(record)
        elif opcode == Opcode.STATISTICS:
            statistics = _parse_statistics(record)
        elif opcode == Opcode.CHUNK_INDEX:
            indexes.append(_parse_chunk_index(record))
    # Only now, since nothing says that schemas come first in a summary.
    for record in channels:
        _define(registry, Opcode.CHANNEL, record)
    end = _with_data_end(file, start)
    indexes.sort(key=lambda index: index.offset)
    _check_layout(indexes, end.data_end)
    return LogEnd(
        data_end=end.data_end,
        has_footer=True,
        data_end_found=end.data_end_found,
        data_crc=end.data_crc,
        chunk_indexes=tuple(indexes),
        statistics=statistics,
        crc_checked=crc_checked,
        lists_all_channels=_lists_all_channels(file, end.data_end, registry, statistics, indexes),
    )


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    position = 0
    while position < len(content):
        if position + PREFIX_BYTES > len(content):
            raise _UnsoundSummaryError("the summary ends within a record")
        opcode, length = RECORD_PREFIX.unpack_from(content, position)
        position += PREFIX_BYTES
        if opcode == 0 or position + length > len(content):
            raise _UnsoundSummaryError("the summary holds a record that can't be one")
        yield opcode, content[position : position + length]
        position += length


def _define(registry: ChannelRegistry, opcode: int, record: bytes) -> None:
    if registry.define(opcode, record):
        raise _UnsoundSummaryError("the summary defines a channel twice, differently")


def _parse_statistics(content: bytes) -> Statistics:
    fields = FieldReader(content)
    messages, _schemas, channels = fields.uint64(), fields.uint16(), fields.uint32()
    _attachments, _metadata, _chunks = fields.uint32(), fields.uint32(), fields.uint32()
    times = fields.uint64(), fields.uint64()
    counts = fields.table(_COUNT)
    return Statistics(
        message_count=messages,
        channel_count=channels,
        start_time_ns=times[0],
        end_time_ns=times[1],
        message_counts=dict(zip(counts["channel_id"].tolist(), counts["count"].tolist(), strict=True)),
    )


def _parse_chunk_index(content: bytes) -> ChunkIndex:
    fields = FieldReader(content)
    times = fields.uint64(), fields.uint64()
    offset, length = fields.uint64(), fields.uint64()
    # Same layout as the counts in the statistics: channel id and a 64-bit number.
    offsets = fields.table(_COUNT)
    return ChunkIndex(
        offset=offset,
        length=length,
        start_time_ns=times[0],
        end_time_ns=times[1],
        channel_ids=frozenset(offsets["channel_id"].tolist()),
        index_length=fields.uint64(),
        compression=fields.string(),
        compressed_size=fields.uint64(),
        uncompressed_size=fields.uint64(),
    )


def _check_layout(indexes: list[ChunkIndex], data_end: int) -> None:
    position = len(MAGIC)
    for index in indexes:
        if index.offset < position or index.compressed_size > index.length:
            raise _UnsoundSummaryError("the chunk indexes in the summary overlap")
        position = index.offset + index.length + index.index_length
    if position > data_end:
        raise _UnsoundSummaryError("the chunk indexes in the summary point behind the data")


def _lists_all_channels(
    file: LogFile, data_end: int, registry: ChannelRegistry, statistics: Statistics | None, indexes: list[ChunkIndex]
) -> bool:
    """Tell whether no message can be of a channel that the summary doesn't list."""
    # A channel that nobody knows of is a channel that nobody asks for: its messages would vanish.
    known = registry.channels.keys()
    if registry.undefined_schemas() or any(index.channel_ids - known for index in indexes):
        return False
    indexed = bool(indexes) and all(index.channel_ids for index in indexes)
    if statistics is None:
        # Then only a complete message index tells which channels there are.
        return indexed and all(_indexed_messages(index) is not None for index in indexes)
    counts = statistics.message_counts
    if not (statistics.channel_count == len(known) and counts.keys() <= known):
        return False
    # The counts of channels may be left out, and are wrong where they don't add up.
    if sum(counts.values()) != statistics.message_count:
        return False
    listed = sum(_indexed_messages(index) or 0 for index in indexes) if indexed else None
    return not _holds_unlisted(file, data_end, indexes, known) and listed in (None, statistics.message_count)


def _indexed_messages(index: ChunkIndex) -> int | None:
    """How many messages the indexes behind a chunk list, by their size; None when it fits no such number."""
    prefixes = len(index.channel_ids) * _EMPTY_INDEX_BYTES
    messages, rest = divmod(index.index_length - prefixes, INDEX_ENTRY.itemsize)
    return None if rest or messages < 0 else messages


def _holds_unlisted(file: LogFile, data_end: int, indexes: list[ChunkIndex], known: AbstractSet[int]) -> bool:
    """Tell whether a chunk or a channel that the summary doesn't list lies where it lists no chunk."""
    position = len(MAGIC)
    for index in indexes:
        if _stretch_holds_unlisted(file, position, index.offset, known):
            return True
        position = index.offset + index.length + index.index_length
    return _stretch_holds_unlisted(file, position, data_end, known)


def _stretch_holds_unlisted(file: LogFile, position: int, stop: int, known: AbstractSet[int]) -> bool:
    """Look at the records between chunks as far as the first messages; the counts answer for those behind them."""
    while position < stop:
        buffer = np.frombuffer(file.read(position, min(_LOOK_BYTES, stop - position)), np.uint8)
        if len(buffer) < PREFIX_BYTES:
            return False
        walk = walk_records(buffer, start=0, stop=len(buffer))
        # A record longer than what was read is looked at by its first bytes.
        starts = walk.starts if walk.end else np.zeros(1, np.int64)
        opcodes = buffer[starts]
        messages = opcodes == Opcode.MESSAGE
        named = starts[(messages | (opcodes == Opcode.CHANNEL)) & (starts + PREFIX_BYTES + 2 <= len(buffer))]
        ids = buffer[named + PREFIX_BYTES].astype(int) | buffer[named + PREFIX_BYTES + 1].astype(int) << 8
        if (opcodes == Opcode.CHUNK).any() or not known >= set(ids.tolist()):
            return True
        if messages.any() or opcodes[0] == 0:
            return False
        position += walk.end or PREFIX_BYTES + RECORD_PREFIX.unpack_from(buffer.data)[1]
    return False
