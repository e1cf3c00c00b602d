"""One pass over a log: decompresses ahead in threads, checks what comes out against the rest of the log."""

import os
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from isal import isal_zlib

from chladni.io.mcap.channel_registry import ChannelRegistry
from chladni.io.mcap.chunk import ChunkRules, OpenedChunk, chunk_content, open_chunk
from chladni.io.mcap.damage import DamageList
from chladni.io.mcap.data_section import BareSegment, ChunkSegment, DataSection, Segment
from chladni.io.mcap.decompress import BELIEVED_RATIO
from chladni.io.mcap.limits import MIB, Limits
from chladni.io.mcap.log_file import LogFile
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.mcap.records import ChunkHeader, MalformedRecordError, record_name
from chladni.io.mcap.selection import Selection
from chladni.io.mcap.stretch_content import StretchContent, fill_content
from chladni.io.mcap.summary import LogEnd
from chladni.signals.arrays import Bytes

_MOST_THREADS = 4
_BYTES_AHEAD = 64 * MIB
# Finishes what was started in a thread.
_Task = Callable[[], StretchContent]
_BLOCK_BYTES = 1 << 20


class LogPass:
    """Reads the messages that are asked for, once, and keeps the books on all others that it meets.

    Parameters
    ----------
    file, end
        The log, and what its end tells.
    registry
        Channels known so far; the pass adds those that it finds.
    damage
        Where damage is noted.
    selection
        What is asked for.
    listed
        Channels of a summary that lists all; None without one.
    limits, check_crc
        As in `McapContainer.open`.
    """

    def __init__(
        self,
        file: LogFile,
        *,
        end: LogEnd,
        registry: ChannelRegistry,
        damage: DamageList,
        selection: Selection,
        listed: frozenset[int] | None,
        limits: Limits,
        check_crc: bool,
    ) -> None:
        self._file = file
        self._end = end
        self._registry = registry
        self._damage = damage
        self._selection = selection
        self._listed = listed
        self._limits = limits
        self._check_crc = check_crc
        self._crc = DataCrc(file, end)
        self._checksum_seen = False
        self._contradicted: set[int] = set()
        self._skipped_any = False
        self._expanded = 0
        self.found: Counter[int] = Counter()
        self._lost: Counter[int] = Counter()
        self._first_ns: int | None = None
        self._last_ns: int | None = None

    @property
    def time_range_ns(self) -> tuple[int, int] | None:
        """Log time of the first and of the last message met, None before the first."""
        if self._first_ns is None or self._last_ns is None:
            return None
        return self._first_ns, self._last_ns

    def batches(self) -> Iterator[MessageBatch]:
        """Yield the batches in file order; the books are complete at the end."""
        section = DataSection(
            self._file,
            self._end,
            self._damage,
            self._limits,
            channel_ids=self._selection.channel_ids,
        )
        # More threads than that only wait for each other: what they can't do in parallel is what the
        # reader has to do anyway. One core is left to whoever decodes what comes out.
        threads = max(1, min(_MOST_THREADS, (os.cpu_count() or 2) - 1))
        pool = ThreadPoolExecutor(threads, thread_name_prefix="mcap")
        ahead: deque[tuple[int, _Task]] = deque()
        try:
            for segment in section.segments():
                size = _size(segment)
                while ahead and (len(ahead) > threads or size + sum(n for n, _ in ahead) > _BYTES_AHEAD):
                    yield from self._enter(ahead.popleft()[1]())
                task = self._start(pool, segment)
                if task is not None:
                    ahead.append((size, task))
                if isinstance(segment, BareSegment) and self._crc.wanted and self._check_crc:
                    self._crc.take(segment.offset, segment.buffer)
            while ahead:
                yield from self._enter(ahead.popleft()[1]())
            self._check_data_crc()
        finally:
            pool.shutdown(cancel_futures=True)
        self._close_books()

    def _check_data_crc(self) -> None:
        # With chunks left out, reading all bytes for the checksum would undo what leaving them out saves.
        if not self._crc.wanted or not self._check_crc or self._skipped_any:
            return
        if not self._crc.is_right():
            what = "the checksum over all data is wrong: messages outside chunks may not be what was recorded"
            self._damage.add(what, offset=self._end.data_end, record="DataEnd", lost_messages=0)

    # ---------------------------------------------------------------- one segment

    def _start(self, pool: ThreadPoolExecutor, segment: Segment) -> _Task | None:
        """Start decompressing a segment in a thread; None when nothing in it is asked for."""
        if isinstance(segment, BareSegment):
            return partial(_bare_content, segment, self._selection, self._check_crc)
        if self._can_skip(segment):
            self._skipped_any = True
            self.found.update({one.channel_id: len(one.entries) for one in segment.index})
            return None
        header = segment.header
        flaw = self._refused(header)
        if flaw is not None:
            refused = OpenedChunk(buffer=None, flaw=flaw)
            return partial(chunk_content, segment, refused, self._selection)
        rules = ChunkRules(check_crc=self._check_crc, checksum_expected=self._checksum_seen)
        self._checksum_seen |= header.uncompressed_crc != 0
        data: bytes | memoryview | None = segment.data
        if data is None:
            data = self._file.read(header.data_offset, header.compressed_size)
        opened = pool.submit(open_chunk, header, data, rules)
        return lambda: chunk_content(segment, opened.result(), self._selection)

    def _refused(self, header: ChunkHeader) -> str | None:
        """Say why a chunk may not be decompressed, before a byte of it is read: its sizes are claims so far."""
        for size in (header.compressed_size, header.uncompressed_size):
            excess = self._limits.excess("chunk_bytes", size)
            if excess is not None:
                return f"the chunk {excess}"
        expanded = self._expanded + header.uncompressed_size
        if expanded > BELIEVED_RATIO * self._file.size:
            excess = self._limits.excess("expanded_bytes", expanded)
            if excess is not None:
                return f"the chunk with those before it {excess}"
        self._expanded = expanded
        return None

    def _can_skip(self, segment: ChunkSegment) -> bool:
        """Tell whether a chunk surely holds nothing that is asked for.

        A wrong index must not hide messages: summary (under its checksum), the chunk's header and its
        message indexes have to say the same; the statistics then settle at the end whether that was all.
        """
        end, listed = self._end, segment.listed
        if not (end.crc_checked and end.lists_all_channels and end.statistics is not None):
            return False
        if listed is None or not segment.agrees or not segment.index:
            return False
        if {one.channel_id for one in segment.index} != listed.channel_ids:
            return False
        # An empty index is as good as none: it says that the channel isn't in the chunk.
        wanted = [
            one.entries["log_time"]
            for one in segment.index
            if one.channel_id in self._selection.channel_ids and len(one.entries)
        ]
        if wanted and self._selection.covers(segment.header.start_time_ns, segment.header.end_time_ns):
            return False
        return not any(self._selection.touches(int(times.min()), int(times.max())) for times in wanted)

    def _enter(self, content: StretchContent) -> list[MessageBatch]:
        """Enter a decoded stretch into the books and return those of its batches that can be given out."""
        self._damage.extend(content.damage)
        self._lost.update(content.lost)
        self._define(content)
        # In the middle of a damaged chunk everything looks like messages outside chunks.
        if content.unprotected and content.found.total():
            what = "messages outside the chunks, in a log whose chunks carry the checksums, are left out"
            self._leave_out(content, set(content.found), what)
        unknown = content.found.keys() - self._registry.channels.keys()
        if unknown:
            what = f"messages of the undefined channel {_listing(unknown)} are left out"
            self._leave_out(content, unknown, what)
        # Nobody can have asked for them.
        unlisted = set[int]() if self._listed is None else content.found.keys() - self._listed
        if unlisted:
            what = f"messages of channel {_listing(unlisted)}, which the summary doesn't list, are left out"
            self._leave_out(content, unlisted, f"{what}; 'mcap recover' writes a whole summary")
        # Which of the two definitions these messages follow can't be known; decoded by the wrong one they
        # would be wrong without looking wrong.
        contradicted = content.found.keys() & self._contradicted
        if contradicted:
            what = f"messages of channel {_listing(contradicted)}, defined in two ways, are left out"
            self._leave_out(content, contradicted, what)
        self.found.update(content.found)
        self._note_times(content)
        return content.batches

    def _leave_out(self, content: StretchContent, channel_ids: set[int], what: str) -> None:
        lost = Counter({number: content.found.pop(number) for number in sorted(channel_ids)})
        self._lost.update(lost)
        self._damage.add(what, offset=content.offset, record="Message", lost_messages=lost.total())
        content.batches = [batch for batch in content.batches if batch.channel_id not in channel_ids]

    def _define(self, content: StretchContent) -> None:
        for definition in content.definitions:
            name = record_name(definition.opcode)
            known = len(self._registry.channels)
            try:
                contradicted = self._registry.define(definition.opcode, definition.content)
            except MalformedRecordError as problem:
                self._damage.add(str(problem), offset=content.offset, record=name, lost_messages=0)
                continue
            if contradicted:
                self._contradicted |= contradicted
                what = f"channel {_listing(contradicted)} is defined here otherwise than before"
                self._damage.add(what, offset=content.offset, record=name, lost_messages=0)
            if self._end.lists_all_channels and len(self._registry.channels) > known:
                what = "a channel is defined here that the summary doesn't know"
                self._damage.add(what, offset=content.offset, record=name, lost_messages=0)

    def _note_times(self, content: StretchContent) -> None:
        first, last = content.first_time_ns, content.last_time_ns
        if first is None or last is None or not content.found.total():
            return
        self._first_ns = first if self._first_ns is None else min(first, self._first_ns)
        self._last_ns = last if self._last_ns is None else max(last, self._last_ns)

    # ---------------------------------------------------------------- the end

    def _close_books(self) -> None:
        for channel_id, schema_id in sorted(self._registry.undefined_schemas().items()):
            what = f"channel {channel_id} refers to schema {schema_id}, which the log doesn't define"
            self._damage.add(what, offset=self._end.data_end, record="Channel", lost_messages=0)
        statistics = self._end.statistics
        if statistics is None:
            return
        channel_ids = self._selection.channel_ids
        # A pass that takes stock asks for no channel but meets them all.
        if not self._end.lists_all_channels:
            channel_ids = frozenset(statistics.message_counts) | frozenset(self.found)
        for channel_id in sorted(channel_ids):
            counted = statistics.message_counts.get(channel_id, 0)
            self._compare(channel_id, counted=counted, met=self.found[channel_id] + self._lost[channel_id])

    def _compare(self, channel_id: int, *, counted: int, met: int) -> None:
        if counted == met:
            return
        way = "fewer" if met < counted else "more"
        what = (
            f"channel {channel_id} has {abs(counted - met)} messages {way} than the statistics count, "
            "beyond other damage told of"
        )
        # Messages that are there beyond the count are no loss, but one of the two numbers is wrong.
        lost = max(counted - met, 0)
        self._damage.add(what, offset=self._end.data_end, record="Statistics", lost_messages=lost)


