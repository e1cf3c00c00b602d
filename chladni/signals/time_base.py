"""Time base: rate, start and soundness of a clock, from the stamps of messages."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, isfinite, pi
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.signals.clock_check import grid_agrees
from chladni.signals.clock_count import Counted, count_batches, count_late_messages, count_messages
from chladni.signals.clock_fit import Clock, fit_clock, measure_wander
from chladni.signals.clock_verdict import EVENTS, advice, uneven, verdict, with_nominal, with_round_rate
from chladni.signals.errors import EstimateError
from chladni.signals.grid_index import choose_smoothing, grid_index
from chladni.signals.stamp_gaps import list_gaps
from chladni.signals.stamp_order import LONGEST_NS, ClockJump, Untangled, require_stamps, untangle
from chladni.signals.time_series import NS_PER_S
from chladni.signals.value import Value, require_shape

# Share of a period below which the second of two messages has no point of its own.
_AT_ONCE = 0.05
# Share of the messages that may find no free point; with more, the source was faster than the grid for a while.
_CROWD = 0.01

Verdict = Literal["regular", "jittered", "bursts", "irregular", "still", "short"]


def _no_stretches() -> NDArray[np.int64]:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeBase(Value):
    """What the stamps of one topic say about its clock.

    Attributes
    ----------
    rate_hz
        Samples a second: of the grid, or for an irregular topic messages over time; 0 when there is none.
    rate_std_hz
        One sigma of it; infinite when the stamps give no bound.
    start_ns
        Time of the grid's index 0, nanoseconds since the Unix epoch.
    samples
        Samples (messages, or all samples of batch messages) that the stamps stand for.
    verdict
        ``regular``; ``jittered`` (scatter above 5 % of a period); ``bursts`` (several messages nearly at once, then
        silence: samples are counted in order); ``irregular`` (events, or no one rate: no grid); ``still`` (stamps
        don't move); ``short`` (fewer than eight, too few to judge).
    advice
        One sentence on what that means for spectra.
    snapped
        Whether `rate_hz` is a round number within the fit's own uncertainty instead of the fit itself.
    jitter_s
        Root mean square of the stamps about the fitted grid.
    wander_s
        Largest departure of the clock from constant rate, means of 256 messages, peak to peak.
    gaps
        (last sample before, first after) in seconds from the first stamp; at most the 1000 longest.
    gap_count, missing
        All gaps, and the grid points without a sample.
    duplicates, out_of_order
        Messages with the stamp of another one, or too near it to have a grid point of their own; messages that came
        after a later one.
    jumps
        Steps of the clock: back, and implausibly far forward (which may also be a pause, and is a gap too).
    burst_size
        Messages that typically arrive at once; 1 when they come one by one.
    knots_ns, knots_index
        ``[knot]`` times (jumps undone) and the grid index there; between knots the clock runs evenly.
    smoothing
        Messages over which the index is smoothed when placing (running median); 1 when stamps are trusted singly.
    resumed_ns, resumed_shift
        ``[stretch]`` when samples are counted in order (bursts, batches, late delivery): the first stamp of each
        stretch between gaps, and what its samples' order lacks to the grid index. Empty when stamps tell the index.
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
    gaps: tuple[tuple[float, float], ...] = ()
    gap_count: int = 0
    missing: int = 0
    duplicates: int = 0
    out_of_order: int = 0
    jumps: tuple[ClockJump, ...] = ()
    burst_size: int = 1
    knots_ns: NDArray[np.int64]
    knots_index: NDArray[np.float64]
    smoothing: int = 1
    resumed_ns: NDArray[np.int64] = field(default_factory=_no_stretches)
    resumed_shift: NDArray[np.int64] = field(default_factory=_no_stretches)

    def __post_init__(self) -> None:
        require_shape("knots_index", self.knots_index, self.knots_ns.shape, "knots_ns")
        require_shape("resumed_shift", self.resumed_shift, self.resumed_ns.shape, "resumed_ns")
        self._freeze()

    @property
    def uniform(self) -> bool:
        """Whether samples can be placed on a grid."""
        return self.verdict in {"regular", "jittered", "bursts"} or (self.verdict == "short" and self.rate_hz > 0)

    @property
    def moving(self) -> bool:
        """Whether the stamps move at all; header stamps that don't are useless."""
        return self.verdict != "still"

    def amplitude_error(self, frequency_hz: float) -> float:
        """Relative error that jitter gives a sine placed on the grid, about ``2 pi f jitter`` RMS."""
        return 2 * pi * frequency_hz * self.jitter_s


def fit_time_base(stamps_ns: NDArray[Any]) -> TimeBase:
    """Fit rate and start to message stamps, ignoring jitter, gaps, repeats, disorder, clock steps and bursts.

    A grid that would contradict the stamps is not given: see `chladni.signals.clock_check.grid_agrees`.

    Parameters
    ----------
    stamps_ns
        ``[message]`` integer nanoseconds, in the order of arrival; one sample a message. May be empty.

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
    return _fit(stamps, None, None)


def fit_batch_time_base(
    stamps_ns: NDArray[Any], counts: NDArray[Any], *, nominal_rate_hz: float | None = None
) -> TimeBase:
    """Fit the sample rate to batch messages.

    Parameters
    ----------
    stamps_ns
        ``[batch]`` integer nanoseconds of each batch's first sample.
    counts
        ``[batch]`` samples of each batch, at least 1.
    nominal_rate_hz
        Rate that the messages state. Taken when the stamps agree with it within three sigma or when there are too
        few to judge; otherwise the fitted rate stands, and `advice` says so.
    """
    stamps = require_stamps(stamps_ns)
    sizes = np.asarray(counts)
    if sizes.shape != stamps.shape or sizes.dtype.kind not in "iu" or (sizes.size and sizes.min() < 1):
        raise EstimateError("counts must be one whole number of samples, at least 1, for each stamp")
    if nominal_rate_hz is not None and not (isfinite(nominal_rate_hz) and nominal_rate_hz > 0):
        raise EstimateError(f"nominal rate {nominal_rate_hz} Hz must be finite and positive")
    return _fit(stamps, sizes.astype(np.int64, copy=False), nominal_rate_hz)


def _fit(stamps: NDArray[np.int64], counts: NDArray[np.int64] | None, nominal_hz: float | None) -> TimeBase:
    samples = stamps.size if counts is None else int(counts.sum())
    if stamps.size < 2:
        return _short(stamps, samples, nominal_hz)
    tangled = untangle(stamps)
    if _stands_still(tangled.steps):
        return _still(stamps, samples)
    if tangled.time_ns[-1] - tangled.time_ns[0] > LONGEST_NS:
        return _irregular(tangled, samples)
    # A single 1 stands for all messages: ten million ones would only cost memory.
    sizes = np.ones(1, dtype=np.int64) if counts is None else counts
    if counts is not None and tangled.order is not None:
        sizes = counts[tangled.order]
    counted = count_messages(tangled) if counts is None else count_batches(tangled.time_ns, sizes, nominal_hz)
    base = _on_grid(tangled, sizes, counted, samples, nominal_hz)
    if base is None and counts is None and counted is not None and not counted.in_order:
        # Phases that only seemed to agree: the order may still tell.
        base = _on_grid(tangled, sizes, count_late_messages(tangled), samples, nominal_hz)
    if base is not None:
        return base
    return _irregular(tangled, samples, EVENTS if counted is None else uneven(tangled.steps))


def _on_grid(
    tangled: Untangled, sizes: NDArray[np.int64], counted: Counted | None, samples: int, nominal_hz: float | None
) -> TimeBase | None:
    """Fit a grid to what was counted; None when there is none, or it tells another time than the stamps."""
    clock = None if counted is None else fit_clock(counted.count, counted.period_ns)
    if counted is None or clock is None:
        return None
    base = _measured(tangled, counted, clock, samples)
    base = _in_order(base, tangled.time_ns, sizes, counted, clock) if counted.in_order else _by_phase(base, tangled)
    base = replace(base, advice=advice(base))
    # Over a long gap even a small step of the rate would move what comes after.
    settled = with_round_rate(base) if nominal_hz is None else with_nominal(base, nominal_hz)
    for one in (settled, base):
        if grid_agrees(one, tangled.time_ns, sizes):
            return one
    return None


def _measured(tangled: Untangled, counted: Counted, clock: Clock, samples: int) -> TimeBase:
    wander = measure_wander(counted.count, clock)
    first_ns = int(tangled.time_ns[0])
    index = counted.count.index + clock.shift[counted.count.stretch]
    # Messages of a burst are late, none is early: the last one of a burst is the most punctual.
    early_ns = (counted.burst_size - 1) * clock.period_ns
    knots_ns, knots_index = _knots(wander.line_ns - early_ns, index - index[0], wander.pieces, first_ns)
    # Late by a tenth of a batch is little, though it be many samples.
    relative_jitter = wander.jitter_ns / (clock.period_ns * counted.item_size)
    return TimeBase(
        rate_hz=NS_PER_S / clock.period_ns,
        rate_std_hz=NS_PER_S * clock.period_std_ns / clock.period_ns**2,
        start_ns=first_ns + round(clock.start_ns + int(index[0]) * clock.period_ns - early_ns),
        samples=samples,
        verdict=verdict(counted, relative_jitter=relative_jitter),
        advice="",
        jitter_s=wander.jitter_ns / NS_PER_S,
        wander_s=wander.span_ns / NS_PER_S,
        duplicates=0 if counted.burst_size > 1 else tangled.duplicates,
        out_of_order=tangled.out_of_order,
        jumps=tangled.jumps,
        burst_size=counted.burst_size,
        knots_ns=knots_ns,
        knots_index=knots_index,
    )


def _in_order(
    base: TimeBase, rising_ns: NDArray[np.int64], sizes: NDArray[np.int64], counted: Counted, clock: Clock
) -> TimeBase:
    """Add the stretches and the gaps between them."""
    first = counted.count.resumed if counted.burst_starts is None else counted.burst_starts[counted.count.resumed]
    resumed_ns = rising_ns[first]
    # A stretch that seems to begin before the one before has ended is late delivery, not time running back.
    shift = np.maximum.accumulate(clock.shift)
    lost = np.diff(shift)
    before = first[1:][lost > 0] - 1
    gaps = list_gaps(rising_ns, before, np.broadcast_to(sizes, rising_ns.shape)[before], clock.period_ns)
    return replace(
        base,
        gaps=gaps.longest,
        gap_count=gaps.count,
        missing=int(shift[-1]),
        jumps=base.jumps + gaps.leaps,
        resumed_ns=resumed_ns,
        resumed_shift=shift,
    )


def _by_phase(base: TimeBase, tangled: Untangled) -> TimeBase:
    """Add the smoothing and the gaps that remain with it."""
    rising_ns = tangled.time_ns
    clock = partial(grid_index, knots_ns=base.knots_ns, knots_index=base.knots_index, rate_hz=base.rate_hz)
    smoothing = choose_smoothing(rising_ns, clock, repeats=base.duplicates)
    lost = _points_lost(rising_ns, clock, smoothing)
    if smoothing > 1 and lost < 0:
        # Two messages for one point of the grid, though not with the very same stamp, are a repeat as well.
        repeats = int(np.count_nonzero(tangled.steps < _AT_ONCE * NS_PER_S / base.rate_hz))
        if repeats > base.duplicates and repeats + lost >= 0:
            base = replace(base, duplicates=repeats)
            smoothing = choose_smoothing(rising_ns, clock, repeats=repeats)
            lost = _points_lost(rising_ns, clock, smoothing)
    long = np.flatnonzero(tangled.steps > 1.5 * NS_PER_S / base.rate_hz)
    crowded = -lost > max(1, _CROWD * rising_ns.size)
    if smoothing > 1 and (crowded or -1 <= lost <= 0) and not base.duplicates:
        # As many samples as grid points: their order tells their places better than scattered stamps. With a few
        # more they follow the stamps and leave those out; with many more this is no grid, as the check will find.
        return replace(base, resumed_ns=rising_ns[:1], resumed_shift=np.zeros(1, dtype=np.int64))
    if smoothing == 1:
        after, before = (clock(rising_ns[place], place) for place in (long + 1, long))
    else:
        index = clock(rising_ns, np.arange(rising_ns.size), smoothing=smoothing)
        after, before = index[long + 1], index[long]
    long = long[after - before > 1]
    gaps = list_gaps(rising_ns, long, np.ones_like(long), 0.0)
    return replace(
        base,
        gaps=gaps.longest,
        gap_count=gaps.count,
        missing=max(0, lost + base.duplicates),
        jumps=base.jumps + gaps.leaps,
        smoothing=smoothing,
    )


def _points_lost(rising_ns: NDArray[np.int64], clock: Callable[..., NDArray[np.int64]], smoothing: int) -> int:
    """Grid points that no message has; negative when there are more messages than points."""
    end = np.arange(max(0, rising_ns.size - 4 * smoothing), rising_ns.size)
    return int(clock(rising_ns[end], end, smoothing=smoothing)[-1]) + 1 - rising_ns.size


def _knots(
    line_ns: NDArray[np.float64], index: NDArray[np.int64], pieces: NDArray[np.int64], first_ns: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Both ends of each straight piece of the clock, in rising order."""
    ends = np.append(pieces[1:], index.size) - 1
    both = np.unique(np.concatenate((pieces, ends)))
    knots = np.rint(line_ns[both]).astype(np.int64) + first_ns
    rising = np.concatenate(([True], knots[1:] > np.maximum.accumulate(knots)[:-1]))
    return knots[rising], index[both][rising].astype(np.float64)


def _stands_still(steps: NDArray[np.int64]) -> bool:
    # A few values for hundreds of messages are a stamp that was set now and then, not a clock.
    return int(np.count_nonzero(steps)) < max(1, steps.size // 200)


def _short(stamps: NDArray[np.int64], samples: int, nominal_hz: float | None) -> TimeBase:
    known = nominal_hz is not None and samples > 0
    return TimeBase(
        rate_hz=nominal_hz if known and nominal_hz else 0.0,
        rate_std_hz=inf,
        start_ns=int(stamps[0]) if stamps.size else 0,
        samples=samples,
        verdict="short",
        advice="a single stamp can't check the stated rate" if known else "no rate without at least two stamps",
        knots_ns=stamps.copy(),
        knots_index=np.zeros(stamps.size),
    )


def _still(stamps: NDArray[np.int64], samples: int) -> TimeBase:
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
        duplicates=tangled.duplicates,
        out_of_order=tangled.out_of_order,
        jumps=tangled.jumps,
        knots_ns=np.empty(0, dtype=np.int64),
        knots_index=np.empty(0),
    )
