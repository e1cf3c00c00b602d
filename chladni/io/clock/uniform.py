"""Placing of stamped samples on the grid of their time base, whole or block by block."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.grid_index import NOWHERE, grid_index, side_by_side
from chladni.io.clock.stamp_order import require_stamps
from chladni.io.clock.time_base import TimeBase
from chladni.signals.arrays import Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S, TimeSeries

_Clock = Callable[[Whole, Whole], Whole]
# Messages that wait for late ones before them.
_HELD = 64


def place(
    stamps_ns: NDArray[Any],
    values: NDArray[Any],
    time_base: TimeBase,
    channels: Sequence[Channel],
    *,
    counts: NDArray[Any] | None = None,
    max_samples: int = 1 << 28,
) -> TimeSeries:
    """Put samples on the grid of their time base; grid points without a sample are NaN and not valid.

    Each sample goes to the nearest grid point (as the time base tells it, drift and late delivery allowed for), and
    keeps its value: what it was sampled early or late is an error of about `TimeBase.amplitude_error`. Of several
    samples on one grid point the earliest stays, unless its neighbour's point is free: then both are where their
    order says. The strays of the time base are left out.

    Parameters
    ----------
    stamps_ns
        ``[message]`` integer nanoseconds, in the order of arrival: those that the time base was fitted to.
    values
        ``[channel, sample]`` numbers; whole numbers become float64.
    time_base
        From `fit_time_base` or `fit_batch_time_base`.
    channels
        One for each row of `values`.
    counts
        ``[message]`` samples of each batch message; None for one sample a message.
    max_samples
        Largest grid, in values; a gap of years isn't filled.

    Raises
    ------
    EstimateError
        When the time base has no grid, shapes don't fit together, or the grid would be too large.

    Examples
    --------
    >>> from chladni.io.clock.time_base import fit_time_base
    >>> stamps = np.array([0, 10, 20, 40, 50, 60, 70, 80, 90]) * 1_000_000
    >>> series = place(stamps, np.ones((1, 9)), fit_time_base(stamps), [Channel(name="a")])
    >>> series.values[0]
    array([ 1.,  1.,  1., nan,  1.,  1.,  1.,  1.,  1.,  1.])
    """
    series = Placer(time_base, channels, max_samples=max_samples).push(stamps_ns, values, counts=counts, last=True)
    if series is None:
        raise EstimateError("there are no samples to place on a grid")
    return series


def message_index(stamps_ns: NDArray[Any], time_base: TimeBase, *, counts: NDArray[Any] | None = None) -> Whole:
    """Give each message's grid index (of its first sample), in the order of arrival, index 0 at `start_ns`.

    Parameters
    ----------
    stamps_ns, counts
        ``[message]`` as the time base was fitted to.

    Returns
    -------
    int64 array ``[message]``
        `NOWHERE` for the strays of the time base.

    Raises
    ------
    EstimateError
        When the time base has no grid.
    """
    clock = _clock(time_base)
    time_ns = time_base.clock.run_on(require_stamps(stamps_ns))
    sizes = None if counts is None else np.asarray(counts, dtype=np.int64)
    if time_base.strays.size:
        kept = np.delete(np.arange(time_ns.size), time_base.strays)
        spread = np.full(time_ns.size, NOWHERE, np.int64)
        spread[kept] = _rising_index(time_ns[kept], clock, None if sizes is None else sizes[kept])
        return spread
    return _rising_index(time_ns, clock, sizes)


def _rising_index(time_ns: Whole, clock: _Clock, sizes: Whole | None) -> Whole:
    # The usual log needs no sorting, which takes as long as all the rest.
    if np.all(time_ns[1:] >= time_ns[:-1]):
        return clock(time_ns, _samples_before(sizes, time_ns.size))
    order = np.argsort(time_ns, kind="stable")
    index = np.empty_like(time_ns)
    index[order] = clock(time_ns[order], _samples_before(None if sizes is None else sizes[order], time_ns.size))
    return index


def _samples_before(sizes: Whole | None, messages: int) -> Whole:
    before: Whole = np.arange(messages) if sizes is None else np.cumsum(sizes) - sizes
    return before


class Placer:
    """Places a stream of blocks; the blocks given back, one after the other, are what `place` gives for the whole.

    Parameters
    ----------
    time_base
        Fitted to the stamps of the whole stream.
    channels
        One for each row of the values to come.
    max_samples
        Largest grid of one block, in values.

    Attributes
    ----------
    left_out
        Samples left out so far because an earlier one had their grid point or that part was already given.
    """

    def __init__(self, time_base: TimeBase, channels: Sequence[Channel], *, max_samples: int = 1 << 28) -> None:
        self.left_out = 0
        self._base = time_base
        self._clock = _clock(time_base)
        self._channels = tuple(channels)
        self._max_samples = max_samples
        self._hold = max(_HELD, time_base.smoothing)
        self._messages = 0
        self._waiting = _Messages.none(len(self._channels))
        # Placed already, but still weighing in the running median of those that wait.
        self._behind = _Messages.none(0)
        self._order = 0
        self._next: int | None = None

    def push(
        self,
        stamps_ns: NDArray[Any],
        values: NDArray[Any],
        *,
        counts: NDArray[Any] | None = None,
        last: bool = False,
    ) -> TimeSeries | None:
        """Take the next messages and give the next block of the grid; None while too few are there to be sure.

        Arguments and errors are those of `place`. About 64 messages are held back for late ones, unless this is the
        `last` block.
        """
        stamps = require_stamps(stamps_ns)
        sizes = np.ones_like(stamps) if counts is None else np.asarray(counts, dtype=np.int64)
        expected = (len(self._channels), int(sizes.sum()))
        if sizes.shape != stamps.shape or values.shape != expected:
            raise EstimateError(
                f"values have shape {values.shape}, but {len(self._channels)} channels and {expected[1]} samples "
                f"in {stamps.size} messages ask for {expected}"
            )
        # Whole numbers can't say "missing".
        floating = values if values.dtype.kind == "f" else values.astype(np.float64)
        time_ns = self._base.clock.run_on(stamps, first=self._messages)
        if self._base.strays.size:
            number = np.arange(self._messages, self._messages + stamps.size)
            kept = np.isin(number, self._base.strays, invert=True)
            time_ns, floating, sizes = time_ns[kept], floating[:, np.repeat(kept, sizes)], sizes[kept]
        self._messages += stamps.size
        self._waiting = self._waiting.followed_by(_Messages(time_ns, sizes, floating)).in_order()
        ready = self._waiting.time_ns.size - (0 if last else self._hold)
        return self._release(ready) if ready > 0 else None

    def finish(self) -> TimeSeries | None:
        """Give what was held back."""
        return self.push(np.empty(0, dtype=np.int64), self._waiting.values[:, :0], last=True)

    def _release(self, ready: int) -> TimeSeries | None:
        now, self._waiting = self._waiting.split(ready)
        # The waiting ones take part in the median too.
        sizes = np.concatenate((self._behind.sizes, now.sizes, self._waiting.sizes))
        time_ns = np.concatenate((self._behind.time_ns, now.time_ns, self._waiting.time_ns))
        index = self._clock(time_ns, self._order + np.cumsum(sizes) - sizes)
        index = index[self._behind.sizes.size : self._behind.sizes.size + ready]
        block = self._filled(_expanded(index, now.sizes), now.values)
        kept = max(0, self._behind.sizes.size + ready - self._hold)
        placed = slice(kept, self._behind.sizes.size + ready)
        self._order += int(sizes[:kept].sum())
        self._behind = _Messages(time_ns[placed], sizes[placed], self._behind.values)
        return block

    def _filled(self, index: Whole, values: NDArray[Any]) -> TimeSeries | None:
        # The first sample seen opens the grid; later ones that belong before it come too late.
        first = int(index[0]) if self._next is None else self._next
        reached = np.maximum.accumulate(np.concatenate(([first - 1], index)))
        fresh = index > reached[:-1]
        self.left_out += int(index.size - np.count_nonzero(fresh))
        length = int(reached[-1]) + 1 - first
        if not length:
            return None
        if length * max(1, len(self._channels)) > self._max_samples:
            raise EstimateError(
                f"the grid from {first} would hold {length} samples of {len(self._channels)} channels, more than "
                f"{self._max_samples} values; read a shorter time, or correct stamps that leap"
            )
        self._next = first + length
        whole = np.full((values.shape[0], length), np.nan, dtype=values.dtype)
        whole[:, index[fresh] - first] = values[:, fresh]
        valid = np.isfinite(whole)
        return TimeSeries(
            values=whole,
            sample_rate_hz=self._base.rate_hz,
            start_time_ns=self._base.start_ns + round(first / self._base.rate_hz * NS_PER_S),
            channels=self._channels,
            valid=None if valid.all() else valid,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Messages:
    """Messages with their times (steps of the clock undone), samples of each, and the samples."""

    time_ns: Whole
    sizes: Whole
    values: NDArray[Any]

    @classmethod
    def none(cls, channels: int) -> Self:
        nothing = np.empty(0, dtype=np.int64)
        # The narrowest type, so that the first block decides.
        return cls(nothing, nothing, np.empty((channels, 0), dtype=np.float16))

    def followed_by(self, other: "_Messages") -> "_Messages":
        if not self.time_ns.size:
            return other
        return _Messages(
            np.concatenate((self.time_ns, other.time_ns)),
            np.concatenate((self.sizes, other.sizes)),
            np.concatenate((self.values, other.values), axis=1),
        )

    def in_order(self) -> "_Messages":
        if not np.any(self.time_ns[1:] < self.time_ns[:-1]):
            return self
        order = np.argsort(self.time_ns, kind="stable")
        samples = _expanded((np.cumsum(self.sizes) - self.sizes)[order], self.sizes[order])
        return _Messages(self.time_ns[order], self.sizes[order], self.values[:, samples])

    def split(self, place: int) -> tuple["_Messages", "_Messages"]:
        sample = int(self.sizes[:place].sum())
        return (
            _Messages(self.time_ns[:place], self.sizes[:place], self.values[:, :sample]),
            _Messages(self.time_ns[place:], self.sizes[place:], self.values[:, sample:]),
        )


def _expanded(first: Whole, sizes: Whole) -> Whole:
    """Give first, first + 1, ... for each message, as many as it has samples."""
    if first.size == sizes.sum():
        return first
    run: Whole = np.repeat(first - (np.cumsum(sizes) - sizes), sizes) + np.arange(sizes.sum())
    return run


def _clock(base: TimeBase) -> _Clock:
    if not base.uniform:
        raise EstimateError(f"samples can't be placed on a grid: {base.advice}")
    set_at = base.clock.message
    indexed = partial(
        grid_index,
        knots_ns=base.knots_ns,
        knots_index=base.knots_index,
        rate_hz=base.rate_hz,
        smoothing=base.smoothing,
        resumed=base.resumed,
        resumed_shift=base.resumed_shift,
        # Strays aren't among the samples that are counted.
        cut_order=None if base.resumed.size else set_at - np.searchsorted(base.strays, set_at),
        cuts=base.cuts,
    )
    if base.smoothing > 1 or base.resumed.size:
        return indexed

    def clock(time_ns: Whole, order: Whole) -> Whole:
        return side_by_side(indexed(time_ns, order), time_ns, base.cuts)

    return clock
