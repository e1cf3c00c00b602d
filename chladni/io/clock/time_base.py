"""Time base: rate, start and soundness of a clock, from the stamps of messages."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import inf, isfinite, pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.clock_count import Counted, count_batches, count_messages, count_stated
from chladni.io.clock.clock_fit import Clock, cut_by_one, fit_clock, grid_agrees, measure_wander
from chladni.io.clock.clock_verdict import (
    EVENTS,
    advice,
    ticking,
    uneven,
    verdict,
    with_nominal,
    with_round_rate,
    with_strays,
)
from chladni.io.clock.grid_places import place_by_phase, place_in_order, spans_between, straight_pieces
from chladni.io.clock.stamp_order import LONGEST_NS, ClockSteps, Untangled, require_stamps, untangle
from chladni.io.clock.stray_stamps import find_strays
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S
from chladni.signals.value import Value, require_shape

Verdict = Literal["regular", "jittered", "coarse", "bursts", "irregular", "still", "short", "stated"]


def _none() -> Whole:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeBase(Value):
    """What the stamps of one topic say about its clock.

    Its time runs on: where the clock was set, what comes after is moved so that one sample is left out there. Grid
    times, gaps and breaks are of that time; until the clock is first set it's that of the stamps.

    Attributes
    ----------
    rate_hz
        Samples a second: of the grid, or for an irregular topic messages over time; 0 when there is none.
    rate_std_hz
        One sigma of it; infinite when the stamps give no bound.
    start_ns
        Time of the grid's index 0, nanoseconds since the Unix epoch.
    samples
        Samples (messages, or all samples of batch messages) that the stamps stand for, without those of `strays`.
    verdict
        ``regular``; ``jittered`` (scatter above 5 % of a period); ``coarse`` (the stamps' ticks are longer than half
        a period) and ``bursts`` (several messages nearly at once, then silence), where samples are counted in order;
        ``irregular`` (events, or no one rate: no grid); ``still`` (stamps don't move); ``short`` (fewer than eight,
        too few to judge); ``stated`` (counted in order at a rate that someone states, since the stamps tell none).
    advice
        One sentence on what that means for spectra.
    snapped
        Whether `rate_hz` is a round number within the fit's own uncertainty instead of the fit itself.
    jitter_s
        Root mean square of the stamps about the fitted grid.
    wander_s
        Largest departure of the clock from constant rate, means of 256 messages, peak to peak.
    quantum_s
        Ticks of the stamps, where they are longer than an eighth of a period; else 0.
    gaps
        (last sample before, first after) in seconds from the first stamp; at most the 1000 longest.
    gap_count, missing
        All gaps, and the grid points without a sample in them.
    clock
        Where the clock was set, and what makes it run on.
    breaks_s
        ``[break, 2]`` last sample before and first after, in seconds from the first stamp, of every place where
        samples don't follow each other in time: where the clock was set, and where it leapt ahead by more than a
        minute and than all that was recorded (which may also be a pause, and is a gap too).
    longest_stretch_s
        Longest time that samples cover without a gap or a break; 0 without a grid.
    duplicates, out_of_order
        Messages that have no place of their own, since another one has their stamp, or nearly so; messages that came
        after a later one.
    burst_size
        Messages that typically arrive at once; 1 when they come one by one.
    knots_ns, knots_index
        ``[knot]`` times and the grid index there; between knots the clock runs evenly.
    smoothing
        Messages over which the index is smoothed when placing (running median); 1 when stamps are trusted singly.
    resumed, resumed_shift
        ``[stretch]`` when samples are counted in order (bursts, ticks, batches, late delivery): the samples before
        each stretch between gaps, and what its samples' order lacks to the grid index. Empty when stamps tell the
        index.
    cuts
        ``[step, 2]`` where the clock was set: the first grid index that is left out, and the first one after.
    strays
        ``[stray]`` numbers, in the order of arrival, of messages that have no place: their stamps contradict the
        count of those around them.
    """

    rate_hz: float
    rate_std_hz: float
    start_ns: int
    samples: int
    verdict: Verdict
    advice: str
    snapped: bool = False
    jitter_s: float = 0.0
    wander_s: float = 0.0
    quantum_s: float = 0.0
    gaps: tuple[tuple[float, float], ...] = ()
    gap_count: int = 0
    missing: int = 0
    clock: ClockSteps = field(default_factory=ClockSteps)
    breaks_s: Real = field(default_factory=lambda: np.empty((0, 2)))
    longest_stretch_s: float = 0.0
    duplicates: int = 0
    out_of_order: int = 0
    burst_size: int = 1
    knots_ns: Whole
    knots_index: Real
    smoothing: int = 1
    resumed: Whole = field(default_factory=_none)
    resumed_shift: Whole = field(default_factory=_none)
    cuts: Whole = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    strays: Whole = field(default_factory=_none)

    def __post_init__(self) -> None:
        require_shape("knots_index", self.knots_index, self.knots_ns.shape, "knots_ns")
        require_shape("resumed_shift", self.resumed_shift, self.resumed.shape, "resumed")
        self._freeze()

    @property
    def uniform(self) -> bool:
        """Whether samples can be placed on a grid."""
        return self.verdict not in {"irregular", "still", "short"} or (self.verdict == "short" and self.rate_hz > 0)

    @property
    def moving(self) -> bool:
        """Whether the stamps move at all; header stamps that don't are useless."""
        return self.verdict != "still"

    def amplitude_error(self, frequency_hz: float) -> float:
        """Relative error that jitter gives a sine placed on the grid, about ``2 pi f jitter`` RMS."""
        return 2 * pi * frequency_hz * self.jitter_s


