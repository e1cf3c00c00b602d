"""Two measurements side by side: levels, spectra, responses and peaks, with what is significant."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.special

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.comparison import DensityComparison, LevelChange, PeakChange, ResponseComparison
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.levels import BandLevels
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.unit_text import in_unit
from chladni.signals.wording import counted
from chladni.spectral.bands import total_rms
from chladni.spectral.octaves import octaves
from chladni.spectral.peaks import find_peaks, find_response_peaks

# Peaks further apart than this share of their frequency, or this many lines, are not the same peak.
SAME_PEAK_SHARE = 0.05
SAME_PEAK_LINES = 3.0
# A shift of 3.5 sigma happens by chance once in 2000 peaks; even were sigma 20 % too small, once in 280.
MOVED_SIGMAS = 3.5
# Peaks looked at on each side, and how many of the highest are told: one of these may be among the lower ones there.
PEAKS_A_CHANNEL = 30
PEAKS_TOLD = 10


def compare_densities(
    before: PowerSpectralDensity, after: PowerSpectralDensity, *, false_discovery: float = 0.05
) -> DensityComparison:
    """Compare power spectral densities of the same channels.

    Parameters
    ----------
    before, after
        Made with the same resolution; channels are matched by name.
    false_discovery
        Share of false ones among the changes called significant, 0 to 1. Where nothing changed, it's the chance of
        calling anything significant; lines, and levels in bands, are two families with that share each.

    Returns
    -------
    DensityComparison
        A change spread thinly over a band shows in `bands` rather than on its lines. Significant means: more than the
        random error of two stationary processes; machines that run differently every day need more than two logs.

    Raises
    ------
    EstimateError
        When no channel is in both, units or frequency lines differ, or `false_discovery` is out of range.

    Notes
    -----
    The ratio of two estimates with nu = 2 (G/std)^2 degrees of freedom each follows F(nu_after, nu_before) when
    nothing changed (Bendat & Piersol 2010, section 4.2.4). Many lines are judged together after Benjamini & Hochberg
    (1995). A peak has moved when its shift exceeds 3.5 sigma; it appeared or vanished when it has no partner within
    5 % and its lines changed significantly. The ten highest peaks of each channel or function on either side are
    told.
    """
    _require_share(false_discovery)
    names, only_before, only_after = _matched(before.channels, after.channels, "channel")
    _require_same_lines(before.frequency_hz, after.frequency_hz)
    first, second = before.select(names), after.select(names)
    surprise = _ratio_surprise(first.values, first.std, second.values, second.std)
    # All channels in one family: the share of false ones is promised for the whole comparison.
    significant = _discoveries(surprise, false_discovery)
    overall = _level_changes(total_rms(first), total_rms(second), false_discovery)
    bands, band_notes = _band_changes(first, second, false_discovery)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where((first.values > 0) & (second.values > 0), second.values / first.values, np.nan)
        spread = np.hypot(first.std / first.values, second.std / second.values)
    return DensityComparison(
        frequency_hz=first.frequency_hz,
        change_db=10 * np.log10(ratio),
        change_std_db=10 / np.log(10) * np.where(np.isnan(ratio), np.nan, spread),
        significant=significant,
        channels=first.channels,
        overall=overall,
        bands=bands,
        peaks=_density_peaks(first, second, significant),
        only_before=only_before,
        only_after=only_after,
        notes=(*_unmatched_notes(only_before, only_after), *band_notes),
    )


def compare_responses(
    before: FrequencyResponse, after: FrequencyResponse, *, false_discovery: float = 0.05
) -> ResponseComparison:
    """Compare frequency responses between the same channels.

    Parameters
    ----------
    before, after
        Made with the same resolution; functions are matched by the names of response and reference.
    false_discovery
        See `compare_densities`.

    Returns
    -------
    ResponseComparison
        On lines that are excited in both.

    Raises
    ------
    EstimateError
        When no function is in both, units or frequency lines differ, or `false_discovery` is out of range.

    Notes
    -----
    With one sigma s of a magnitude, real and imaginary part scatter by s each, so |H_after - H_before|^2 /
    (2 (s_before^2 + s_after^2)) follows F(2, d) when nothing changed; d = 2 (n - q) of the smaller number of
    averages n, with q references (Bendat & Piersol 2010, section 9.2).
    """
    _require_share(false_discovery)
    answers, gone, new = _matched(before.responses, after.responses, "response")
    sources, gone_sources, new_sources = _matched(before.references, after.references, "reference")
    _require_same_lines(before.frequency_hz, after.frequency_hz)
    first, second = (_functions(response, answers, sources) for response in (before, after))
    excited = np.broadcast_to(first.excited & second.excited, first.values.shape)
    usable = excited & np.isfinite(first.std) & np.isfinite(second.std) & (first.values != 0) & (second.values != 0)
    significant = _discoveries(np.where(usable, _difference_surprise(first, second), 1.0), false_discovery)
    ratio = np.divide(second.values, first.values, out=np.full(usable.shape, np.nan + 0j), where=usable)
    relative = [
        np.divide(r.std, np.abs(r.values), out=np.full(usable.shape, np.nan), where=usable) for r in (first, second)
    ]
    only_before, only_after = gone + gone_sources, new + new_sources
    return ResponseComparison(
        frequency_hz=first.frequency_hz,
        change_db=20 * np.log10(np.abs(ratio)),
        change_std_db=20 / np.log(10) * np.hypot(*relative),
        phase_change_deg=np.degrees(np.angle(ratio)),
        significant=significant,
        responses=first.responses,
        references=first.references,
        peaks=_response_peaks(first, second, significant),
        only_before=only_before,
        only_after=only_after,
        notes=_unmatched_notes(only_before, only_after),
    )


def _ratio_surprise(before: Real, before_std: Real, after: Real, after_std: Real) -> Real:
    """Chance of a ratio at least as far from 1, on either side, if nothing changed; 1 where that can't be told."""
    usable = (before > 0) & (after > 0) & (before_std > 0) & (after_std > 0)
    usable &= np.isfinite(before_std) & np.isfinite(after_std)
    freedom = [
        2 * np.divide(value, std, out=np.ones(value.shape), where=usable) ** 2
        for value, std in ((before, before_std), (after, after_std))
    ]
    ratio = np.divide(after, before, out=np.ones(before.shape), where=usable)
    # Both tails are computed as such: 1 - fdtr would end at 1e-16, and ranks need the small ones.
    below = scipy.special.fdtr(freedom[1], freedom[0], ratio)
    above = scipy.special.fdtrc(freedom[1], freedom[0], ratio)
    return np.where(usable, np.minimum(2 * np.minimum(below, above), 1.0), 1.0)


