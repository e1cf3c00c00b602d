"""Averages in the way that suits the excitation: hits of a hammer, whole periods, or windowed segments."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic

import numpy as np

from chladni.signals.channel import find_channels
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.number_range import require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.spectral.accumulator import AutoSpectraAccumulator, require_finite
from chladni.spectral.blocks import Source, leading_part
from chladni.spectral.cross_spectra import cross_spectra, segment_average
from chladni.spectral.impact import (
    Impacts,
    find_impacts,
    impact_auto_spectra,
    impact_cross_spectra,
    is_impact_test,
)
from chladni.spectral.period import Period, first_period
from chladni.spectral.periodic import periodic_auto_spectra, periodic_cross_spectra
from chladni.spectral.products import SpectraT
from chladni.spectral.segmentation import Detrend, require_resolution
from chladni.spectral.stretches import valid_runs
from chladni.spectral.windows import Window

DEFAULT_WINDOW = "hann"
DEFAULT_OVERLAP = 0.5
# A period is looked for in the first samples of a log; three of them must fit.
SAMPLES_EXAMINED = 1 << 19


@in_one_thread()
def adaptive_cross_spectra(
    source: Source,
    *,
    references: str | Sequence[str] | None = None,
    resolution_hz: float | None = None,
    window: Window | None = None,
    overlap: float | None = None,
    detrend: Detrend = "constant",
) -> CrossSpectra:
    """Average cross-spectra as the excitation asks for, unless told how.

    When the only reference is a hammer (`is_impact_test`) and neither `window` nor `overlap` is given, its accepted
    hits are averaged (`find_impacts`); all of the source is held in memory for that.

    A reference that repeats (`find_period`) is averaged over whole periods without window, in which nothing leaks,
    unless `resolution_hz`, `window` or `overlap` is given: then that is done, with a note that says what it costs.
    All else is averaged after Welch.

    Parameters
    ----------
    source
        A series, or consecutive blocks of one; the period is looked for in the leading part.
    references
        Names of the excitations; None looks at the channels whose role is reference, or at all when none is.
    resolution_hz, window, overlap, detrend
        See `cross_spectra`; None leaves the choice to this function. For hits, the resolution sets the length of a
        record.

    Raises
    ------
    EstimateError
        When a channel is missing, or there is nothing to average.
    SetupError
        When an option is out of its range.
    """
    return _average(
        _CROSS,
        source,
        references=references,
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        detrend=detrend,
    )


@in_one_thread()
def adaptive_auto_spectra(
    source: Source,
    *,
    resolution_hz: float | None = None,
    window: Window | None = None,
    overlap: float | None = None,
) -> AutoSpectra:
    """Average each channel's auto-spectrum alone: the diagonal of `adaptive_cross_spectra`, which see."""
    return _average(_AUTO, source, resolution_hz=resolution_hz, window=window, overlap=overlap)


@dataclass(frozen=True, slots=True)
class _Estimators(Generic[SpectraT]):
    """What averages segments, whole periods and hits."""

    segments: Callable[..., SpectraT]
    periods: Callable[[Source, Period], SpectraT]
    hits: Callable[[TimeSeries, Impacts], SpectraT]


_CROSS = _Estimators(cross_spectra, periodic_cross_spectra, impact_cross_spectra)
_AUTO = _Estimators(partial(segment_average, AutoSpectraAccumulator), periodic_auto_spectra, impact_auto_spectra)


def _average(
    estimators: _Estimators[SpectraT],
    source: Source,
    *,
    references: str | Sequence[str] | None = None,
    resolution_hz: float | None,
    window: Window | None,
    overlap: float | None,
    detrend: Detrend = "constant",
) -> SpectraT:
    lead, blocks = leading_part(source, SAMPLES_EXAMINED)
    start = _joined(lead)
    # Said once and by name, before periods and hits are looked for in what no number holds.
    largest = require_finite(start, valid_runs(start))
    if isinstance(source, TimeSeries):
        require_in_range(source.channels, largest)
    hammer = _hammer(start, references)
    if hammer is not None and window is None and overlap is None:
        return _hits(estimators, tuple(blocks), hammer, resolution_hz)
    period = first_period(start, _excitations(start, references))
    chosen = resolution_hz is None and window is None and overlap is None
    if period is not None and period.whole and chosen:
        return estimators.periods(blocks, period)
    spectra = estimators.segments(
        source if isinstance(source, TimeSeries) else blocks,
        resolution_hz=resolution_hz,
        window=DEFAULT_WINDOW if window is None else window,
        overlap=DEFAULT_OVERLAP if overlap is None else overlap,
        detrend=detrend,
    )
    if period is None:
        return spectra
    return _noted(spectra, _price(period, spectra.provenance))


def _hits(
    estimators: _Estimators[SpectraT], blocks: tuple[TimeSeries, ...], force: str, resolution_hz: float | None
) -> SpectraT:
    series = _joined(blocks)
    if resolution_hz is not None:
        require_resolution(resolution_hz, series.sample_rate_hz)
    record_s = None if resolution_hz is None else 1 / resolution_hz
    spectra = estimators.hits(series, find_impacts(series, force=force, record_s=record_s))
    beyond_s = sum(block.duration_s for block in blocks) - series.duration_s
    if beyond_s * series.sample_rate_hz < 0.5:
        return spectra
    note = f"hits after the break in time at {series.duration_s:g} s are not used: {beyond_s:g} s of record"
    return _noted(spectra, note)


def _noted(spectra: SpectraT, note: str) -> SpectraT:
    return replace(spectra, provenance=spectra.provenance.with_notes(note))


def _hammer(series: TimeSeries, references: str | Sequence[str] | None) -> str | None:
    """Name the reference when it's the only one and strikes; a series without references has no hammer."""
    if references is None:
        names = [channel.name for channel in series.channels if channel.role == "reference"]
    else:
        names = list(series.names(references))
    return names[0] if len(names) == 1 and is_impact_test(series, names[0]) else None


def _excitations(series: TimeSeries, references: str | Sequence[str] | None) -> Sequence[int]:
    if references is not None:
        return find_channels(series.channels, references)
    marked = [row for row, channel in enumerate(series.channels) if channel.role == "reference"]
    return marked or range(len(series.channels))


def _joined(lead: tuple[TimeSeries, ...]) -> TimeSeries:
    """Join consecutive blocks up to the first break in time; a period is looked for in one stretch only."""
    joined, length = [lead[0]], lead[0].samples
    for block in lead[1:]:
        expected = round((block.start_time_ns - lead[0].start_time_ns) * 1e-9 * lead[0].sample_rate_hz)
        if expected != length or block.channels != lead[0].channels:
            break
        joined.append(block)
        length += block.samples
    if len(joined) == 1:
        return lead[0]
    valid = None
    if any(block.valid is not None for block in joined):
        parts = [np.ones(block.values.shape, bool) if block.valid is None else block.valid for block in joined]
        valid = np.concatenate(parts, axis=1)
    return replace(lead[0], values=np.concatenate([block.values for block in joined], axis=1), valid=valid)


def _price(period: Period, account: Provenance) -> str:
    repeats = f"{period.channel} repeats every {period.period_s:.6g} s"
    if not period.whole:
        return (
            f"{repeats}, which is no whole number of samples ({period.period_s:.9g} s, {period.drift_samples:.2g} "
            f"samples of drift over the record): averaged with a window; resample to average whole periods"
        )
    return (
        f"{repeats}; a {account.window} window over {account.segment_s:g} s reads sharp peaks low: leave window, "
        "resolution and overlap out to average whole periods"
    )