def fit_time_base(
    stamps_ns: NDArray[Any],
    *,
    nominal_rate_hz: float | None = None,
    clock: ClockSteps | None = None,
    logged_ns: Whole | None = None,
) -> TimeBase:
    """Fit rate and start to message stamps, ignoring jitter, ticks, gaps, disorder, steps of the clock and bursts.

    A message whose stamp contradicts the count of those around it is left out: see `find_strays`.

    Messages with the same stamp are samples, as a clock makes them that ticks more slowly than they are taken, when
    that explains all of the stamps; else they are repeats. Who knows that they are repeats leaves them out.

    A grid that would contradict the stamps is not given: see `chladni.io.clock.clock_fit.grid_agrees`.

    Parameters
    ----------
    stamps_ns
        ``[message]`` integer nanoseconds, in the order of arrival; one sample a message. May be empty.
    nominal_rate_hz
        Rate that someone states. It settles what the stamps leave open, and is taken when they agree with it within
        three sigma; otherwise the fitted rate stands, and `advice` says so.
    clock
        Where the clock was set, when that is known from elsewhere; None looks for it.
    logged_ns
        ``[message]`` times of another clock, which tells steps ahead from pauses; None without.

    Raises
    ------
    EstimateError
        When the stamps are no one-dimensional integers between 0 and 2^62.

    Examples
    --------
    >>> fit_time_base(np.arange(0, 10**9, 10**7)).rate_hz
    100.0
    """
    stamps = require_stamps(stamps_ns)
    _require_rate(nominal_rate_hz)
    return _fit(stamps, None, nominal_rate_hz, clock, logged_ns)


def fit_batch_time_base(
    stamps_ns: NDArray[Any],
    counts: NDArray[Any],
    *,
    nominal_rate_hz: float | None = None,
    clock: ClockSteps | None = None,
    logged_ns: Whole | None = None,
) -> TimeBase:
    """Fit the sample rate to batch messages.

    Parameters
    ----------
    stamps_ns
        ``[batch]`` integer nanoseconds of each batch's first sample.
    counts
        ``[batch]`` samples of each batch, at least 1.
    nominal_rate_hz
        Rate that the messages, or a user, state. Taken when the stamps agree with it within three sigma or when there
        are too few to judge; otherwise the fitted rate stands, and `advice` says so.
    clock, logged_ns
        As for `fit_time_base`.
    """
    stamps = require_stamps(stamps_ns)
    sizes = np.asarray(counts)
    if sizes.shape != stamps.shape or sizes.dtype.kind not in "iu" or (sizes.size and sizes.min() < 1):
        raise EstimateError("counts must be one whole number of samples, at least 1, for each stamp")
    _require_rate(nominal_rate_hz)
    return _fit(stamps, sizes.astype(np.int64, copy=False), nominal_rate_hz, clock, logged_ns)


def _require_rate(rate_hz: float | None) -> None:
    if rate_hz is not None and not (isfinite(rate_hz) and rate_hz > 0):
        raise EstimateError(f"nominal rate {rate_hz} Hz must be finite and positive")


