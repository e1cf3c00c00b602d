"""What a time base is worth: a word for it, a sentence of advice, and the rate it may be rounded to."""

from dataclasses import replace
from math import floor, inf, isfinite, log10, pi
from typing import TYPE_CHECKING

import numpy as np

from chladni.io.clock.clock_count import SHORT, Counted
from chladni.io.clock.coarse_stamps import few_ticks, stamp_quantum
from chladni.signals.arrays import Whole
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.clock.time_base import TimeBase, Verdict

# Scatter, relative to the period, above which samples placed on a grid deserve a warning.
JITTERED = 0.05
# Ticks, relative to the period, above which a sample's stamp may be nearer to another one's place.
COARSE = 0.5
# As many gaps at chance intervals don't look like the ticks of a coarse clock.
_FEW = 2
#: Advice where nothing speaks against a clock, and where nothing speaks for one.
SOUND = "the clock is sound"
EVENTS = "messages come at events and not on a grid; a spectrum needs uniform samples"


def verdict(counted: Counted, *, relative_jitter: float) -> "Verdict":
    """Give the word for a clock that has a grid; `relative_jitter` in periods of messages."""
    if counted.burst_size > 1:
        return "bursts"
    if counted.count.time.size < SHORT and counted.item_size == 1:
        return "short"
    if counted.quantum_ns > COARSE * counted.period_ns:
        return "coarse"
    return "jittered" if relative_jitter > JITTERED else "regular"


def advice(base: "TimeBase", unless_hz: float = 0.0) -> str:
    """Give one sentence on what the verdict means for spectra; `unless_hz` is the rate if no sample was lost."""
    if unless_hz and (base.gap_count > _FEW or base.duplicates > _FEW):
        told = f"unless none was lost or repeated, and the rate is {unless_hz:.5g} Hz: then state it (--rate HZ)"
        return f"{advice(base)}, {told}"
    if base.verdict == "short":
        return f"{counted(base.samples, 'sample')}: too few to judge the clock by; state the rate if you know it"
    if base.verdict == "bursts":
        return (
            f"messages come in bursts of about {base.burst_size}, so samples are counted in order and a lost one "
            "shifts those after it; log the sensor's own stamps"
        )
    if base.verdict == "stated":
        return "; ".join((f"samples are counted at {base.rate_hz:.9g} Hz, as stated", *_remarks(base)))
    if base.verdict == "coarse":
        told = f"{base.rate_hz:.9g} Hz, give or take {base.rate_std_hz:.2g} Hz" if isfinite(base.rate_std_hz) else ""
        told = (
            f"stamps come in ticks of {base.quantum_s * 1e3:.4g} ms, coarser than the sampling, so samples are "
            f"counted in order; their rate is {told or 'uncertain'}"
        )
        # One tick and sometimes two: losses that are as even have nothing else to be known by.
        if COARSE < base.quantum_s * base.rate_hz < 1:
            lost_hz = 1 / base.quantum_s
            told += f", unless samples were lost as evenly and it is {lost_hz:.5g} Hz: then state it (--rate HZ)"
        return "; ".join((told, *_remarks(base)))
    if base.verdict == "jittered":
        limit_hz = 0.1 / (2 * pi * base.jitter_s)
        return (
            f"stamps scatter by {base.jitter_s * 1e3:.3g} ms RMS; if the sampling does, amplitudes are 10 % "
            f"uncertain at {limit_hz:.3g} Hz, more above"
        )
    return "; ".join(_remarks(base)) or SOUND


def breaks_sentence(base: "TimeBase") -> str:
    """Say how often and by how much the clock was set, and what that leaves."""
    told = []
    if base.clock.count:
        sizes_s = base.clock.sizes_s
        some = ", ".join(f"{size:.3g} s" for size in sizes_s[:3]) + (", ..." if sizes_s.size > 3 else "")
        told.append(f"the clock was set {counted(base.clock.count, 'time')} ({some}); time runs on from each")
    leaps = len(base.breaks_s) - base.clock.count
    if leaps:
        told.append(f"it leaps ahead {counted(leaps, 'time')} by more than was recorded: it was set, or paused")
    if base.longest_stretch_s:
        told.append(f"no average crosses a break, and the longest stretch is {base.longest_stretch_s:.4g} s")
    return "; ".join(told)


