"""Where the samples of a stream lie on its grid."""

from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.clock.stamp_order import ClockSteps
from chladni.io.clock.time_base import TimeBase, fit_batch_time_base, fit_time_base
from chladni.io.clock.uniform import message_index
from chladni.io.repeats import repeats_of
from chladni.io.stream import Stream
from chladni.signals.arrays import Whole
from chladni.signals.time_series import NS_PER_S

#: A rate that is stated is for stamps that tell it within this share.
STATED_NEAR = 0.05
#: ... or, where they tell none, for messages that come as often within this share.
STATED_ABOUT = 0.2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """Grid places of one stream's messages.

    Attributes
    ----------
    stream
        The stream.
    time_base
        Fitted to its stamps.
    index
        ``[message]``, grid index of each message's (first) sample, in the order of the file, counted from the
        origin of the group, `NOWHERE` for messages without a time; empty when the stream has no uniform time base.
    counts
        ``[message]``, samples of each; None when each has one.
    taken
        ``[message]``, samples at its start that are left out because an earlier message has their place; None when
        there are none.
    first_ns, end_ns
        First stamp in the order of arrival, and the end of the last sample, where the clock was set on time that runs
        on; None when there is none.
    untimed
        Messages left out because their stamps are no times beside the others.
    stored_late
        Messages that the file holds behind later ones.
    publishers
        How many publish at once, by their stamps alone.
    clock
        Number of the clock, where clocks of the log were set at different times: streams of different numbers share
        no time. None for stamps of one stretch.
    """

    stream: Stream
    time_base: TimeBase
    index: Whole
    counts: Whole | None
    taken: Whole | None = None
    first_ns: int | None = None
    end_ns: int | None = None
    untimed: int = 0
    stored_late: int = 0
    publishers: int = 1
    clock: int | None = None

    @property
    def first(self) -> int:
        """Grid index of the first sample."""
        return lowest_index(self.index, 0)

    @property
    def last(self) -> int:
        """One more than the grid index of the last sample."""
        return int((self.index + (1 if self.counts is None else self.counts)).max())

    @property
    def left_out(self) -> int:
        """Samples left out because an earlier one has their place."""
        return 0 if self.taken is None else int(self.taken.sum())

    @property
    def without_time(self) -> int:
        """Messages left out because their stamps are no times, or not those of their samples."""
        return self.untimed + int(self.time_base.strays.size)

    @property
    def values(self) -> int:
        """How many numbers its channels hold together."""
        return self.time_base.samples * len(self.stream.sources)

    def samples_index(self, part: slice) -> Whole:
        """Grid index of every sample of some messages, message after message; `NOWHERE` for those left out."""
        index = self.index[part]
        if self.counts is None:
            return index if self.taken is None else np.where(self.taken[part], NOWHERE, index)
        counts = self.counts[part]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        samples = np.repeat(index, counts) + within
        return (
            samples
            if self.taken is None
            else np.where(within < np.repeat(self.taken[part], counts), NOWHERE, samples)
        )

    def shifted(self, samples: int) -> "Placement":
        """Count the index from another origin."""
        return replace(self, index=self.index + samples) if samples else self


