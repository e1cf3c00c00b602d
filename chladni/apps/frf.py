"""Transfer functions and coherence of a log or a series, in one call."""

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

from numpy.typing import ArrayLike

from chladni.apps.excitation import excitation_names, stored_functions
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging, grid_of, of_series, require_moving, without_constant
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.io.source import SeriesLike, are_numbers, driven_series, log_or_series
from chladni.signals.channel import Names, as_names
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.join import JoinMethod
from chladni.signals.renamed import renamed
from chladni.signals.time_series import TimeSeries
from chladni.spectral.excitation import HAMMER_RANGE
from chladni.spectral.frf import Estimator, frequency_response
from chladni.spectral.windows import Window


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
        How named channels of several sampling grids become one, see `chladni.signals.join.join_resampled`; a
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
        spectra = averaging.spectra(of_series(source, names, span), references)
        return frequency_response(
            spectra,
            references=references,
            responses=responses,
            estimator=estimator,
            hammer_range=hammer_range,
        )
    # A path may be written in more than one way; the channels that come back have one name each.
    references = source.names(references)
    grid = grid_of(source, references, names, span, progress)
    named = None if responses is None else source.names(responses)
    _require_others(references, named)
    try:
        spectra = averaging.spectra(grid, references)
        spectra = replace(spectra, provenance=spectra.provenance.with_notes(*grid.notes))
        require_moving(grid, references)
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
