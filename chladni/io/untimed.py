"""Stamps that are no time: zero, 1970 among 2026, or whatever else a message says that was never synchronised."""

from itertools import pairwise
from typing import Final

import numpy as np

from chladni.signals.arrays import Mask, Whole
from chladni.signals.clock_steps import LEAP_NS

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
