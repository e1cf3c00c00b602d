"""Counting of samples: which grid index each stamp has.

Two ways. Where stamps scatter by less than about a third of a period, their phase exp(2 pi j t/T) tells each
sample's index by itself, whatever is missing (`count_by_phase`). Where messages come in bursts or late by several
periods, only their order tells, and gaps are what exceeds the scatter (`count_by_order`).
"""

from dataclasses import dataclass, replace
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real, Whole

ScalarT = TypeVar("ScalarT", bound=np.generic)
#: Items whose mean is taken as one point of the clock's slow wander.
WINDOW = 256
#: Items that a clock is fitted to; of more, every n-th is as good.
MAX_ITEMS = 500_000
#: Values that a median is taken of: its own scatter is then below a hundredth of the values'.
SAMPLE = 50_000
# Below this relative scatter an interval of 3.5 periods is a gap and no accident.
_TIGHT = 0.1
_BLOCK = 1024


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Count:
    """Grid indices of items: messages, bursts of them, or batches.

    Attributes
    ----------
    time
        ``[item]`` nanoseconds since the first item, rising.
    index
        ``[item]`` whole index, on a grid that is common within a stretch.
    place
        ``[item]`` where it stands in the list counted, of which the items may be only a part.
    stretch
        ``[item]`` number of the stretch between gaps, from 0, rising.
    window
        ``[item]`` number of a window of about 256 items that spans no gap.
    starts, sizes
        ``[window]`` first item and number of items.
    resumed
        ``[stretch]`` where each stretch begins in the list counted.
    firsts, ends
        ``[stretch]`` lowest index in each, and one more than the last sample's.
    cuts
        Numbers of the stretches that begin where the clock was set.
    coherence
        0 to 1: how well the stamps agree with a grid of the period; 1 when counted by order.
    """

    time: Real
    index: Whole
    place: Whole
    stretch: Whole
    window: Whole
    starts: Whole
    sizes: Whole
    resumed: Whole
    firsts: Whole
    ends: Whole
    cuts: Whole
    coherence: float = 1.0

    def moved(self, by_ns: Real) -> Self:
        """Give the items with the times of each ``[stretch]`` moved."""
        return replace(self, time=self.time + by_ns[self.stretch])

    def cut(self, per_cut: NDArray[ScalarT]) -> NDArray[ScalarT]:
        """Give ``[stretch]`` what each has since the last cut, of ``[1 + cut]``."""
        return np.repeat(per_cut, np.diff(self.cuts, prepend=0, append=self.resumed.size))


def count_even(time_ns: Whole) -> Count:
    """Count stamps whose steps are all alike: a few spread over the log tell what all of them tell.

    Parameters
    ----------
    time_ns
        ``[message]`` evenly rising, at least 2.
    """
    item = np.linspace(0, time_ns.size - 1, min(time_ns.size, WINDOW)).astype(np.int64)
    return Count(
        time=(time_ns[item] - time_ns[0]).astype(np.float64),
        index=item,
        place=item,
        stretch=np.zeros_like(item),
        window=np.zeros_like(item),
        starts=np.zeros(1, dtype=np.int64),
        sizes=np.array([item.size]),
        resumed=np.zeros(1, dtype=np.int64),
        firsts=np.zeros(1, dtype=np.int64),
        ends=np.array([time_ns.size]),
        cuts=np.zeros(0, dtype=np.int64),
    )


