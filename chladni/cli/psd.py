"""``chladni psd``: which frequencies, how strong."""

from typing import TYPE_CHECKING

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_drawn
from chladni.cli.words import number, unit, with_error

if TYPE_CHECKING:
    from chladni.apps.documents import Document
    from chladni.apps.unit_peaks import UnitPeaks
    from chladni.signals.power_spectral_density import PowerSpectralDensity


@opens_files
def psd(
    log: options.Log,
    *,
    channel: options.Channels = None,
    resolution: options.Resolution = None,
    window: options.Window = None,
    overlap: options.Overlap = None,
    fmax: options.Fmax = None,
    start: options.Start = None,
    end: options.End = None,
    opener: Opener,
    json: options.Json = None,
    csv: options.Csv = None,
    figures: options.Figures = None,
    report: options.Report = None,
    db: options.Decibels = False,
    log_frequency: options.LogFrequency = False,
) -> None:
    """Averaged power spectral densities with named peaks."""
    from chladni.apps.documents import psd_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span
    from chladni.apps.spectra import Averaging, densities
    from chladni.apps.unit_peaks import unit_peaks
    from chladni.signals.study import Study
    from chladni.spectral.bands import up_to

    out = Output.of_log([log, opener.setup], json=json, csv=csv, figures=figures, report=report)
    require_drawn({"--db": db, "--log-frequency": log_frequency}, [figures, report])
    with opener(log) as opened, out.progress(log.name) as progress:
        found = densities(
            opened,
            channels=channel,
            averaging=Averaging(resolution_hz=resolution, window=window, overlap=overlap),
            span=Span(start_s=start, end_s=end),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
        geometry = opened.geometry
    found = tuple(up_to(one, fmax) for one in found)
    document = psd_document(found)
    named = [group for density in found for group in unit_peaks(density)]
    for density in found:
        _print_levels(out, density, document)
    for group in named:
        _print_peaks(out, group)
    notes = tuple(note for density in found for note in density.provenance.notes)
    out.lines((*told, *notes))
    peaks = tuple(peak for group in named for peak in group.peaks)
    study = Study(title=log.name, densities=found, peaks=peaks, geometry=geometry, findings=told + notes)
    out.csv(found)
    out.pictures(study, figures=figures, report=report, decibels=db, log_frequency=log_frequency)
    out.json(document)


def _print_levels(out: Output, density: "PowerSpectralDensity", document: "Document") -> None:
    account = density.provenance
    spacing_hz = float(density.frequency_hz[1] - density.frequency_hz[0])
    names = {channel.name for channel in density.channels}
    out.channel_table(
        f"Levels: {account.averages} averages ({account.effective_averages:.1f} effective) of "
        f"{account.segment_s:.6g} s, window {account.window}, lines {number(spacing_hz)} Hz apart",
        ["channel", "RMS", "unit", "highest peak [Hz]", "density there", "unit"],
        [
            [one["name"], number(one["rms"]), unit(one["channel_unit"]), *_highest(one)]
            for one in document["channels"]
            if one["name"] in names
        ],
    )


def _highest(channel: "Document") -> list[str]:
    if not channel["peaks"]:
        return ["-", "-", unit(channel["psd_unit"])]
    peak = channel["peaks"][0]
    return [number(peak["frequency_hz"], digits=6), number(peak["psd"]), unit(channel["psd_unit"])]


def _print_peaks(out: Output, found: "UnitPeaks") -> None:
    from chladni.spectral.peaks import MOST_PEAKS

    where = "" if found.unit == "1" else f" in {found.unit}"
    judged = f", above {number(found.above_hz)} Hz" if found.above_hz else ""
    if not found.peaks:
        out.line(f"No peak stands out of the scatter{where}{judged}.")
        return
    at_most = f", {MOST_PEAKS} at most" if len(found.peaks) == MOST_PEAKS else ""
    out.channel_table(
        f"Peaks{where}, the highest first{at_most}{judged}",
        ["strongest in", "frequency [Hz]", "density", "unit"],
        [
            [
                _names(peak.channels),
                with_error(peak.frequency_hz, peak.frequency_std_hz),
                with_error(peak.height, peak.height_std),
                unit(peak.unit),
            ]
            for peak in found.peaks
        ],
    )


def _names(channels: tuple[str, ...]) -> str:
    """Name the strongest and count the others, whose names would fill the table."""
    return channels[0] if len(channels) == 1 else f"{channels[0]} and {len(channels) - 1} more"
