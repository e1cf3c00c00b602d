"""Fit of a sampling clock: the period as the slope of time over index, and how the clock departs from it.

Each stretch between gaps has an intercept of its own, because a source that paused rarely resumes on the old grid.
"""

from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import TYPE_CHECKING, Self

import numpy as np

from chladni.io.clock.grid_index import grid_index
from chladni.io.clock.sample_count import WINDOW, Count, robust_std
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.time_series import NS_PER_S

if TYPE_CHECKING:
    from chladni.io.clock.time_base import TimeBase

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clock:
    """The straight line through time over index.

    Attributes
    ----------
    period_ns, period_std_ns
        Slope and one sigma of it, with the correlation of the scatter over time; infinite when nothing bounds it.
    starts_ns
        ``[stretch]`` time of a stretch's index 0, since the first stamp.
    shift
        ``[stretch]`` what to add to a stretch's indices so that all share one grid, 0 for the first.
    residual_ns
        ``[item]`` time off the line of the item's own stretch.
    """

    period_ns: float
    period_std_ns: float
    starts_ns: Real
    shift: Whole
    residual_ns: Real

    def on_grid(self, starts_ns: Real) -> Self:
        """Give the same clock with stretches that start elsewhere."""
        # Stretches share one grid to the nearest index; what is left of a period stays as an error of the placing.
        shift = np.rint((starts_ns - starts_ns[0]) / self.period_ns).astype(np.int64)
        return replace(self, starts_ns=starts_ns, shift=shift)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wander:
    """How a clock departs from its straight line.

    Attributes
    ----------
    jitter_ns
        Root mean square of the stamps about the slow wander.
    span_ns
        Peak to peak of the slow wander, means of windows; 0 when it doesn't stand out of the jitter.
    line_ns
        ``[item]`` where each item would be without jitter.
    pieces
        First item of each piece over which `line_ns` is straight.
    """

    jitter_ns: float
    span_ns: float
    line_ns: Real
    pieces: Whole


def fit_clock(count: Count, period_ns: float) -> Clock | None:
    """Fit time = start + period * index with a start for each stretch, outliers left out once.

    With a single item in every stretch the period given is kept, with infinite sigma. None when the slope has nothing
    to do with the period guessed: then the indices are no count of a clock.
    """
    # All first, to learn the scatter; then without what lies beyond it, such as a message held up by the network.
    slope, starts, residual = _fit_stretches(count, None, period_ns)
    limit = max(6 * robust_std(residual), 1.0)
    kept = np.abs(residual) <= limit
    if not kept.all() and np.bincount(count.stretch, kept).min() > 0:
        slope, starts, residual = _fit_stretches(count, kept, slope)
    if not 0.5 * period_ns < slope < 2 * period_ns:
        return None
    return Clock(
        period_ns=slope,
        period_std_ns=_slope_std(count, residual * kept),
        starts_ns=starts,
        shift=np.zeros(starts.size, dtype=np.int64),
        residual_ns=residual,
    ).on_grid(starts)


def cut_by_one(count: Count, clock: Clock) -> Real:
    """Say how far to move the stretches so that one sample is left out where the clock was set, and grids agree.

    Parameters
    ----------
    count, clock
        Items, and the line through them.

    Returns
    -------
    float64 array ``[1 + cut]``
        Nanoseconds by which to move what comes after each cut, 0 before the first one.
    """
    era = np.append(0, count.cuts)
    # Within an era gaps are as long as the stamps say.
    within = np.rint((clock.starts_ns - count.cut(clock.starts_ns[era])) / clock.period_ns).astype(np.int64)
    first = np.minimum.reduceat(count.firsts + within, era)
    end = np.maximum.reduceat(count.ends + within, era)
    index = np.append(0, np.cumsum(end[:-1] + 1 - first[1:]))
    by_ns: Real = clock.starts_ns[0] + index * clock.period_ns - clock.starts_ns[era]
    return by_ns


def measure_wander(count: Count, clock: Clock) -> Wander:
    """Part the residual into slow wander and jitter; wander that jitter explains leaves the line straight."""
    slow = np.add.reduceat(clock.residual_ns, count.starts) / count.sizes
    full = count.sizes >= WINDOW // 2
    # A short window's mean is mostly jitter.
    slow = np.where(full, slow, 0.0)
    span = float(slow[full].max() - slow[full].min()) if full.any() else 0.0
    # Means of white jitter span up to six times the scatter of neighbours' differences, in any log that fits a disk.
    straight = span <= max(0.1 * clock.period_ns, 8 * robust_std(np.diff(slow[full])))
    if straight:
        slow, span = np.zeros_like(slow), 0.0
    jitter = clock.residual_ns - slow[count.window]
    return Wander(
        jitter_ns=float(np.sqrt(np.mean(jitter**2))),
        span_ns=span,
        line_ns=count.time - jitter,
        pieces=np.flatnonzero(np.diff(count.stretch, prepend=-1)) if straight else count.starts,
    )


def _fit_stretches(count: Count, kept: Mask | None, period_ns: float) -> tuple[float, Real, Real]:
    # About each stretch's own mean and the slope guessed, so that large numbers cost no digits. In place, because
    # memory that is new costs several times what the arithmetic does.
    run = count.index.astype(np.float64)
    rise = count.time - period_ns * run
    mean_index, mean_time = (_stretch_means(values, kept, count.stretch) for values in (run, rise))
    run -= mean_index[count.stretch]
    rise -= mean_time[count.stretch]
    weighted = run if kept is None else kept * run
    leverage = float(weighted @ run)
    correction = float(weighted @ rise) / leverage if leverage else 0.0
    run *= correction
    rise -= run
    return period_ns + correction, mean_time - correction * mean_index, rise


def _stretch_means(values: Real, kept: Mask | None, stretch: Whole) -> Real:
    if kept is None:
        return np.bincount(stretch, values) / np.bincount(stretch)
    return np.bincount(stretch, kept * values) / np.bincount(stretch, kept)


def _slope_std(count: Count, residual: Real) -> float:
    stretches = int(count.stretch[-1]) + 1
    # Each stretch takes one degree of freedom for its start, the slope takes one more.
    run = count.index.astype(np.float64)
    run -= _stretch_means(run, None, count.stretch)[count.stretch]
    leverage = float(run @ run)
    freedom = residual.size - stretches - 1
    if not leverage or freedom < 1:
        return float("inf")
    variance = float(residual @ residual) / freedom * leverage
    # Scores summed over ever longer blocks see correlation that single items don't, up to an eighth of the log.
    run *= residual
    scores = np.add.reduceat(run, count.starts)
    while scores.size >= 8:
        variance = max(variance, float(scores @ scores))
        scores = np.add.reduceat(scores, np.arange(0, scores.size, 2))
    return float(np.sqrt(variance)) / leverage


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
