"""Places of counted samples on the grid of a time base: in order or by phase, with gaps and breaks between them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from chladni.io.clock.clock_count import LEAP_S, Counted
from chladni.io.clock.clock_fit import Clock
from chladni.io.clock.grid_index import NOWHERE, choose_smoothing, grid_index, side_by_side
from chladni.io.clock.stamp_order import Untangled
from chladni.signals.arrays import Real, Whole
from chladni.signals.time_series import NS_PER_S

if TYPE_CHECKING:
    from chladni.io.clock.time_base import TimeBase

#: Gaps that are listed one by one, the longest chosen; all are counted.
MAX_GAPS = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Gaps:
    """Gaps of a log, seconds from the first stamp.

    Attributes
    ----------
    longest
        (last sample before, first after), in order of time; at most 1000.
    count
        All of them.
    leaps
        ``[leap, 2]`` those longer than a minute and than all that was recorded: set clocks rather than pauses.
    """

    longest: tuple[tuple[float, float], ...]
    count: int
    leaps: Real


def list_gaps(spans_s: Real, recorded_s: float) -> Gaps:
    """List gaps.

    Parameters
    ----------
    spans_s
        ``[gap, 2]`` time of the last sample before and of the first after each, in order of time.
    recorded_s
        Time that all samples cover.
    """
    lengths = spans_s[:, 1] - spans_s[:, 0]
    chosen = np.sort(np.argsort(lengths)[-MAX_GAPS:])
    return Gaps(
        longest=tuple((start, end) for start, end in spans_s[chosen].tolist()),
        count=lengths.size,
        leaps=spans_s[lengths > max(LEAP_S, recorded_s)],
    )


def spans_between(stamps_ns: Whole, after: Whole, sizes: Whole, period_ns: float) -> Real:
    """Give ``[gap, 2]`` seconds from the first stamp: the last sample before, and the first one after.

    Parameters
    ----------
    stamps_ns
        ``[message]`` rising stamps.
    after
        ``[gap]`` the first message after each gap.
    sizes, period_ns
        ``[message]`` samples of each, or a single number for all; and the time between them.
    """
    first = int(stamps_ns[0])
    before = np.broadcast_to(sizes, stamps_ns.shape)[after - 1]
    # A gap begins with the last sample before it, which in a batch comes after the stamp.
    starts_s = (stamps_ns[after - 1] - first + (before - 1) * period_ns) / NS_PER_S
    return np.stack((starts_s, (stamps_ns[after] - first) / NS_PER_S), axis=1)


# Share of a period below which the second of two messages has no point of its own.
_AT_ONCE = 0.05
# Share of the messages that may find no free point; with more, the source was faster than the grid for a while.
_CROWD = 0.01


def place_in_order(base: "TimeBase", tangled: Untangled, sizes: Whole, counted: Counted, clock: Clock) -> "TimeBase":
    """Add the stretches and the gaps between them."""
    first = counted.count.resumed
    if counted.burst_starts is not None:
        first = counted.burst_starts[first]
    samples = first if sizes.size == 1 else np.append(0, np.cumsum(sizes))[first]
    total = tangled.time_ns.size if sizes.size == 1 else int(sizes.sum())
    # A stretch that seems to begin before the one before has ended is late delivery, not time running back.
    shift = np.maximum.accumulate(clock.shift)
    base = replace(base, resumed=samples, resumed_shift=shift)
    gap = np.flatnonzero(np.diff(shift) > 0) + 1
    begin, end = samples[gap] + shift[gap], samples[gap] + shift[gap - 1]
    return _with_gaps(base, tangled, sizes, first[gap], begin, end, total + int(shift[-1]))


def place_by_phase(base: "TimeBase", tangled: Untangled) -> "TimeBase":
    """Add the smoothing and the gaps that remain with it."""
    rising_ns = tangled.time_ns
    clock = partial(
        grid_index,
        knots_ns=base.knots_ns,
        knots_index=base.knots_index,
        rate_hz=base.rate_hz,
        cut_order=tangled.clock.message,
        cuts=base.cuts,
    )
    smoothing = choose_smoothing(rising_ns, clock, repeats=base.duplicates)
    lost = _points_lost(base, rising_ns, clock, smoothing)
    if smoothing > 1 and lost < 0:
        # Two messages for one point of the grid, though not with the very same stamp, are a repeat as well.
        repeats = int(np.count_nonzero(tangled.steps < _AT_ONCE * NS_PER_S / base.rate_hz))
        if repeats > base.duplicates and repeats + lost >= 0:
            base = replace(base, duplicates=repeats)
            smoothing = choose_smoothing(rising_ns, clock, repeats=repeats)
            lost = _points_lost(base, rising_ns, clock, smoothing)
    crowded = -lost > max(1, _CROWD * rising_ns.size)
    one, set_at = np.ones(1, dtype=np.int64), tangled.clock.message
    if smoothing > 1 and (crowded or -1 <= lost <= 0) and not base.duplicates:
        # As many samples as grid points: their order tells their places better than scattered stamps. With a few
        # more they follow the stamps and leave those out; with many more this is no grid, as the check will find.
        shift = np.append(0, np.cumsum(base.cuts[:, 1] - base.cuts[:, 0]))
        base = replace(base, resumed=np.append(0, set_at), resumed_shift=shift)
        begin, end = set_at + shift[1:], set_at + shift[:-1]
        return _with_gaps(base, tangled, one, set_at, begin, end, rising_ns.size + int(shift[-1]))
    after = np.union1d(np.flatnonzero(tangled.steps > 1.5 * NS_PER_S / base.rate_hz) + 1, set_at)
    if smoothing == 1:
        begin, end = _parted_ends(rising_ns, after, clock, base.cuts)
    else:
        index = clock(rising_ns, np.arange(rising_ns.size), smoothing=smoothing)
        begin, end = index[after], index[after - 1]
    gap = begin - end > 1
    last = rising_ns.size + lost + _cut_out(base)
    base = _with_gaps(base, tangled, one, after[gap], begin[gap], end[gap] + 1, last)
    return replace(base, missing=max(0, lost + base.duplicates), smoothing=smoothing)


def _parted_ends(
    rising_ns: Whole,
    after: Whole,
    clock: Callable[..., Whole],
    cuts: Whole,
) -> tuple[Whole, Whole]:
    """Grid indices of messages and of those before them, two on one point parted where there's room."""
    # With one more message on each side.
    beside = after[:, None] + np.arange(-2, 2)
    inside = np.clip(beside, 0, rising_ns.size - 1)
    message, back = np.unique(inside, return_inverse=True)
    index = clock(rising_ns[message], message)[back].reshape(beside.shape) + beside - inside
    parted = side_by_side(index, rising_ns[inside], cuts)
    parted = np.where(parted == NOWHERE, index, parted)
    return parted[:, 2], parted[:, 1]


