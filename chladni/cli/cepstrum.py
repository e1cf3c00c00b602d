"""``chladni cepstrum``: what repeats in a spectrum."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.signals.cepstrum import Cepstrum

MOST_PEAKS = 5


@opens_files
def cepstrum(
    log: options.Log,
    *,
    channel: options.Channels = None,
    kind: Annotated[
        Literal["real", "power"], typer.Option(help="Of ln abs(X), or the square of that of its power.")
    ] = "real",
    resolution: options.Resolution = None,
    part: options.Part,
    opener: Opener,
    targets: options.Targets,
) -> None:
    """Cepstrum: echoes, and families of harmonics or sidebands, as one peak each."""
    from chladni.apps.cepstrum import cepstrum_document, measure_cepstra
    from chladni.apps.findings import reading_sentences
    from chladni.signals.study import Study

    out = targets.output([log, opener.setup])
    with opener(log) as opened, out.progress(log.name) as progress:
        found = measure_cepstra(
            opened,
            channels=channel,
            kind=kind,
            resolution_hz=resolution,
            span=part.span(),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    for one in found.cepstra:
        _print_peaks(out, one)
    out.lines((*told, *found.notes))
    study = Study(title=log.name, cepstra=found.cepstra, findings=(*told, *found.notes))
    out.csv(found.cepstra)
    out.pictures(study, figures=targets.figures, report=targets.report)
    out.json(cepstrum_document, found)


def _print_peaks(out: Output, found: "Cepstrum") -> None:
    out.channel_table(
        f"{found.kind.capitalize()} cepstrum: {counted(found.provenance.averages, 'average')}, quefrencies up to "
        f"{number(1e3 * float(found.quefrency_s[-1]))} ms",
        ["channel", "peaks, the highest first [ms]", "one over them [Hz]"],
        [
            [
                channel.name,
                ", ".join(number(1e3 * peak_s) for peak_s in peaks_s[:MOST_PEAKS]) or "-",
                ", ".join(number(1 / peak_s) for peak_s in peaks_s[:MOST_PEAKS]) or "-",
            ]
            for channel, peaks_s in zip(found.channels, found.peaks_s, strict=True)
        ],
    )
