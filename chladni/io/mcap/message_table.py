"""Messages of a decompressed stretch as columns, found by index or by walk."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import (
    MESSAGE_FIELDS_BYTES,
    PREFIX_BYTES,
    MessageIndex,
    Opcode,
)

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
# More stretches between indexed messages than this, and the walk is faster than looking at each.
_MOST_STRETCHES = 256


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordStarts:
    """Starts of the messages and of all other records of a stretch, and where its sound part ends."""

    messages: NDArray[np.int64]
    others: NDArray[np.int64]
    end: int


def split_starts(buffer: NDArray[np.uint8], starts: NDArray[np.int64], *, end: int) -> RecordStarts:
    """Tell messages from other records."""
    is_message = buffer[starts] == Opcode.MESSAGE
    if is_message.all():
        return RecordStarts(messages=starts, others=starts[:0], end=end)
    return RecordStarts(messages=starts[is_message], others=starts[~is_message], end=end)


def message_headers(buffer: NDArray[np.uint8], starts: NDArray[np.int64]) -> NDArray[np.void]:
    """Return the headers of the messages at ``starts`` (which must lie inside), a view when equally spaced."""
    if len(starts) == 0:
        return np.empty(0, MESSAGE_HEADER)
    stride = constant_stride(starts)
    if stride is not None:
        return np.ndarray(len(starts), MESSAGE_HEADER, buffer, offset=int(starts[0]), strides=(stride,))
    # A header at every byte, overlapping; indexing then copies one header a message.
    everywhere: NDArray[np.void] = np.ndarray(
        len(buffer) - MESSAGE_HEADER_BYTES + 1, MESSAGE_HEADER, buffer, strides=(1,)
    )
    return everywhere[starts]


def constant_stride(starts: NDArray[np.int64]) -> int | None:
    """Return the distance of equally spaced starts, None when they are not."""
    if len(starts) < 2:
        return MESSAGE_HEADER_BYTES
    stride = int(starts[1]) - int(starts[0])
    evenly = starts[0] + stride * (len(starts) - 1) == starts[-1] and (np.diff(starts) == stride).all()
    return stride if evenly else None


def starts_from_index(buffer: NDArray[np.uint8], index: Sequence[MessageIndex]) -> RecordStarts | None:
    """Find the records of a chunk through its message indexes, which are not trusted.

    Returns
    -------
    RecordStarts or None
        None unless every entry points to a message of its channel and log time inside the chunk,
        and these messages together with other records tile the chunk exactly.
    """
    entries = [one.entries for one in index]
    offsets = np.concatenate([one["offset"] for one in entries])
    if len(offsets) == 0 or int(offsets.max()) > len(buffer) - MESSAGE_HEADER_BYTES:
        return None
    log_time = np.concatenate([one["log_time"] for one in entries])
    channel_id = np.repeat([one.channel_id for one in index], [len(one) for one in entries])
    starts = offsets.astype(np.int64)
    if not (np.diff(starts) > 0).all():
        order = np.argsort(starts, kind="stable")
        starts, log_time, channel_id = starts[order], log_time[order], channel_id[order]
    headers = message_headers(buffer, starts)
    agrees = (headers["channel_id"] == channel_id) & (headers["log_time"] == log_time)
    agrees &= headers["opcode"] == Opcode.MESSAGE
    lengths = headers["length"]
    agrees &= (lengths >= MESSAGE_FIELDS_BYTES) & (lengths <= len(buffer))
    if not agrees.all():
        return None
    others = _tile_between(buffer, starts, starts + PREFIX_BYTES + lengths.astype(np.int64))
    return None if others is None else RecordStarts(messages=starts, others=others, end=len(buffer))


def _tile_between(
    buffer: NDArray[np.uint8], starts: NDArray[np.int64], ends: NDArray[np.int64]
) -> NDArray[np.int64] | None:
    """Return the records other than messages between messages, None when these don't tile the buffer."""
    stretch_starts = np.concatenate([[0], ends])
    stretch_ends = np.concatenate([starts, [len(buffer)]])
    gaps = np.flatnonzero(stretch_starts != stretch_ends)
    if len(gaps) > _MOST_STRETCHES:
        return None
    found = [np.empty(0, np.int64)]
    for start, stop in zip(stretch_starts[gaps].tolist(), stretch_ends[gaps].tolist(), strict=True):
        walk = walk_records(buffer, start=start, stop=stop, until=frozenset([Opcode.MESSAGE]))
        if walk.end != stop:
            return None
        found.append(walk.starts)
    return np.concatenate(found)
