"""When messages were logged and where they stand in the log, and in which order they came."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stray_stamps import find_strays
from chladni.io.mcap.message_batch import MessageBatch
from chladni.signals.arrays import Mask, Whole

#: Percentile of the steps forward that is the longest usual one, and the step over one lost message in its units.
_MOST, _LOST = 90, 2
#: Steps from half to one and a half of their median are even: neither a message more nor one less would fit in.
_EVEN: Final = (0.5, 1.5)
#: Messages of a shuffled log are evenly spaced by log time, nine in ten at least; as stored a quarter is not.
_EVENLY_SORTED, _EVENLY_STORED = 0.9, 0.75


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arrivals:
    """What the log says of some messages beside their content.

    Attributes
    ----------
    log_ns
        ``[message]``, when each was logged.
    sequence
        ``[message]``, the publisher's counter; 0 throughout where it has none.
    channel
        ``[message]``, MCAP channel; None when the topic has only one.
    position
        ``[message]``, rises with the place in the file; None when the messages are in that order anyway.
    """

    log_ns: Whole
    sequence: NDArray[np.uint32]
    channel: NDArray[np.uint16] | None = None
    position: Whole | None = None

    @classmethod
    def of(cls, batch: MessageBatch, stretch: int | None) -> "Arrivals":
        """Arrivals of a batch in the given stretch of the log; None for a topic with a single MCAP channel."""
        # Most writers don't count: a zero that is repeated without taking memory stands for all of them.
        counted = batch.sequence if batch.sequence.any() else np.broadcast_to(np.uint32(0), batch.sequence.shape)
        if stretch is None:
            return cls(log_ns=batch.log_time_ns, sequence=counted)
        return cls(
            log_ns=batch.log_time_ns,
            sequence=counted,
            channel=np.full(len(batch), batch.channel_id, np.uint16),
            # A stretch is shorter than 2^40 bytes by far.
            position=batch.offsets + (stretch << 40),
        )

    @classmethod
    def joined(cls, parts: Sequence["Arrivals"]) -> "Arrivals":
        """Put the arrivals of several batches of one topic together."""
        if not parts:
            return cls(log_ns=np.zeros(0, np.int64), sequence=np.zeros(0, np.uint32))
        channels = [one.channel for one in parts if one.channel is not None]
        positions = [one.position for one in parts if one.position is not None]
        return cls(
            log_ns=np.concatenate([one.log_ns for one in parts]),
            sequence=np.concatenate([one.sequence for one in parts]),
            channel=np.concatenate(channels) if channels else None,
            position=np.concatenate(positions) if positions else None,
        )

    def kept(self, keep: Mask | Whole | slice) -> "Arrivals":
        """Give some of them, or all in another order."""
        return replace(
            self,
            log_ns=self.log_ns[keep],
            sequence=self.sequence[keep],
            channel=None if self.channel is None else self.channel[keep],
            position=None if self.position is None else self.position[keep],
        )


def numbered(batches: Iterable[MessageBatch]) -> Iterator[tuple[int, MessageBatch]]:
    """Number the stretches of a log that batches come from, one after another."""
    stretch, buffer = 0, None
    for batch in batches:
        stretch, buffer = stretch + (batch.buffer is not buffer), batch.buffer
        yield stretch, batch


def arrival_order(stamps_ns: Whole, arrivals: Arrivals) -> Whole | None:
    """Find the order in which messages came, which may not be the one in which they are stored.

    MCAP lets messages be stored in any order; but log times that run back in the file may also come from a clock
    that was set back while it recorded. The order is that of the file where the stamps or the log times rise in it;
    else that of log time where each MCAP channel by itself speaks for it (see `_stored_out_of_order`); else that of
    the file again, and the clock was set back.

    Parameters
    ----------
    stamps_ns
        ``[message]``, times of the samples.
    arrivals
        Of the same messages.

    Returns
    -------
    int64 array ``[message]`` or None
        Indices of the messages one after another; None when they are in order as they are.
    """
    stored = None if arrivals.position is None else np.argsort(arrivals.position, kind="stable")
    if stored is not None:
        stamps_ns, arrivals = stamps_ns[stored], arrivals.kept(stored)
    if _rises(stamps_ns) or _rises(arrivals.log_ns):
        return stored
    if all(_rises(one.log_ns) or _stored_out_of_order(one) for one in _by_channel(arrivals)):
        by_time = np.argsort(arrivals.log_ns, kind="stable") if arrivals.channel is not None else _by_time(arrivals)
        return by_time if stored is None else stored[by_time]
    return stored


def stored_late(order: Whole, arrivals: Arrivals) -> int:
    """How many messages are stored behind one that came after them, given the order in which they came."""
    rank = np.argsort(order if arrivals.position is None else arrivals.position[order], kind="stable")
    return int(np.count_nonzero(rank < np.maximum.accumulate(rank)))


def _by_channel(arrivals: Arrivals) -> Iterable[Arrivals]:
    if arrivals.channel is None:
        return [arrivals]
    return [arrivals.kept(arrivals.channel == one) for one in np.unique(arrivals.channel)]


def _rises(times: Whole) -> bool:
    return bool(np.all(times[1:] >= times[:-1]))


def _stored_out_of_order(arrivals: Arrivals) -> bool:
    """Whether messages of one MCAP channel whose log times run back are stored out of order; else a clock was set.

    The publisher's counter tells, where there is one: by the MCAP specification it rises with time. Without one, two
    things tell a shuffled log from a clock that was set back, after which times come a second time: its parts fit end
    to end in some order, or the messages are evenly spaced by log time and not as they are stored.
    """
    order = _by_time(arrivals)
    as_stored, by_time = _repeats(arrivals.sequence), _repeats(arrivals.sequence[order])
    if as_stored != by_time and min(as_stored, by_time) == 0:
        return by_time == 0
    # A wrong log time of a message that stands in its place may well fit before the first one or behind the last.
    if _rises(np.delete(arrivals.log_ns, find_strays(arrivals.log_ns))):
        return False
    return _fit_end_to_end(arrivals.log_ns) or _evener_by_time(arrivals.log_ns, arrivals.log_ns[order])


def _by_time(arrivals: Arrivals) -> Whole:
    """Order of the log times; where these are the same the publisher's counter tells."""
    return np.lexsort((arrivals.sequence, arrivals.log_ns))


