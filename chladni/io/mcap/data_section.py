"""Walks the data section of a log: chunks, and stretches of records outside chunks.

The walk goes from record to record and trusts no length that it has not checked. The chunk indexes
of the summary serve as second opinion, and as stepping stones behind damage.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from chladni.io.mcap.damage import DamageList
from chladni.io.mcap.limits import MIB, Limits
from chladni.io.mcap.log_file import LogFile, Window
from chladni.io.mcap.message_table import MessageTable, table_from_walk
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import (
    CHUNK_HEADER_BYTES,
    DATA_END_BYTES,
    INDEX_ENTRY,
    KNOWN_COMPRESSIONS,
    MAGIC,
    MESSAGE_FIELDS_BYTES,
    PREFIX_BYTES,
    RECORD_PREFIX,
    ChunkHeader,
    MalformedRecordError,
    MessageIndex,
    Opcode,
    parse_chunk_header,
    parse_message_index,
    record_name,
)
from chladni.io.mcap.stepping_stones import SteppingStones, agrees, find_chunk, lies_alike
from chladni.io.mcap.summary import ChunkIndex, LogEnd
from chladni.signals.arrays import Bytes

_STRETCH_BYTES = 4 * MIB
_FIRST_STRETCH_BYTES = 64 * 1024
_READ_ALONG_BYTES = 16 * MIB
_ZERO_BLOCK_BYTES = MIB
# Of a MessageIndex: channel id, and length of the list.
_INDEX_FIELDS_BYTES = 6
# Records that end a stretch: each is looked at by itself, an attachment not read at all.
_SINGLE = frozenset([Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.DATA_END, Opcode.FOOTER, Opcode.ATTACHMENT])
_READ_BARE = frozenset([Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChunkSegment:
    """A chunk that is not decompressed yet.

    ``listed`` is the summary's entry for it, if any; ``agrees`` tells whether the chunk's own header says
    the same.
    """

    offset: int
    header: ChunkHeader
    index: tuple[MessageIndex, ...]
    # The compressed bytes if they were read along with the rest; None when they still have to be read.
    data: memoryview | None
    listed: ChunkIndex | None
    agrees: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BareSegment:
    """Whole records outside chunks; ``in_chunked_log`` when the log is known to have chunks."""

    offset: int
    buffer: Bytes
    table: MessageTable
    in_chunked_log: bool


Segment = ChunkSegment | BareSegment


class DataSection:
    """One walk over the data section.

    Parameters
    ----------
    file, end
        The log, and what its end tells.
    damage
        Where damage is noted.
    limits
        What may be read into memory.
    channel_ids
        Chunks of which the summary says that they hold none of these are not read along with the walk.
    """

    def __init__(
        self,
        file: LogFile,
        end: LogEnd,
        damage: DamageList,
        limits: Limits,
        *,
        channel_ids: frozenset[int],
    ) -> None:
        self._channel_ids = channel_ids
        self._file = file
        self._window = Window(file)
        self._end = end
        self._damage = damage
        self._limits = limits
        self._stones = SteppingStones(end.chunk_indexes, self._window)
        self._stretch = _FIRST_STRETCH_BYTES
        self._chunks_seen = len(self._stones) > 0
        self._reached: set[int] = set()
        self._closed = end.has_footer
        self._behind_chunk = -1

    def segments(self) -> Iterator[Segment]:
        """Yield what the data section holds, in file order."""
        position = self._header(len(MAGIC))
        while position < self._end.data_end:
            segment, position = self._next(position)
            if segment is not None:
                yield segment
        self._check_end()

    def _header(self, position: int) -> int:
        """Step over the Header, which has to be the first record."""
        prefix = self._window.read(position, PREFIX_BYTES)
        if len(prefix) == PREFIX_BYTES and position + PREFIX_BYTES <= self._end.data_end:
            opcode, length = RECORD_PREFIX.unpack(prefix)
            end: int = position + PREFIX_BYTES + length
            if end <= self._bound(position):
                if opcode != Opcode.HEADER:
                    what = f"the log starts with a {record_name(opcode)} where its Header belongs"
                    self._damage.add(what, offset=position, record="Header", lost_messages=0)
                return end
        return self._broken(position, "the log doesn't start with a Header", "Header")

    def _check_end(self) -> None:
        if not self._closed:
            what = "the log ends without a footer: its recording was cut off"
            self._damage.add(what, offset=self._file.size, record="Footer", lost_messages=None)
        # A chunk in the list that the walk never came to is missing, or the list is wrong: both are damage.
        for stone in self._end.chunk_indexes:
            if stone.offset not in self._reached:
                what = "no chunk was found here, where the summary lists one"
                self._damage.add(what, offset=stone.offset, record="Chunk", lost_messages=None)

    # ---------------------------------------------------------------- one record

    def _next(self, position: int) -> tuple[Segment | None, int]:
        listed = self._stones.at(position)
        # Where the summary lists a chunk there is one, whatever its first byte says.
        if listed is not None:
            self._read_along(listed)
        prefix = self._window.read(position, PREFIX_BYTES)
        if position + PREFIX_BYTES > self._end.data_end or len(prefix) < PREFIX_BYTES:
            return None, self._broken(position, "the data ends within a record's first bytes", "record")
        opcode, length = RECORD_PREFIX.unpack(prefix)
        if opcode == Opcode.CHUNK or self._is_disguised_chunk(position, opcode) or listed is not None:
            return self._chunk(position, listed)
        # The specification reserves 0: a record never starts with it, a file that lost its end often does.
        if opcode == 0:
            return None, self._zeros(position)
        end = position + PREFIX_BYTES + length
        if end > self._bound(position):
            return None, self._does_not_fit(position, opcode, end)
        if opcode == Opcode.DATA_END:
            return None, self._data_end(position, end)
        if opcode == Opcode.FOOTER:
            return None, self._broken(position, "a footer lies within the data", "Footer")
        if opcode == Opcode.MESSAGE_INDEX:
            return None, self._orphan_index(position, end)
        # An attachment can be larger than memory and is of no interest.
        if opcode in _SINGLE:
            return None, end
        return self._bare(position, opcode, end)

    def _is_disguised_chunk(self, position: int, opcode: int) -> bool:
        """Tell whether all but the opcode makes this record a chunk; else a wrong bit there would hide it."""
        start = self._window.read(position, CHUNK_HEADER_BYTES)
        try:
            header = parse_chunk_header(bytes([Opcode.CHUNK]) + start[1:], offset=position)
        except MalformedRecordError:
            return False
        # Where only the checksum can prove it, there has to be one.
        if header.uncompressed_crc == 0 or header.compression not in KNOWN_COMPRESSIONS:
            return False
        what = f"a chunk has the opcode of a {record_name(opcode)}; it is read as chunk"
        self._damage.add(what, offset=position, record="Chunk", lost_messages=0)
        return True

    def _orphan_index(self, position: int, end: int) -> int:
        if position == self._behind_chunk:
            # Left over from the chunk before, which had no room for so many messages.
            what, lost = "a message index with more entries than its chunk can hold messages", 0
        else:
            lost = max(end - position - PREFIX_BYTES - _INDEX_FIELDS_BYTES, 0) // INDEX_ENTRY.itemsize
            what = "a message index without a chunk before it"
        self._damage.add(what, offset=position, record="MessageIndex", lost_messages=lost)
        return end

    def _read_along(self, listed: ChunkIndex) -> None:
        """Read a chunk, its indexes and the next header in one go: many small reads cost more than bytes."""
        size = listed.length + listed.index_length + CHUNK_HEADER_BYTES
        if size <= _READ_ALONG_BYTES and not self._channel_ids.isdisjoint(listed.channel_ids):
            self._window.load(listed.offset, size)

    def _bound(self, position: int) -> int:
        """Return where a record that starts at ``position`` has to end at the latest."""
        stone = self._stones.after(position)
        return self._end.data_end if stone is None else stone.offset

    def _does_not_fit(self, position: int, opcode: int, end: int) -> int:
        name = record_name(opcode)
        # A file that has its end isn't cut off: then the length is wrong, and so may be all the rest.
        if self._end.has_footer or end <= self._end.data_end:
            return self._broken(position, f"a record of {end - position} bytes doesn't fit here", name)
        what = f"the file ends within a record of {end - position} bytes"
        return self._broken(position, what, name, lost=1 if opcode == Opcode.MESSAGE else None)

    def _data_end(self, position: int, end: int) -> int:
        if self._end.data_end_found or end != position + DATA_END_BYTES:
            return self._broken(position, "the data seem to end here, too early", "DataEnd")
        self._closed = True
        # The footer may be gone, with the summary before it; all messages lie before this record.
        if not self._end.has_footer:
            what = "the summary is cut off or overwritten; the data before it is whole"
            self._damage.add(what, offset=end, record="Summary", lost_messages=0)
        return self._end.data_end

    def _zeros(self, position: int) -> int:
        """Tell a stretch of zeros from a single wrong byte."""
        end = self._bound(position)
        for at in range(position, end, _ZERO_BLOCK_BYTES):
            if self._file.read(at, min(_ZERO_BLOCK_BYTES, end - at)).strip(b"\0"):
                return self._broken(position, "zeros where a record should start", "zeros")
        return self._broken(position, f"{end - position} bytes are filled with zeros", "zeros")

    def _broken(self, position: int, what: str, record: str, *, lost: int | None = None) -> int:
        """Note damage and return where reading goes on: at the next chunk, if there is one."""
        stone = self._stones.after(position)
        if stone is not None:
            target: int | None = stone.offset
        else:
            target = find_chunk(self._file, start=position + 1, stop=self._end.data_end)
        goes_on = "nothing behind it can be read" if target is None else f"reading goes on at byte {target}"
        self._damage.add(f"{what}; {goes_on}", offset=position, record=record, lost_messages=lost)
        return self._end.data_end if target is None else target

    # ---------------------------------------------------------------- chunks

    def _chunk(self, position: int, listed: ChunkIndex | None) -> tuple[Segment | None, int]:
        self._chunks_seen = True
        self._reached.add(position)
        header = self._chunk_header(position, listed)
        if header is None:
            return None, self._broken(position, "the chunk's header is damaged", "Chunk")
        end = header.data_offset + header.compressed_size
        cut = end > self._end.data_end and not self._end.has_footer
        if end > self._bound(position) and not cut:
            return None, self._does_not_fit(position, Opcode.CHUNK, end)
        # Reading the indexes may move the window.
        data = self._window.view_if_loaded(header.data_offset, header.compressed_size)
        index, position_behind = ((), self._end.data_end) if cut else self._indexes(end, header)
        segment = ChunkSegment(
            offset=position,
            header=header,
            index=index,
            data=data,
            listed=listed,
            agrees=listed is not None and agrees(header, listed),
        )
        self._behind_chunk = position_behind
        return segment, position_behind

    def _chunk_header(self, position: int, listed: ChunkIndex | None) -> ChunkHeader | None:
        """Parse the chunk's header; where it is damaged, the summary's entry replaces it."""
        start = self._window.read(position, CHUNK_HEADER_BYTES)
        try:
            # A wrong opcode has been told of where it was found out; it makes nothing else wrong.
            own = parse_chunk_header(bytes([Opcode.CHUNK]) + start[1:], offset=position)
        except MalformedRecordError:
            own = None
        if listed is None or (own is not None and agrees(own, listed)):
            return own
        what = "the chunk's header and the summary contradict each other"
        self._damage.add(what, offset=position, record="Chunk", lost_messages=0)
        # A header whose lengths agree with each other isn't damaged there; then the summary may be wrong.
        if not self._end.crc_checked or (own is not None and not lies_alike(own, listed)):
            return own
        return _header_from_summary(start, listed)

    def _indexes(self, position: int, header: ChunkHeader) -> tuple[tuple[MessageIndex, ...], int]:
        """Collect the message indexes behind a chunk."""
        found: list[MessageIndex] = []
        # There can't be more entries than the shortest messages that the chunk has room for.
        room = header.uncompressed_size // (PREFIX_BYTES + MESSAGE_FIELDS_BYTES) * INDEX_ENTRY.itemsize
        start = position
        while (content := self._index_content(position, room)) is not None:
            try:
                found.append(parse_message_index(content))
            except MalformedRecordError as problem:
                self._damage.add(str(problem), offset=position, record="MessageIndex", lost_messages=0)
            # An index that lists nothing takes no room.
            room -= max(0, len(content) - _INDEX_FIELDS_BYTES)
            position += PREFIX_BYTES + len(content)
        # Two for one channel can't both be right, and the counts of lost messages rely on them.
        if len({one.channel_id for one in found}) < len(found):
            what = "two message indexes for one channel; the chunk is read record by record"
            self._damage.add(what, offset=start, record="MessageIndex", lost_messages=0)
            found = []
        return tuple(found), position

    def _index_content(self, position: int, room: int) -> bytes | None:
        prefix = self._window.read(position, PREFIX_BYTES)
        if len(prefix) < PREFIX_BYTES:
            return None
        opcode, length = RECORD_PREFIX.unpack(prefix)
        end = position + PREFIX_BYTES + length
        if opcode != Opcode.MESSAGE_INDEX or end > self._bound(position) or length > room + _INDEX_FIELDS_BYTES:
            return None
        content = self._window.read(position + PREFIX_BYTES, length)
        return content if len(content) == length else None

    # ---------------------------------------------------------------- records outside chunks

    def _bare(self, position: int, opcode: int, end: int) -> tuple[Segment | None, int]:
        """Read a stretch of records outside chunks, longer and longer ones while there are only such."""
        # No longer than the limit, so that what is longer comes first in a stretch and is seen.
        size = min(self._stretch, self._limits.record_bytes)
        if end - position > size:
            if opcode not in _READ_BARE:
                return None, end
            excess = self._limits.excess("record_bytes", end - position)
            if excess is not None:
                lost = 1 if opcode == Opcode.MESSAGE else None
                name = record_name(opcode)
                self._damage.add(f"the record {excess}", offset=position, record=name, lost_messages=lost)
                return None, end
            size = end - position
        content = self._file.read(position, min(size, self._bound(position) - position))
        buffer = np.frombuffer(content, np.uint8)
        walk = walk_records(buffer, start=0, stop=len(buffer), until=_SINGLE)
        if walk.end == 0:
            return None, self._no_record(position, opcode, end, len(content))
        # A walk that ended early has met a chunk or the end: the next stretch begins small again.
        used_up = walk.end + PREFIX_BYTES > len(buffer) or len(walk.starts) > 1
        self._stretch = min(self._stretch * 4, _STRETCH_BYTES) if used_up else _FIRST_STRETCH_BYTES
        segment = BareSegment(
            offset=position,
            buffer=buffer[: walk.end],
            table=table_from_walk(buffer, walk),
            in_chunked_log=self._chunks_seen,
        )
        return segment, position + walk.end

    def _no_record(self, position: int, opcode: int, end: int, found: int) -> int:
        if found < end - position:
            return self._broken(position, "the file became shorter while it was read", record_name(opcode))
        # The only record that fits and yet can't be one; its length is as good as any other.
        what = "a message too short to hold its own fields"
        self._damage.add(what, offset=position, record="Message", lost_messages=1)
        return end


def _header_from_summary(start: bytes, listed: ChunkIndex) -> ChunkHeader | None:
    """Build a chunk's header from the summary; only the checksum comes from the chunk, and proves the rest."""
    # Without it nothing would tell a chunk from whatever lies at that place.
    crc = int.from_bytes(start[PREFIX_BYTES + 24 : PREFIX_BYTES + 28], "little")
    if crc == 0:
        return None
    return ChunkHeader(
        start_time_ns=listed.start_time_ns,
        end_time_ns=listed.end_time_ns,
        uncompressed_size=listed.uncompressed_size,
        uncompressed_crc=crc,
        compression=listed.compression,
        data_offset=listed.offset + listed.length - listed.compressed_size,
        compressed_size=listed.compressed_size,
    )
