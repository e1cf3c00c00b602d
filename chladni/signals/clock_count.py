"""Choice of how to count samples: by phase, in order, by bursts or by batches."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.sample_count import SAMPLE, Count, count_by_order, count_by_phase, count_even, order_fano
from chladni.signals.stamp_order import Untangled, typical_period
from chladni.signals.time_series import NS_PER_S

#: Fewer messages than this can't show whether they are regular.
SHORT = 8
# Share of intervals under a quarter of the mean one that makes bursts; chance (Poisson) gives 0.22.
_BURST_SHARE = 0.3
# Fano factor between a clock (0) and chance (1); a clock whose intervals scatter by a quarter is none.
_RANDOM = 0.06


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Counted:
    """Items (messages, bursts or batches) with their indices.

    Attributes
    ----------
    count
        Time and index of each item's first sample.
    item_size
        Samples that an item typically has.
    period_ns
        First guess of the sampling period.
    in_order
        Whether samples were counted in order instead of by the phase of their stamps.
    burst_starts
        First message of each burst; None when messages weren't pooled.
    """

    count: Count
    item_size: float
    period_ns: float
    in_order: bool
    burst_starts: NDArray[np.int64] | None = None

    @property
    def burst_size(self) -> int:
        """Messages typically pooled in an item because they came at once; 1 when none were."""
        return 1 if self.burst_starts is None else round(self.item_size)


def count_messages(tangled: Untangled) -> Counted | None:
    """Count messages of one sample each, by whatever tells their place; None when nothing does."""
    time_ns, steps = tangled.time_ns, tangled.steps
    if 0 < steps[0] == steps.min() == steps.max():
        return Counted(count=count_even(time_ns), item_size=1, period_ns=float(steps[0]), in_order=False)
    mean_ns = typical_period(time_ns)
    if np.count_nonzero(steps < 0.25 * mean_ns) > _BURST_SHARE * steps.size:
        return _count_bursts(time_ns, steps, mean_ns)
    some = steps[:: max(1, steps.size // SAMPLE)]
    guess = float(np.median(some[some > 0]))
    by_phase = count_by_phase(time_ns, steps, guess)
    # Chance gives a coherence of 0.055 over windows of 256.
    if by_phase.coherence > 0.09 + 2.5 / np.sqrt(time_ns.size) and _mostly_filled(steps, guess):
        return Counted(count=by_phase, item_size=1, period_ns=guess, in_order=False)
    return count_late_messages(tangled)


def count_late_messages(tangled: Untangled) -> Counted | None:
    """Count messages in order: too late or scattered for their phase, they may still come from a steady source."""
    time_ns, mean_ns = tangled.time_ns, typical_period(tangled.time_ns)
    by_order = count_by_order(time_ns, tangled.steps, np.ones_like(time_ns), mean_ns)
    if time_ns.size >= SHORT and order_fano(by_order, mean_ns) > _RANDOM:
        return None
    return Counted(count=by_order, item_size=1, period_ns=mean_ns, in_order=True)


def count_batches(time_ns: NDArray[np.int64], sizes: NDArray[np.int64], nominal_hz: float | None) -> Counted:
    """Count the samples of batches with `sizes` samples each, stamped at their first."""
    steps = np.diff(time_ns)
    intervals = steps / sizes[:-1]
    period_ns = max(1.0, float(np.median(intervals)))
    scatter = float(np.median(np.abs(intervals - period_ns)))
    # Records triggered now and then have intervals that say nothing of the rate; the stated one is all there is.
    pause_ns = None
    if nominal_hz is not None and scatter > 0.1 * period_ns:
        period_ns = NS_PER_S / nominal_hz
        pause_ns = 0.02 * float(np.median(sizes)) * period_ns
    count = count_by_order(time_ns, steps, sizes, period_ns, pause_ns=pause_ns)
    return Counted(count=count, item_size=float(np.median(sizes)), period_ns=period_ns, in_order=True)


def _count_bursts(time_ns: NDArray[np.int64], steps: NDArray[np.int64], mean_ns: float) -> Counted | None:
    starts = np.concatenate(([0], np.flatnonzero(steps >= 0.5 * mean_ns) + 1))
    if starts.size < 2:
        return None
    sizes = np.diff(starts, append=time_ns.size)
    first = time_ns[starts]
    between = np.diff(first)
    period_ns = float(np.median(between / sizes[:-1]))
    count = count_by_order(first, between, sizes, period_ns)
    if starts.size >= SHORT and order_fano(count, period_ns) > _RANDOM:
        return None
    size = float(np.median(sizes))
    return Counted(count=count, item_size=size, period_ns=period_ns, in_order=True, burst_starts=starts)


def _mostly_filled(steps: NDArray[np.int64], period_ns: float) -> bool:
    # A topic that is published on change skips most points of its grid.
    return int(np.count_nonzero(steps < 1.5 * period_ns)) >= 0.5 * steps.size
