"""``chladni psd``: which frequencies, how strong."""

from typing import TYPE_CHECKING

from chladni.cli import options
from chladni.cli.logs import told_apart
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.apps.documents import Document
    from chladni.apps.unit_peaks import UnitPeaks
    from chladni.signals.power_spectral_density import PowerSpectralDensity
    from chladni.signals.study import Study


@opens_files
def psd(
    logs: options.Logs,
    *,
    channel: options.Channels = None,
    averages: options.Averages,
    cut: options.Cut,
    part: options.Part,
    opener: Opener,
    targets: options.Targets,
    looks: options.Looks,
) -> None:
    """Averaged power spectral densities with named peaks; of several logs over one another."""
    from chladni.apps.documents import psd_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.psd import densities
    from chladni.apps.unit_peaks import unit_peaks
    from chladni.signals.shown_units import require_units
    from chladni.signals.study import Study

    out = targets.output([*logs, opener.setup], looks)
    studies: list[Study] = []
    for title, opened, progress in told_apart(logs, opener, out):
        require_units(opened.channels, cut.unit)
        spectra = densities(
            opened, channels=channel, averaging=averages.averaging(), span=part.span(), progress=progress
        )
        told = reading_sentences(opened, everything=channel is None)
        found = cut.of(spectra)
        named = [group for density in found for group in unit_peaks(density)]
        notes = tuple(note for density in found for note in density.provenance.notes)
        peaks = tuple(peak for group in named for peak in group.peaks)
        study = Study(title=title, densities=found, peaks=peaks, geometry=opened.geometry, findings=told + notes)
        _print_study(out, study, named)
        studies.append(study)
    out.csv([density for study in studies for density in study.densities])
    out.pictures(*studies, figures=targets.figures, report=targets.report, looks=looks)
    out.documents(psd_document, [(study.title, (study.densities,)) for study in studies])


def _print_study(out: Output, study: "Study", named: "list[UnitPeaks]") -> None:
    from chladni.apps.documents import psd_document

    document = psd_document(study.densities)
    for density in study.densities:
        _print_levels(out, density, document)
    for group in named:
        _print_peaks(out, group)
    out.lines(study.findings)


def _print_levels(out: Output, density: "PowerSpectralDensity", document: "Document") -> None:
    account = density.provenance
    spacing_hz = float(density.frequency_hz[1] - density.frequency_hz[0])
    names = {channel.name for channel in density.channels}
    out.channel_table(
        f"Levels: {counted(account.averages, 'average')} ({account.effective_averages:.1f} effective) of "
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
        ["strongest in", "frequency [Hz]", "density", "unit", "seen in"],
        [
            [
                peak.channels[0],
                with_error(peak.frequency_hz, peak.frequency_std_hz),
                with_error(peak.height, peak.height_std),
                unit(peak.unit),
                counted(len(peak.channels), "channel"),
            ]
            for peak in found.peaks
        ],
    )
