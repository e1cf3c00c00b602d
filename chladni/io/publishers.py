"""Who publishes on a topic: one source, perhaps through several MCAP channels, or several at once."""

from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.clock_count import SHORT
from chladni.io.clock.clock_verdict import JITTERED
from chladni.signals.arrays import Mask, Real, Whole

#: A message of another publisher comes between two of one, which are no further apart for it; one of the same source
#: takes a place of its own, and doubles the step around it. This is half way.
_IN_PLACE: Final = 1.5

#: From the tenth to the ninetieth percentile of Gaussian steps, in standard deviations.
_SIGMAS: Final = 2.56
#: Timers of one source keep its period in the mean; a share of it that says nothing.
_TIMER: Final = 0.01


def at_once(times_ns: Whole, source: NDArray[np.integer]) -> bool:
    """Tell whether messages with different labels come from publishers that send at the same time.

    One source may send through several MCAP channels in turn. Then a message of one channel stands in the place of
    one of the other, whose step around it is longer. Where several publish at once the step is as long as without it.

    Parameters
    ----------
    times_ns
        ``[message]``, in the order in which they came.
    source
        ``[message]``, label of each: its MCAP channel, or what a field says.

    Examples
    --------
    >>> times = np.arange(8) * 10
    >>> at_once(times, np.array([1, 1, 1, 1, 2, 2, 2, 2])), at_once(times, np.array([1, 2, 1, 2, 1, 2, 1, 2]))
    (False, True)
    """
    crossed, in_place = False, False
    for label in np.unique(source):
        places = np.flatnonzero(source == label)
        steps, across = np.diff(times_ns[places]), np.diff(places) > 1
        crossed |= bool(across.any())
        if across.any() and not across.all():
            if float(np.median(steps[across])) < _IN_PLACE * float(np.median(steps[~across])):
                return True
            in_place = True
    # Where every message of each lies between two of another, nothing says that they are of one source.
    return crossed and not in_place and _overlap(times_ns, source)


def evenly_in_turn(times_ns: Whole, source: NDArray[np.integer]) -> bool:
    """Tell whether messages of several MCAP channels lie as evenly together as those of each do.

    Then they are one source: two that know nothing of each other hardly send half a period apart. Were they two, each
    alone would show a tone above its own Nyquist frequency at another one.

    Parameters
    ----------
    times_ns, source
        As for `at_once`.
    """
    steps = np.diff(times_ns)
    own = [_spread(_single_steps(np.diff(one))) for one in _of_each(times_ns, source) if one.size >= SHORT]
    middle = float(np.median(steps)) if steps.size else 0.0
    if not own or _spread(steps) > max(JITTERED * middle, _CLEARLY * max(own)):
        return False
    single = _single_steps(steps, middle)
    from_to = np.stack((source[:-1], source[1:]))[:, source[1:] != source[:-1]]
    between = single[source[1:] != source[:-1]]
    for pair in np.unique(from_to, axis=1).T:
        some = between[np.all(from_to == pair[:, None], axis=0)]
        # Four standard errors of a median, and what timers leave out.
        off = 5 * max(own) / _SIGMAS / np.sqrt(some.size) + _TIMER * middle
        if abs(float(np.median(some)) - middle) > off:
            return False
    return True


def _of_each(times_ns: Whole, source: NDArray[np.integer]) -> list[Whole]:
    return [times_ns[source == label] for label in np.unique(source)]


def _overlap(times_ns: Whole, source: NDArray[np.integer]) -> bool:
    """Whether messages of some label come between those of another."""
    ends = sorted((int(one[0]), int(one[-1])) for one in _of_each(times_ns, source))
    return any(after[0] < before[1] for before, after in pairwise(ends))


# --- by their stamps alone ---------------------------------------------------------------------------------------

#: Publishers that stamps are looked through for; and messages that a chain of steps of one period may lack in a row.
_MOST_PUBLISHERS, _MOST_LOST = 4, 3
#: A stamp may be this share of a period away from where the one before puts it.
_OFF: Final = 0.2
#: Stamps of one publisher keep their period so many times better than stamps of all of them together keep theirs.
_CLEARLY: Final = 2.0
#: Share of the messages that must be there of one publisher, and belong to any: some are lost or held up.
_MOST: Final = 0.9
# Messages looked at together, and how often in a log.
_SLICE, _SLICES = 512, 3


def count_by_stamps(times_ns: Whole, *, in_bursts: bool) -> int:
    """Count publishers that only the stamps tell apart: each keeps a period, all together keep none.

    Parameters
    ----------
    times_ns
        ``[message]``, in the order in which they came.
    in_bursts
        Whether messages seem to come in bursts: then publishers of one rate can't be told from samples of a burst.

    Returns
    -------
    int
        1 where nothing speaks for more.
    """
    places = np.linspace(0, max(0, times_ns.size - _SLICE), _SLICES if times_ns.size > _SLICE else 1).astype(np.int64)
    found = []
    for place in places.tolist():
        part = np.sort(times_ns[place : place + _SLICE])
        chains = [] if _regular(part) else chains_of(part)
        if chains and not (in_bursts and _one_rate(part, chains)):
            found.append(len(chains))
    # Where publishers meet, the messages of one may look like those of two.
    return min(found, default=1)


def told_apart(times_ns: Whole) -> list[Whole]:
    """Give the messages of each publisher that only the stamps tell apart, where these do so without doubt.

    Parameters
    ----------
    times_ns
        ``[message]``.

    Returns
    -------
    list of int64 arrays
        Indices of the messages of each, in the order of its first; empty where two publishers send at nearly the same
        time, or pause, so that it isn't sure whose the next message is.
    """
    order = np.argsort(times_ns, kind="stable")
    rising_ns = times_ns[order]
    chains = chains_of(rising_ns)
    owner = np.full(times_ns.size, -1)
    for number, chain in enumerate(chains):
        owner[chain] = number
    between = np.diff(rising_ns)[owner[1:] != owner[:-1]]
    scatter = [_spread(_single_steps(np.diff(rising_ns[chain]))) for chain in chains]
    sure = between.size and int(between.min()) > max(scatter)
    return [order[chain] for chain in chains] if sure else []


