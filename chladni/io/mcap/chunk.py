"""Decodes one chunk: checksum, decompression, message index or record walk."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from isal import isal_zlib

from chladni.io.mcap.damage import Damage
from chladni.io.mcap.data_section import ChunkSegment
from chladni.io.mcap.decompress import DecompressError, decompress, decompress_start
from chladni.io.mcap.message_table import MessageTable, table_from_index, table_from_walk
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import ChunkHeader
from chladni.io.mcap.selection import Selection
from chladni.io.mcap.stretch_content import StretchContent, fill_content
from chladni.signals.arrays import Bytes

# So many zeros at the end of compressed data don't come from compressing anything.
_ZERO_TAIL_BYTES = 32
_UNCHECKED = "whole messages before that are given, though the checksum could not be checked"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChunkRules:
    """How strictly chunks are taken: ``checksum_expected`` once another chunk of the log carries one."""

    check_crc: bool
    checksum_expected: bool


class _UnreadableChunkError(Exception):
    """Nothing of the chunk can be given out; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenedChunk:
    """What could be decompressed; ``flaw`` says what is wrong when that isn't all, or is nothing (None)."""

    buffer: Bytes | None
    flaw: str | None = None


def open_chunk(header: ChunkHeader, data: bytes | memoryview, rules: ChunkRules) -> OpenedChunk:
    """Decompress and check a chunk, of which fewer bytes than it declares are there when it is cut.

    Made to run in a thread: nothing shared is touched, and nearly all of it runs outside Python's
    global lock. The rest of the work waits for `chunk_content`, since threads that take turns at the
    lock for every chunk are slower than one.
    """
    try:
        return _open(header, data, rules)
    except (_UnreadableChunkError, DecompressError) as problem:
        return OpenedChunk(buffer=None, flaw=str(problem))


def chunk_content(segment: ChunkSegment, opened: OpenedChunk, selection: Selection) -> StretchContent:
    """Find the messages in an opened chunk."""
    content = StretchContent(offset=segment.offset)
    if opened.buffer is None:
        _report(content, segment, f"{opened.flaw}; none of the chunk's messages are given")
        return content
    table = _find_records(content, segment, opened.buffer, whole=opened.flaw is None)
    fill_content(content, opened.buffer, table, selection)
    if opened.flaw is not None:
        _report(content, segment, opened.flaw)
    elif table.end != len(opened.buffer):
        what = f"the chunk's records stop making sense {table.end} bytes into its content"
        _report(content, segment, f"{what}; the messages before that are given")
    return content


def _report(content: StretchContent, segment: ChunkSegment, what: str) -> None:
    """Note the damage, counting as lost what the message index lists and was not found."""
    listed = Counter({one.channel_id: len(one.entries) for one in segment.index})
    # Subtracting counters leaves out what would be negative: an index may list too few.
    lost = listed - content.found
    content.lost += lost
    content.damage.append(
        Damage(
            what=what,
            offset=segment.offset,
            record="Chunk",
            lost_messages=lost.total() if segment.index else None,
        )
    )


def _open(header: ChunkHeader, data: bytes | memoryview, rules: ChunkRules) -> OpenedChunk:
    if len(data) < header.compressed_size:
        missing = header.compressed_size - len(data)
        return _open_start(header, data, f"the file ends within the chunk, {missing} bytes are missing")
    try:
        opened = decompress(data, header.compression, size=header.uncompressed_size)
        _check_crc(opened, header.uncompressed_crc, rules)
    except (DecompressError, _UnreadableChunkError):
        # Recorders that lose power leave zeros where the end of a chunk should be. What comes before them
        # is whole. Any other damage in the middle may have spoiled bytes long before it shows.
        start = bytes(data).rstrip(b"\0")
        if len(data) - len(start) < _ZERO_TAIL_BYTES or (header.compression == "" and _tiles(data)):
            raise
        what = f"the last {len(data) - len(start)} bytes of the chunk are filled with zeros"
        return _open_start(header, start, what)
    return OpenedChunk(buffer=np.frombuffer(opened, np.uint8))


def _open_start(header: ChunkHeader, data: bytes | memoryview, what: str) -> OpenedChunk:
    try:
        opened = decompress_start(data, header.compression, size=header.uncompressed_size)
    except DecompressError as problem:
        raise _UnreadableChunkError(f"{what}, and {problem}") from problem
    return OpenedChunk(buffer=np.frombuffer(opened, np.uint8), flaw=f"{what}; {_UNCHECKED}")


def _tiles(data: bytes | memoryview) -> bool:
    """Tell whether the records are whole although the checksum is wrong: then its zeros are meant."""
    return walk_records(np.frombuffer(data, np.uint8), start=0, stop=len(data)).end == len(data)


def _check_crc(content: bytes | memoryview, crc: int, rules: ChunkRules) -> None:
    # The checksum of nothing is 0, the same as no checksum.
    if not rules.check_crc or not content:
        return
    if crc and isal_zlib.crc32(content) != crc:
        raise _UnreadableChunkError("the chunk's checksum is wrong")
    if crc == 0 and rules.checksum_expected:
        raise _UnreadableChunkError("the chunk carries no checksum, unlike others of this log")


def _find_records(content: StretchContent, segment: ChunkSegment, buffer: Bytes, *, whole: bool) -> MessageTable:
    if segment.index and whole:
        table = table_from_index(buffer, segment.index)
        if table is not None:
            return table
        what = "the message index contradicts the chunk before it, which is read record by record"
        content.damage.append(Damage(what=what, offset=segment.offset, record="MessageIndex", lost_messages=0))
    return table_from_walk(buffer, walk_records(buffer, start=0, stop=len(buffer)))