def uneven(steps_ns: Whole) -> str:
    """Give the advice for stamps that are near a clock, but keep no rate that all of them would fit."""
    low_ms, high_ms = np.percentile(steps_ns, [5, 95]) * 1e-6
    return (
        f"no single rate fits the stamps: intervals run from {low_ms:.4g} to {high_ms:.4g} ms (5 to 95 %), mean "
        f"{steps_ns.mean() * 1e-6:.4g} ms; a spectrum needs uniform samples, so resample the signal at even times "
        "first, or take a part that keeps its rate"
    )


def ticking(steps_ns: Whole) -> str:
    """Give the advice for stamps with ticks that don't tell how many samples were lost; empty for others."""
    mean_ns = float(steps_ns.mean())
    quantum_ns = stamp_quantum(steps_ns, mean_ns)
    if quantum_ns <= COARSE * mean_ns or not few_ticks(steps_ns, quantum_ns, mean_ns):
        return ""
    return (
        f"stamps come in ticks of {quantum_ns * 1e-6:.4g} ms, coarser than the sampling, less evenly than samples "
        "do: some are lost or doubled, so the rate can't be told; state it: --rate HZ, in Python sample_rate_hz"
    )


def with_strays(base: "TimeBase", strays: Whole, kept: Whole) -> "TimeBase":
    """Give the time base of the messages `kept` for all of them, of which `strays` are left out."""
    stamps = "stamp contradicts" if strays.size == 1 else "stamps contradict"
    told = f"{strays.size} {stamps} the count of samples around, left out"
    return replace(
        base,
        strays=strays,
        clock=replace(base.clock, message=kept[base.clock.message]),
        advice=told if base.advice == SOUND else f"{base.advice}; {told}",
    )


def _remarks(base: "TimeBase") -> list[str]:
    remarks = []
    # A sine wanders out of its line when its phase does: one period of the clock is where that may begin to show.
    if base.wander_s * base.rate_hz > 1:
        remarks.append(f"the clock wanders by {base.wander_s * 1e3:.3g} ms, so long averages smear sharp peaks")
    if base.clock.count:
        remarks.append(f"the clock was set ({counted(base.clock.count, 'step')})")
    if base.gap_count:
        lost = f"{counted(base.missing, 'sample')} missing in {counted(base.gap_count, 'gap')}"
        remarks.append(f"{lost}, averages leave out what touches them")
    if base.duplicates:
        remarks.append(f"{counted(base.duplicates, 'repeated stamp')}, the first message of each is kept")
    if base.out_of_order:
        remarks.append(f"{counted(base.out_of_order, 'message')} late, put in order")
    return remarks


def round_rate(rate_hz: float, std_hz: float) -> float | None:
    """Give a round rate or a round period within two sigma of the fit, None when there is none.

    Round means so few digits that hitting the interval by chance has odds under 1 in 25; a rate of 99.993 Hz known
    to 1 mHz stays what it is.

    Examples
    --------
    >>> round_rate(99.99998, 1e-4)
    100.0
    >>> round_rate(99.993, 1e-3) is None
    True
    >>> round_rate(1 / 3 + 1e-9, 1e-8) == 1 / 3
    True
    """
    return _round_number(rate_hz, std_hz) or _inverse(_round_number(1 / rate_hz, std_hz / rate_hz**2))


def _round_number(value: float, std: float) -> float | None:
    # Two sigma, and never less than the rounding of the division that gave the value.
    within = max(2 * std, 4e-16 * value)
    if not 0 < value < inf:
        return None
    for digits in range(8):
        decimals = digits - floor(log10(value))
        if 10.0**-decimals < 100 * within:
            return None
        if abs(round(value, decimals) - value) <= within:
            return round(value, decimals)
    return None


def _inverse(period: float | None) -> float | None:
    return 1 / period if period else None


def with_nominal(base: "TimeBase", nominal_hz: float) -> "TimeBase":
    """Take the stated rate where the stamps agree with it or can't judge; else say that they differ."""
    off = base.rate_hz - nominal_hz
    # A state that the fit can't tell from its own is the better one: it carries no noise from log to log.
    if abs(off) <= max(3 * base.rate_std_hz, 1e-9 * nominal_hz):
        return replace(base, rate_hz=nominal_hz, snapped=True)
    told = f"a rate of {nominal_hz:.9g} Hz is stated, but the stamps advance at {base.rate_hz:.9g} Hz, which is used"
    return replace(base, advice=told)


def with_round_rate(base: "TimeBase") -> "TimeBase":
    """Round the rate where the fit allows; a short log's scatter proves nothing."""
    if base.verdict == "short":
        return base
    rounded = round_rate(base.rate_hz, base.rate_std_hz)
    return base if rounded is None else replace(base, rate_hz=rounded, snapped=True)
