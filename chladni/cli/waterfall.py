"""``chladni waterfall``: how the spectrum changes as time goes on."""

from typing import TYPE_CHECKING

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, unit
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.signals.waterfall import Waterfall


@opens_files
def waterfall(
    log: options.Log,
    *,
    channel: options.Channels = None,
    averages: options.Averages,
    cut: options.Cut,
    part: options.Part,
    opener: Opener,
    log_frequency: options.LogFrequency = False,
    targets: options.Targets,
) -> None:
    """Spectra over time: how strong each frequency is in each slice of the log."""
    from chladni.apps.findings import reading_sentences
    from chladni.apps.waterfalls import measure_waterfalls, waterfalls_document
    from chladni.signals.shown_units import require_units
    from chladni.signals.study import Study

    looks = options.Looks(log_frequency=log_frequency)
    out = targets.output([log, opener.setup], looks)
    with opener(log) as opened, out.progress(log.name) as progress:
        require_units(opened.channels, cut.unit)
        whole = measure_waterfalls(
            opened, channels=channel, averaging=averages.averaging(), span=part.span(), progress=progress
        )
        told = reading_sentences(opened, everything=channel is None)
    found = cut.of(whole)
    for one in found:
        _print_slices(out, one)
    findings = (*told, *dict.fromkeys(note for one in found for note in one.provenance.notes))
    out.lines(findings)
    out.csv(found)
    study = Study(title=log.name, waterfalls=found, findings=findings)
    out.pictures(study, figures=targets.figures, report=targets.report, looks=looks)
    out.json(waterfalls_document, found)


def _print_slices(out: Output, found: "Waterfall") -> None:
    import numpy as np

    from chladni.apps.waterfalls import slice_rms

    rms = slice_rms(found)
    known = np.where(np.isfinite(rms), rms, -1.0)
    spacing_s = float(np.median(np.diff(found.time_s))) if found.time_s.size > 1 else 0.0
    spacing_hz = float(found.frequency_hz[1] - found.frequency_hz[0])
    rows = []
    for row, channel in enumerate(found.channels):
        strongest = int(known[row].argmax())
        line = int(np.nan_to_num(found.values[row, strongest]).argmax())
        numbers = (*np.nanquantile(rms[row], [0.0, 0.5, 1.0]).tolist(), float(found.time_s[strongest]))
        rows.append(
            [channel.name, *map(number, numbers), number(float(found.frequency_hz[line])), unit(channel.unit)]
        )
    apart = f"{counted(found.time_s.size, 'slice')} {number(spacing_s)} s apart, lines {number(spacing_hz)} Hz apart"
    out.channel_table(
        f"{apart}: RMS of a slice",
        ["channel", "least", "median", "greatest", "at [s]", "strongest line there [Hz]", "unit"],
        rows,
    )