def _fit(
    stamps: Whole,
    counts: Whole | None,
    nominal_hz: float | None,
    known: ClockSteps | None,
    logged_ns: Whole | None,
) -> TimeBase:
    strays = find_strays(stamps, counts)
    if known is not None:
        # On either side of a step the count isn't known.
        strays = np.setdiff1d(strays, np.concatenate((known.message, known.message - 1)))
    if strays.size:
        kept = np.delete(np.arange(stamps.size), strays)
        base = _fit_all(
            stamps[kept],
            None if counts is None else counts[kept],
            nominal_hz,
            None if known is None else known.among(kept),
            None if logged_ns is None else logged_ns[kept],
        )
        # Where the others make no grid, there's nothing that a stamp could contradict.
        if base.uniform:
            return with_strays(base, strays, kept)
    return _fit_all(stamps, counts, nominal_hz, known, logged_ns)


def _fit_all(
    stamps: Whole,
    counts: Whole | None,
    nominal_hz: float | None,
    known: ClockSteps | None,
    logged_ns: Whole | None,
) -> TimeBase:
    samples = stamps.size if counts is None else int(counts.sum())
    if stamps.size < 2:
        return _short(stamps, samples, nominal_hz)
    before = None if counts is None else np.cumsum(counts) - counts
    tangled = untangle(stamps, before, known=known, logged_ns=logged_ns)
    # A single 1 stands for all messages: ten million ones would only cost memory.
    sizes = np.ones(1, dtype=np.int64) if counts is None else counts
    if counts is not None and tangled.order is not None:
        sizes = counts[tangled.order]
    still, tried, base = _stands_still(tangled.steps), False, None
    if not still and int(tangled.time_ns[-1]) - int(tangled.time_ns[0]) > LONGEST_NS:
        return _irregular(tangled, samples, EVENTS)
    if not still:
        ways = count_messages(tangled) if counts is None else iter((count_batches(tangled, sizes, nominal_hz),))
        base, tried = _best(tangled, sizes, ways, nominal_hz, settled=known is not None)
    if base is None and nominal_hz is not None and counts is None:
        base = _stated(tangled, nominal_hz)
    if base is not None:
        return replace(base, samples=samples)
    if still:
        return _still(stamps, samples)
    told = ticking(tangled.within()) or (uneven(tangled.within()) if tried else EVENTS)
    return _irregular(tangled, samples, told)


def _best(
    tangled: Untangled,
    sizes: Whole,
    ways: Iterator[Counted],
    nominal_hz: float | None,
    *,
    settled: bool,
) -> tuple[TimeBase | None, bool]:
    """Give the first way of counting that makes a grid, of the stated rate if one does; and whether any was tried."""
    first, tried = None, False
    for counted in ways:
        tried = True
        base = _on_grid(tangled, sizes, counted, nominal_hz, settled=settled)
        if base is not None and (counted.proven if nominal_hz is None else base.rate_hz == nominal_hz):
            return base, True
        first = first or (base if counted.proven else None)
    return first, tried


def _on_grid(
    tangled: Untangled, sizes: Whole, counted: Counted, nominal_hz: float | None, *, settled: bool
) -> TimeBase | None:
    """Fit a grid to what was counted; None when there is none, or it tells another time than the stamps."""
    clock = fit_clock(counted.count, counted.period_ns)
    if clock is None:
        return None
    clock = replace(clock, period_std_ns=max(clock.period_std_ns, counted.period_std_ns))
    # Steps of the clock that are known from elsewhere are as long as is known there.
    if tangled.clock.count and not settled:
        tangled, counted, clock = _running_on(tangled, counted, clock)
    base = _measured(tangled, counted, clock)
    base = place_in_order(base, tangled, sizes, counted, clock) if counted.in_order else place_by_phase(base, tangled)
    # Over a long gap even a small step of the rate would move what comes after.
    nearest = with_round_rate(base) if nominal_hz is None else with_nominal(base, nominal_hz)
    for one in (nearest, base):
        if grid_agrees(one, tangled.time_ns, sizes):
            return replace(one, advice="; ".join(filter(None, (one.advice, advice(one, counted.unless_hz)))))
    return None


def _stated(tangled: Untangled, rate_hz: float) -> TimeBase:
    """Count at a rate that the stamps don't tell."""
    counted, clock = count_stated(tangled, NS_PER_S / rate_hz)
    if tangled.clock.count:
        tangled, counted, clock = _running_on(tangled, counted, clock)
    # How the stamps depart from a rate that they don't keep is no wander.
    base = replace(_measured(tangled, counted, clock), verdict="stated", snapped=True, rate_std_hz=inf, wander_s=0.0)
    if counted.in_order:
        base = place_in_order(base, tangled, np.ones(1, dtype=np.int64), counted, clock)
    else:
        base = place_by_phase(base, tangled)
    return replace(base, rate_hz=rate_hz, advice=advice(base))


