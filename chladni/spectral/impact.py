"""Impact tests: hits found in the force, judged one by one, and averaged."""

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from chladni.signals.arrays import Real, Whole
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import rounded_up
from chladni.spectral.accumulator import line_frequencies_hz, one_sided_weights, require_finite
from chladni.spectral.force_pulses import (
    LONGEST_PULSE_S,
    NOISE_SIGMAS,
    Pulses,
    find_pulses,
    typical_peak,
)
from chladni.spectral.hammer import Hit, Impacts, Judge, Rejection
from chladni.spectral.products import PAIRS, POWERS, Products, SpectraT
from chladni.spectral.stretches import valid_runs

# Widths of the pulse after the trigger during which the force window is one, and then falls to zero.
FORCE_WINDOW_PULSES = 4
# A response whose last tenth still holds this share of its energy has not died away: its record is cut off.
STILL_RINGING = 1e-3

__all__ = [
    "Hit",
    "Impacts",
    "Rejection",
    "find_impacts",
    "impact_auto_spectra",
    "impact_cross_spectra",
    "is_impact_test",
]


def is_impact_test(series: TimeSeries, channel: str) -> bool:
    """Tell whether a channel looks like the force of a hammer: short one-sided pulses with silence between.

    Parameters
    ----------
    series
        The log, or a part of it that holds at least one hit.
    channel
        Name of the channel to judge.

    Returns
    -------
    bool
        True when pulses at least 50 times the noise, 3 samples to 30 ms wide, none of them followed by a swing to the
        other side of a third of it, fill less than 5 % of the time.
    """
    alone = series.select([channel])
    measured = np.isfinite(alone.values) if alone.valid is None else alone.valid & np.isfinite(alone.values)
    if not measured.any() or not _may_be_one_sided(alone.values[measured]):
        return False
    # Without a level: the question is whether the channel has pulses of its own accord.
    pulses = find_pulses(alone, channel, level=None)
    if not pulses.starts.size:
        return False
    heights = pulses.force[pulses.peaks]
    typical = float(np.median(heights))
    lasting = np.count_nonzero(pulses.force > pulses.level) / pulses.force.size
    width_s = float(np.median(pulses.widths)) / series.sample_rate_hz
    wide_enough = float(np.median(pulses.widths)) >= 3
    one_sided = -pulses.force.min() < heights.max() / 3
    silent = typical > 50 * pulses.noise and lasting < 0.05
    return bool(silent and one_sided and wide_enough and width_s <= LONGEST_PULSE_S)


def _may_be_one_sided(samples: NDArray[np.floating]) -> bool:
    """Whether the swing to one side of the median may be below a third of that to the other side.

    The median then lies in an outer quarter of the range, which takes a count to see and no sorting.
    """
    low, high = float(samples.min()), float(samples.max())
    quarter = (high - low) / 4
    least = samples.size // 2
    # Exactly half on either side: the median is anywhere between the two in the middle.
    low_side, high_side = np.count_nonzero(samples <= low + quarter), np.count_nonzero(samples >= high - quarter)
    return bool(low_side >= least or high_side >= least)


def find_impacts(
    series: TimeSeries,
    *,
    force: str,
    level: float | None = None,
    pretrigger_s: float | None = None,
    record_s: float | None = None,
    double_hit_share: float = 0.03,
) -> Impacts:
    """Find the hits of an impact test and reject those that would spoil the average.

    Parameters
    ----------
    series
        Force and responses on one clock.
    force
        Name of the hammer's channel; pulses may point either way.
    level
        Trigger level as a magnitude in the force's unit; default a tenth of the typical peak.
    pretrigger_s
        Time before the trigger that belongs to a record, default twice the width of the pulse.
    record_s
        Length of a record; default as long as fits between the hits.
    double_hit_share
        A second pulse that rises by this share of the peak rejects the hit, 0 to 1.

    Returns
    -------
    Impacts
        With a `Rejection` for each hit left out: overload (a channel's limit reached, or a crest cut flat), a double
        hit, a hit too weak, samples missing, a record that begins while the hit before still rings or that ends after
        the log, a pulse that begins before it. What a record lacks before the log is taken for silence.

    Raises
    ------
    EstimateError
        When the force holds no pulse, or the times don't fit.
    """
    if not 0 < double_hit_share < 1:
        raise EstimateError(f"double_hit_share is {double_hit_share}; it must lie between 0 and 1")
    pulses = find_pulses(series, force, level=level)
    if not pulses.starts.size:
        raise EstimateError(
            f"{force!r} holds no pulse above its noise; name another force channel or a trigger level"
        )
    rate_hz = series.sample_rate_hz
    pulse = int(np.median(pulses.widths))
    # The pulse crosses the trigger at a tenth of its height, less than one width after it began.
    before = 2 * pulse if pretrigger_s is None else round(pretrigger_s * rate_hz)
    longest = _record_length(pulses.starts, before, pulses.force.size)
    length = longest if record_s is None else round(record_s * rate_hz)
    if not 0 <= before < length:
        raise EstimateError(
            f"a record of {length / rate_hz:g} s can't hold {before / rate_hz:g} s of pretrigger; make it longer"
        )
    judge = Judge(series=series, pulses=pulses, before=before, length=length, double_hit_share=double_hit_share)
    accepted, rejected = judge.verdicts()
    return Impacts(
        force=force,
        trigger_level=pulses.sign * pulses.level,
        pretrigger_s=before / rate_hz,
        record_s=length / rate_hz,
        longest_s=longest / rate_hz,
        pulse_s=pulse / rate_hz,
        accepted=accepted,
        rejected=rejected,
        notes=_advice(pulses, double_hit_share, len(accepted)),
    )


