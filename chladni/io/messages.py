"""What readers of messages ask of whatever holds them: a file, or memory."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Protocol

from chladni.io.mcap.channel_registry import McapChannel
from chladni.io.mcap.message_batch import MessageBatch


class Messages(Protocol):
    """Channels, and their messages as columns of still encoded bytes; see `McapContainer`."""

    path: Path

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """The channels by id."""

    @property
    def time_range_ns(self) -> tuple[int, int] | None:
        """Log time of the first and of the last message, None when it isn't known."""

    def message_counts(self) -> Mapping[int, int] | None:
        """How many messages each channel has; None when that isn't known."""

    def batches(
        self,
        channel_ids: Collection[int],
        *,
        start_time_ns: int | None = None,
        end_time_ns: int | None = None,
    ) -> Iterator[MessageBatch]:
        """Messages of some channels between two log times, in the order in which they came."""
