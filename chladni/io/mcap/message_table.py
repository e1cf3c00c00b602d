"""Messages of a decompressed stretch as columns, found by index or by walk."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.io.mcap.record_walk import RecordWalk, walk_records
from chladni.io.mcap.records import (
    MESSAGE_FIELDS_BYTES,
    PREFIX_BYTES,
    MessageIndex,
    Opcode,
)
from chladni.signals.arrays import Bytes, Index, Whole

MESSAGE_HEADER = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel_id", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
MESSAGE_HEADER_BYTES = MESSAGE_HEADER.itemsize
# With more stretches between indexed messages than this, one walk over all is faster than looking at each.
_MOST_STRETCHES = 256
_NO_STARTS: Whole = np.empty(0, np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MessageTable:
    """Starts and headers of a stretch's messages, starts of its other records, end of its sound part."""

    starts: Whole
    headers: NDArray[np.void]
    others: Whole
    end: int


def message_headers(buffer: Bytes, starts: Whole) -> NDArray[np.void]:
    """Return the headers of the messages at ``starts`` (which must lie inside), a view when equally spaced."""
    view = _even_headers(buffer, starts)
    if view is not None:
        return view
    # A header at every byte, overlapping; indexing then copies one header a message.
    everywhere: NDArray[np.void] = np.ndarray(
        len(buffer) - MESSAGE_HEADER_BYTES + 1, MESSAGE_HEADER, buffer, strides=(1,)
    )
    return everywhere[starts]


def choose_messages(buffer: Bytes, table: MessageTable, chosen: Index) -> tuple[Whole, NDArray[np.void]]:
    """Return starts and headers of some messages of a table, the headers as a view when equally spaced."""
    starts = table.starts[chosen]
    view = _even_headers(buffer, starts)
    return starts, table.headers[chosen] if view is None else view


def _even_headers(buffer: Bytes, starts: Whole) -> NDArray[np.void] | None:
    if len(starts) == 0:
        return np.empty(0, MESSAGE_HEADER)
    stride = _constant_stride(starts)
    if stride is None:
        return None
    return np.ndarray(len(starts), MESSAGE_HEADER, buffer, offset=int(starts[0]), strides=(stride,))


def _constant_stride(starts: Whole) -> int | None:
    if len(starts) < 2:
        return MESSAGE_HEADER_BYTES
    stride = int(starts[1]) - int(starts[0])
    # One comparison before a thousand: most stretches that are not evenly spaced show it here already.
    if starts[0] + stride * (len(starts) - 1) != starts[-1]:
        return None
    return stride if (starts[1:] - starts[:-1] == stride).all() else None


def table_from_walk(buffer: Bytes, walk: RecordWalk) -> MessageTable:
    """Tell the messages that a walk has found from other records."""
    is_message = buffer[walk.starts] == Opcode.MESSAGE
    messages, others = walk.starts[is_message], walk.starts[~is_message]
    return MessageTable(starts=messages, headers=message_headers(buffer, messages), others=others, end=walk.end)


def table_from_index(buffer: Bytes, index: Sequence[MessageIndex]) -> MessageTable | None:
    """Find the messages of a chunk through its message indexes, which are not trusted.

    Returns
    -------
    MessageTable or None
        None unless every entry points to a message of its channel and log time inside the chunk,
        and these messages together with other records tile the chunk exactly.
    """
    starts, log_time, channel_id = _merge(index)
    # Sorted, so that the first and the last speak for all; as int64, an offset of 2^63 and more is negative.
    if len(starts) == 0 or starts[0] < 0 or starts[-1] > len(buffer) - MESSAGE_HEADER_BYTES:
        return None
    headers = message_headers(buffer, starts)
    lengths = headers["length"].astype(np.int64)
    agrees = (headers["channel_id"] == channel_id) & (headers["log_time"] == log_time)
    agrees &= headers["opcode"] == Opcode.MESSAGE
    # As int64, a length of 2^63 and more is negative.
    if not agrees.all() or lengths.min() < MESSAGE_FIELDS_BYTES or lengths.max() > len(buffer):
        return None
    lengths += PREFIX_BYTES
    lengths += starts
    others = _others_between(buffer, starts, lengths)
    if others is None:
        return None
    return MessageTable(starts=starts, headers=headers, others=others, end=len(buffer))


def _merge(
    index: Sequence[MessageIndex],
) -> tuple[Whole, NDArray[np.uint64], NDArray[np.uint16] | int]:
    """Return offset, log time and channel of all indexed messages, by offset."""
    if len(index) == 1:
        entries, channel_id = index[0].entries, index[0].channel_id
        starts = entries["offset"].astype(np.int64)
        # The usual case by far, and worth its own way: no sorting, no joining.
        if (starts[1:] > starts[:-1]).all():
            return starts, entries["log_time"], channel_id
    starts = np.concatenate([one.entries["offset"] for one in index]).astype(np.int64)
    order = np.argsort(starts, kind="stable")
    log_time = np.concatenate([one.entries["log_time"] for one in index])
    ids = np.array([one.channel_id for one in index], np.uint16)
    channel_ids = np.repeat(ids, [len(one.entries) for one in index])
    return starts[order], log_time[order], channel_ids[order]


def _others_between(buffer: Bytes, starts: Whole, ends: Whole) -> Whole | None:
    """Return the records other than messages between messages, None when these don't tile the buffer."""
    gaps = np.flatnonzero(ends[:-1] != starts[1:])
    if len(gaps) > _MOST_STRETCHES:
        walked = table_from_walk(buffer, walk_records(buffer, start=0, stop=len(buffer)))
        tiles = walked.end == len(buffer) and np.array_equal(walked.starts, starts)
        return walked.others if tiles else None
    stretches = [(0, int(starts[0])), (int(ends[-1]), len(buffer))]
    stretches += zip(ends[gaps].tolist(), starts[gaps + 1].tolist(), strict=True)
    found = [_NO_STARTS]
    for start, stop in stretches:
        if start != stop:
            walk = walk_records(buffer, start=start, stop=stop, until=frozenset([Opcode.MESSAGE]))
            if walk.end != stop:
                return None
            found.append(walk.starts)
    return np.concatenate(found)
