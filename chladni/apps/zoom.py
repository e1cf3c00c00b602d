"""Zoom into a band of a log, grid by grid."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from chladni.apps.sources import Progress, Span, Watched, moving_only, no_progress, watched_grids
from chladni.io.log import Log
from chladni.signals.errors import EstimateError
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum
from chladni.spectral.zoom import zoom_of_blocks


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
