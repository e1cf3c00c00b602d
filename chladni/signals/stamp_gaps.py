"""Gaps between stamped samples, and steps forward that look like a clock being set."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.stamp_order import ClockJump
from chladni.signals.time_series import NS_PER_S

#: Gaps that are listed one by one, the longest chosen; all are counted.
MAX_GAPS = 1000
# A pause of more than a minute that outlasts all the rest of the log.
_LEAP_S = 60.0


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
        Those longer than a minute and than all the rest of the log: set clocks rather than pauses.
    """

    longest: tuple[tuple[float, float], ...]
    count: int
    leaps: tuple[ClockJump, ...]


def list_gaps(
    stamps_ns: NDArray[np.int64], before: NDArray[np.int64], sizes: NDArray[np.int64], period_ns: float
) -> Gaps:
    """List the gaps after the messages `before`.

    Parameters
    ----------
    stamps_ns
        ``[message]`` rising stamps.
    before, sizes
        ``[gap]`` the last message before each gap, and its samples.
    period_ns
        Of the samples in a batch.
    """
    first, span = int(stamps_ns[0]), int(stamps_ns[-1] - stamps_ns[0])
    lengths = stamps_ns[before + 1] - stamps_ns[before]
    chosen = np.sort(np.argsort(lengths)[-MAX_GAPS:])
    # A gap begins with the last sample before it, which in a batch comes after the stamp.
    starts_s = (stamps_ns[before] - first + (sizes - 1) * period_ns) / NS_PER_S
    ends_s = (stamps_ns[before + 1] - first) / NS_PER_S
    leaping = chosen[lengths[chosen] > np.maximum(_LEAP_S * NS_PER_S, span - lengths[chosen])]
    return Gaps(
        longest=tuple(zip(starts_s[chosen].tolist(), ends_s[chosen].tolist(), strict=True)),
        count=before.size,
        leaps=tuple(
            ClockJump(before_ns=int(stamps_ns[before[gap]]), after_ns=int(stamps_ns[before[gap] + 1]), shift_ns=0)
            for gap in leaping
        ),
    )