def _difference_surprise(before: FrequencyResponse, after: FrequencyResponse) -> Real:
    variance = before.std**2 + after.std**2
    distance = np.abs(after.values - before.values) ** 2
    statistic = np.divide(distance, 2 * variance, out=np.zeros(distance.shape), where=(variance > 0) & (distance > 0))
    # The smaller number of averages has the heavier tails, so this errs towards silence.
    averages = min(before.provenance.effective_averages, after.provenance.effective_averages)
    freedom = max(2 * (averages - len(before.references)), 1.0)
    # The survival function of F(2, d) in closed form.
    return np.asarray((1 + 2 * statistic / freedom) ** (-freedom / 2), dtype=np.float64)


def _discoveries(surprise: Real, share: float) -> Mask:
    """Benjamini & Hochberg (1995): reject the k smallest p-values, k the largest with p_(k) <= k q / m."""
    ranked = np.sort(surprise, axis=None)
    passed = np.flatnonzero(ranked <= share * np.arange(1, ranked.size + 1) / ranked.size)
    if not passed.size:
        return np.zeros(surprise.shape, dtype=bool)
    return np.asarray(surprise <= ranked[passed[-1]])


def _level_changes(before: BandLevels, after: BandLevels, false_discovery: float) -> tuple[LevelChange, ...]:
    power, power_std = (
        [levels.rms**2 for levels in (before, after)],
        [2 * levels.rms * levels.std for levels in (before, after)],
    )
    significant = _discoveries(_ratio_surprise(power[0], power_std[0], power[1], power_std[1]), false_discovery)
    return tuple(
        _level_change(before, after, row, band, significant=bool(significant[row, band]))
        for row in range(len(before.channels))
        for band in range(before.low_hz.size)
    )


def _level_change(before: BandLevels, after: BandLevels, row: int, band: int, *, significant: bool) -> LevelChange:
    levels = (before.rms[row, band], before.std[row, band], after.rms[row, band], after.std[row, band])
    old, old_std, new, new_std = (float(level) for level in levels)
    both = old > 0 and new > 0
    return LevelChange(
        channel=before.channels[row].name,
        unit=before.channels[row].unit,
        low_hz=float(before.low_hz[band]),
        high_hz=float(before.high_hz[band]),
        before=old,
        before_std=old_std,
        after=new,
        after_std=new_std,
        change_db=float(20 * np.log10(new / old)) if both else np.nan,
        change_std_db=float(20 / np.log(10) * np.hypot(old_std / old, new_std / new)) if both else np.nan,
        significant=significant,
    )


def _band_changes(
    before: PowerSpectralDensity, after: PowerSpectralDensity, false_discovery: float
) -> tuple[tuple[LevelChange, ...], tuple[str, ...]]:
    try:
        levels = octaves(before).bands, octaves(after).bands
    except EstimateError as error:
        # A coarse spectrum holds no third octave; its lines and its overall level can be compared all the same.
        return (), (f"levels in bands are not compared: {error}",)
    return _level_changes(*levels, false_discovery), ()


def _density_peaks(
    before: PowerSpectralDensity, after: PowerSpectralDensity, significant: Mask
) -> tuple[PeakChange, ...]:
    changes: list[PeakChange] = []
    for row, channel in enumerate(before.channels):
        # One channel at a time, since a peak shared with others carries the frequency of the strongest one.
        old, new = (find_peaks(d.select([channel.name]), count=PEAKS_A_CHANNEL) for d in (before, after))
        changes += _fates(old, new, before.frequency_hz, significant[row])
    return tuple(changes)


