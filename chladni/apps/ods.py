"""Operating deflection shapes of a log."""

from collections.abc import Sequence
from dataclasses import replace

from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging, grid_of, require_moving, without_constant
from chladni.io.log import Log
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.errors import EstimateError
from chladni.spectral.ods import deflection_shapes


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
    grid = grid_of(log, references, names, span, progress)
    try:
        spectra = averaging.spectra(grid, references)
        require_moving(grid, references)
        spectra = without_constant(spectra, grid, keep=references)
        spectra = replace(spectra, provenance=spectra.provenance.with_notes(*grid.notes))
        return deflection_shapes(spectra, references=references[0], frequencies_hz=frequencies_hz)
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error
