"""Stray stamps: those that are no time, and those that contradict the count of the samples around them."""

from itertools import pairwise
from typing import Final

import numpy as np

from chladni.io.clock.clock_count import SHORT
from chladni.io.clock.clock_fit import JITTERS
from chladni.io.clock.sample_count import SAMPLE, robust_std
from chladni.io.clock.stamp_order import LEAP_NS
from chladni.signals.arrays import Mask, Real, Whole

#: A message may be logged this much later than its sample, beside what the others show.
SLACK_NS: Final = 30_000_000_000
# Stamps that run on together: a clock, though one that was set; two may be chance.
_STRETCH = 3
# Stamps that are looked at to learn where most of them lie.
_SAMPLE = 50_000


def untimed(stamps_ns: Whole, log_ns: Whole | None) -> Mask | None:
    """Find the stamps that are no time, by the other stamps of the topic and by the log time.

    Such a stamp lies farther from where most stamps are than the whole log lasts; it isn't there by the log time
    either; and it's not part of a stretch of stamps that run on, as those of a clock do that is set later.

    Parameters
    ----------
    stamps_ns
        ``[message]``, in the order of the file.
    log_ns
        ``[message]``, when they were logged; None when these are the stamps, and nothing else tells the time. What
        is more than eleven days away from the others is then no time.

    Returns
    -------
    bool array ``[message]`` or None
        None when all are times.

    Examples
    --------
    >>> untimed(np.array([10**18, 10**18 + 10**7, 0, 10**18 + 2 * 10**7]), None)
    array([False, False,  True, False])
    >>> untimed(np.array([0, 1, 2, 3, 4]) * 10**7, None) is None
    True
    """
    if stamps_ns.size < 2:
        return None
    far_ns = LEAP_NS if log_ns is None else SLACK_NS + _lasts_ns(log_ns)
    if int(stamps_ns.max()) - int(stamps_ns.min()) <= far_ns:
        return None
    bounds = _where_most_are(stamps_ns, log_ns, far_ns)
    if bounds is None:
        return None
    low, high = bounds
    away = (stamps_ns < low - far_ns) | (stamps_ns > high + far_ns)
    if log_ns is not None and not away.all():
        lag = log_ns - stamps_ns
        logged_away = untimed(log_ns, None)
        confirmed = np.abs(lag - int(np.median(lag[~away]))) <= far_ns
        away &= ~confirmed if logged_away is None else ~confirmed | logged_away
    for first, end in _stretches(away):
        if _runs_on(stamps_ns[first:end], far_ns):
            away[first:end] = False
    return away if away.any() and not away.all() else None


def _lasts_ns(log_ns: Whole) -> int:
    """How long a log lasts, log times that are no times left out."""
    low, high = int(log_ns.min()), int(log_ns.max())
    bounds = _where_most_are(log_ns, None, LEAP_NS) if high - low > LEAP_NS else None
    return high - low if bounds is None else bounds[1] - bounds[0]


def _where_most_are(stamps_ns: Whole, log_ns: Whole | None, far_ns: int) -> tuple[int, int] | None:
    """Ends of the stretch of time, without a pause longer than `far_ns`, in which most different stamps lie.

    Of two with as many the one nearer to the log time; None when there is no stretch with half of them.
    """
    every = max(1, stamps_ns.size // _SAMPLE)
    some = np.unique(stamps_ns[::every])
    logged = None if log_ns is None else int(np.median(log_ns))
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(some) > far_ns) + 1, [some.size]))
    stretches = [some[first:end] for first, end in pairwise(bounds.tolist())]
    best = max(stretches, key=lambda one: (one.size, 0 if logged is None else -abs(int(one[0]) - logged)))
    return (int(best[0]), int(best[-1])) if 2 * best.size >= some.size else None