def _response_peaks(before: FrequencyResponse, after: FrequencyResponse, significant: Mask) -> tuple[PeakChange, ...]:
    found = [find_response_peaks(response, count=PEAKS_A_CHANNEL) for response in (before, after)]
    changes: list[PeakChange] = []
    for row, answer in enumerate(before.responses):
        for column, source in enumerate(before.references):
            names = (answer.name, source.name)
            old, new = ([peak for peak in peaks if peak.channels == names] for peaks in found)
            changes += _fates(old, new, before.frequency_hz, significant[row, column])
    return tuple(changes)


def _fates(old: Sequence[Peak], new: Sequence[Peak], frequency_hz: Real, significant: Mask) -> list[PeakChange]:
    """Pair peaks, the nearest first; those without a partner count only where their lines changed."""
    reach_hz = SAME_PEAK_LINES * float(np.median(np.diff(frequency_hz)))
    # The nearest pair first: a greedy choice, but peaks further apart than their shifts can't be mixed up by it.
    pairs = sorted(
        (abs(late.frequency_hz - early.frequency_hz), i, k)
        for i, early in enumerate(old)
        for k, late in enumerate(new)
        if abs(late.frequency_hz - early.frequency_hz) <= max(reach_hz, SAME_PEAK_SHARE * early.frequency_hz)
    )
    partners: dict[int, int] = {}
    for _, i, k in pairs:
        if i not in partners and k not in partners.values():
            partners[i] = k
    changes = [_moved_or_not(old[i], new[k]) for i, k in sorted(partners.items())]

    def changed(peak: Peak) -> bool:
        return bool(np.any(significant & (np.abs(frequency_hz - peak.frequency_hz) <= reach_hz / 2)))

    gone = [peak for i, peak in enumerate(old) if i not in partners and changed(peak)]
    come = [peak for k, peak in enumerate(new) if k not in partners.values() and changed(peak)]
    changes += [PeakChange(fate="vanished", before=p, after=None, shift_hz=np.nan, shift_std_hz=np.nan) for p in gone]
    changes += [PeakChange(fate="appeared", before=None, after=p, shift_hz=np.nan, shift_std_hz=np.nan) for p in come]
    high = {id(peak) for peak in (*old[:PEAKS_TOLD], *new[:PEAKS_TOLD])}
    return [change for change in changes if {id(change.before), id(change.after)} & high]


def _moved_or_not(before: Peak, after: Peak) -> PeakChange:
    shift_hz = after.frequency_hz - before.frequency_hz
    std_hz = float(np.hypot(before.frequency_std_hz, after.frequency_std_hz))
    moved = abs(shift_hz) > MOVED_SIGMAS * std_hz
    return PeakChange(
        fate="moved" if moved else "unchanged", before=before, after=after, shift_hz=shift_hz, shift_std_hz=std_hz
    )


def _matched(
    before: Sequence[Channel], after: Sequence[Channel], kind: str
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    """Names in both, and those only in one; the units of those in both agree."""
    old, new = ({channel.name: channel.unit for channel in channels} for channels in (before, after))
    both = [name for name in old if name in new]
    if not both:
        raise EstimateError(f"no {kind} is in both: {', '.join(old)} before, {', '.join(new)} after")
    for name in both:
        if old[name] != new[name]:
            raise EstimateError(
                f"{name!r} is {in_unit(old[name])} before and {in_unit(new[name])} after; state one unit for both"
            )
    return both, tuple(name for name in old if name not in new), tuple(name for name in new if name not in old)


def _functions(response: FrequencyResponse, answers: Sequence[str], sources: Sequence[str]) -> FrequencyResponse:
    pairs = [[response.function(answer, source) for source in sources] for answer in answers]
    rows, columns = [row[0][0] for row in pairs], [column for _, column in pairs[0]]
    return replace(
        response,
        values=response.values[np.ix_(rows, columns)],
        std=response.std[np.ix_(rows, columns)],
        coherence=response.coherence[rows],
        responses=tuple(response.responses[row] for row in rows),
        references=tuple(response.references[column] for column in columns),
    )


def _require_same_lines(before_hz: Real, after_hz: Real) -> None:
    if before_hz.shape == after_hz.shape and np.allclose(before_hz, after_hz, rtol=1e-6, atol=0):
        return
    described = [f"{counted(hz.size, 'line')} to {hz[-1]:g} Hz" for hz in (before_hz, after_hz)]
    raise EstimateError(f"{described[0]} before, {described[1]} after: make both with the same resolution and rate")


def _require_share(false_discovery: float) -> None:
    if not 0 < false_discovery < 1:
        raise EstimateError(f"false_discovery is {false_discovery}; it must lie between 0 and 1")


def _unmatched_notes(only_before: tuple[str, ...], only_after: tuple[str, ...]) -> tuple[str, ...]:
    sides = (("before", only_before), ("after", only_after))
    return tuple(f"only {side}, so not compared: {', '.join(names)}" for side, names in sides if names)
