"""Records of an MCAP log as its bytes come, without index or summary."""

from collections import Counter
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.live.reception import Reception
from chladni.io.mcap.channel_registry import ChannelRegistry, McapChannel
from chladni.io.mcap.chunk import ChunkRules, chunk_content, open_chunk
from chladni.io.mcap.damage import Damage
from chladni.io.mcap.data_section import ChunkSegment
from chladni.io.mcap.limits import Limits
from chladni.io.mcap.message_table import table_from_walk
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import (
    CHUNK_HEADER_BYTES,
    KNOWN_COMPRESSIONS,
    MAGIC,
    PREFIX_BYTES,
    RECORD_PREFIX,
    MalformedRecordError,
    Opcode,
    parse_chunk_header,
)
from chladni.io.mcap.selection import Selection
from chladni.io.mcap.stretch_content import StretchContent, fill_content
from chladni.signals.errors import LogError
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.mcap.message_batch import MessageBatch

_BARE: Final = frozenset([Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL])
_END: Final = frozenset([Opcode.DATA_END, Opcode.FOOTER])
#: Records that a walk over messages outside chunks stops at.
_SINGLE: Final = frozenset(Opcode) - _BARE
_KNOWN: Final = frozenset(int(one) for one in Opcode)
#: Records that are neither messages nor chunks hold words about the log; longer ones are no such record.
_LONGEST_OTHER: Final = 1 << 32


@cache
def _everything() -> Selection:
    return Selection(channel_ids=frozenset(range(1 << 16)))


