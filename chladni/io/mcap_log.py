"""An MCAP log: channels decoded as they are asked for, in memory that doesn't grow with the log."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any, Final
from weakref import finalize

import numpy as np

from chladni.io.catalog import Catalog, read_catalog
from chladni.io.channel_source import ChannelSource
from chladni.io.clock.shared_clocks import Key, StreamClock, clocks_of
from chladni.io.files.formats import MCAP, told_by_content
from chladni.io.first_pass import FirstPass
from chladni.io.gathering import LostMessages, gather
from chladni.io.log import Log, outside
from chladni.io.log_info import LogInfo, oddities, unread_sentences
from chladni.io.log_reader import LogReader, StampedSamples, Window
from chladni.io.log_survey import survey
from chladni.io.loss import Loss, Unread, losses
from chladni.io.mcap.container import McapContainer
from chladni.io.mcap.limits import Limits
from chladni.io.missing_samples import MissingSamples
from chladni.io.number_lists import NumberLists
from chladni.io.setup import Setup
from chladni.io.shared_grid import SampleGrid
from chladni.io.stamps import StampRequest
from chladni.io.stream import Stream, read_pieces
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import NS_PER_S, TimeSeries

#: How much later (or earlier) than its sample a message may be logged, beyond what the first messages show, and still
#: be found when a window of time is read: the log is indexed by log time.
LATENESS_NS = 30 * NS_PER_S
#: A log up to this size is read whole in less time than it takes to ask for it.
READ_WHOLE_BYTES: Final = 48 << 20
#: Messages may be logged this much later than the first ones of a log were, without a clock having been set.
LATER_NS: Final = NS_PER_S
Lags = Mapping[str, tuple[int, int] | None]


def open_mcap(
    path: Path,
    *,
    setup: Setup,
    stamp: StampRequest,
    limits: Limits | None,
    sample_rate_hz: float | None,
    options: Mapping[str, Any],
) -> "McapLog":
    """Open an MCAP log; no sample is read yet. See `chladni.io.log.open`."""
    if sample_rate_hz is not None and not (isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise SetupError(f"sample rate {sample_rate_hz} Hz must be finite and positive")
    for name in options:
        raise SetupError(f"{path}: {name} is for data files; messages of an MCAP log say their times and names")
    container = McapContainer.open(path, limits=limits)
    log = McapLog(container, setup=setup, stamp=stamp, sample_rate_hz=sample_rate_hz)
    if setup.channels or setup.batches:
        # A setup file that doesn't fit the log is better told now than after an hour of averaging.
        with ExitStack() as refused:
            refused.callback(container.close)
            _ = log.channels
            refused.pop_all()
    return log


class McapLog(Log):
    """Channels of one MCAP log, decoded as they are asked for; made by `chladni.io.log.open`."""

    def __init__(
        self, container: McapContainer, *, setup: Setup, stamp: StampRequest, sample_rate_hz: float | None = None
    ) -> None:
        self._container = container
        self._setup = setup
        self._stamp = stamp
        self._rate_hz = sample_rate_hz
        self._clocks: LogClocks | None = None
        self._catalog: Catalog | None = None
        self._lost = LostMessages()
        self._close = finalize(self, container.close)
        self._known: tuple[object, FirstPass] | None = None
        self._info: LogInfo | None = None
        self._missing = MissingSamples()

    @property
    def path(self) -> Path:
        """The file."""
        return self._container.path

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every channel that is a signal: numbers, but no stamps, covariances, counters or identities."""
        return tuple(source.channel for source in self._content.channels)

    @property
    def start_time_ns(self) -> int:
        """Time of the earliest sample, nanoseconds since the Unix epoch: zero of all times in seconds."""
        return self._content.start_ns

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self.path.stat().st_size

    @property
    def geometry(self) -> Geometry:
        """Points and lines of the setup file; empty without one."""
        return self._setup.geometry

    @property
    def damage(self) -> tuple[Loss, ...]:
        """What was lost of what has been read so far; complete after `info`, or after all of it has been read."""
        return losses(self._container.damage, self._lost)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is odd about messages that have been read so far, and which samples are missing, in sentences."""
        told = told_by_content(self.path, MCAP)
        return (*told, *oddities(self._lost), *self._missing.sentences(from_ns=self.start_time_ns))

    @property
    def unread(self) -> tuple[Unread, ...]:
        """Topics, and fields of topics, that no channel is made of."""
        return self._content.unread

    @property
    def number_lists(self) -> tuple[NumberLists, ...]:
        """Lists of numbers in messages, an element for each joint or motor, as in JointState."""
        return self._content.number_lists

    @property
    def _content(self) -> Catalog:
        if self._catalog is None:
            self._catalog = read_catalog(self._container, setup=self._setup, request=self._stamp)
        return self._catalog

    def read_groups(
        self,
        paths: Sequence[str] | None = None,
        *,
        start_s: float | None = None,
        end_s: float | None = None,
        one_clock: bool = False,
    ) -> tuple[TimeSeries, ...]:
        """Read channels, one series for each sampling grid; see `Log.read_groups`."""
        return tuple(self._missing.watch(self._reader(paths, start_s, end_s).series(one_clock=one_clock)))

    def stamped(
        self, paths: Sequence[str], *, start_s: float | None = None, end_s: float | None = None
    ) -> tuple[StampedSamples, ...]:
        """Read channels as they were stamped, on no grid; see `Log.stamped`."""
        return self._reader(paths, start_s, end_s).stamped()

    def blocks(
        self,
        paths: Sequence[str] | None = None,
        *,
        seconds: float,
        start_s: float | None = None,
        end_s: float | None = None,
        between: tuple[int, int] | None = None,
    ) -> Iterator[TimeSeries]:
        """Read channels block by block, in memory that doesn't grow with the samples of the log; see `Log.blocks`.

        One pass over the log fits the time base to all stamps (some 30 bytes of memory a message), a second one
        places the samples. A log that is stored far out of order takes more passes.
        """
        if not (isfinite(seconds) and seconds > 0):
            raise LogError(f"blocks of {seconds} s: seconds must be finite and positive")
        reader = self._reader(paths, start_s, end_s)
        return self._held_open(self._missing.watch(reader.blocks(self._first_pass(reader), seconds, between)))

    def grids(
        self, paths: Sequence[str] | None = None, *, start_s: float | None = None, end_s: float | None = None
    ) -> tuple[SampleGrid, ...]:
        """Tell which channels share a sampling grid, without keeping samples; see `Log.grids`."""
        reader = self._reader(paths, start_s, end_s)
        return reader.grids(self._first_pass(reader))

    def names(self, paths: Sequence[str]) -> tuple[str, ...]:
        """Names that channels have in what is read; `LogError` when the log doesn't hold one."""
        return tuple(source.channel.name for source in self._sources(paths))

    def info(self) -> LogInfo:
        """Read all of the log once and tell whether it's sound."""
        if self._info is None:
            self._info = survey(self._container, self._content, self._lost, rate_hz=self._rate_hz)
        return self._info

    def close(self) -> None:
        """Close the file; a log that is dropped closes it too."""
        self._close()

    def _held_open(self, blocks: Iterator[TimeSeries]) -> Iterator[TimeSeries]:
        # Whoever iterates over open_log(path).blocks() has no other hold on the log, and a dropped log is closed.
        yield from blocks

    def _first_pass(self, reader: LogReader) -> FirstPass:
        # Whoever asks for the grids reads blocks next, of the same channels.
        key = (reader.window, tuple(stream.key for stream in reader.streams))
        if self._known is None or self._known[0] != key:
            self._known = (key, reader.first_pass())
        return self._known[1]

    # --- selection ---

    def _sources(self, paths: Sequence[str] | None) -> tuple[ChannelSource, ...]:
        content = self._content
        if paths is not None and not paths:
            raise LogError(f"{self.path.name}: no channel is asked for; name one, or None for all")
        sources = content.channels if paths is None else content.named(paths)
        if not sources:
            reasons = "; ".join(unread_sentences(content.unread)[:3])
            raise LogError(
                f"{self.path.name}: the log has no channel that could be read{reasons and f' ({reasons})'}"
            )
        return sources

    def _reader(self, paths: Sequence[str] | None, start_s: float | None, end_s: float | None) -> LogReader:
        sources = self._sources(paths)
        streams = self._content.streams(sources)
        if self._clocks is None:
            listed = self._content.streams(self._content.channels)
            self._clocks = LogClocks(self._container, listed, self._content.lags_ns)
        window = self._window(streams, start_s, end_s)
        known = self._clocks.before(streams, window)
        return LogReader(
            container=self._container,
            streams=streams,
            order=tuple(source.channel for source in sources),
            # Log times may have been set back as well.
            window=replace(window, log_start_ns=None, log_end_ns=None) if known else window,
            lost=self._lost,
            required=paths is not None,
            clocks=self._clocks.of,
            known_clocks=known,
            rate_hz=self._rate_hz,
            log_start_ns=self.start_time_ns,
        )

    def _window(self, streams: Sequence[Stream], start_s: float | None, end_s: float | None) -> Window:
        if start_s is None and end_s is None:
            return Window()
        start_ns, end_ns = self._time_ns(start_s), self._time_ns(end_s)
        if start_ns is not None and end_ns is not None and start_ns >= end_ns:
            raise LogError(
                f"{self.path.name}: the window from {start_s} s to {end_s} s is empty; let it end after its start"
            )
        lags = [self._content.lags_ns[stream.topic.name] for stream in streams]
        known = [lag for lag in lags if lag is not None]
        bounded = len(known) == len(lags)
        earliest, latest = min((low for low, _ in known), default=0), max((high for _, high in known), default=0)
        told = f"between {start_s or 0.0} s and {'its end' if end_s is None else f'{end_s} s'}"
        return Window(
            start_ns=start_ns,
            end_ns=end_ns,
            log_start_ns=None if start_ns is None or not bounded else max(0, start_ns + earliest - LATENESS_NS),
            log_end_ns=None if end_ns is None or not bounded else max(0, end_ns + latest + LATENESS_NS),
            told=told + outside(start_s, end_s, self._last_s()),
        )

    def _last_s(self) -> float | None:
        logged = self._container.time_range_ns
        return None if logged is None else (logged[1] - self.start_time_ns) / NS_PER_S

    def _time_ns(self, time_s: float | None) -> int | None:
        if time_s is None:
            return None
        if not isfinite(time_s):
            raise LogError(f"{self.path.name}: time {time_s} s must be finite")
        return self.start_time_ns + round(time_s * NS_PER_S)


