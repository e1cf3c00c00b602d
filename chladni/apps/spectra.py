"""Power spectral densities and transfer functions of a log or a series, in one call each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from chladni.apps.excitation import excitation_names, stored_functions
from chladni.apps.sources import (
    Progress,
    Span,
    Watched,
    moving_only,
    no_progress,
    on_one_grid,
    watched_grids,
)
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.io.source import SeriesLike, are_numbers, driven_series, log_or_series
from chladni.signals.channel import Names, as_names
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.renamed import renamed
from chladni.signals.resampling import JoinMethod
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import rounded_up
from chladni.spectral.adaptive import adaptive_auto_spectra, adaptive_cross_spectra
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum
from chladni.spectral.bands import band_rms, total_rms
from chladni.spectral.blocks import Source
from chladni.spectral.excitation import HAMMER_RANGE
from chladni.spectral.frf import Estimator, frequency_response
from chladni.spectral.ods import deflection_shapes
from chladni.spectral.peaks import judged_above_hz
from chladni.spectral.products import PAIRS
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.response_advice import longest_segment_s
from chladni.spectral.segmentation import SHORTEST_SEGMENT
from chladni.spectral.windows import Window
from chladni.spectral.zoom import zoom_of_blocks

SpectraT = TypeVar("SpectraT", CrossSpectra, PowerSpectralDensity)

# A tenth of the variance is half a decibel: less than that is lost at the ends of any record.
MISSING_TOLD = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Averaging:
    """How to average; None leaves the choice to the excitation, see `adaptive_cross_spectra`."""

    resolution_hz: float | None = None
    window: Window | None = None
    overlap: float | None = None

    def powers(self, source: Source) -> AutoSpectra:
        """Average the auto-spectrum of each of the source's channels so."""
        return adaptive_auto_spectra(
            source, resolution_hz=self.resolution_hz, window=self.window, overlap=self.overlap
        )

    def spectra(self, source: Source, references: Sequence[str] | None) -> CrossSpectra:
        """Average the source's cross-spectra so."""
        return adaptive_cross_spectra(
            source,
            references=references,
            resolution_hz=self.resolution_hz,
            window=self.window,
            overlap=self.overlap,
        )


