"""Still encoded messages of one channel, as columns."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Bytes, Mask, Whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MessageBatch:
    """Still encoded messages of one channel from one stretch (usually a chunk) of a log.

    The payload of message ``i`` is ``buffer[offsets[i] : offsets[i] + lengths[i]]``; nothing is
    copied. Messages of equal length that follow each other come with a constant stride, so that
    a decoder can look at all of them through one strided view.

    Parameters
    ----------
    channel_id
        Id of the channel in the log.
    buffer
        Bytes of the stretch, shape ``(byte,)``, uint8, contiguous, read-only.
    offsets, lengths
        First payload byte of each message in ``buffer`` and its payload bytes, shape ``(message,)``.
    log_time_ns, publish_time_ns
        When each message was recorded and published, in ns since the log's epoch.
    sequence
        The publisher's counter.
    """

    channel_id: int
    buffer: Bytes
    offsets: Whole
    lengths: Whole
    log_time_ns: Whole
    publish_time_ns: Whole
    sequence: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.offsets)

    def parts(self, size: int) -> Iterator["MessageBatch"]:
        """Give the batch in parts of so many messages."""
        if len(self) <= size:
            yield self
            return
        for first in range(0, len(self), size):
            yield self.kept(slice(first, first + size))

    def kept(self, chosen: slice | Mask) -> "MessageBatch":
        """Give some of the messages."""
        return replace(
            self,
            offsets=self.offsets[chosen],
            lengths=self.lengths[chosen],
            log_time_ns=self.log_time_ns[chosen],
            publish_time_ns=self.publish_time_ns[chosen],
            sequence=self.sequence[chosen],
        )
