"""Octave bands of a log, and their document."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.apps.documents import Document, finite
from chladni.apps.sources import Progress, Span, Watched, no_progress, watched_grids
from chladni.apps.spectra import without_constant
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.levels import DECIBEL_REFERENCES, OctaveLevels, decibels
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.spectral.blocks import leading_part
from chladni.spectral.octaves import lowest_band_hz, octave_density, octave_resolution_hz, octaves
from chladni.spectral.weighting import Weighting


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogOctaves:
    """Octave bands of a log's channels, one value for each sampling grid, and what was left out, in sentences."""

    octaves: tuple[OctaveLevels, ...]
    notes: tuple[str, ...]


def measure_octaves(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    fraction: int = 3,
    weighting: Weighting | None = None,
    low_hz: float | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> LogOctaves:
    """Measure the octave bands of a log's channels, see `chladni.spectral.octaves.octaves`.

    Parameters
    ----------
    log
        Read block by block when it's large.
    channels
        Message paths; None for all that change at all.
    fraction, weighting, low_hz
        Bands in an octave, ``A`` or ``C``, and where bands begin.
    span
        Part of the log.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel has a band.
    """
    found: list[OctaveLevels] = []
    notes: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            density, low = _density(grid, fraction, low_hz)
            found.append(octaves(density, fraction=fraction, weighting=weighting, low_hz=low))
        except EstimateError as error:
            notes.append(f"{some_of(grid.names)}: {error}")
    if not found:
        raise EstimateError(f"{log.path.name}: no octave bands could be made: {'; '.join(notes)}")
    notes += [note for one in found for note in one.bands.provenance.notes]
    return LogOctaves(octaves=tuple(found), notes=tuple(dict.fromkeys(notes)))


def _density(grid: Watched, fraction: int, low_hz: float | None) -> tuple[PowerSpectralDensity, float]:
    """Densities of the channels that change, with lines as fine as the bands need, and where these begin."""
    lead, blocks = leading_part(grid, 1)
    resolution_hz = octave_resolution_hz(lead[0].sample_rate_hz, grid.duration_s, fraction=fraction, low_hz=low_hz)
    density = without_constant(octave_density(blocks, resolution_hz=resolution_hz), grid, keep=())
    return density, low_hz or lowest_band_hz(resolution_hz, fraction=fraction)


def octaves_document(found: LogOctaves) -> Document:
    """Document of ``chladni octaves``."""
    first = found.octaves[0]
    return {
        "format": "chladni.octaves/1",
        "fraction": first.fraction,
        "weighting": first.weighting,
        "channels": [_channel(one, row) for one in found.octaves for row in range(len(one.channels))],
        "notes": list(found.notes),
    }


def _channel(found: OctaveLevels, row: int) -> Document:
    channel, bands = found.channels[row], found.bands
    level_db, total_db = found.decibels()[row], decibels(found.total, found.channels)[row]
    return {
        "name": channel.name,
        "unit": channel.unit,
        "decibel_reference": DECIBEL_REFERENCES.get(channel.unit, 1.0),
        "bands": [
            {
                "nominal_hz": float(found.nominal_hz[band]),
                "mid_hz": float(found.mid_hz[band]),
                "low_hz": float(bands.low_hz[band]),
                "high_hz": float(bands.high_hz[band]),
                "rms": finite(float(bands.rms[row, band])),
                "rms_std": finite(float(bands.std[row, band])),
                "level_db": finite(float(level_db[band])),
            }
            for band in range(bands.low_hz.size)
        ],
        "rms": finite(float(found.total[row])),
        "level_db": finite(float(total_db)),
    }