def chains_of(times_ns: Whole) -> list[Whole]:
    """Find the publishers whose rising stamps are interleaved.

    Returns
    -------
    list of int64 arrays
        Indices of the messages of each, in the order of their first; empty when the stamps don't tell them apart.
    """
    rest, found = np.arange(times_ns.size), list[Whole]()
    while rest.size >= SHORT and len(found) <= _MOST_PUBLISHERS:
        chains = _chains(times_ns[rest])
        if not chains:
            break
        found += [rest[chain] for chain in chains]
        rest = np.setdiff1d(rest, np.concatenate(found), assume_unique=True)
    found.sort(key=lambda chain: int(chain[0]))
    together = sum(map(len, found)) >= _MOST * times_ns.size
    several = 1 < len(found) <= _MOST_PUBLISHERS
    return found if several and together and _clearly_apart(times_ns, found) else []


def _regular(times_ns: Whole) -> bool:
    """Whether stamps show one clock: hardly any scatter, or no more than their own resolution explains."""
    steps = np.diff(times_ns)
    if steps.size < SHORT:
        return True
    low, middle, high = np.percentile(steps, [5, 50, 95])
    return bool(high - low <= max(JITTERED * middle, int(np.gcd.reduce(steps))))


def _chains(times_ns: Whole) -> list[Whole]:
    """Messages that follow each other by the shortest period that any publisher keeps, each publisher's by itself."""
    for period_ns in _common_steps(times_ns):
        before = np.full(times_ns.size, -1)
        ends = np.ones(times_ns.size, np.bool_)
        for periods in range(1, _MOST_LOST + 2):
            _link(times_ns, before, ends, periods * period_ns, _OFF * period_ns)
        first = np.where(before < 0, np.arange(times_ns.size), before)
        while not np.array_equal(first, first[first]):
            first = first[first]
        chains = [np.flatnonzero(first == one) for one in np.unique(first)]
        long = [chain for chain in chains if chain.size >= SHORT and _mostly_there(times_ns[chain], period_ns)]
        if sum(map(len, long)) >= times_ns.size / _MOST_PUBLISHERS:
            return long
    return []


def _link(times_ns: Whole, before: Whole, ends: Mask, step_ns: float, off_ns: float) -> None:
    """Put into `before` the message one step before each, where both are the nearest to where the other puts them."""
    starts = np.flatnonzero(before < 0)
    last = np.flatnonzero(ends)
    follower = starts[_nearest(times_ns[starts], times_ns[last] + step_ns)]
    back = last[_nearest(times_ns[last], times_ns[follower] - step_ns)]
    linked = (back == last) & (np.abs(times_ns[follower] - times_ns[last] - step_ns) < off_ns) & (follower > last)
    before[follower[linked]] = last[linked]
    ends[last[linked]] = False


def _nearest(rising: Whole, wanted: NDArray[np.floating]) -> Whole:
    """Index of the entry nearest to each wanted number."""
    after = np.clip(np.searchsorted(rising, wanted), 0, rising.size - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(wanted - rising[before]) < np.abs(wanted - rising[after]), before, after)


def _mostly_there(times_ns: Whole, period_ns: float) -> bool:
    """Whether a chain lacks few of the messages that the period asks for."""
    return (times_ns.size - 1) * period_ns > _MOST * float(times_ns[-1] - times_ns[0])


def _common_steps(times_ns: Whole) -> list[float]:
    """Times that often lie between two of a few messages one after another, the shortest first."""
    some = times_ns[:_SLICE]
    steps = np.sort(np.concatenate([some[lag:] - some[:-lag] for lag in range(1, 2 * _MOST_PUBLISHERS + 1)]))
    steps = steps[steps > 0]
    found: list[float] = []
    often = 0
    while steps.size:
        within = np.searchsorted(steps, steps * (1 + JITTERED), side="right") - np.arange(steps.size)
        place = int(np.argmax(within))
        often = often or int(within[place])
        if within[place] * _MOST_PUBLISHERS < often:
            break
        step_ns = float(np.median(steps[place : place + within[place]]))
        found.append(step_ns)
        steps = steps[np.abs(steps - step_ns) > _OFF * step_ns]
    return sorted(found)


def _clearly_apart(times_ns: Whole, chains: list[Whole]) -> bool:
    """Whether publishers send at once, and each keeps its own period far better than all together keep one."""
    if max(int(chain[0]) for chain in chains) > min(int(chain[-1]) for chain in chains):
        return False
    together = _spread(np.diff(times_ns))
    return all(together >= _CLEARLY * _spread(_single_steps(np.diff(times_ns[chain]))) for chain in chains)


def _single_steps(steps: Whole, period_ns: float | None = None) -> Real:
    """Divide the steps over lost messages among them; the period is the median step where it isn't given."""
    periods = np.rint(steps / max(1.0, float(np.median(steps)) if period_ns is None else period_ns))
    single: Real = steps / np.maximum(1, periods)
    return single


def _spread(steps: Whole | Real) -> float:
    low, high = np.percentile(steps, [10, 90])
    return float(high - low)


def _one_rate(times_ns: Whole, chains: list[Whole]) -> bool:
    periods = [float(np.median(np.diff(times_ns[chain]))) for chain in chains]
    return bool(periods) and max(periods) < _IN_PLACE * min(periods)