def _running_on(tangled: Untangled, counted: Counted, clock: Clock) -> tuple[Untangled, Counted, Clock]:
    """Move what comes after each step of the clock so that one sample is left out there and the grid goes on."""
    by_ns = cut_by_one(counted.count, clock)
    of_stretch = counted.count.cut(by_ns)
    return (
        tangled.moved(np.rint(by_ns[1:]).astype(np.int64)),
        replace(counted, count=counted.count.moved(of_stretch)),
        clock.on_grid(clock.starts_ns + of_stretch),
    )


def _measured(tangled: Untangled, counted: Counted, clock: Clock) -> TimeBase:
    count = counted.count
    wander = measure_wander(count, clock)
    first_ns = int(tangled.time_ns[0])
    index = count.index + clock.shift[count.stretch]
    # Messages of a burst are late, none is early: the last one of a burst is the most punctual.
    early_ns = (counted.burst_size - 1) * clock.period_ns
    knots_ns, knots_index = straight_pieces(wander.line_ns - early_ns, index - index[0], wander.pieces, first_ns)
    # Late by a tenth of a batch is little, though it be many samples.
    relative_jitter = wander.jitter_ns / (clock.period_ns * counted.item_size)
    # Where the clock was set: the first index that is left out, and the first one after.
    cuts = np.stack((count.ends[count.cuts - 1], count.firsts[count.cuts]), axis=1)
    cuts += np.stack((clock.shift[count.cuts - 1], clock.shift[count.cuts]), axis=1) - index[0]
    return TimeBase(
        rate_hz=NS_PER_S / clock.period_ns,
        rate_std_hz=NS_PER_S * clock.period_std_ns / clock.period_ns**2,
        start_ns=first_ns + round(float(clock.starts_ns[0]) + int(index[0]) * clock.period_ns - early_ns),
        samples=tangled.time_ns.size,
        verdict=verdict(counted, relative_jitter=relative_jitter),
        advice="",
        jitter_s=wander.jitter_ns / NS_PER_S,
        wander_s=wander.span_ns / NS_PER_S,
        quantum_s=counted.quantum_ns / NS_PER_S,
        clock=tangled.clock,
        duplicates=0 if counted.in_order or counted.quantum_ns else tangled.duplicates,
        out_of_order=tangled.out_of_order,
        burst_size=counted.burst_size,
        knots_ns=knots_ns,
        knots_index=knots_index,
        cuts=cuts,
    )


def _stands_still(steps: Whole) -> bool:
    # A few values for hundreds of messages are a stamp that was set now and then, not a clock.
    return int(np.count_nonzero(steps)) < max(1, steps.size // 200)


def _short(stamps: Whole, samples: int, nominal_hz: float | None) -> TimeBase:
    known = nominal_hz is not None and samples > 0
    return TimeBase(
        rate_hz=nominal_hz if known and nominal_hz else 0.0,
        rate_std_hz=inf,
        start_ns=int(stamps[0]) if stamps.size else 0,
        samples=samples,
        verdict="short",
        advice="a single stamp can't check the stated rate"
        if known
        else "no rate without at least two stamps, so record longer",
        knots_ns=stamps.copy(),
        knots_index=np.zeros(stamps.size),
    )


def _still(stamps: Whole, samples: int) -> TimeBase:
    return TimeBase(
        rate_hz=0.0,
        rate_std_hz=inf,
        start_ns=int(stamps[0]),
        samples=samples,
        verdict="still",
        advice="the stamps don't move, so they are no clock; use the publish or log time",
        duplicates=samples - 1,
        knots_ns=np.empty(0, dtype=np.int64),
        knots_index=np.empty(0),
    )


def _irregular(tangled: Untangled, samples: int, told: str = EVENTS) -> TimeBase:
    span_s = float(tangled.time_ns[-1] - tangled.time_ns[0]) / NS_PER_S
    return TimeBase(
        rate_hz=(samples - 1) / span_s,
        rate_std_hz=inf,
        start_ns=int(tangled.time_ns[0]),
        samples=samples,
        verdict="irregular",
        advice=told,
        clock=tangled.clock,
        breaks_s=spans_between(tangled.time_ns, tangled.clock.message, np.ones(1, dtype=np.int64), 0.0),
        duplicates=tangled.duplicates,
        out_of_order=tangled.out_of_order,
        knots_ns=np.empty(0, dtype=np.int64),
        knots_index=np.empty(0),
    )