class McapStream:
    """Takes the bytes of a log in pieces of any size and gives whole messages; what is torn waits for its rest.

    Parameters
    ----------
    name
        Of the log, for messages.
    limits
        What may be held in memory on the word of the log.

    Attributes
    ----------
    position
        Offset in the log of the first byte that isn't used yet.
    ended
        Whether the end of the data was met: nothing more can come.
    """

    def __init__(self, name: str, *, limits: Limits | None = None) -> None:
        self.name = name
        self.position = 0
        self.ended = False
        self._limits = limits or Limits()
        self._registry = ChannelRegistry(self._limits)
        self._bytes = bytearray()
        self._skip = 0
        self._begun = False
        self._lost_since: int | None = None
        self._checksums = False
        self._contradicted: set[int] = set()
        self._unknown: set[int] = set()
        self._batches: list[MessageBatch] = []
        self._told: list[str] = []

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """Channels defined so far."""
        return self._registry.channels

    @property
    def wanted(self) -> int:
        """Offset in the log of the next byte to feed."""
        return self.position + len(self._bytes)

    def feed(self, content: bytes) -> Reception:
        """Take the next bytes.

        Raises
        ------
        LogError
            When the first bytes are none of an MCAP log.
        """
        self._batches, self._told = [], []
        self._bytes += content
        if not self._begun:
            self._begin()
        while self._begun and not self.ended and self._bytes and self._next():
            pass
        return Reception(batches=tuple(self._batches), told=tuple(self._told), ended=self.ended)

    def finish(self) -> Reception:
        """Say what is missing where no more bytes will come."""
        self._batches, told = [], []
        if not self._begun:
            told.append(f"{self.name}: ended within its first {len(MAGIC)} bytes; it holds no message")
        elif not self.ended:
            torn = f", {len(self._bytes)} bytes within a record" if self._bytes else ""
            told.append(
                f"{self.name}: ended at byte {self.wanted} without a footer{torn}: its recording was cut off; all "
                "whole messages before are used"
            )
        self.ended = True
        return Reception(told=tuple(told), ended=True)

    # --- records ---

    def _begin(self) -> None:
        start = bytes(self._bytes[: len(MAGIC)])
        if not MAGIC.startswith(start):
            raise LogError(
                f"{self.name}: not an MCAP log: starts with {start.hex(' ')}, expected the MCAP magic "
                f"{MAGIC.hex(' ')}; give a log, or a recorder's output, in MCAP"
            )
        if len(start) == len(MAGIC):
            self._begun = True
            self._drop(len(MAGIC))

    def _drop(self, count: int) -> None:
        del self._bytes[:count]
        self.position += count

    def _next(self) -> bool:
        """Use the next record; False while it isn't whole."""
        if self._skip:
            part = min(self._skip, len(self._bytes))
            self._skip -= part
            self._drop(part)
            return True
        if self._lost_since is not None:
            return self._find_chunk()
        if len(self._bytes) < PREFIX_BYTES:
            return False
        opcode, length = RECORD_PREFIX.unpack_from(self._bytes)
        if opcode == 0:
            # Space that a recorder has taken and not yet filled reads as zeros: it's read again.
            self._bytes.clear()
            return False
        if opcode == Opcode.CHUNK:
            return self._chunk(length)
        if opcode in _END:
            self.ended = True
            return False
        if opcode in _BARE:
            return self._bare(length)
        if (opcode not in _KNOWN and opcode < 0x80) or length > _LONGEST_OTHER:
            return self._lose("no record of an MCAP log")
        self._skip = PREFIX_BYTES + length
        return True

    def _chunk(self, length: int) -> bool:
        excess = self._limits.excess("chunk_bytes", length)
        if excess is not None:
            return self._lose(f"the chunk {excess}")
        whole = PREFIX_BYTES + length
        if len(self._bytes) < min(whole, CHUNK_HEADER_BYTES):
            return False
        try:
            header = parse_chunk_header(bytes(self._bytes[:CHUNK_HEADER_BYTES]), offset=0)
        except MalformedRecordError as problem:
            return self._lose(str(problem))
        excess = self._limits.excess("chunk_bytes", header.uncompressed_size)
        if excess is not None:
            self._told.append(f"{self.name}: at byte {self.position} the chunk {excess}; its messages are left out")
            self._skip = whole
            return True
        if len(self._bytes) < whole:
            return False
        rules = ChunkRules(check_crc=True, checksum_expected=self._checksums)
        self._checksums |= header.uncompressed_crc != 0
        opened = open_chunk(header, bytes(self._bytes[header.data_offset : whole]), rules)
        segment = ChunkSegment(offset=self.position, header=header, index=(), data=None, listed=None, agrees=False)
        self._take(chunk_content(segment, opened, _everything()))
        self._drop(whole)
        return True

    def _bare(self, length: int) -> bool:
        whole = PREFIX_BYTES + length
        excess = self._limits.excess("record_bytes", whole)
        if excess is not None:
            self._told.append(f"{self.name}: at byte {self.position} the record {excess}; it is left out")
            self._skip = whole
            return True
        if len(self._bytes) < whole:
            return False
        buffer = np.frombuffer(bytes(self._bytes), np.uint8)
        walk = walk_records(buffer, start=0, stop=len(buffer), until=frozenset(int(one) for one in _SINGLE))
        if walk.end == 0:
            return self._lose("a message too short to hold its own fields")
        content = StretchContent(offset=self.position)
        fill_content(content, buffer[: walk.end], table_from_walk(buffer, walk), _everything())
        self._take(content)
        self._drop(walk.end)
        return True

    # --- damage ---

    def _lose(self, what: str) -> bool:
        """Look for the next chunk behind what can't be a record."""
        self._told.append(f"{self.name}: damaged at byte {self.position}: {what}; the next whole chunk is looked for")
        self._lost_since = self.position
        self._drop(1)
        return True

    def _find_chunk(self) -> bool:
        while True:
            place = self._bytes.find(bytes([Opcode.CHUNK]))
            if place < 0:
                self._drop(len(self._bytes))
                return False
            self._drop(place)
            if len(self._bytes) < CHUNK_HEADER_BYTES:
                return False
            if self._seems_chunk():
                lost = self.position - (self._lost_since or 0)
                self._told.append(f"{self.name}: reading goes on at byte {self.position}, {lost} bytes are lost")
                self._lost_since = None
                return True
            self._drop(1)

    def _seems_chunk(self) -> bool:
        try:
            header = parse_chunk_header(bytes(self._bytes[:CHUNK_HEADER_BYTES]), offset=0)
        except MalformedRecordError:
            return False
        sizes = max(header.compressed_size, header.uncompressed_size)
        # A checksum must prove it: nothing else tells a chunk from bytes that look like one.
        return (
            header.compression in KNOWN_COMPRESSIONS
            and header.uncompressed_crc != 0
            and self._limits.excess("chunk_bytes", sizes) is None
        )

    # --- content ---

    def _take(self, content: StretchContent) -> None:
        for definition in content.definitions:
            try:
                fresh = self._registry.define(definition.opcode, definition.content) - self._contradicted
            except MalformedRecordError as problem:
                self._told.append(f"{self.name}: at byte {content.offset}: {problem}")
                continue
            if fresh:
                self._contradicted |= fresh
                told = ", ".join(str(one) for one in sorted(fresh))
                self._told.append(f"{self.name}: channel {told} is defined in two ways; its messages are left out")
        self._told += [self._sentence(one) for one in content.damage]
        unknown = Counter({one: n for one, n in content.found.items() if one not in self._registry.channels})
        if fresh_ids := set(unknown) - self._unknown:
            self._unknown |= fresh_ids
            told = counted(sum(unknown[one] for one in fresh_ids), "message")
            names = ", ".join(str(one) for one in sorted(fresh_ids))
            self._told.append(
                f"{self.name}: {told} of undefined channels ({names}), and all later ones, are left out"
            )
        refused = self._contradicted | set(unknown)
        self._batches += [batch for batch in content.batches if batch.channel_id not in refused]

    def _sentence(self, damage: Damage) -> str:
        lost = f" ({counted(damage.lost_messages, 'message')} lost)" if damage.lost_messages else ""
        return f"{self.name}: at byte {damage.offset}: {damage.what}{lost}"
