"""Decodes one chunk: checksum, decompression, message index or record walk."""

import zlib
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.io.mcap.damage import Damage
from chladni.io.mcap.data_section import ChunkSegment
from chladni.io.mcap.decompress import DecompressError, decompress, decompress_start
from chladni.io.mcap.message_table import RecordStarts, split_starts, starts_from_index
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.selection import Selection
from chladni.io.mcap.stretch_content import StretchContent, fill_content

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
class _Opened:
    """Decompressed bytes; ``flaw`` says what is wrong when they are not all."""

    buffer: NDArray[np.uint8]
    flaw: str | None = None


def decode_chunk(segment: ChunkSegment, data: bytes, selection: Selection, rules: ChunkRules) -> StretchContent:
    """Decode a chunk from its compressed bytes, of which a cut chunk has fewer than it declares.

    Safe to run in a thread: nothing shared is touched.
    """
    content = StretchContent(offset=segment.offset)
    try:
        opened = _open(segment, data, rules)
    except (_UnreadableChunkError, DecompressError) as problem:
        refuse_chunk(content, segment, str(problem))
        return content
    starts = _find_records(content, segment, opened)
    fill_content(content, opened.buffer, starts, selection)
    if opened.flaw is not None or starts.end != len(opened.buffer):
        flaw = opened.flaw or f"the chunk's records stop making sense {starts.end} bytes into its content"
        _report(content, segment, flaw)
    return content


def refuse_chunk(content: StretchContent, segment: ChunkSegment, why: str) -> None:
    """Note that no message of the chunk is given out."""
    _report(content, segment, f"{why}; none of the chunk's messages are given")


def _report(content: StretchContent, segment: ChunkSegment, what: str) -> None:
    """Note the damage, counting as lost what the message index lists and was not found."""
    listed = Counter({one.channel_id: len(one.entries) for one in segment.index})
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


def _open(segment: ChunkSegment, data: bytes, rules: ChunkRules) -> _Opened:
    header = segment.header
    if len(data) < header.compressed_size:
        missing = header.compressed_size - len(data)
        return _open_start(segment, data, f"the file ends within the chunk, {missing} bytes are missing")
    try:
        opened = decompress(data, header.compression, size=header.uncompressed_size)
        _check_crc(opened, header.uncompressed_crc, rules)
    except (DecompressError, _UnreadableChunkError):
        start = data.rstrip(b"\0")
        if len(data) - len(start) < _ZERO_TAIL_BYTES:
            raise
        if header.compression == "" and _tiles(data):
            raise
        what = f"the last {len(data) - len(start)} bytes of the chunk are filled with zeros"
        return _open_start(segment, start, what)
    return _Opened(buffer=np.frombuffer(opened, np.uint8))


def _open_start(segment: ChunkSegment, data: bytes, what: str) -> _Opened:
    header = segment.header
    try:
        opened = decompress_start(data, header.compression, size=header.uncompressed_size)
    except DecompressError as problem:
        raise _UnreadableChunkError(f"{what}, and {problem}") from problem
    return _Opened(buffer=np.frombuffer(opened, np.uint8), flaw=f"{what}; {_UNCHECKED}")


def _tiles(data: bytes) -> bool:
    """Tell whether the records are whole although the checksum is wrong: then its zeros are meant."""
    return walk_records(np.frombuffer(data, np.uint8), start=0, stop=len(data)).end == len(data)


def _check_crc(content: bytes, crc: int, rules: ChunkRules) -> None:
    if not rules.check_crc or not content:
        return
    if crc and zlib.crc32(content) != crc:
        raise _UnreadableChunkError("the chunk's checksum is wrong")
    if crc == 0 and rules.checksum_expected:
        raise _UnreadableChunkError("the chunk carries no checksum, unlike others of this log")


def _find_records(content: StretchContent, segment: ChunkSegment, opened: _Opened) -> RecordStarts:
    if segment.index and opened.flaw is None:
        starts = starts_from_index(opened.buffer, segment.index)
        if starts is not None:
            return starts
        what = "the message index contradicts the chunk before it, which is read record by record"
        content.damage.append(Damage(what=what, offset=segment.offset, record="MessageIndex", lost_messages=0))
    walk = walk_records(opened.buffer, start=0, stop=len(opened.buffer))
    return split_starts(opened.buffer, walk.starts, end=walk.end)
