"""Envelope spectra of a log, and their document."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from chladni.apps.documents import Document, finite, plain
from chladni.apps.sources import Progress, Span, no_progress, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.envelope import EnvelopeSpectrum, Kurtogram
from chladni.signals.errors import EstimateError
from chladni.spectral.bearings import Bearing, fault_frequencies_hz
from chladni.spectral.envelope import BandChoice, chosen_bands, envelope_spectra


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogEnvelopes:
    """Envelope spectra of a log's channels, and what was left out, in sentences."""

    spectra: tuple[EnvelopeSpectrum, ...]
    notes: tuple[str, ...]


def measure_envelopes(
    log: Log,
    *,
    channels: Sequence[str] | None = None,
    band_hz: tuple[float, float] | None = None,
    resolution_hz: float | None = None,
    bearing: Bearing | None = None,
    shaft_hz: float | None = None,
    span: Span | None = None,
    progress: Progress = no_progress,
) -> LogEnvelopes:
    """Compute the envelope spectra of a log's channels, see `chladni.spectral.envelope.envelope`.

    A log is read twice when its bands are to be chosen: once for the kurtogram, once for the envelopes.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel has an envelope spectrum.
    SetupError
        When only one of bearing and shaft is known.
    """
    span, faults_hz = span or Span(), fault_frequencies_hz(bearing, shaft_hz)
    spectra: list[EnvelopeSpectrum] = []
    notes: list[str] = []
    choices = {} if band_hz else _choices(log, channels, span, faults_hz, notes)
    for grid in watched_grids(log, channels, span, progress=progress):
        bands = dict.fromkeys(grid.names, BandChoice(band_hz=band_hz)) if band_hz else choices
        try:
            found = envelope_spectra(
                grid, bands, length_s=grid.duration_s, resolution_hz=resolution_hz, faults_hz=faults_hz
            )
            constant = grid.constant()
            spectra += [one for one in found if one.channel.name not in constant]
        except EstimateError as error:
            notes.append(f"{some_of(grid.names)}: {error}")
    if not spectra:
        raise EstimateError(f"{log.path.name}: no envelope spectrum could be made: {'; '.join(notes)}")
    notes += [note for one in spectra for note in one.notes]
    return LogEnvelopes(spectra=tuple(spectra), notes=tuple(dict.fromkeys(notes)))


def _choices(
    log: Log, channels: Sequence[str] | None, span: Span, faults_hz: Mapping[str, float], notes: list[str]
) -> dict[str, BandChoice]:
    """Bands by the name of their channel; those that never change have none, and a note says so."""
    found: dict[str, BandChoice] = {}
    for grid in watched_grids(log, channels, span):
        try:
            found |= chosen_bands(grid, faults_hz)
        except EstimateError as error:
            notes.append(f"{some_of(grid.names)}: {error}")
        constant = grid.constant()
        if constant:
            notes.append(f"channels that never change are left out: {some_of(constant)}")
            found = {name: choice for name, choice in found.items() if name not in constant}
    return found


def envelope_document(found: LogEnvelopes) -> Document:
    """Document of ``chladni envelope``."""
    return {
        "format": "chladni.envelope/1",
        "channels": [_channel(one) for one in found.spectra],
        "notes": list(found.notes),
    }


def _channel(found: EnvelopeSpectrum) -> Document:
    return {
        "name": found.channel.name,
        "unit": found.channel.unit,
        "low_hz": found.band_hz[0],
        "high_hz": found.band_hz[1],
        "spectral_kurtosis": finite(found.band_kurtosis),
        "envelope_unit": found.density.channels[0].unit,
        "mean": found.mean,
        "frequency_hz": plain(found.frequency_hz),
        "amplitude": plain(found.amplitude),
        "peaks": [
            {"frequency_hz": peak.frequency_hz, "frequency_std_hz": finite(peak.frequency_std_hz)}
            for peak in found.peaks
        ],
        "faults": [asdict(fault) for fault in found.faults],
        "kurtogram": None if found.kurtogram is None else _kurtogram(found.kurtogram),
    }


def _kurtogram(found: Kurtogram) -> Document:
    return {
        "low_hz": plain(found.low_hz),
        "high_hz": plain(found.high_hz),
        "spectral_kurtosis": plain(found.kurtosis[0]),
        "spectral_kurtosis_std": plain(found.std[0]),
    }
