"""Stamps that are coarser than the sampling: a clock that ticks every 10 ms beside a sensor of 104 Hz."""

from dataclasses import dataclass, replace
from math import floor, lgamma, log

import numpy as np

from chladni.io.clock.clock_fit import HELD_UP, Clock, fit_clock
from chladni.io.clock.sample_count import (
    SAMPLE,
    WINDOW,
    Count,
    count_by_order,
    count_in_stretches,
    refined_period,
)
from chladni.io.clock.stamp_order import Untangled
from chladni.signals.arrays import Whole

# Stamps of doubles and of whole microseconds are off their tick by as much.
_ROUNDING_NS = 1000.0
# Ticks of a smaller share of a period tell each sample's place by themselves.
_FINE = 0.125
# Different intervals that ticks may make; more are no ticks.
_MOST_SIZES = 64
# Logs in which messages share stamps by accident, beside those in which ticks are near, but not at, the sampling.
_SHARED_BY_ACCIDENT = 0.01
# As many logs have lost messages; and ten to one is asked for, since a loss is told and a wrong rate isn't seen.
_LOST_BY_ACCIDENT = 10.0
# Hidden losses are looked for in ever shorter stretches, and found as long as these are this long in the mean; in
# shorter ones more of them hide.
_SHORTEST, _LONG_ENOUGH = 64, 256
_ROUNDS = 24
# Share of samples that may be lost for the phases of the rest to be looked for.
_MOST_LOST = 0.1
# Power of phases, relative to random ones, that a hundred trials on eight blocks don't reach by chance: its logarithm
# is -8 (r - 1 - ln r), Chernoff's bound of the sum of eight exponentials.
_PHASES_AGREE = 4.0
# Messages whose mean tells where a stretch lies, within a quarter of a tick.
_SURE = 8
# Messages of a stretch of which one may be off by more.
_TRIMMED = 200
# Jitter that is allowed for, in periods. Once samples are known to be lost, a rate that is a little off would hide
# more of them in it.
_SLACKS = (0.5, 0.1)
# With more samples a tick than this, single ones that are lost hide in it.
_MANY = 2.0