def impact_cross_spectra(
    series: TimeSeries, impacts: Impacts, *, force_window: bool = True, decay_per_s: float = 0.0
) -> CrossSpectra:
    """Average the accepted hits to cross-spectra of all channel pairs.

    Parameters
    ----------
    series
        The series in which `impacts` were found.
    impacts
        What `find_impacts` gave.
    force_window
        Whether to silence the force after its pulse, where it holds only noise: one until four pulse widths after the
        trigger, then a cosine down to zero over four more.
    decay_per_s
        Decay rate sigma of an exponential window exp(-sigma t) on *all* channels, for a response that still rings at
        the end of the record; 0 for none. It adds sigma to the decay of every pole, so it's carried in
        ``provenance.window_decay_per_s`` for whoever estimates damping.

    Returns
    -------
    CrossSpectra
        ``averaging="impact"``, in unit_i unit_j / Hz: energy spectral density over the length of the record. Times
        ``impacts.record_s`` it is the energy spectral density; ratios such as H1 don't depend on that length.

    Raises
    ------
    EstimateError
        When no hit was accepted, the decay is negative, or values are too large or too small to be squared.

    Notes
    -----
    G_ij = 2/(M T) sum over hits of conj(X_i) X_j with X the Fourier integral of the record. Windows after Halvorsen &
    Brown (1977), the correction of damping after Fladung & Rost (1997).
    """
    return _average(series, impacts, PAIRS, force_window=force_window, decay_per_s=decay_per_s)


def impact_auto_spectra(series: TimeSeries, impacts: Impacts) -> AutoSpectra:
    """Average each channel's auto-spectrum of the accepted hits alone; see `impact_cross_spectra`."""
    return _average(series, impacts, POWERS, force_window=True, decay_per_s=0.0)


