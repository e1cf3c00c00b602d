"""Shock response spectra of a log's accelerations."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from chladni.apps.sources import Span, moving_channels, still_note
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.shock_response import ShockResponse
from chladni.signals.time_series import TimeSeries
from chladni.spectral.shock import ACCELERATIONS, srs


def shock_responses(
    log: Log, *, channels: Sequence[str] | None, span: Span, **options: Any
) -> tuple[ShockResponse, ...]:
    """Compute the spectra of named channels, or of all accelerations, one value for each sampling grid.

    Parameters
    ----------
    log
        Read into memory.
    channels
        Message paths; None for every channel in m/s^2 or rad/s^2 that changes.
    span
        Which part of the log.
    options
        As for `srs`.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When there is no acceleration, or an option of `srs` is out of its range.
    """
    series = log.read_groups(channels, start_s=span.start_s, end_s=span.end_s)
    if channels is None:
        chosen = [[c.name for c in one.channels if c.unit in ACCELERATIONS] for one in series]
        if not any(chosen):
            units = sorted({channel.unit for one in series for channel in one.channels})
            raise EstimateError(
                f"{log.path.name}: no channel is an acceleration; units are {some_of(units)}: name a channel "
                "(--channel), or give its unit in a setup file (--setup)"
            )
        moving = [
            [name for name in moving_channels(one) if name in names]
            for one, names in zip(series, chosen, strict=True)
        ]
        # Of channels that never change each oscillator stays at rest.
        kept = moving if any(moving) else chosen
        series = tuple(one.select(names) for one, names in zip(series, kept, strict=True) if names)
    try:
        return tuple(_told_still(srs(one, **options), one) for one in series)
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error


def _told_still(found: ShockResponse, series: TimeSeries) -> ShockResponse:
    moving = moving_channels(series)
    still = [channel.name for channel in series.channels if channel.name not in moving]
    return replace(found, notes=(*found.notes, *still_note(still)))
