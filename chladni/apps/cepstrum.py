"""Cepstra of a log, and their document."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.apps.documents import Document, plain
from chladni.apps.sources import Progress, Span, no_progress, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.cepstrum import Cepstrum, CepstrumKind
from chladni.signals.errors import EstimateError
from chladni.spectral.cepstrum import cepstrum_of, cepstrum_spectra


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogCepstra:
    """Cepstra of a log's channels, one value for each sampling grid, and what was left out, in sentences."""

    cepstra: tuple[Cepstrum, ...]
    notes: tuple[str, ...]


def measure_cepstra(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    kind: CepstrumKind = "real",
    resolution_hz: float | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> LogCepstra:
    """Compute the cepstra of a log's channels, see `chladni.spectral.cepstrum.cepstrum`.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel has a cepstrum.
    """
    found: list[Cepstrum] = []
    notes: list[str] = []
    for grid in watched_grids(log, channels, span or Span(), progress=progress):
        try:
            density, rate_hz = cepstrum_spectra(grid, resolution_hz=resolution_hz)
            constant = grid.constant()
            if constant:
                notes.append(f"channels that never change are left out: {some_of(constant)}")
            moving = [channel.name for channel in density.channels if channel.name not in constant]
            if moving:
                found.append(cepstrum_of(density.select(moving), kind=kind, sample_rate_hz=rate_hz))
                notes += found[-1].provenance.notes
        except EstimateError as error:
            notes.append(f"{some_of(grid.names)}: {error}")
    if not found:
        raise EstimateError(f"{log.path.name}: no cepstrum could be made: {'; '.join(notes)}")
    return LogCepstra(cepstra=tuple(found), notes=tuple(dict.fromkeys(notes)))


def cepstrum_document(found: LogCepstra) -> Document:
    """Document of ``chladni cepstrum``."""
    return {
        "format": "chladni.cepstrum/1",
        "kind": found.cepstra[0].kind,
        "channels": [_channel(one, row) for one in found.cepstra for row in range(len(one.channels))],
        "notes": list(found.notes),
    }


def _channel(found: Cepstrum, row: int) -> Document:
    return {
        "name": found.channels[row].name,
        "unit": found.channels[row].unit,
        "averages": found.provenance.averages,
        "quefrency_s": plain(found.quefrency_s),
        "cepstrum": plain(found.values[row]),
        "std": plain(found.std),
        "peaks": [
            {"quefrency_s": peak_s, "frequency_hz": 1 / peak_s, "cepstrum": found.at(row, peak_s)}
            for peak_s in found.peaks_s[row]
        ],
    }
