"""The main job: a log to everything that can be said and shown of it."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from chladni.apps.excitation import excitations
from chladni.apps.findings import peak_sentence, response_sentences, soundness_sentences
from chladni.apps.frf import transfer
from chladni.apps.psd import densities
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.apps.unit_peaks import unit_peaks
from chladni.io.log import Log, open_log
from chladni.io.log_reader import MostlyEmptyError
from chladni.io.source import is_small
from chladni.signals.channel import Channel, Names, as_names
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.renamed import renamed
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.signals.waterfall import Waterfall
from chladni.spectral.peaks import find_response_peaks
from chladni.spectral.waterfall import waterfall

if TYPE_CHECKING:
    from chladni.signals.peak import Peak

# Waveforms and waterfalls of a larger log are drawn for its beginning only; spectra always cover all of it.
MOST_VALUES_DRAWN = 40_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shown:
    """Samples to draw, and what isn't drawn."""

    series: tuple[TimeSeries, ...]
    notes: tuple[str, ...] = ()


@renamed(log="source")
def analyse(
    source: Log | Path | str,
    *,
    channels: Names | None = None,
    references: Names | None = None,
    resolution_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    progress: Progress = no_progress,
) -> Study:
    """Analyse a log: soundness, levels, spectra, peaks, spectra over time, transfer functions.

    Parameters
    ----------
    source
        A log from `chladni.open`, or its path; its setup file tells points, units and references.
    channels
        Message paths; None for all channels that are uniform series and change at all.
    references
        Excitations; None takes the channels whose role is reference, else the first force that changes.
    resolution_hz
        Distance of the spectral lines; None chooses.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the log's start.
    progress
        Called with the share done, 0 to 1.

    Returns
    -------
    Study
        What viewers and reports draw.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel holds enough samples for a spectrum.
    """
    log = open_log(source) if isinstance(source, Path | str) else source
    channels = None if channels is None else as_names(channels)
    references = None if references is None else as_names(references)
    averaging, span = Averaging(resolution_hz=resolution_hz), Span(start_s=start_s, end_s=end_s)
    soundness = soundness_sentences(log.info())
    progress(0.2)
    if not log.channels and (log.functions is not None or log.modes is not None):
        response = None
        if log.functions is not None:
            response = transfer(log, references, channels, estimator="H1", averaging=averaging, span=span)
        return _study(log, (), response, _Shown(series=()), (), soundness)
    found = densities(log, channels=channels, averaging=averaging, span=span)
    progress(0.5)
    moving = [channel for density in found for channel in density.channels]
    response = _response(log, moving, references, channels, averaging, span)
    progress(0.7)
    shown = _shown(log, [channel.name for channel in moving], span)
    falls = tuple(waterfall(series) for series in shown.series)
    progress(1.0)
    return _study(log, found, response, shown, falls, soundness)


def _study(
    log: Log,
    found: tuple[PowerSpectralDensity, ...],
    response: FrequencyResponse | None,
    shown: _Shown,
    falls: tuple[Waterfall, ...],
    soundness: tuple[str, ...],
) -> Study:
    peaks = [unit_peaks(density) for density in found]
    findings = list(soundness)
    for density, named in zip(found, peaks, strict=True):
        findings += [*(peak_sentence(group) for group in named), *density.provenance.notes]
    response_peaks: tuple[Peak, ...] = ()
    if response is not None:
        response_peaks = find_response_peaks(response)
        findings += [*response_sentences(response, response_peaks), *response.provenance.notes]
    return Study(
        title=log.path.name,
        series=shown.series,
        densities=found,
        waterfalls=falls,
        response=response,
        peaks=tuple(peak for named in peaks for group in named for peak in group.peaks),
        response_peaks=response_peaks,
        modes=log.modes,
        geometry=log.geometry,
        findings=tuple(dict.fromkeys([*findings, *shown.notes])),
    )


def _response(
    log: Log,
    moving: Sequence[Channel],
    references: Sequence[str] | None,
    channels: Sequence[str] | None,
    averaging: Averaging,
    span: Span,
) -> FrequencyResponse | None:
    chosen = references or excitations(moving)
    if not chosen:
        return log.functions
    others = None if channels is None else [name for name in log.names(channels) if name not in log.names(chosen)]
    if others == []:
        return None
    try:
        return transfer(log, chosen, others, estimator="H1", averaging=averaging, span=span)
    except EstimateError:
        # Asked for, a response that can't be made is an error; guessed, it's only one picture less.
        if references:
            raise
        return None


def _shown(log: Log, names: Sequence[str], span: Span) -> _Shown:
    """Read what is drawn over time; of a log too large for memory its beginning, with a word."""
    if is_small(log):
        with suppress(MostlyEmptyError):
            return _Shown(series=log.read_groups(names, start_s=span.start_s, end_s=span.end_s))
    grids = log.grids(names, start_s=span.start_s, end_s=span.end_s)
    a_second = sum(len(grid.names) * grid.sample_rate_hz for grid in grids)
    seconds = MOST_VALUES_DRAWN / a_second
    longest = max(grid.duration_s for grid in grids)
    if seconds >= longest:
        return _Shown(series=log.read_groups(names, start_s=span.start_s, end_s=span.end_s))
    begin = span.start_s or 0.0
    series = log.read_groups(names, start_s=begin, end_s=begin + seconds)
    note = (
        f"Waveforms and waterfalls show {seconds:.4g} s from {begin:g} s on, of {longest:.6g} s; spectra cover all. "
        "Choose another part with a start and an end."
    )
    return _Shown(series=series, notes=(note,))
