"""Spectra over time of a log, and their document."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from chladni.apps.documents import Document, finite, plain
from chladni.apps.sources import Progress, Span, no_progress, watched_grids
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.arrays import Real
from chladni.signals.errors import ChladniError, EstimateError
from chladni.signals.waterfall import Waterfall
from chladni.spectral.waterfall import waterfall


def measure_waterfalls(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    averaging: Averaging | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> tuple[Waterfall, ...]:
    """Compute the spectra over time of a log's channels, one value for each sampling grid.

    Channels that never change are left out, and grids too short for a spectrum; notes say so.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no grid gives a spectrum.
    """
    given = averaging or Averaging()
    chosen = {"resolution_hz": given.resolution_hz, "window": given.window, "overlap": given.overlap}
    options: dict[str, Any] = {name: value for name, value in chosen.items() if value is not None}
    found: list[Waterfall] = []
    left_out: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            whole = waterfall(grid, **options)
        except ChladniError as error:
            left_out.append(f"{some_of(grid.names)}: {error}")
            continue
        constant = grid.constant()
        if constant:
            left_out.append(f"channels that never change are left out: {some_of(constant)}")
        if moving := [channel.name for channel in whole.channels if channel.name not in constant]:
            found.append(whole.select(moving))
    if not found:
        raise EstimateError(f"{log.path.name}: no spectrum over time could be made: {'; '.join(left_out)}")
    return (replace(found[0], provenance=found[0].provenance.with_notes(*left_out)), *found[1:])


def slice_rms(found: Waterfall) -> Real:
    """``[channel, time]`` RMS of each slice over all lines that are left; NaN where samples are missing."""
    spacing_hz = float(found.frequency_hz[1] - found.frequency_hz[0])
    return np.asarray(np.sqrt(found.values.sum(axis=2, dtype=np.float64) * spacing_hz))


def waterfalls_document(found: Sequence[Waterfall]) -> Document:
    """Document of ``chladni waterfall``; channels of further sampling grids carry their own axes."""
    channels = []
    for one in found:
        own = {} if one is found[0] else _axes(one)
        channels += [
            {
                "name": channel.name,
                "unit": channel.unit,
                "psd_unit": one.unit_at("values", (row,)),
                "psd": [[finite(float(value)) for value in line] for line in one.values[row]],
                **own,
            }
            for row, channel in enumerate(one.channels)
        ]
    notes = [note for one in found for note in one.provenance.notes]
    return {"format": "chladni.waterfall/1", **_axes(found[0]), "channels": channels, "notes": notes}


def _axes(found: Waterfall) -> Document:
    return {
        "start_time_ns": found.start_time_ns,
        "time_s": plain(found.time_s),
        "frequency_hz": plain(found.frequency_hz),
    }
