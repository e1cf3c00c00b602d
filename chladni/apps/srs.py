"""Shock response spectra of a log's accelerations."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

from chladni.apps.sources import Progress, Span, Watched, moving_only, no_progress, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.shock_response import ShockResponse
from chladni.signals.time_series import TimeSeries
from chladni.spectral.blocks import leading_part
from chladni.spectral.srs import ACCELERATIONS, RATE_OVER_HIGHEST, srs


def shock_responses(
    log: Log, *, channels: Sequence[str] | None, span: Span, progress: Progress = no_progress, **options: Any
) -> tuple[ShockResponse, ...]:
    """Compute the spectra of named channels, or of all accelerations, one value for each sampling grid.

    Parameters
    ----------
    log
        Read block by block when it's large.
    channels
        Message paths; None for every channel in m/s^2 or rad/s^2 that changes.
    span
        Which part of the log.
    progress
        Called with the share done, 0 to 1.
    options
        As for `srs`.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When there is no acceleration, or an option of `srs` is out of its range.
    """
    found: list[tuple[ShockResponse, Watched]] = []
    units: set[str] = set()
    for grid in watched_grids(log, channels, span, progress=progress):
        lead, blocks = leading_part(grid, 1)
        units |= {channel.unit for channel in lead[0].channels}
        names = [c.name for c in lead[0].channels if channels is not None or c.unit in ACCELERATIONS]
        if names:
            try:
                found.append((_of_grid((one.select(names) for one in blocks), grid.duration_s, options), grid))
            except EstimateError as error:
                raise EstimateError(f"{log.path.name}: {error}") from error
    if not found:
        raise EstimateError(
            f"{log.path.name}: no channel is an acceleration; units are {some_of(sorted(units))}: name a channel "
            "(--channel), or give its unit in a setup file (--setup)"
        )
    # Of channels that never change each oscillator stays at rest.
    moving = () if channels is not None else moving_only(found)
    return moving or tuple(
        replace(one, notes=(*one.notes, *grid.still_note([c.name for c in one.channels]))) for one, grid in found
    )


def _of_grid(blocks: Iterator[TimeSeries], duration_s: float, options: dict[str, Any]) -> ShockResponse:
    """Compute the spectra of one sampling grid, which is a single block where it fits in memory."""
    first, second = next(blocks), next(blocks, None)
    if second is None:
        return srs(first, **options)
    if options.get("band_hz") is None:
        options = options | {"band_hz": (1 / duration_s, first.sample_rate_hz / RATE_OVER_HIGHEST)}
    return srs(chain((first, second), blocks), **options)