def count_by_phase(time_ns: Whole, steps: Whole, period_ns: float, cuts: Whole) -> Count:
    """Give each stamp the index that its phase tells.

    Parameters
    ----------
    time_ns, steps
        ``[message]`` rising, at least 2; and their differences.
    period_ns
        First guess: the median interval.
    cuts
        Messages before which the clock was set, rising.
    """
    scatter = _phase_scatter(steps, period_ns)
    # Reach: the median's own error, a bias of missing samples under scatter, and rounding to whole nanoseconds.
    reach = min(0.08, 4 * scatter / np.sqrt(time_ns.size) + 0.1 * scatter + 2 / period_ns)
    # Short blocks first: their broad maximum takes few trials to find, and leaves few for the long ones.
    period, _ = refined_period(time_ns, period_ns, reach, cuts, block=WINDOW)
    period, _ = refined_period(time_ns, period, min(reach, 0.5 / WINDOW), cuts, block=_BLOCK)
    every = -(-time_ns.size // MAX_ITEMS)
    if every > 1:
        # Windows of every n-th stamp are longer, so the period must be known better.
        period, _ = refined_period(
            time_ns[::every], period, min(reach, 0.5 / _BLOCK), -(-cuts // every), block=_BLOCK, every=every
        )
    resumed, cut_stretches = _resumed(steps > (3.5 if scatter < _TIGHT else 64) * period, cuts)
    item, stretch = _chosen(time_ns.size, resumed)
    window, starts = _windows(stretch)
    # Relative to the first, where a double holds nanoseconds exactly for 100 days.
    time = (time_ns[item] - time_ns[0]).astype(np.float64)
    cycles = time / period
    sums = np.add.reduceat(_phasors(cycles), starts)
    offset = np.unwrap(np.angle(sums)) / (2 * np.pi)
    index = np.rint(cycles - offset[window]).astype(np.int64)
    first_item = np.searchsorted(stretch, np.arange(resumed.size))
    return Count(
        time=time,
        index=index,
        place=item,
        stretch=stretch,
        window=window,
        starts=starts,
        sizes=np.diff(starts, append=time.size),
        resumed=resumed,
        firsts=np.minimum.reduceat(index, first_item),
        ends=np.maximum.reduceat(index, first_item) + 1,
        cuts=cut_stretches,
        coherence=float(np.abs(sums).sum() / time.size),
    )


def count_by_order(
    time_ns: Whole,
    steps: Whole,
    counts: Whole,
    period_ns: float,
    cuts: Whole,
    *,
    pause_ns: float | None = None,
    quantum_ns: float = 0.0,
) -> Count:
    """Number samples in the order in which they came; an interval far beyond the scatter is a gap.

    Parameters
    ----------
    time_ns, steps
        ``[item]`` time of the first sample of each item, rising, at least 2; and its differences.
    counts
        ``[item]`` samples of each item, at least 1.
    period_ns
        First guess; at most a few percent off.
    cuts
        Items before which the clock was set, rising.
    pause_ns
        What an interval must exceed its samples by to be a gap; by default eight times the scatter.
    quantum_ns
        What an interval may read too much because of the stamps' ticks.
    """
    excess = steps - counts[:-1] * period_ns
    centre = float(np.median(excess))
    # A guess that is a little off shifts every interval; one that is far off is a pause after every item.
    if abs(centre) < 0.1 * float(np.median(counts)) * period_ns:
        excess -= centre
    pause = 8 * robust_std(excess) if pause_ns is None else pause_ns
    # A tick is known to a rounding.
    resumed, cut_stretches = _resumed(excess > max(0.5 * period_ns, pause, 1.005 * quantum_ns), cuts)
    return count_in_stretches(time_ns, counts, resumed, cut_stretches)


def count_in_stretches(time_ns: Whole, counts: Whole, resumed: Whole, cut_stretches: Whole) -> Count:
    """Number samples in the order in which they came; what lies between the stretches is for a fit to find.

    Parameters
    ----------
    time_ns, counts
        As in `count_by_order`.
    resumed, cut_stretches
        `resumed` and `cuts` of the `Count`.
    """
    item, stretch = _chosen(time_ns.size, resumed)
    window, starts = _windows(stretch)
    after = np.cumsum(counts)
    return Count(
        time=(time_ns[item] - time_ns[0]).astype(np.float64),
        index=(after - counts)[item],
        place=item,
        stretch=stretch,
        window=window,
        starts=starts,
        sizes=np.diff(starts, append=item.size),
        resumed=resumed,
        firsts=(after - counts)[resumed],
        ends=after[np.append(resumed[1:], counts.size) - 1],
        cuts=cut_stretches,
    )


def order_fano(count: Count, period_ns: float) -> float:
    """Variance of the time that many items take, over that of as many random arrivals: 1 is chance, 0 a clock.

    Infinite when no stretch is long enough to tell.
    """
    items = count.time.size
    # Many windows for a robust scatter, each long enough to average delivery out.
    lag = int(np.clip(items // 16, 1, 512))
    same = np.flatnonzero(count.stretch[lag:] == count.stretch[:-lag])
    if not same.size:
        return np.inf
    late = count.time - period_ns * count.index
    mean = float(count.time[-1] - count.time[0]) / (items - 1)
    interval = max(float(np.median(np.diff(count.time))), 0.5 * mean)
    spread = robust_std(late[same + lag] - late[same])
    return spread**2 / (lag * interval**2)


def robust_std(values: Real) -> float:
    """Scatter by the median absolute deviation, on at most 100 000 of the values; 0 of none."""
    part = values[:: max(1, values.size // SAMPLE)]
    return float(1.4826 * np.median(np.abs(part - np.median(part)))) if part.size else 0.0


def refined_period(
    time_ns: Whole, period_ns: float, reach: float, cuts: Whole, *, block: int, every: int = 1
) -> tuple[float, float]:
    """Find the period whose phases agree best over blocks of stamps, one every n periods, near the guess.

    Parameters
    ----------
    time_ns
        ``[message]`` rising.
    period_ns, reach
        Guess, and how far off it may be, relative.
    cuts
        Messages before which the clock was set.
    block
        Stamps of a block; eight of them, spread over the log, are looked at.
    every
        Periods from stamp to stamp.

    Returns
    -------
    period_ns, power : float
        And the power of its phases, relative to that of random ones.
    """
    block = min(block, time_ns.size)
    step = 1 / (4 * block * every)
    half = int(np.ceil(reach / step))
    trial = 1 + np.arange(-half, half + 1) * step
    # Powers of separate blocks add, so that a gap or a step between blocks does no harm.
    power = np.zeros(trial.size)
    starts = np.unique(np.linspace(0, time_ns.size - block, 8).astype(np.int64))
    for start in starts:
        part = time_ns[start : start + block]
        # A clock that was set has another phase, so its stretches have powers of their own, too.
        inside = cuts[(cuts > start) & (cuts < start + block)] - start
        sums = np.add.reduceat(
            _phasors(np.outer((part - part[0]) / period_ns, trial)), np.unique(np.append(0, inside)), axis=0
        )
        power += (np.abs(sums) ** 2).sum(axis=0)
    best = int(np.argmax(power))
    return period_ns / float(trial[best]), float(power[best]) / (starts.size * block)


def _phasors(cycles: Real) -> NDArray[np.complex64]:
    """exp(2 pi j cycles); single precision, since of their sums only the nearest whole index is wanted."""
    angle = ((cycles - np.floor(cycles)) * (2 * np.pi)).astype(np.float32)
    phasors = np.empty(angle.shape, np.complex64)
    np.cos(angle, out=phasors.real)
    np.sin(angle, out=phasors.imag)
    return phasors


def _phase_scatter(steps: Whole, period_ns: float) -> float:
    """Robust scatter of intervals about whole periods, relative to the period."""
    turns = steps[:: max(1, steps.size // SAMPLE)] / period_ns
    # Over many periods the guess's own error would count as scatter.
    turns = turns[turns < 8]
    return robust_std(turns - np.rint(turns))


def _resumed(gaps: Mask, cuts: Whole) -> tuple[Whole, Whole]:
    """First items of the stretches, and the numbers of those that begin at a cut."""
    if cuts.size:
        gaps[cuts - 1] = True
    resumed = np.append(0, np.flatnonzero(gaps) + 1)
    return resumed, np.searchsorted(resumed, cuts)


def _chosen(items: int, resumed: Whole) -> tuple[Whole, Whole]:
    """Items to fit, with both ends of each stretch, and the stretch of each."""
    every = -(-items // MAX_ITEMS)
    chosen = np.arange(0, items, every)
    if every == 1:
        return chosen, np.repeat(np.arange(resumed.size), np.diff(resumed, append=items))
    chosen = np.sort(np.concatenate((chosen, resumed, resumed[1:] - 1, [items - 1])), kind="stable")
    chosen = chosen[np.diff(chosen, prepend=-1) > 0]
    return chosen, np.searchsorted(resumed, chosen, side="right") - 1


def _windows(stretch: Whole) -> tuple[Whole, Whole]:
    """Cut each stretch into near-equal windows of about 256; number of the window of each item, and the starts."""
    first = np.flatnonzero(np.diff(stretch, prepend=-1))
    sizes = np.diff(first, append=stretch.size)
    pieces = np.maximum(1, np.rint(sizes / WINDOW).astype(np.int64))
    of_stretch = np.repeat(np.arange(first.size), pieces)
    piece = np.arange(of_stretch.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    # Rounded up: item i of a stretch belongs to piece floor(i pieces/size).
    starts = first[of_stretch] - -piece * sizes[of_stretch] // pieces[of_stretch]
    return np.repeat(np.arange(starts.size), np.diff(starts, append=stretch.size)), starts