def _size(segment: Segment) -> int:
    """Return how many bytes a segment takes in memory while it waits."""
    if isinstance(segment, BareSegment):
        return len(segment.buffer)
    return segment.header.compressed_size + segment.header.uncompressed_size


def _bare_content(segment: BareSegment, selection: Selection, check_crc: bool) -> StretchContent:
    content = StretchContent(offset=segment.offset, unprotected=segment.in_chunked_log and check_crc)
    fill_content(content, segment.buffer, segment.table, selection)
    return content


def _listing(channel_ids: set[int] | frozenset[int]) -> str:
    """Return a few ids in words.

    >>> _listing({3, 1, 2, 9, 7})
    '1, 2, 3, ...'
    """
    first = ", ".join(str(number) for number in sorted(channel_ids)[:3])
    return first if len(channel_ids) <= 3 else f"{first}, ..."


class DataCrc:
    """CRC-32 from the start of the log up to DataEnd, kept in step with the walk so that pages are read once.

    Parameters
    ----------
    file, end
        The log, and what its end tells.
    """

    def __init__(self, file: LogFile, end: LogEnd) -> None:
        self._file = file
        self._end = end
        self._position = 0
        self._crc = 0

    @property
    def wanted(self) -> bool:
        """Whether the log carries such a checksum."""
        return self._end.data_crc != 0

    def take(self, offset: int, content: Bytes) -> None:
        """Take in bytes that have been read already, and those of the file before them."""
        self._read_to(offset)
        if self._position == offset:
            self._crc = isal_zlib.crc32(content.data, self._crc)
            self._position += len(content)

    def _read_to(self, offset: int) -> None:
        while self._position < offset:
            block = self._file.read(self._position, min(_BLOCK_BYTES, offset - self._position))
            if not block:
                return
            self._crc = isal_zlib.crc32(block, self._crc)
            self._position += len(block)

    def is_right(self) -> bool:
        """Take in the rest and compare."""
        self._read_to(self._end.data_end)
        return self._crc == self._end.data_crc
