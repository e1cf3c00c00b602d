"""The messages and definitions of one decompressed stretch of a log."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.io.mcap.damage import Damage
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.mcap.message_table import MessageTable, choose_messages
from chladni.io.mcap.records import (
    MESSAGE_FIELDS_BYTES,
    PREFIX_BYTES,
    RECORD_PREFIX,
    Opcode,
)
from chladni.io.mcap.selection import Selection
from chladni.signals.arrays import Bytes, Whole


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


def fill_content(content: StretchContent, buffer: Bytes, table: MessageTable, selection: Selection) -> None:
    """Split the messages in ``table`` into batches by channel, and collect definitions."""
    content.definitions.extend(_definitions(buffer, table.others))
    for channel_id, starts, headers in _by_channel(buffer, table):
        batch = MessageBatch(
            channel_id=channel_id,
            buffer=buffer,
            offsets=starts + (PREFIX_BYTES + MESSAGE_FIELDS_BYTES),
            lengths=headers["length"].astype(np.int64) - MESSAGE_FIELDS_BYTES,
            log_time_ns=headers["log_time"].astype(np.int64),
            publish_time_ns=headers["publish_time"].astype(np.int64),
            sequence=headers["sequence"].astype(np.uint32),
        )
        _add_batch(content, batch, selection)


def _definitions(buffer: Bytes, starts: Whole) -> Iterator[Definition]:
    if len(starts) == 0:
        return
    opcodes = buffer[starts]
    for start in starts[(opcodes == Opcode.SCHEMA) | (opcodes == Opcode.CHANNEL)].tolist():
        opcode, length = RECORD_PREFIX.unpack_from(buffer.data, start)
        content = buffer[start + PREFIX_BYTES : start + PREFIX_BYTES + length].tobytes()
        yield Definition(opcode=opcode, content=content, position=start)


def _by_channel(buffer: Bytes, table: MessageTable) -> Iterator[tuple[int, Whole, NDArray[np.void]]]:
    """Group messages by channel, in file order within each."""
    if len(table.starts) == 0:
        return
    ids = table.headers["channel_id"]
    if (ids == ids[0]).all():
        yield int(ids[0]), table.starts, table.headers
        return
    # Stable, so that messages keep their order within a channel; 16-bit keys are sorted in linear time.
    order = np.argsort(ids, kind="stable")
    borders = np.flatnonzero(np.diff(ids[order])) + 1
    for group in np.split(order, borders):
        yield int(ids[group[0]]), *choose_messages(buffer, table, group)


def _add_batch(content: StretchContent, batch: MessageBatch, selection: Selection) -> None:
    log_time = batch.log_time_ns
    first, last = int(log_time.min()), int(log_time.max())
    # As int64, times of 2^63 ns and more are negative.
    if first < 0 or batch.publish_time_ns.min() < 0:
        sound = (log_time >= 0) & (batch.publish_time_ns >= 0)
        _report_times(content, batch.channel_id, int(len(sound) - sound.sum()))
        batch = batch.kept(sound)
        if len(batch) == 0:
            return
        first, last = int(batch.log_time_ns.min()), int(batch.log_time_ns.max())
    content.found[batch.channel_id] += len(batch)
    content.first_time_ns = first if content.first_time_ns is None else min(first, content.first_time_ns)
    content.last_time_ns = last if content.last_time_ns is None else max(last, content.last_time_ns)
    if batch.channel_id not in selection.channel_ids or not selection.touches(first, last):
        return
    if not selection.covers(first, last):
        batch = batch.kept(selection.mask(batch.log_time_ns))
    if len(batch):
        content.batches.append(batch)


def _report_times(content: StretchContent, channel_id: int, count: int) -> None:
    content.lost[channel_id] += count
    content.damage.append(
        Damage(
            what=f"{count} messages of channel {channel_id} have a time beyond 2^63 ns and are left out",
            offset=content.offset,
            record="Message",
            lost_messages=count,
        )
    )