def stamp_quantum(steps: Whole, period_ns: float) -> float:
    """Find the ticks of a clock: the largest step of which all others are multiples.

    Parameters
    ----------
    steps
        ``[interval]`` nanoseconds between messages, none negative.
    period_ns
        Mean interval of the samples.

    Returns
    -------
    float
        Nanoseconds; 0 when there are no ticks, or they are finer than an eighth of a period.

    Examples
    --------
    >>> stamp_quantum(np.array([10, 10, 0, 20, 10]) * 1_000_000, 8e6)
    10000000.0
    >>> stamp_quantum(np.array([9_999_100, 10_001_300, 10_007_000, 9_990_000]), 1e7)
    0.0
    """
    some = steps[:: max(1, steps.size // SAMPLE)]
    some = some[some > 0]
    # Pauses tell nothing more, and the error of the ticks would add up over them.
    usual = max(period_ns, float(np.median(some))) if some.size else period_ns
    sizes, often = np.unique(some[some < _MOST_SIZES * usual], return_counts=True)
    if not sizes.size or sizes.size > 4 * _MOST_SIZES:
        return 0.0
    quantum = 0.0
    for size in sizes.tolist():
        quantum = _common(quantum, float(size))
        if quantum < max(_FINE * period_ns, 20 * _ROUNDING_NS):
            return 0.0
    ticks = np.rint(sizes / quantum)
    quantum = float(np.sum(ticks * sizes * often) / np.sum(ticks * ticks * often))
    return quantum if np.all(np.abs(sizes - ticks * quantum) <= _ROUNDING_NS) else 0.0


def _common(one: float, other: float) -> float:
    """Greatest common divisor of two lengths that are known to a rounding."""
    while one > 2 * _ROUNDING_NS:
        one, other = abs(other - round(other / one) * one), one
    return other


def few_ticks(steps: Whole, quantum_ns: float, period_ns: float) -> bool:
    """Whether intervals are those of even samples, give or take a tick: else messages come in bursts."""
    return int(np.count_nonzero(steps > period_ns + 2.5 * quantum_ns)) <= 0.01 * steps.size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TickCount:
    """Samples counted in order, as ticks explain their stamps.

    Attributes
    ----------
    count
        With gaps where an interval is longer than a tick explains.
    hidden
        Losses that no interval shows.
    proven
        Whether intervals are too even for another explanation.
    """

    count: Count
    hidden: int
    proven: bool


def count_ticks(tangled: Untangled, quantum_ns: float, period_ns: float) -> TickCount | None:
    """Count samples in order, with gaps where an interval is longer than a tick explains.

    The true time of a sample lies within the tick of its stamp. So times over index stay in a strip of one tick in
    every stretch, half a sample of jitter allowed for. One that is wider has hidden losses, and is cut where its
    middle steps (the extreme of the cumulative sum), until all are narrow.

    Samples that are lost or doubled, of a clock which ticks as it samples, also make intervals of whole ticks, though
    not as evenly: k uneven intervals of a stretch all lie as evenly as that by chance in ``k!/k^k`` of all cases, in
    more by the jitter, and each cut is chosen among all samples. On the other side, ticks that are as near to the
    sampling as that are as rare as uneven intervals are among all. Hidden losses prove nothing where several samples
    share a tick: more may be hidden.

    Parameters
    ----------
    tangled
        Stamps.
    quantum_ns, period_ns
        Ticks and mean interval, see `stamp_quantum`.

    Returns
    -------
    TickCount or None
        None when ticks don't explain the stamps.
    """
    # Jitter makes an interval longer, too; what is lost in so short a gap is found as hidden losses are.
    explained_ns, set_at = quantum_ns + _SLACKS[0] * period_ns, tangled.clock.message
    ones = np.ones_like(tangled.time_ns)
    count = count_by_order(
        tangled.time_ns, tangled.steps, ones, period_ns, set_at, pause_ns=0.0, quantum_ns=explained_ns
    )
    gaps = count.resumed
    slack: float | None = None
    for allowed in _SLACKS:
        narrowed = _narrowed(tangled, count, gaps, quantum_ns, period_ns, allowed)
        if narrowed is None:
            break
        count, slack = narrowed, allowed
        if count.resumed.size == gaps.size:
            break
    if slack is None:
        return None
    hidden = count.resumed.size - gaps.size
    told = hidden <= ones.size // _LONG_ENOUGH and (not hidden or quantum_ns <= _MANY * period_ns)
    proven = told and _proven(tangled.steps, count, quantum_ns, 1 + slack * period_ns / quantum_ns, hidden)
    return TickCount(count=count, hidden=hidden, proven=proven)


def _proven(steps: Whole, count: Count, quantum_ns: float, width: float, hidden: int) -> bool:
    """Whether uneven intervals are so even that ticks explain them rather than accidents; see `count_ticks`."""
    ticks = np.rint(steps / quantum_ns).astype(np.int64)
    usual = int(np.argmax(np.bincount(np.minimum(ticks, _MOST_SIZES))))
    uneven = (ticks != usual).astype(np.int64)
    # What lies between stretches is a gap by itself.
    uneven[count.resumed[1:] - 1] = 0
    if usual > 1 and 2 * np.count_nonzero(uneven[ticks % usual != 0]) > uneven.sum():
        # Nothing that was lost or doubled makes an interval of three ticks where two are usual.
        return True
    of_stretch = np.add.reduceat(uneven, np.minimum(count.resumed, uneven.size - 1))
    chance = sum(one * (log(width) - log(one)) + lgamma(one + 1) for one in of_stretch[of_stretch > 0].tolist())
    accidents = _LOST_BY_ACCIDENT if steps.all() else _SHARED_BY_ACCIDENT
    return bool(chance + hidden * log(steps.size) + log(accidents) < log(max(1, uneven.sum()) / steps.size))


def phase_period(tangled: Untangled, quantum_ns: float, period_ns: float) -> tuple[float, float] | None:
    """Find the period that stamps tell by their phase although they are coarse and some samples are lost.

    A true time is uniform within its tick, so phases of the period agree by ``sinc(q/T)``, whatever is lost. They
    always agree for the ticks themselves, and with a period also for its mirror image at half of their frequency:
    near a whole or a half number of samples a tick nothing can be told.

    Returns
    -------
    period_ns, period_std_ns : float
        Or None where phases don't tell.
    """
    low, high = (1 - _MOST_LOST) * period_ns, 1.02 * period_ns
    if floor(2.06 * quantum_ns / low) > floor(1.94 * quantum_ns / high):
        return None
    centre, reach, block = 0.5 * (low + high), (high - low) / (high + low), WINDOW
    period, power = refined_period(tangled.time_ns, centre, reach, tangled.clock.message, block=block)
    if power < _PHASES_AGREE:
        return None
    while block < tangled.time_ns.size:
        reach, block = 0.5 / block, 4 * block
        period, _ = refined_period(tangled.time_ns, period, reach, tangled.clock.message, block=block)
    # The best of trials a quarter of a turn apart over a block is uniform within half of that.
    return period, period / (8 * min(block, tangled.time_ns.size) * 3**0.5)


def count_by_ticks(tangled: Untangled, period_ns: float) -> Count:
    """Give each stamp the index nearest to it, at a known period, in stretches that begin where the clock was set."""
    time_ns, resumed = tangled.time_ns, np.append(0, tangled.clock.message)
    count = count_in_stretches(time_ns, np.ones_like(time_ns), resumed, np.arange(1, resumed.size))
    begun = (time_ns[resumed] - time_ns[0]).astype(np.float64)
    index = np.rint((count.time - begun[count.stretch]) / period_ns).astype(np.int64)
    last = np.append(resumed[1:], time_ns.size) - 1
    ends = np.rint((time_ns[last] - time_ns[0] - begun) / period_ns).astype(np.int64) + 1
    return replace(count, index=index, firsts=np.zeros_like(resumed), ends=ends)


def _narrowed(
    tangled: Untangled, count: Count, gaps: Whole, quantum_ns: float, period_ns: float, slack: float
) -> Count | None:
    """Cut stretches until all are as narrow as a tick and `slack` of a period; None when no cuts make them so."""
    for _ in range(_ROUNDS):
        clock = fit_clock(count, period_ns)
        if clock is None:
            return None
        wide = _wide(count, clock, quantum_ns + slack * clock.period_ns)
        if not wide.size:
            # Cuts that turn out to leave nothing out were made while the rate was still off, or because of jitter.
            idle = np.append(False, np.diff(clock.shift) == 0) & ~np.isin(count.resumed, gaps)
            return _cut_at(tangled, count.resumed[~idle])
        resumed = np.union1d(count.resumed, _steps_up(count, clock, wide))
        if resumed.size > gaps.size + tangled.time_ns.size // _SHORTEST:
            return None
        count = _cut_at(tangled, resumed)
    return None


def _cut_at(tangled: Untangled, resumed: Whole) -> Count:
    ones = np.ones_like(tangled.time_ns)
    return count_in_stretches(tangled.time_ns, ones, resumed, np.searchsorted(resumed, tangled.clock.message))


def _wide(count: Count, clock: Clock, allowed_ns: float) -> Whole:
    """Stretches whose times over index don't fit into a strip, one message in two hundred left out.

    Short ones are let be: where they lie against the others is too uncertain to find a sample lost.
    """
    first = np.searchsorted(count.stretch, np.arange(count.resumed.size + 1))
    residual = clock.residual_ns
    width = np.maximum.reduceat(residual, first[:-1]) - np.minimum.reduceat(residual, first[:-1])
    for stretch in np.flatnonzero((width > allowed_ns) & (np.diff(first) >= _TRIMMED)):
        part = residual[first[stretch] : first[stretch + 1]]
        low, high = np.quantile(part, [0.5 * HELD_UP, 1 - 0.5 * HELD_UP])
        width[stretch] = high - low
    return np.flatnonzero((width > allowed_ns) & (np.diff(first) > 4 * _SURE))


def _steps_up(count: Count, clock: Clock, stretches: Whole) -> Whole:
    """Messages at which the middle of each stretch steps most."""
    first = np.searchsorted(count.stretch, np.arange(count.resumed.size + 1))
    found = []
    for stretch in stretches.tolist():
        part = clock.residual_ns[first[stretch] : first[stretch + 1]]
        sums = np.abs(np.cumsum(part - part.mean()))[_SURE - 1 : -_SURE]
        found.append(int(count.place[first[stretch] + _SURE + int(np.argmax(sums))]))
    return np.array(found, dtype=np.int64)