class LogClocks:
    """Which clocks of a log were set; read when they're asked for, and kept.

    Parameters
    ----------
    container
        The log.
    listed
        Streams of all channels that the log lists. With them the answer is the same whatever is read.
    lags_ns
        Least and most time from a sample to its log time in the first messages, by topic.
    """

    def __init__(self, container: McapContainer, listed: Sequence[Stream], lags_ns: Lags) -> None:
        self._container = container
        self._listed = tuple(listed)
        self._lags_ns = lags_ns
        self._seen: frozenset[Key] = frozenset()
        self._found: Mapping[Key, StreamClock] = {}

    def of(self, streams: Sequence[Stream]) -> Mapping[Key, StreamClock]:
        """Give the clocks that were set, of the streams and of all that are listed."""
        wanted = {stream.key: stream for stream in (*self._listed, *streams)}
        if not self._seen.issuperset(wanted):
            pieces = read_pieces(self._container, tuple(wanted.values()), with_values=False)
            gatherings = gather(tuple(wanted.values()), pieces, with_values=False)
            self._found = clocks_of([one.stamped(one.place().time_base) for one in gatherings])
            self._seen = frozenset(wanted)
        return self._found

    def before(self, streams: Sequence[Stream], window: Window) -> Mapping[Key, StreamClock]:
        """Give the clocks that have to be known to find a window of time in the streams; empty when none was set.

        All stamps from the start of the log on would have to be read to be sure. Of a large log that takes long, so
        there it's done only when its chunks' log times, or the log times of messages at the ends of the window, say
        that a clock was set.
        """
        if window == Window() or not self._may_be_set(streams, window):
            return {}
        found = self.of(streams)
        return found if any(stream.key in found for stream in streams) else {}

    def _may_be_set(self, streams: Sequence[Stream], window: Window) -> bool:
        whole = window.log_start_ns is None and window.log_end_ns is None
        small = self._container.path.stat().st_size <= READ_WHOLE_BYTES
        if whole or small or not self._container.log_times_rise(within_ns=LATER_NS):
            return True
        ends_ns = [end for end in (window.start_ns, window.end_ns) if end is not None]
        return any(self._lag_changed(stream, end_ns) for stream in streams for end_ns in ends_ns)

    def _lag_changed(self, stream: Stream, time_ns: int) -> bool:
        """Whether messages near a time are logged much later, or earlier, after their samples than the first ones."""
        lag = self._lags_ns[stream.topic.name]
        if lag is None:
            return True
        start_ns = max(0, time_ns + lag[0])
        for batch in self._container.batches(stream.topic.decoders, start_time_ns=start_ns):
            decoded = stream.topic.decode(batch, stream.leaves())
            stamps_ns = stream.piece(batch, decoded, with_values=False).stamps_ns
            if stamps_ns.size:
                now_ns = float(np.median(batch.log_time_ns)) - float(np.median(stamps_ns))
                return not lag[0] - LATER_NS <= now_ns <= lag[1] + LATER_NS
        return False