def psd(
    source: SeriesLike,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    resolution_hz: float | None = None,
    window: Window | None = None,
    overlap: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> PowerSpectralDensity:
    """Estimate averaged power spectral densities.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, or an array ``[channel, sample]``.
    channels
        Message paths or names; None for all that share one sampling grid. Channels of a log that never change are
        left out, with a note.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    resolution_hz
        Distance of the lines; None chooses by the length of the record.
    window
        As in `scipy.signal.get_window`. None takes whole periods without window where the excitation is periodic,
        else Hann.
    overlap
        Share of a segment that the next one repeats, 0 <= overlap < 1; None for 0.5.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.

    Returns
    -------
    PowerSpectralDensity
        ``.values[channel, frequency]`` in unit^2/Hz.

    Raises
    ------
    LogError
        When there is no such channel, or the channels have different sampling grids.
    EstimateError
        When there is too little to average.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).standard_normal(2**16)
    >>> density = psd(noise, sample_rate_hz=2.0)  # white noise of variance 1 up to 1 Hz: density 1
    >>> bool(abs(density.values.mean() - 1) < 0.02)
    True
    """
    source = log_or_series(source, sample_rate_hz=sample_rate_hz)
    names = None if channels is None else as_names(channels)
    averaging = Averaging(resolution_hz=resolution_hz, window=window, overlap=overlap)
    span = Span(start_s=start_s, end_s=end_s)
    if isinstance(source, TimeSeries):
        return _density(_of_series(source, names, span), averaging)
    grids = list(watched_grids(source, names, span))
    if len(grids) > 1:
        # The log's own error names the grids and the remedies.
        source.read(names, start_s=start_s, end_s=end_s)
    return _density(grids[0], averaging)


def densities(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    averaging: Averaging | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> tuple[PowerSpectralDensity, ...]:
    """Estimate the densities of a log's channels, one value for each sampling grid.

    Grids on which nothing moves, or that are too short to average, are left out; a note on the first value says so.

    Raises
    ------
    EstimateError
        When no grid gives a spectrum.
    """
    found: list[PowerSpectralDensity] = []
    left_out: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            found.append(_density(grid, averaging or Averaging()))
        except EstimateError as error:
            left_out.append(f"{some_of(grid.names)}: {error}")
    if not found:
        raise EstimateError(f"{log.path.name}: no spectrum could be made: {'; '.join(left_out)}")
    noted = replace(found[0], provenance=found[0].provenance.with_notes(*left_out))
    return (noted, *found[1:])


@renamed(reference="references", response="responses")
def frf(
    source: SeriesLike,
    *,
    references: Names | ArrayLike | None = None,
    responses: Names | None = None,
    estimator: Estimator = "H1",
    resolution_hz: float | None = None,
    window: Window | None = None,
    overlap: float | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    join: JoinMethod = "auto",
) -> FrequencyResponse:
    """Estimate transfer functions and coherence.

    A hammer test is recognised: its hits are cut out, overloads and double hits rejected with a note each. So is
    periodic excitation, which is averaged over whole periods. Everything else is averaged after Welch. Of a universal
    file without time records the functions that it holds are given.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, or an array ``[channel, sample]``.
    references
        Message path of the excitation, or several; None takes those whose role is reference, else the first force.
        Beside an array the samples of the excitation may be given, ``[sample]`` or ``[channel, sample]``.
    responses
        Message paths of the responses; None for all other channels that share the reference's sampling grid and
        change at all.
    estimator
        ``H1``, ``H2`` or ``Hv``, see `frequency_response`.
    resolution_hz, window, overlap, sample_rate_hz, start_s, end_s
        See `psd`. For a hammer test the resolution sets the length of a record.
    join
        How named channels of several sampling grids become one, see `chladni.signals.resampling.join_resampled`; a
        note says how it was done.

    Returns
    -------
    FrequencyResponse
        ``.values[response, reference, frequency]``.

    Raises
    ------
    LogError
        When there is no such channel, or the channels named have different sampling grids.
    EstimateError
        When there is too little to average.

    Examples
    --------
    >>> import numpy as np
    >>> force = np.random.default_rng(1).standard_normal(2**14)
    >>> response = frf({"f": force, "a": 0.5 * force}, sample_rate_hz=100.0, references="f", resolution_hz=1.0)
    >>> float(abs(response.values[0, 0, 10]).round(12))
    0.5
    >>> same = frf(0.5 * force, references=force, sample_rate_hz=100.0, resolution_hz=1.0)
    >>> bool(np.array_equal(same.values, response.values))
    True
    """
    named: Names | None
    if references is not None and are_numbers(references):
        source, named = driven_series(source, cast("ArrayLike", references), sample_rate_hz=sample_rate_hz)
    else:
        source, named = log_or_series(source, sample_rate_hz=sample_rate_hz), cast("Names | None", references)
    averaging = Averaging(resolution_hz=resolution_hz, window=window, overlap=overlap)
    return transfer(
        source,
        None if named is None else as_names(named),
        None if responses is None else as_names(responses),
        estimator=estimator,
        averaging=averaging,
        span=Span(start_s=start_s, end_s=end_s, join=join),
    )


def transfer(
    source: Log | TimeSeries,
    references: Sequence[str] | None,
    responses: Sequence[str] | None,
    *,
    estimator: Estimator,
    averaging: Averaging,
    span: Span,
    hammer_range: float = HAMMER_RANGE,
    progress: Progress = no_progress,
) -> FrequencyResponse:
    """Do the work of `frf`, with progress; see `excited_lines` for `hammer_range`."""
    if references is not None and not references:
        raise EstimateError("no reference is given; name the channel of the excitation")
    stored = stored_functions(source, references, responses)
    if stored is not None:
        _require_nothing_to_average(source, averaging, span)
        return stored
    if references is None:
        references = _told_excitations(source, span)
    names = None if responses is None else tuple(dict.fromkeys((*references, *responses)))
    if isinstance(source, TimeSeries):
        references = source.names(references)
        _require_others(references, None if responses is None else source.names(responses))
        spectra = averaging.spectra(_of_series(source, names, span), references)
        return frequency_response(
            spectra,
            references=references,
            responses=responses,
            estimator=estimator,
            hammer_range=hammer_range,
        )
    # A path may be written in more than one way; the channels that come back have one name each.
    references = source.names(references)
    grid = _grid_of(source, references, names, span, progress)
    named = None if responses is None else source.names(responses)
    _require_others(references, named)
    try:
        spectra = averaging.spectra(grid, references)
        spectra = replace(spectra, provenance=spectra.provenance.with_notes(*grid.notes))
        _require_moving(grid, references)
        spectra = without_constant(spectra, grid, keep=(*references, *(named or ())))
        spectra = replace(spectra, provenance=spectra.provenance.with_notes(*grid.still_note(named or ())))
        return frequency_response(
            spectra, references=references, responses=named, estimator=estimator, hammer_range=hammer_range
        )
    except EstimateError as error:
        raise EstimateError(f"{source.path.name}: {error}") from error


def _require_others(references: Sequence[str], responses: Sequence[str] | None) -> None:
    both = [one for one in responses or () if one in references]
    if both:
        raise EstimateError(
            f"{some_of(both)}: reference and response at once, which gives 1 everywhere; name another response"
        )


def log_deflection(
    log: Log,
    *,
    reference: str,
    channels: Sequence[str] | None,
    frequencies_hz: Sequence[float] | None,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> DeflectionShapes:
    """Give the deflection shapes of named channels, or of all that share the reference's sampling grid and change.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        As `deflection_shapes` does.
    """
    references = (log.name(reference),)
    names = None if channels is None else tuple(dict.fromkeys((*references, *channels)))
    grid = _grid_of(log, references, names, span, progress)
    try:
        spectra = averaging.spectra(grid, references)
        _require_moving(grid, references)
        spectra = without_constant(spectra, grid, keep=references)
        spectra = replace(spectra, provenance=spectra.provenance.with_notes(*grid.notes))
        return deflection_shapes(spectra, references=references[0], frequencies_hz=frequencies_hz)
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error


def zoomed(
    log: Log, *, channels: Sequence[str] | None, span: Span, progress: Progress = no_progress, **options: Any
) -> tuple[AmplitudeSpectrum, ...]:
    """Zoom into named channels, or all that change, one value for each sampling grid; options are `zoom_spectrum`'s.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        As `zoom_spectrum` does.
    """
    found: list[tuple[AmplitudeSpectrum, Watched]] = []
    for grid in watched_grids(log, channels, span, progress=progress):
        try:
            found.append((zoom_of_blocks(partial(iter, grid), **options), grid))
        except EstimateError as error:
            raise EstimateError(f"{log.path.name}: {error}") from error
    moving = () if channels is not None else moving_only(found)
    return moving or tuple(
        replace(one, provenance=one.provenance.with_notes(*grid.still_note([c.name for c in one.channels])))
        for one, grid in found
    )


def _told_excitations(source: Log | TimeSeries, span: Span) -> tuple[str, ...]:
    try:
        # Parts must not choose differently, so each looks at all of the candidates.
        return excitation_names(source, replace(span, share=None))
    except EstimateError as error:
        raise EstimateError(f"{source.path.name}: {error}" if isinstance(source, Log) else str(error)) from error


def _require_nothing_to_average(source: Log | TimeSeries, averaging: Averaging, span: Span) -> None:
    if averaging != Averaging() or span != Span():
        name = source.path.name if isinstance(source, Log) else "these functions"
        raise EstimateError(
            f"{name}: holds averaged functions already; leave out resolution, window, overlap, start and end"
        )


def _require_moving(watched: Watched, references: Sequence[str]) -> None:
    """Raise `EstimateError` when a reference never changes: all lines would be masked, and nobody told why."""
    dead = [name for name in references if name in watched.constant()]
    if dead:
        raise EstimateError(f"{some_of(dead)} never changes, so it excites nothing; name another reference")


def _density(source: TimeSeries | Watched, averaging: Averaging) -> PowerSpectralDensity:
    density = power_spectral_density(averaging.powers(source))
    if isinstance(source, Watched):
        density = without_constant(density, source, keep=())
        # Segments that were skipped hold variance, too, and that is told.
        whole = [0.0 if density.provenance.skipped else source.variance(one.name) for one in density.channels]
    else:
        whole = [0.0] * len(density.channels)
    return replace(density, provenance=density.provenance.with_notes(*_slow_variance(density, whole)))


def _slow_variance(density: PowerSpectralDensity, whole: Sequence[float]) -> tuple[str, ...]:
    """Say so when much of a signal is slower than what peaks are looked for in: it may be drift, or a tone.

    ``whole[channel]`` is the variance of the samples, 0 where that isn't known.
    """
    low_hz = judged_above_hz(density)
    # Whole periods and hits leave nothing out.
    if not low_hz:
        return ()
    judged = np.square(band_rms(density, bands_hz=[(low_hz, float(density.frequency_hz[-1]))]).rms[:, 0])
    total = np.maximum(np.square(total_rms(density).rms[:, 0]), np.asarray(whole))
    share = 1 - judged / np.maximum(total, np.finfo(float).tiny)
    slow = [channel.name for channel, one in zip(density.channels, share, strict=True) if one > MISSING_TOLD]
    if not slow:
        return ()
    note = (
        f"{some_of(slow)}: up to {share.max():.0%} of the variance is slower than {low_hz:.3g} Hz, or at the ends of "
        "the record. Below that a trend leaks and no peak is looked for. If it isn't drift, "
        f"{_finest(density.provenance)}"
    )
    return (note,)


def _finest(account: Provenance) -> str:
    """Ask for the finest lines that the record allows, or for a longer record."""
    longest_s = longest_segment_s(account)
    if longest_s <= account.segment_s:
        return "measure longer"
    return f"ask for a resolution of {rounded_up(1 / longest_s, digits=2)} Hz"


def _of_series(series: TimeSeries, names: Sequence[str] | None, span: Span) -> TimeSeries:
    chosen = series if names is None else series.select(list(names))
    if span == Span():
        return chosen
    return chosen.window(start_s=span.start_s, end_s=span.end_s)


def _grid_of(
    log: Log, references: Sequence[str], names: Sequence[str] | None, span: Span, progress: Progress
) -> Watched:
    """Find the stream that holds the references, and the responses when they were named."""
    wanted = set(references if names is None else log.names(names))
    for grid in watched_grids(log, names, span, progress=progress):
        if wanted <= set(grid.names):
            # Known before a sample of a large log is read.
            PAIRS.require_fitting(len(grid.names), SHORTEST_SEGMENT)
            return grid
    return on_one_grid(log, sorted(wanted), span, progress=progress)


def without_constant(spectra: SpectraT, watched: Watched, *, keep: Sequence[str]) -> SpectraT:
    """Leave out channels that never changed: their spectra are zero, and a table of zeros hides the rest."""
    constant = dict.fromkeys(name for name in watched.constant() if name not in keep)
    if not constant:
        return spectra
    moving = [channel.name for channel in spectra.channels if channel.name not in constant]
    if not moving:
        raise EstimateError("no channel changes, so there is nothing to make a spectrum of")
    note = f"channels that never change are left out: {some_of(list(constant))}"
    chosen = spectra.select(moving)
    return replace(chosen, provenance=chosen.provenance.with_notes(note))
