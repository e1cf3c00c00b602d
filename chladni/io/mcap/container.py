"""An MCAP log as channels and batches of still encoded messages."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack
from itertools import accumulate
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Self

from chladni.io.mcap.channel_registry import ChannelRegistry, McapChannel
from chladni.io.mcap.damage import Damage, DamageList
from chladni.io.mcap.limits import Limits
from chladni.io.mcap.log_file import LogFile
from chladni.io.mcap.log_pass import LogPass
from chladni.io.mcap.message_batch import MessageBatch
from chladni.io.mcap.records import (
    MAGIC,
    PREFIX_BYTES,
    RECORD_PREFIX,
    FieldReader,
    MalformedRecordError,
    Opcode,
)
from chladni.io.mcap.selection import Selection
from chladni.io.mcap.summary import LogEnd, read_log_end

_LONGEST_HEADER_BYTES = 64 * 1024


class McapContainer:
    """An MCAP log: its channels, and their messages as columns of still encoded bytes.

    Whatever the bytes of the log are, reading ends, takes bounded memory, and gives out every
    whole message whose checksum is right; the rest is told in `damage`.

    Examples
    --------
    >>> with McapContainer.open("arm.mcap") as log:  # doctest: +SKIP
    ...     for batch in log.batches(log.channels):
    ...         print(batch.channel_id, len(batch))
    """

    def __init__(
        self,
        file: LogFile,
        *,
        limits: Limits,
        check_crc: bool,
        registry: ChannelRegistry,
        end: LogEnd,
        damage: DamageList,
    ) -> None:
        self._file = file
        self._limits = limits
        self._check_crc = check_crc
        self._registry = registry
        self._end = end
        self._damage = damage
        self._listed = frozenset(registry.channels) if end.lists_all_channels else None
        self._counts: Mapping[int, int] | None = None
        self._time_range_ns: tuple[int, int] | None = None
        self.path = file.path
        self.profile, self.library = _read_header(file)

    @classmethod
    def open(cls, path: Path | str, *, limits: Limits | None = None, check_crc: bool = True) -> Self:
        """Open a log.

        A log with a sound summary is opened at once. Without one, all of it is read to learn its
        channels.

        Parameters
        ----------
        path
            The file.
        limits
            What may be read into memory on the word of the log.
        check_crc
            Check the checksums, and give out nothing that they say is wrong.

        Raises
        ------
        LogError
            When the file can't be read, is no MCAP log at all, or was changed by a text-mode transfer.
        """
        limits = limits or Limits()
        file = LogFile(Path(path))
        with ExitStack() as refused:
            refused.callback(file.close)
            damage, registry = DamageList(), ChannelRegistry(limits)
            end = read_log_end(file, registry, damage, limits=limits, check_crc=check_crc)
            # What a whole summary defines holds even where it doesn't list all.
            if not (end.lists_all_channels or end.crc_checked):
                registry = ChannelRegistry(limits)
            container = cls(file, limits=limits, check_crc=check_crc, registry=registry, end=end, damage=damage)
            container._take_stock()
            if container.damage:
                file.require_lone_line_feeds()
            refused.pop_all()
        return container

    def _take_stock(self) -> None:
        """Learn counts and times from the summary, or from one pass over the log."""
        if self._end.lists_all_channels:
            statistics = self._end.statistics
            self._counts = None if statistics is None else statistics.message_counts
            self._time_range_ns = _time_range(self._end)
            return
        scan = self._new_pass(Selection(channel_ids=frozenset()))
        for _ in scan.batches():
            raise AssertionError("no channel was asked for")
        self._counts = MappingProxyType(dict(scan.found))
        self._time_range_ns = scan.time_range_ns

    def _new_pass(self, selection: Selection) -> LogPass:
        return LogPass(
            self._file,
            end=self._end,
            registry=self._registry,
            damage=self._damage,
            selection=selection,
            listed=self._listed,
            limits=self._limits,
            check_crc=self._check_crc,
        )

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """The channels by id. Several channels may share a topic."""
        return self._registry.channels

    @property
    def damage(self) -> tuple[Damage, ...]:
        """What was found damaged so far, in file order; complete once all messages have been read."""
        return self._damage.in_file_order()

    @property
    def time_range_ns(self) -> tuple[int, int] | None:
        """Log time of the first and of the last message in ns, None when the log doesn't tell."""
        return self._time_range_ns

    def log_times_rise(self, *, within_ns: int) -> bool:
        """Whether the summary says that no chunk begins more than so long before an earlier one ends."""
        chunks = self._end.chunk_indexes
        ends = accumulate((chunk.end_time_ns for chunk in chunks), max)
        return bool(chunks) and all(
            chunk.start_time_ns >= end - within_ns for chunk, end in zip(chunks[1:], ends, strict=False)
        )

    def message_counts(self) -> Mapping[int, int] | None:
        """Return how many messages each channel has.

        The summary's statistics say so; a log without usable summary has been read to learn it. None
        when the summary has no statistics. Channels without messages may be missing.
        """
        return self._counts

    def batches(
        self,
        channel_ids: Collection[int],
        *,
        start_time_ns: int | None = None,
        end_time_ns: int | None = None,
    ) -> Iterator[MessageBatch]:
        """Read messages, in file order.

        Parameters
        ----------
        channel_ids
            The channels to read.
        start_time_ns, end_time_ns
            Only messages with ``start_time_ns <= log time < end_time_ns``; None is without bound.

        Yields
        ------
        MessageBatch
            One for each channel in each chunk, or in each stretch of at most 4 MiB outside chunks. Some
            chunks are decompressed ahead in threads; memory doesn't grow with the log.
        """
        selection = Selection(
            channel_ids=frozenset(channel_ids), start_time_ns=start_time_ns, end_time_ns=end_time_ns
        )
        return self._new_pass(selection).batches()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exception_type: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _read_header(file: LogFile) -> tuple[str, str]:
    """Return profile and library, empty when the Header is damaged (which reading the data reports)."""
    start = file.read(len(MAGIC), _LONGEST_HEADER_BYTES)
    if len(start) < PREFIX_BYTES:
        return "", ""
    opcode, length = RECORD_PREFIX.unpack_from(start)
    fields = FieldReader(start[PREFIX_BYTES : PREFIX_BYTES + length])
    try:
        return (fields.string(), fields.string()) if opcode == Opcode.HEADER else ("", "")
    except MalformedRecordError:
        return "", ""


def _time_range(end: LogEnd) -> tuple[int, int] | None:
    statistics = end.statistics
    if statistics is not None:
        return (statistics.start_time_ns, statistics.end_time_ns) if statistics.message_count else None
    filled = [index for index in end.chunk_indexes if index.channel_ids]
    if not filled:
        return None
    return min(index.start_time_ns for index in filled), max(index.end_time_ns for index in filled)
