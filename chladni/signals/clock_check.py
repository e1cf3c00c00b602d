"""Final check of a time base: the grid must tell the same time as the stamps that it stands for."""

from math import ceil, sqrt
from typing import TYPE_CHECKING

import numpy as np

from chladni.signals.arrays import Real, Whole
from chladni.signals.grid_index import grid_index
from chladni.signals.time_series import NS_PER_S

if TYPE_CHECKING:
    from chladni.signals.time_base import TimeBase

#: Root mean squares of jitter that a stamp may be off its grid point; of a Gaussian, two in a billion are further.
JITTERS = 6.0
#: Share of messages that may be further off: those that a network held up.
HELD_UP = 0.005
#: Local change of rate that no clock shows; crystals keep 1e-4, and a spectral line smears by as much.
RATE_CHANGE = 0.05
# Messages at either end whose median tells the span, so that one that was held up doesn't.
_END = 9
# Messages whose median tells where the clock is; few enough to see a short log change its rate.
_PIECE = 64
_PIECES = 64
# Messages looked at when each can be by itself: enough for medians and for shares of half a percent.
_SAMPLE = 50_000


def grid_agrees(base: "TimeBase", time_ns: Whole, sizes: Whole) -> bool:
    """Whether the grid of a time base tells the time of the stamps that were placed on it.

    With T the period and `off` the stamps minus the times of their grid points, all of these must hold:

    1. 99.5 % of the messages have ``abs(off) <= T + 6 jitter + wander``, in bursts ``burst_size T`` in place of T;
    2. the grid's span is the stamps' span: `off` at the two ends (medians of up to nine messages) differs by no more
       than that, with the scatter of neighbours in place of a larger jitter;
    3. from one 64th of the log (64 messages, ticks or bursts at least) to the next, the median of `off` moves by less
       than 5 % of the time between them: wander is slow, and two rates aren't one.

    Parameters
    ----------
    base
        A time base that has a grid.
    time_ns
        ``[message]`` rising stamps, steps of the clock undone, at least two.
    sizes
        ``[message]`` samples of each, or a single number for all.
    """
    message, index = _indices(base, time_ns, sizes)
    stamp_ns = (time_ns[message] - base.start_ns).astype(np.float64)
    off_ns = stamp_ns - index * (NS_PER_S / base.rate_hz)
    slack_ns = NS_PER_S * (base.burst_size / base.rate_hz + base.wander_s)
    far = int(np.count_nonzero(np.abs(off_ns) > slack_ns + JITTERS * NS_PER_S * base.jitter_s))
    end = min(_END, 1 + off_ns.size // 16)
    drift_ns = float(np.median(off_ns[-end:]) - np.median(off_ns[:end]))
    # A wrong rate counts as jitter of the whole log, but hardly as jitter from one message to the next.
    scatter_ns = float(np.std(np.diff(off_ns))) / sqrt(2)
    drifts = abs(drift_ns) > slack_ns + JITTERS * min(scatter_ns, NS_PER_S * base.jitter_s)
    # Samples that share a tick, or a burst, tell where the clock is only together.
    together = max(base.burst_size, ceil(base.quantum_s * base.rate_hz))
    return far <= HELD_UP * off_ns.size and not drifts and _one_rate(stamp_ns, off_ns, _PIECE * together)


def _indices(base: "TimeBase", time_ns: Whole, sizes: Whole) -> tuple[Whole, Whole]:
    """Messages to look at, and their grid indices."""
    # A running median needs all neighbours; without one, each message tells its index alone.
    every = max(1, time_ns.size // _SAMPLE) if base.smoothing == 1 else 1
    chosen = np.arange(0, time_ns.size, every)
    if chosen[-1] != time_ns.size - 1:
        chosen = np.append(chosen, time_ns.size - 1)
    before = chosen * sizes[0] if sizes.size == 1 else (np.cumsum(sizes) - sizes)[chosen]
    index = grid_index(
        time_ns[chosen],
        before,
        knots_ns=base.knots_ns,
        knots_index=base.knots_index,
        rate_hz=base.rate_hz,
        smoothing=base.smoothing,
        resumed=base.resumed,
        resumed_shift=base.resumed_shift,
        cut_order=base.clock.message if sizes.size == 1 else None,
        cuts=base.cuts,
    )
    return chosen, index


def _one_rate(stamp_ns: Real, off_ns: Real, least: int) -> bool:
    pieces = min(_PIECES, stamp_ns.size // least)
    if pieces < 2:
        return True
    parts = np.array_split(np.stack((stamp_ns, off_ns)), pieces, axis=1)
    stamps, offs = np.array([np.median(part, axis=1) for part in parts]).T
    return bool(np.all(np.abs(np.diff(offs)) <= RATE_CHANGE * np.diff(stamps)))
