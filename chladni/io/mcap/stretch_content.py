"""The messages and definitions of one decompressed stretch of a log."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.io.mcap.damage import Damage
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.mcap.message_table import RecordStarts, message_headers
from chladni.io.mcap.records import (
    MESSAGE_FIELDS_BYTES,
    PREFIX_BYTES,
    RECORD_PREFIX,
    Opcode,
)
from chladni.io.mcap.selection import Selection

_LATEST_NS = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Definition:
    """A Schema or Channel record: its content, and where it lies in the stretch."""

    opcode: int
    content: bytes
    position: int


@dataclass(slots=True, kw_only=True, eq=False)
class StretchContent:
    """What one chunk, or one stretch outside chunks, holds.

    ``found`` counts the whole messages of every channel, asked for or not; ``lost`` those known to be
    lost; ``unprotected`` tells that they lie outside the chunks, whose checksums don't cover them.
    """

    offset: int
    batches: list[MessageBatch] = field(default_factory=list)
    definitions: list[Definition] = field(default_factory=list)
    found: Counter[int] = field(default_factory=Counter)
    lost: Counter[int] = field(default_factory=Counter)
    first_time_ns: int | None = None
    last_time_ns: int | None = None
    damage: list[Damage] = field(default_factory=list)
    unprotected: bool = False


def fill_content(
    content: StretchContent, buffer: NDArray[np.uint8], starts: RecordStarts, selection: Selection
) -> None:
    """Split the records at ``starts`` into batches by channel, and definitions."""
    content.definitions.extend(_definitions(buffer, starts.others))
    for channel_id, positions in _by_channel(buffer, starts.messages):
        headers = message_headers(buffer, positions)
        content.found[channel_id] += len(positions)
        sound = (headers["log_time"] <= _LATEST_NS) & (headers["publish_time"] <= _LATEST_NS)
        if not sound.all():
            _report_times(content, channel_id, int(len(sound) - sound.sum()))
            headers, positions = headers[sound], positions[sound]
        if len(positions):
            _note_times(content, headers["log_time"])
            if channel_id in selection.channel_ids:
                _add_batch(content, channel_id, buffer, positions, headers, selection)


def _definitions(buffer: NDArray[np.uint8], starts: NDArray[np.int64]) -> Iterator[Definition]:
    if len(starts) == 0:
        return
    opcodes = buffer[starts]
    for start in starts[(opcodes == Opcode.SCHEMA) | (opcodes == Opcode.CHANNEL)].tolist():
        opcode, length = RECORD_PREFIX.unpack_from(buffer.data, start)
        content = buffer[start + PREFIX_BYTES : start + PREFIX_BYTES + length].tobytes()
        yield Definition(opcode=opcode, content=content, position=start)


def _by_channel(buffer: NDArray[np.uint8], starts: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Group message starts by channel, in file order within each."""
    if len(starts) == 0:
        return
    ids = message_headers(buffer, starts)["channel_id"]
    if (ids == ids[0]).all():
        yield int(ids[0]), starts
        return
    order = np.argsort(ids, kind="stable")
    ids = ids[order]
    borders = np.flatnonzero(np.diff(ids)) + 1
    for group in np.split(order, borders):
        yield int(message_headers(buffer, starts[group[:1]])["channel_id"][0]), starts[group]


def _report_times(content: StretchContent, channel_id: int, count: int) -> None:
    content.lost[channel_id] += count
    content.found[channel_id] -= count
    content.damage.append(
        Damage(
            what=f"{count} messages of channel {channel_id} have a time beyond 2^63 ns and are left out",
            offset=content.offset,
            record="Message",
            lost_messages=count,
        )
    )


def _note_times(content: StretchContent, log_time: NDArray[np.uint64]) -> None:
    first, last = int(log_time.min()), int(log_time.max())
    content.first_time_ns = first if content.first_time_ns is None else min(first, content.first_time_ns)
    content.last_time_ns = last if content.last_time_ns is None else max(last, content.last_time_ns)


def _add_batch(
    content: StretchContent,
    channel_id: int,
    buffer: NDArray[np.uint8],
    positions: NDArray[np.int64],
    headers: NDArray[np.void],
    selection: Selection,
) -> None:
    log_time = headers["log_time"].astype(np.int64)
    if selection.has_times:
        chosen = selection.mask(log_time)
        positions, headers, log_time = positions[chosen], headers[chosen], log_time[chosen]
    if len(positions) == 0:
        return
    content.batches.append(
        MessageBatch(
            channel_id=channel_id,
            buffer=buffer,
            offsets=positions + (PREFIX_BYTES + MESSAGE_FIELDS_BYTES),
            lengths=headers["length"].astype(np.int64) - MESSAGE_FIELDS_BYTES,
            log_time_ns=log_time,
            publish_time_ns=headers["publish_time"].astype(np.int64),
            sequence=headers["sequence"].astype(np.uint32),
        )
    )
