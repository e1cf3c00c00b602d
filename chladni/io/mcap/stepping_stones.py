"""The chunks that the summary lists, as second opinion on the walk and as stepping stones behind damage."""

from collections.abc import Sequence

import numpy as np

from chladni.io.mcap.log_file import LogFile, Window
from chladni.io.mcap.records import (
    CHUNK_HEADER_BYTES,
    PREFIX_BYTES,
    ChunkHeader,
    MalformedRecordError,
    Opcode,
    parse_chunk_header,
)
from chladni.io.mcap.summary import ChunkIndex
from chladni.signals.arrays import Bytes

_BLOCK_BYTES = 1 << 20
_NAME_AT = PREFIX_BYTES + 28
_FIXED_BYTES = 28 + 4 + 8
_LONGEST_NAME = 4
_HEADER_BYTES = PREFIX_BYTES + _FIXED_BYTES + _LONGEST_NAME
_NAMES = {0: b"", 3: b"lz4", 4: b"zstd"}


class SteppingStones:
    """Listed chunks by offset; one that isn't where the list says is never stepped on."""

    def __init__(self, listed: Sequence[ChunkIndex], window: Window) -> None:
        self._listed = {stone.offset: stone for stone in listed}
        self._ahead = list(listed)
        self._window = window
        self._checked = -1
        self._passed = 0

    def __len__(self) -> int:
        return len(self._listed)

    def at(self, offset: int) -> ChunkIndex | None:
        """Return the chunk listed at ``offset``, there or not."""
        return self._listed.get(offset)

    def after(self, offset: int) -> ChunkIndex | None:
        """Return the next listed chunk behind ``offset`` that really is there; offsets must not fall."""
        while self._passed < len(self._ahead):
            stone = self._ahead[self._passed]
            if stone.offset > offset and (self._checked == self._passed or self._is_there(stone)):
                self._checked = self._passed
                return stone
            self._passed += 1
        return None

    def _is_there(self, stone: ChunkIndex) -> bool:
        try:
            start = self._window.peek(stone.offset, CHUNK_HEADER_BYTES)
            return agrees(parse_chunk_header(start, offset=stone.offset), stone)
        except MalformedRecordError:
            return False


def agrees(header: ChunkHeader, stone: ChunkIndex) -> bool:
    """Tell whether a chunk's own header says what the summary says of it."""
    return (
        lies_alike(header, stone)
        and header.uncompressed_size == stone.uncompressed_size
        and (header.start_time_ns, header.end_time_ns) == (stone.start_time_ns, stone.end_time_ns)
    )


def lies_alike(header: ChunkHeader, stone: ChunkIndex) -> bool:
    """Tell whether header and summary agree on where the chunk's data lies and how it is compressed."""
    return (
        header.compression == stone.compression
        and header.compressed_size == stone.compressed_size
        and header.data_offset + header.compressed_size == stone.offset + stone.length
    )


def find_chunk(file: LogFile, *, start: int, stop: int) -> int | None:
    """Return where the first record from ``start`` on begins that has a chunk's opcode and sound lengths.

    A known compression and two 64-bit lengths that agree leave no room for chance in ordinary data;
    the chunk's checksum then proves it.
    """
    for offset in range(start, stop, _BLOCK_BYTES):
        # Blocks overlap by a header, so that none is cut in two.
        block = file.read(offset, min(_BLOCK_BYTES + _HEADER_BYTES, stop - offset))
        for candidate in _candidates(np.frombuffer(block, np.uint8)):
            length = int.from_bytes(block[candidate + 1 : candidate + PREFIX_BYTES], "little")
            if _is_header(block, candidate, length) and offset + candidate + PREFIX_BYTES + length <= stop:
                return offset + candidate
    return None


def _candidates(block: Bytes) -> list[int]:
    if len(block) < _HEADER_BYTES:
        return []
    last = len(block) - _HEADER_BYTES + 1
    found = np.flatnonzero(block[:last] == Opcode.CHUNK)
    # Lengths below 2^40 leave the upper bytes zero, as is the rest of the name's length.
    for place in (6, 7, 8, _NAME_AT + 1, _NAME_AT + 2, _NAME_AT + 3):
        found = found[block[found + place] == 0]
    result: list[int] = found[np.isin(block[found + _NAME_AT], list(_NAMES))].tolist()
    return result


def _is_header(block: bytes, at: int, length: int) -> bool:
    name_bytes = block[at + _NAME_AT]
    size_at = at + _NAME_AT + 4 + name_bytes
    data_bytes = int.from_bytes(block[size_at : size_at + 8], "little")
    named = block[at + _NAME_AT + 4 : size_at] == _NAMES[name_bytes]
    return named and data_bytes > 0 and length == _FIXED_BYTES + name_bytes + data_bytes
