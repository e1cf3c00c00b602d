"""The first messages of a source, held in memory until the channels and their clocks are known."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from chladni.io.mcap.channel_registry import McapChannel
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.mcap.selection import Selection


class HeldMessages:
    """Messages in memory, read as a log's are; see `chladni.io.messages.Messages`.

    Parameters
    ----------
    name
        Of the source.
    channels
        By id.
    held
        In the order in which they came.
    """

    def __init__(self, name: str, channels: Mapping[int, McapChannel], held: Sequence[MessageBatch]) -> None:
        self.path = Path(name)
        self.channels = dict(channels)
        self._held = tuple(held)

    @property
    def time_range_ns(self) -> tuple[int, int] | None:
        """Log time of the first and of the last message, None without any."""
        if not self._held:
            return None
        return (
            min(int(batch.log_time_ns.min()) for batch in self._held),
            max(int(batch.log_time_ns.max()) for batch in self._held),
        )

    def message_counts(self) -> Mapping[int, int]:
        """How many messages each channel has."""
        counts: Counter[int] = Counter()
        for batch in self._held:
            counts[batch.channel_id] += len(batch)
        return counts

    def batches(
        self,
        channel_ids: Collection[int],
        *,
        start_time_ns: int | None = None,
        end_time_ns: int | None = None,
    ) -> Iterator[MessageBatch]:
        """Messages of some channels between two log times."""
        wanted = Selection(channel_ids=frozenset(channel_ids), start_time_ns=start_time_ns, end_time_ns=end_time_ns)
        for batch in self._held:
            if batch.channel_id in wanted.channel_ids:
                yield from chosen(batch, wanted)


def chosen(batch: MessageBatch, wanted: Selection) -> Iterator[MessageBatch]:
    """Messages of a batch that are asked for, if there are any."""
    first, last = int(batch.log_time_ns.min()), int(batch.log_time_ns.max())
    if wanted.covers(first, last):
        yield batch
    elif wanted.touches(first, last):
        some = batch.kept(wanted.mask(batch.log_time_ns))
        if len(some):
            yield some


def joined_messages(
    channel_id: int, payloads: Sequence[bytes], log_time_ns: Sequence[int], *, sequence: int
) -> MessageBatch:
    """Make a batch of single messages.

    Parameters
    ----------
    channel_id
        Of all of them.
    payloads, log_time_ns
        ``[message]``.
    sequence
        Number of the first; the others follow.
    """
    lengths = np.array([len(one) for one in payloads], np.int64)
    times_ns = np.array(log_time_ns, np.int64)
    return MessageBatch(
        channel_id=channel_id,
        buffer=np.frombuffer(b"".join(payloads), np.uint8),
        offsets=np.cumsum(lengths) - lengths,
        lengths=lengths,
        log_time_ns=times_ns,
        publish_time_ns=times_ns,
        sequence=(np.arange(sequence, sequence + lengths.size) % 2**32).astype(np.uint32),
    )
