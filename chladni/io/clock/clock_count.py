"""Choice of how to count samples: by phase, in order, by ticks, by bursts or by batches."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from chladni.io.clock.clock_fit import Clock, fit_clock
from chladni.io.clock.coarse_stamps import count_by_ticks, count_ticks, few_ticks, phase_period, stamp_quantum
from chladni.io.clock.sample_count import SAMPLE, Count, count_by_order, count_by_phase, count_even, order_fano
from chladni.io.clock.stamp_order import Untangled, typical_period
from chladni.signals.arrays import Whole
from chladni.signals.time_series import NS_PER_S

#: A pause longer than this, and than all that was recorded, may as well be a clock that was set.
LEAP_S = 60.0
#: Fewer messages than this can't show whether they are regular.
SHORT = 8
# Share of intervals under a quarter of the mean one that makes bursts; chance (Poisson) gives 0.22.
_BURST_SHARE = 0.3
# Fano factor between a clock (0) and chance (1); a clock whose intervals scatter by a quarter is none.
_RANDOM = 0.06
# Share of messages with the stamp of another above which a stamp can't be a sample's place.
_SHARED = 0.01


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
    quantum_ns
        Ticks of the stamps, where they are coarser than an eighth of a period; else 0.
    period_std_ns
        One sigma of it at least, where it isn't the count's to tell.
    proven
        False for a way that the stamps allow but don't ask for.
    unless_hz
        Rate if no sample was lost or doubled, where that can't be told; else 0.
    """

    count: Count
    item_size: float
    period_ns: float
    in_order: bool
    burst_starts: Whole | None = None
    quantum_ns: float = 0.0
    period_std_ns: float = 0.0
    proven: bool = True
    unless_hz: float = 0.0

    @property
    def burst_size(self) -> int:
        """Messages typically pooled in an item because they came at once; 1 when none were."""
        return 1 if self.burst_starts is None else round(self.item_size)


def count_messages(tangled: Untangled) -> Iterator[Counted]:
    """Count messages of one sample each in the ways that may tell their places, the likeliest first.

    A way that the stamps allow but don't ask for comes last; it's for rates that someone states.
    """
    if 0 < tangled.steps[0] == tangled.steps.min() == tangled.steps.max():
        period_ns = float(tangled.steps[0])
        yield Counted(count=count_even(tangled.time_ns), item_size=1, period_ns=period_ns, in_order=False)
        return
    steps, mean_ns = tangled.within(), typical_period(tangled)
    quantum_ns = stamp_quantum(steps, mean_ns)
    bursts = int(np.count_nonzero(steps < 0.25 * mean_ns)) > _BURST_SHARE * steps.size
    # As many messages for every stamp were most likely sent together.
    if not quantum_ns or not few_ticks(steps, quantum_ns, mean_ns) or (bursts and _equally_shared(steps)):
        yield from _count_untold(tangled, mean_ns, quantum_ns, bursts=bursts)
        return
    ticks = count_ticks(tangled, quantum_ns, mean_ns)
    if ticks is None or ticks.hidden:
        yield from _count_phases_of_ticks(tangled, mean_ns, quantum_ns)
    in_order = None
    if ticks is not None:
        in_order = Counted(
            count=ticks.count,
            item_size=1,
            period_ns=mean_ns,
            in_order=True,
            quantum_ns=quantum_ns,
            proven=ticks.proven,
        )
    if in_order is not None and in_order.proven:
        yield in_order
    # Other ways would take samples that share a stamp for repeats, or for fewer than were taken.
    if int(np.count_nonzero(steps == 0)) <= _SHARED * steps.size:
        unless = None if ticks is None or ticks.hidden or ticks.proven else fit_clock(ticks.count, mean_ns)
        unless_hz = 0.0 if unless is None else NS_PER_S / unless.period_ns
        for counted in _count_untold(tangled, mean_ns, quantum_ns, bursts=bursts):
            yield replace(counted, unless_hz=unless_hz)
    if in_order is not None and not in_order.proven:
        yield in_order


def count_stated(tangled: Untangled, period_ns: float) -> tuple[Counted, Clock]:
    """Count messages at a period that their stamps don't tell.

    Ticks tell where each sample lies, give or take one; other stamps that tell no period are late by any time, so
    there samples are counted in order, with gaps as long as the stamps say.
    """
    time_ns, steps, cuts = tangled.time_ns, tangled.steps, tangled.clock.message
    mean_ns, ones = typical_period(tangled), np.ones_like(time_ns)
    quantum_ns = stamp_quantum(tangled.within(), mean_ns)
    in_order = not (quantum_ns and few_ticks(steps, quantum_ns, mean_ns))
    if in_order:
        count = count_by_order(time_ns, steps, ones, mean_ns, cuts)
        lost = np.maximum(0, np.rint(steps[count.resumed[1:] - 1] / period_ns).astype(np.int64) - 1)
        # How long a step of the clock took is unknown.
        lost[count.cuts - 1] = 1
        shift = np.append(0, np.cumsum(lost))
    else:
        count = count_by_ticks(tangled, period_ns)
        shift = np.rint(count.time[count.resumed] / period_ns).astype(np.int64)
    residual = count.time - (count.index + shift[count.stretch]) * period_ns
    start_ns = float(np.median(residual))
    clock = Clock(
        period_ns=period_ns,
        period_std_ns=inf,
        starts_ns=start_ns + shift * period_ns,
        shift=shift,
        residual_ns=residual - start_ns,
    )
    counted = Counted(count=count, item_size=1, period_ns=period_ns, in_order=in_order, quantum_ns=quantum_ns)
    return counted, clock


