"""Levels and severity of a log, read once, and their document."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.apps.documents import Document, finite, plain
from chladni.apps.sources import Progress, Span, Watched, no_progress, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.levels import Levels, RunningLevels, Severity
from chladni.spectral.blocks import leading_part, sum_up
from chladni.spectral.levels import LevelsAccumulator
from chladni.spectral.severity import Machine, SeverityAccumulator, is_motion

Bands = Sequence[tuple[float, float]] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogLevels:
    """Levels of a log's channels, one value for each sampling grid, and the severity of its motions.

    Attributes
    ----------
    levels
        One for each sampling grid.
    severities
        One for each grid with accelerations or velocities that could be judged.
    notes
        What was left out, and what to know, in sentences.
    """

    levels: tuple[Levels, ...]
    severities: tuple[Severity, ...]
    notes: tuple[str, ...]


def measure_levels(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    bands_hz: Bands = None,
    running_s: float | None = None,
    machine: Machine | None = None,
    slow: bool = False,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> LogLevels:
    """Measure the levels of a log's channels, and the severity of its accelerations and velocities.

    Parameters
    ----------
    log
        Read block by block when it's large.
    channels
        Message paths; None for all that change at all.
    bands_hz, running_s
        See `chladni.spectral.levels.levels`.
    machine, slow
        See `chladni.spectral.severity.severity`.
    span
        Part of the log.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel has levels.
    """
    levels: list[Levels] = []
    severities: list[Severity] = []
    notes: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            found, judged = _of_grid(grid, bands_hz, running_s, machine, slow, notes)
        except EstimateError as error:
            notes.append(f"{some_of(grid.names)}: {error}")
            continue
        constant = set() if channels is not None else set(grid.constant())
        notes += grid.still_note(grid.names) if channels is not None else ()
        if constant:
            notes.append(f"channels that never change are left out: {some_of(sorted(constant))}")
        moving = [channel.name for channel in found.channels if channel.name not in constant]
        if moving:
            levels.append(found.select(moving))
            notes += found.notes
        if judged is not None and (seen := [one.name for one in judged.channels if one.name not in constant]):
            severities.append(judged.select(seen))
            notes += judged.notes
    if not levels:
        raise EstimateError(f"{log.path.name}: nothing has levels: {'; '.join(notes)}")
    return LogLevels(levels=tuple(levels), severities=tuple(severities), notes=tuple(dict.fromkeys(notes)))


def _of_grid(
    grid: Watched, bands_hz: Bands, running_s: float | None, machine: Machine | None, slow: bool, notes: list[str]
) -> tuple[Levels, Severity | None]:
    """Both measures of one sampling grid in one reading; a note says why there is no severity."""
    lead, blocks = leading_part(grid, 1)
    first = lead[0]
    measured = LevelsAccumulator(first.channels, first.sample_rate_hz, bands_hz=bands_hz, running_s=running_s)
    judged = None
    if any(is_motion(channel) for channel in first.channels):
        try:
            judged = SeverityAccumulator(first.channels, first.sample_rate_hz, machine=machine, slow=slow)
        except EstimateError as error:
            notes.append(f"no severity of {some_of(grid.names)}: {error}")
    sum_up(blocks, measured, *([] if judged is None else [judged]))
    found = measured.result()
    try:
        return found, None if judged is None else judged.result()
    except EstimateError as error:
        notes.append(f"no severity of {some_of(grid.names)}: {error}")
        return found, None


def levels_document(found: LogLevels) -> Document:
    """Document of ``chladni levels``."""
    judged = {channel.name: (one, row) for one in found.severities for row, channel in enumerate(one.channels)}
    return {
        "format": "chladni.levels/1",
        "channels": [
            {
                "name": channel.name,
                "unit": channel.unit,
                "bands": [_band(one, row, column) for column in range(len(one.bands_hz))],
                "severity": _severity(*judged[channel.name]) if channel.name in judged else None,
            }
            for one in found.levels
            for row, channel in enumerate(one.channels)
        ],
        "notes": list(found.notes),
    }


def _band(levels: Levels, row: int, column: int) -> Document:
    low_hz, high_hz = levels.bands_hz[column]
    names = ("mean", "rms", "rms_std", "peak", "peak_to_peak", "crest_factor", "skewness", "kurtosis")
    return {
        "low_hz": low_hz,
        "high_hz": high_hz,
        "samples": int(levels.samples[row, column]),
        **{name: finite(float(getattr(levels, name)[row, column])) for name in names},
        "running": _running(levels.running, row, column),
    }


def _running(running: RunningLevels, row: int, column: int) -> Document:
    return {
        "window_s": running.window_s,
        "time_s": plain(running.time_s),
        **{name: plain(getattr(running, name)[row, column]) for name in ("rms", "peak", "kurtosis")},
    }


def _severity(found: Severity, row: int) -> Document:
    return {
        "low_hz": found.band_hz[0],
        "high_hz": found.band_hz[1],
        "velocity_mm_s": finite(float(found.velocity_mm_s[row])),
        "velocity_std_mm_s": finite(float(found.velocity_std_mm_s[row])),
        "displacement_um": finite(float(found.displacement_um[row])),
        "displacement_std_um": finite(float(found.displacement_std_um[row])),
        "machine": found.machine,
        "boundaries_mm_s": list(found.boundaries_mm_s) or None,
        "boundaries_um": list(found.boundaries_um) or None,
        "velocity_zone": _of_row(found.velocity_zones, row),
        "displacement_zone": _of_row(found.displacement_zones, row),
        "zone": _of_row(found.zones, row),
    }


def _of_row(zones: tuple[str, ...], row: int) -> str | None:
    return zones[row] or None if zones else None