def _repeats(sequence: NDArray[np.uint32]) -> int:
    """How often a counter doesn't rise."""
    return int(np.count_nonzero(sequence[1:] <= sequence[:-1]))


def _fit_end_to_end(log_ns: Whole) -> bool:
    """Whether parts of the file, each without a leap, follow each other in another order with a step like theirs."""
    steps = np.diff(log_ns)
    forward = steps[steps >= 0]
    if not forward.size:
        return False
    # Most steps are shorter, and one message may be lost where parts meet.
    longest = _LOST * float(np.percentile(forward, _MOST))
    breaks = np.flatnonzero((steps < 0) | (steps > longest))
    first = log_ns[np.append(0, breaks + 1)]
    last = log_ns[np.append(breaks, log_ns.size - 1)]
    order = np.argsort(first, kind="stable")
    seams = first[order][1:] - last[order][:-1]
    fit = (seams >= min(1, int(forward.min()))) & (seams <= longest)
    # What follows in the file, too, after a pause of the recording.
    pause = (seams > longest) & (np.diff(order) == 1)
    return bool(np.all(fit | pause))


def _evener_by_time(stored_ns: Whole, rising_ns: Whole) -> bool:
    steps = np.diff(stored_ns)
    return _even(np.diff(rising_ns)) > _EVENLY_SORTED and _even(steps[steps >= 0]) < _EVENLY_STORED


def _even(steps: Whole) -> float:
    """Share of steps that are even."""
    if not steps.size:
        return 0.0
    low, high = (bound * float(np.median(steps)) for bound in _EVEN)
    return float(np.mean((steps > low) & (steps < high)))