def count_batches(tangled: Untangled, sizes: Whole, nominal_hz: float | None) -> Counted:
    """Count the samples of batches with `sizes` samples each, stamped at their first."""
    steps, cuts = tangled.steps, tangled.clock.message
    intervals = steps / sizes[:-1]
    period_ns = max(1.0, float(np.median(intervals)))
    scatter = float(np.median(np.abs(intervals - period_ns)))
    # Records triggered now and then have intervals that say nothing of the rate; the stated one is all there is.
    pause_ns = None
    if nominal_hz is not None and scatter > 0.1 * period_ns:
        period_ns = NS_PER_S / nominal_hz
        pause_ns = 0.02 * float(np.median(sizes)) * period_ns
    count = count_by_order(tangled.time_ns, steps, sizes, period_ns, cuts, pause_ns=pause_ns)
    return Counted(count=count, item_size=float(np.median(sizes)), period_ns=period_ns, in_order=True)


def _count_untold(tangled: Untangled, mean_ns: float, quantum_ns: float, *, bursts: bool) -> Iterator[Counted]:
    """Count in bursts, by phase, or by the order alone."""
    time_ns, steps, cuts = tangled.time_ns, tangled.steps, tangled.clock.message
    if bursts:
        yield from _count_bursts(tangled, mean_ns, quantum_ns)
    some = steps[:: max(1, steps.size // SAMPLE)]
    guess = float(np.median(some[some > 0]))
    by_phase = count_by_phase(time_ns, steps, guess, cuts)
    # Records of a few samples each, with pauses of any length, look like bursts; of two or three any grid is chance.
    told = not bursts or time_ns.size >= SHORT * by_phase.resumed.size
    # A stamp that others have too tells no sample's place; a single one of a short log may be wrong.
    told &= int(np.count_nonzero(steps == 0)) <= max(1, _SHARED * steps.size)
    # Chance gives a coherence of 0.055 over windows of 256.
    if told and by_phase.coherence > 0.09 + 2.5 / np.sqrt(time_ns.size) and _mostly_filled(steps, guess):
        yield Counted(count=by_phase, item_size=1, period_ns=guess, in_order=False)
    if bursts:
        return
    # Too late or scattered for their phase, or it only seemed to agree: they may still come from a steady source.
    by_order = count_by_order(time_ns, steps, np.ones_like(time_ns), mean_ns, cuts, quantum_ns=quantum_ns)
    if time_ns.size < SHORT or order_fano(by_order, mean_ns) <= _RANDOM:
        yield Counted(count=by_order, item_size=1, period_ns=mean_ns, in_order=True)


def _count_phases_of_ticks(tangled: Untangled, mean_ns: float, quantum_ns: float) -> Iterator[Counted]:
    told = phase_period(tangled, quantum_ns, mean_ns)
    if told is not None:
        yield Counted(
            count=count_by_ticks(tangled, told[0]),
            item_size=1,
            period_ns=told[0],
            period_std_ns=told[1],
            in_order=False,
            quantum_ns=quantum_ns,
        )


def _count_bursts(tangled: Untangled, mean_ns: float, quantum_ns: float) -> Iterator[Counted]:
    """Count samples that are held back and sent together, a minute of them at most: records lie further apart."""
    starts = np.union1d(np.append(0, np.flatnonzero(tangled.steps >= 0.5 * mean_ns) + 1), tangled.clock.message)
    if starts.size < 2:
        return
    sizes = np.diff(starts, append=tangled.time_ns.size)
    first = tangled.time_ns[starts]
    between = np.diff(first)
    period_ns = float(np.median(between / sizes[:-1]))
    if np.median(between) > LEAP_S * NS_PER_S:
        return
    cuts = np.searchsorted(starts, tangled.clock.message)
    # The last sample of a burst is there by its tick: a whole one more without any is a gap.
    ticks_ns = max(0.0, quantum_ns - 0.5 * period_ns)
    count = count_by_order(first, between, sizes, period_ns, cuts, quantum_ns=ticks_ns)
    if starts.size < SHORT or order_fano(count, period_ns) <= _RANDOM:
        size = float(np.median(sizes))
        yield Counted(count=count, item_size=size, period_ns=period_ns, in_order=True, burst_starts=starts)


def _equally_shared(steps: Whole) -> bool:
    """Whether every stamp but the first and the last ones is that of as many messages, two at least."""
    alike = np.diff(np.flatnonzero(steps))
    return alike.size > 0 and bool(alike.min() == alike.max() > 1)


def _mostly_filled(steps: Whole, period_ns: float) -> bool:
    # A topic that is published on change skips most points of its grid.
    return int(np.count_nonzero(steps < 1.5 * period_ns)) >= 0.5 * steps.size