def _with_gaps(
    base: "TimeBase",
    tangled: Untangled,
    sizes: Whole,
    message: Whole,
    begin: Whole,
    end: Whole,
    last: int,
) -> "TimeBase":
    """Add gaps, breaks and the longest stretch between them.

    Parameters
    ----------
    base, tangled, sizes
        What is known; samples of each message, or a single number for all.
    message
        First message after each place where samples don't follow each other.
    begin, end
        Grid index of its first sample, and one more than that of the last sample before.
    last
        One more than the last index of all.
    """
    spans_s = spans_between(tangled.time_ns, message, sizes, NS_PER_S / base.rate_hz)
    cut = np.isin(message, tangled.clock.message)
    lengths = np.append(end, last) - np.append(0, begin)
    gaps = list_gaps(spans_s[~cut], float(lengths.sum()) / base.rate_hz)
    breaks_s = np.concatenate((spans_s[cut], gaps.leaps))
    return replace(
        base,
        gaps=gaps.longest,
        gap_count=gaps.count,
        missing=int((begin - end)[~cut].sum()),
        breaks_s=breaks_s[np.argsort(breaks_s[:, 0], kind="stable")],
        longest_stretch_s=float(lengths.max()) / base.rate_hz,
    )


def _cut_out(base: "TimeBase") -> int:
    """Grid points left out where the clock was set."""
    return int((base.cuts[:, 1] - base.cuts[:, 0]).sum())


def _points_lost(base: "TimeBase", rising_ns: Whole, clock: Callable[..., Whole], smoothing: int) -> int:
    """Grid points that no message has, beside those left out on purpose; negative with more messages than points."""
    end = np.arange(max(0, rising_ns.size - 4 * smoothing), rising_ns.size)
    return int(clock(rising_ns[end], end, smoothing=smoothing)[-1]) + 1 - rising_ns.size - _cut_out(base)


def straight_pieces(line_ns: Real, index: Whole, pieces: Whole, first_ns: int) -> tuple[Whole, Real]:
    """Both ends of each straight piece of the clock, in rising order."""
    ends = np.append(pieces[1:], index.size) - 1
    both = np.unique(np.concatenate((pieces, ends)))
    knots = np.rint(line_ns[both]).astype(np.int64) + first_ns
    rising = np.concatenate(([True], knots[1:] > np.maximum.accumulate(knots)[:-1]))
    return knots[rising], index[both][rising].astype(np.float64)