def _stretches(mask: Mask) -> list[tuple[int, int]]:
    """Where enough messages in a row are marked."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)
    return [(first, end) for first, end in edges[np.diff(edges)[:, 0] >= _STRETCH].tolist()]


def _runs_on(stamps_ns: Whole, far_ns: int) -> bool:
    steps = np.diff(stamps_ns)
    moves = np.count_nonzero(steps) > steps.size / 2
    return bool(moves and steps.min() >= 0 and stamps_ns[-1] - stamps_ns[0] <= far_ns)


# Stray stamps in a row; three that run on together may be a clock that was set.
_MOST = 2
# A clock whose intervals scatter by a quarter is none, and from there on neighbours don't tell how many they are.
_UNEVEN = 0.25


def find_strays(stamps_ns: Whole, sizes: Whole | None = None) -> Whole:
    """Find messages whose stamps contradict the count of samples around them.

    A message that is late leaves no hole where it came, and fills one where its stamp says. A stray one is neither:
    the messages before and after it leave exactly its place empty, and its stamp lies where others have all places,
    amid a pause, or beyond all others. What it does say isn't known, and must move no other sample.

    Parameters
    ----------
    stamps_ns
        ``[message]`` nanoseconds, in the order of arrival.
    sizes
        ``[message]`` samples of each; None when every message is one sample.

    Returns
    -------
    int64 array ``[stray]``
        Their numbers in the order of arrival, rising. Empty for stamps that rise, for too few, and for
        uneven ones.

    Examples
    --------
    >>> find_strays(np.array([0, 10, 20, 30, 40, 50, 12, 70, 80, 90]))
    array([6])
    >>> find_strays(np.array([0, 10, 30, 40, 50, 20, 60, 70, 80, 90]))
    array([], dtype=int64)
    """
    none = np.zeros(0, np.int64)
    # The usual log is done here.
    back = np.flatnonzero(stamps_ns[1:] < stamps_ns[:-1]) + 1
    if not back.size or stamps_ns.size < SHORT:
        return none
    counts = np.ones_like(stamps_ns) if sizes is None else sizes
    some = slice(None, None, max(1, stamps_ns.size // SAMPLE))
    steps = np.diff(stamps_ns)[some]
    intervals = (steps / counts[:-1][some])[steps > 0]
    period_ns = float(np.median(intervals)) if intervals.size else 0.0
    scatter = robust_std(intervals) / period_ns if period_ns else np.inf
    if scatter > _UNEVEN:
        return none
    # In periods, from the first stamp: small enough for doubles to tell nanoseconds of a log that lasts days.
    time = (stamps_ns - stamps_ns[0]) / period_ns
    found = none
    for run in range(1, _MOST + 1):
        starts = np.unique(np.concatenate([back - ahead for ahead in range(run + 1)]))
        starts = starts[(starts >= 0) & (starts + run <= time.size)]
        fits = starts[_leave_a_place(time, counts, starts, run, JITTERS * scatter / np.sqrt(2))]
        found = np.union1d(found, (fits[:, None] + np.arange(run)).ravel())
    return found[~_fill_a_hole(time, counts, found)] if found.size else none


def _leave_a_place(time: Real, counts: Whole, starts: Whole, run: int, reach: float) -> Mask:
    """Whether the messages around each run leave exactly its place empty, and none of it lies near there.

    At an end of the log there's room for any run, if the others go on as evenly as ever.
    """
    last = time.size - 1
    before, after = starts - 1, starts + run
    inner = (before >= 0) & (after <= last)
    before = np.where(before < 0, after, np.minimum(before, last))
    after = np.where(after > last, before, after)
    members = np.minimum(starts[:, None] + np.arange(run), last)
    needed, half = counts[members].sum(axis=1), 0.5 * counts[members].min(axis=1)
    room = time[after] - time[before] - counts[before]
    # The step beside the run, at an end of the log.
    low = np.clip(np.where(starts == 0, after, before - 1), 0, last - 1)
    beside = time[low + 1] - time[low] - counts[low]
    fits = np.where(inner, np.abs(room - needed) < half, np.abs(beside) < half)
    # Where the run begins if it follows the one before, or else ends where the one after begins.
    place = np.where(starts == 0, time[after] - needed, time[before] + counts[before])
    own = place[:, None] + np.cumsum(counts[members], axis=1) - counts[members]
    stamps = time[members]
    floor = np.where(starts == 0, -np.inf, time[before])[:, None]
    ceiling = np.where(starts + run > last, np.inf, time[after])[:, None]
    outside = ((stamps < floor) | (stamps > ceiling)) & (np.abs(stamps - own) > reach)
    told: Mask = fits & outside.all(axis=1)
    if told.any():
        # What came earlier or later may lie there.
        rising = np.sort(time)
        first = np.where(starts == 0, 0, np.searchsorted(rising, time[before], side="right"))
        end = np.where(starts + run > last, time.size, np.searchsorted(rising, time[after], side="left"))
        told &= first >= end
    return told


def _fill_a_hole(time: Real, counts: Whole, found: Whole) -> Mask:
    """Whether the others leave a free place where a stamp says, next to one of them: a late message follows on."""
    order = np.argsort(time, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    inside = (rank[found] > 0) & (rank[found] < order.size - 1)
    before, after = (order[np.clip(rank[found] + step, 0, order.size - 1)] for step in (-1, 1))
    behind, ahead = time[found] - time[before] - counts[before], time[after] - time[found] - counts[found]
    half, nearest = 0.5 * counts[found], np.minimum(behind, ahead)
    free: Mask = inside & (behind + ahead > -half) & (np.abs(nearest) < half)
    return free
