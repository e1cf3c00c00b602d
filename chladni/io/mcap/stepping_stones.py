"""The chunks that the summary lists, as second opinion on the walk and as stepping stones behind damage."""

from collections.abc import Sequence

from chladni.io.mcap.log_file import Window
from chladni.io.mcap.records import (
    CHUNK_HEADER_BYTES,
    ChunkHeader,
    MalformedRecordError,
    parse_chunk_header,
)
from chladni.io.mcap.summary import ChunkIndex


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