def lowest_index(index: Whole, otherwise: int) -> int:
    """Lowest grid index of messages that have a place on the grid."""
    lowest = int(index.min(initial=-NOWHERE))
    if lowest < NOWHERE // 2:
        lowest = int(index[index > NOWHERE // 2].min(initial=-NOWHERE))
    return lowest if lowest < -NOWHERE else otherwise


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedRate:
    """A sampling rate that the user states, for what the stamps leave open.

    Attributes
    ----------
    hz
        The rate.
    named
        Whether the channels were named; else it's for those whose messages come about as often.
    """

    hz: float
    named: bool

    def settles(self, base: TimeBase) -> bool:
        """Whether to fit again with the rate: it's near what the stamps tell, or they tell none."""
        near = abs(base.rate_hz / self.hz - 1)
        return near < STATED_NEAR if base.uniform else self.named or near < STATED_ABOUT or not base.moving


def place_stream(
    stream: Stream,
    stamps_ns: Whole,
    counts: Whole | None,
    period_s: float,
    *,
    chosen: Whole | None = None,
    digests: NDArray[np.uint64] | None = None,
    stated: StatedRate | None = None,
    clock: ClockSteps | None = None,
    logged_ns: Whole | None = None,
) -> Placement:
    """Fit the time base of a stream and give each message its place.

    Parameters
    ----------
    stream
        The stream.
    stamps_ns
        ``[message]``, time of each message's first sample, in the order of the file.
    counts
        ``[message]``, samples of each; None when each has one.
    period_s
        Time between the samples of a batch message, as it says itself.
    chosen
        Indices of the messages that have a time, in the order in which they came; None for all in file order.
    digests
        ``[message]``, of its samples, equal where they are; None when no two messages have the same stamp.
    stated
        Rate that the user states.
    clock
        Where the clock was set, when that is known; None looks for it.
    logged_ns
        ``[message]``, log times beside stamps of another clock; None when these are the stamps.
    """
    if chosen is None:
        return _placed(stream, stamps_ns, counts, period_s, digests, seen=_Seen(stated, clock, logged_ns))
    placement = _placed(
        stream,
        stamps_ns[chosen],
        None if counts is None else counts[chosen],
        period_s,
        None if digests is None else digests[chosen],
        seen=_Seen(stated, clock, None if logged_ns is None else logged_ns[chosen]),
    )
    if not placement.index.size:
        return replace(placement, counts=counts)
    taken = placement.taken
    return replace(
        placement,
        counts=counts,
        index=_in_file(placement.index, chosen, stamps_ns.size, otherwise=NOWHERE),
        taken=None if taken is None else _in_file(taken, chosen, stamps_ns.size, otherwise=0),
    )


def without_grid(base: TimeBase, stamps_ns: Whole, advice: str) -> TimeBase:
    """Give the time base of messages that have no grid, and the reason in place of its advice."""
    span_s = float(np.ptp(stamps_ns)) / NS_PER_S
    return replace(
        base,
        verdict="irregular",
        advice=advice,
        rate_hz=(stamps_ns.size - 1) / span_s if span_s else 0.0,
        rate_std_hz=inf,
        gaps=(),
        gap_count=0,
        missing=0,
    )


def _in_file(numbers: Whole, chosen: Whole, messages: int, *, otherwise: int) -> Whole:
    """Bring what belongs to the chosen messages into the order of the file."""
    spread = np.full(messages, otherwise, np.int64)
    spread[chosen] = numbers
    return spread


def _placed(
    stream: Stream,
    stamps_ns: Whole,
    counts: Whole | None,
    period_s: float,
    digests: NDArray[np.uint64] | None,
    *,
    seen: "_Seen",
) -> Placement:
    """Do the work of `place_stream` for messages in the order of their arrival."""
    twins = None
    if counts is not None:
        base = seen.fit_batches(stamps_ns, counts, period_s)
    else:
        twins, base = _fit_messages(stamps_ns, digests, seen)
    kept = None if twins is None else np.flatnonzero(twins == np.arange(twins.size))
    chosen_ns = stamps_ns if kept is None else stamps_ns[kept]
    placement = Placement(stream=stream, time_base=base, index=np.zeros(0, np.int64), counts=counts)
    if not stamps_ns.size:
        return placement
    first_ns, end_ns = _span_ns(chosen_ns, counts, base)
    placement = replace(placement, first_ns=first_ns, end_ns=end_ns)
    if not base.uniform:
        return placement
    index = message_index(chosen_ns, base, counts=counts)
    if kept is not None and twins is not None:
        index = index[np.searchsorted(kept, twins)]
        steps = replace(base.clock, message=kept[base.clock.message])
        placement = replace(placement, time_base=replace(base, clock=steps, strays=kept[base.strays]))
    return replace(placement, index=index, taken=_taken(stamps_ns, index, counts))


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What is known of a stream beside its stamps, as for `place_stream`."""

    stated: StatedRate | None
    clock: ClockSteps | None
    logged_ns: Whole | None

    def kept(self, kept: Whole) -> "_Seen":
        """Give the same for some of the messages."""
        clock, logged_ns = self.clock, self.logged_ns
        return replace(
            self,
            clock=None if clock is None else clock.among(kept),
            logged_ns=None if logged_ns is None else logged_ns[kept],
        )

    def fit(self, stamps_ns: Whole) -> TimeBase:
        """Fit to messages of one sample each."""
        fit = partial(fit_time_base, stamps_ns, clock=self.clock, logged_ns=self.logged_ns)
        base = fit()
        return base if self.stated is None or not self.stated.settles(base) else fit(nominal_rate_hz=self.stated.hz)

    def fit_batches(self, stamps_ns: Whole, counts: Whole, period_s: float) -> TimeBase:
        """Fit to messages of many samples each."""
        fit = partial(fit_batch_time_base, stamps_ns, counts, clock=self.clock, logged_ns=self.logged_ns)
        base = fit(nominal_rate_hz=1 / period_s if period_s > 0 else None)
        return base if self.stated is None or not self.stated.settles(base) else fit(nominal_rate_hz=self.stated.hz)


def _fit_messages(stamps_ns: Whole, digests: NDArray[np.uint64] | None, seen: _Seen) -> tuple[Whole | None, TimeBase]:
    """Fit, and say which message each one repeats, itself if none; None when none repeats another."""
    repeats = None if digests is None else repeats_of(stamps_ns, digests)
    if repeats is None:
        return None, seen.fit(stamps_ns)
    if repeats.differ:
        # Messages of one stamp that differ are samples; then those that don't may be, too.
        base = seen.fit(stamps_ns)
        if base.uniform and not base.duplicates:
            return None, base
    kept = np.flatnonzero(repeats.twin == np.arange(stamps_ns.size))
    base = seen.kept(kept).fit(stamps_ns[kept])
    again = stamps_ns.size - kept.size
    return repeats.twin, replace(base, samples=base.samples + again, duplicates=base.duplicates + again)


def _span_ns(stamps_ns: Whole, counts: Whole | None, base: TimeBase) -> tuple[int, int]:
    """First stamp, and the end of the last sample, at least its stamp; strays say nothing of either."""
    time_ns = base.clock.run_on(stamps_ns)
    if base.strays.size:
        kept = np.delete(np.arange(stamps_ns.size), base.strays)
        stamps_ns, time_ns, counts = stamps_ns[kept], time_ns[kept], None if counts is None else counts[kept]
    period_ns = NS_PER_S / base.rate_hz if base.rate_hz > 0 else 0.0
    if counts is None:
        return int(stamps_ns[0]), int(time_ns.max()) + round(period_ns)
    return int(stamps_ns[0]), int((time_ns + np.rint(counts * period_ns).astype(np.int64)).max())


def _taken(stamps_ns: Whole, index: Whole, counts: Whole | None) -> Whole | None:
    """Samples at the start of each message whose grid place an earlier message has; None when there are none."""
    if np.all(index[1:] - index[:-1] >= (1 if counts is None else counts[:-1])):
        return None
    sizes = np.ones(index.size, np.int64) if counts is None else counts
    order = np.lexsort((stamps_ns, index))
    reached = np.maximum.accumulate(index[order] + sizes[order])
    taken = np.zeros(index.size, np.int64)
    taken[order[1:]] = np.clip(reached[:-1] - index[order[1:]], 0, sizes[order[1:]])
    taken[index == NOWHERE] = 0
    return taken if taken.any() else None
