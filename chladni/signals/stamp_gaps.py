"""Gaps between stamped samples, and steps forward that look like a clock being set."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real, Whole
from chladni.signals.time_series import NS_PER_S

#: Gaps that are listed one by one, the longest chosen; all are counted.
MAX_GAPS = 1000
#: A pause longer than this, and than all that was recorded, may as well be a clock that was set.
LEAP_S = 60.0


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
