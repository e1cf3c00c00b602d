"""The clocks of a log, found by reading all of its stamps once."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from chladni.io.clocks import Key, StreamClock, clocks_of
from chladni.io.gathering import gather
from chladni.io.log_reader import Window
from chladni.io.mcap.container import McapContainer
from chladni.io.stream import Stream, read_pieces
from chladni.signals.time_series import NS_PER_S

#: A log up to this size is read whole in less time than it takes to ask for it.
READ_WHOLE_BYTES: Final = 48 << 20
#: Messages may be logged this much later than the first ones of a log were, without a clock having been set.
LATER_NS: Final = NS_PER_S

Lags = Mapping[str, tuple[int, int] | None]


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