def _average(
    series: TimeSeries, impacts: Impacts, products: Products[SpectraT], *, force_window: bool, decay_per_s: float
) -> SpectraT:
    if not impacts.accepted:
        raise EstimateError(f"no hit of {impacts.force!r} was accepted{_why_none(impacts)}")
    if not 0 <= decay_per_s < np.inf:
        raise EstimateError(f"decay_per_s is {decay_per_s}; it must be 0 or positive")
    require_in_range(series.channels, require_finite(series, valid_runs(series)))
    rate_hz = series.sample_rate_hz
    length = round(impacts.record_s * rate_hz)
    windows = _windows(series, impacts, length, force_window=force_window, decay_per_s=decay_per_s)
    products.require_fitting(len(series.channels), length)
    total = products.zeros(len(series.channels), length // 2 + 1)
    # One hit at a time: the memory stays that of one record, however many hits there are.
    for hit in impacts.accepted:
        spectrum = scipy.fft.rfft(_record(series, impacts, hit, length) * windows) / rate_hz
        products.add(total, spectrum, spectrum)
    total *= one_sided_weights(length)
    # Times the inverse, as NumPy divides complex numbers: so the powers are those of the matrix to rounding.
    total *= 1 / (len(impacts.accepted) * impacts.record_s)
    return products.spectra(
        frequency_hz=line_frequencies_hz(length, rate_hz),
        density=total,
        channels=series.channels,
        bandwidth_hz=1 / impacts.record_s,
        provenance=_provenance(series, impacts, force_window=force_window, decay_per_s=decay_per_s),
    )


def _why_none(impacts: Impacts) -> str:
    if impacts.record_s > impacts.longest_s:
        return (
            f": records of {impacts.record_s:.3g} s are longer than the {impacts.longest_s:.3g} s between hits. Ask "
            f"for a resolution of {rounded_up(1 / impacts.longest_s)} Hz or coarser, or hit at longer intervals"
        )
    reasons = "; ".join(f"record {r.record}: {r.reason}" for r in impacts.rejected) or "no hit was found"
    return f" ({reasons})"


def _record_length(starts: Whole, before: int, samples: int) -> int:
    """Longest record that fits between hits; hits that follow each other unusually fast are judged, not obeyed."""
    spaces = np.diff(np.append(starts, samples + before))
    # The shortest space would obey one hasty double swing, the usual one may be a sample longer than the next.
    usual = float(np.median(spaces))
    longest = int(spaces[spaces >= 0.8 * usual].min())
    return scipy.fft.prev_fast_len(longest, real=True)


def _advice(pulses: Pulses, double_hit_share: float, accepted: int) -> tuple[str, ...]:
    notes = []
    if pulses.ignored:
        notes.append(f"{pulses.ignored} bumps below the trigger level of {pulses.level:.3g} were ignored")
    hidden = NOISE_SIGMAS * pulses.noise / typical_peak(pulses.force, pulses.peaks)
    if hidden > double_hit_share:
        notes.append(f"second pulses under {hidden:.0%} of the usual peak can't be told from the noise of the force")
    if 0 < accepted < 3:
        notes.append(f"only {accepted} accepted: errors from so few hits are themselves uncertain; take 5 or more")
    return tuple(notes)


def _record(series: TimeSeries, impacts: Impacts, hit: Hit, length: int) -> Real:
    """Samples of one hit, each channel freed of its offset."""
    first = round(hit.time_s * series.sample_rate_hz) - round(impacts.pretrigger_s * series.sample_rate_hz)
    silent = max(-first, 0)
    record = series.values[:, first + silent : first + length].astype(np.float64)
    if silent + record.shape[1] < length:
        raise EstimateError(f"record {hit.record} leaves the series; give the one in which the impacts were found")
    offset = record.mean(axis=1)
    # The mean of a force holds its pulse; what it reads in silence is the median.
    force = series.index(impacts.force)
    offset[force] = np.median(record[force])
    return np.pad(record - offset[:, np.newaxis], ((0, 0), (silent, 0)))


def _windows(series: TimeSeries, impacts: Impacts, length: int, *, force_window: bool, decay_per_s: float) -> Real:
    since_trigger_s = np.arange(length) / series.sample_rate_hz - impacts.pretrigger_s
    # From the record's first sample on, without a bend at the trigger: only so is it a pure shift of all poles.
    exponential = np.exp(-decay_per_s * np.arange(length) / series.sample_rate_hz)
    windows = np.tile(exponential, (len(series.channels), 1))
    if force_window:
        span_s = FORCE_WINDOW_PULSES * impacts.pulse_s
        fading = np.clip(since_trigger_s / span_s - 1, 0.0, 1.0)
        windows[series.index(impacts.force)] *= (1 + np.cos(np.pi * fading)) / 2
    return windows


def _provenance(series: TimeSeries, impacts: Impacts, *, force_window: bool, decay_per_s: float) -> Provenance:
    parts = ["force"] * force_window + [f"exponential {decay_per_s:g}/s"] * (decay_per_s > 0)
    notes = [f"record {r.record} at {r.time_s:.3f} s rejected: {r.reason}" for r in impacts.rejected]
    return Provenance(
        window=" + ".join(parts) or "boxcar",
        segment_s=impacts.record_s,
        averages=len(impacts.accepted),
        effective_averages=float(len(impacts.accepted)),
        averaging="impact",
        window_decay_per_s=decay_per_s,
        skipped=len(impacts.rejected),
        longest_s=impacts.longest_s,
        notes=(*impacts.notes, *notes, *_still_ringing(series, impacts, decay_per_s)),
    )


def _still_ringing(series: TimeSeries, impacts: Impacts, decay_per_s: float) -> list[str]:
    """Advice for channels that haven't died away when the record ends."""
    length = round(impacts.record_s * series.sample_rate_hz)
    energy = np.zeros((len(series.channels), length))
    for hit in impacts.accepted:
        energy += _record(series, impacts, hit, length) ** 2
    # The window acts on the amplitude, and is asked for its share at the end only.
    late = energy[:, -length // 10 :].sum(axis=1) * np.exp(-2 * decay_per_s * impacts.record_s)
    names = [
        c.name for c, share in zip(series.channels, late / energy.sum(axis=1), strict=True) if share > STILL_RINGING
    ]
    if not names:
        return []
    advised = np.log(100) / impacts.record_s
    if impacts.record_s < 0.95 * impacts.longest_s:
        longer = f"ask for a resolution of {rounded_up(1 / impacts.longest_s)} Hz"
    else:
        longer = "hit at longer intervals"
    note = (
        f"{', '.join(names)}: not died away at the end of the record, which smears peaks. Remedy: {longer}, or in "
        f"Python give impact_cross_spectra an exponential window of {advised:.3g}/s (1 % at the end)"
    )
    return [note]
