"""``chladni ods``: how all points move together as the machine runs."""

from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import angle, number, unit, with_error

if TYPE_CHECKING:
    from chladni.signals.deflection_shapes import DeflectionShapes


@opens_files
def ods(
    log: options.Log,
    *,
    reference: Annotated[str, typer.Option(metavar="NAME", help="Channel whose phase is 0.", show_default=False)],
    channel: options.Channels = None,
    frequency: Annotated[
        list[float] | None,
        typer.Option(metavar="HZ", help="Where; may be repeated. The named peaks if not given.", show_default=False),
    ] = None,
    resolution: options.Resolution = None,
    start: options.Start = None,
    end: options.End = None,
    join: options.Join = "auto",
    opener: Opener,
    json: options.Json = None,
    figures: options.Figures = None,
) -> None:
    """Operating deflection shapes: amplitude and phase of all points at chosen frequencies."""
    from chladni.apps.documents import deflection_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.ods import log_deflection
    from chladni.apps.sources import Span
    from chladni.apps.spectra import Averaging

    out = Output.of_log([log, opener.setup], json=json, figures=figures)
    with opener(log) as opened, out.progress(log.name) as progress:
        found = log_deflection(
            opened,
            reference=reference,
            channels=channel,
            frequencies_hz=frequency,
            averaging=Averaging(resolution_hz=resolution),
            span=Span(start_s=start, end_s=end, join=join),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    _print_shapes(out, found)
    out.lines((*told, *found.provenance.notes))
    if figures is not None:
        from chladni.viewers.figures.ods import deflection_figures

        out.figures("ods", deflection_figures(found), figures)
    out.json(deflection_document, found)


def _print_shapes(out: Output, found: "DeflectionShapes") -> None:
    import numpy as np

    for row, frequency_hz in enumerate(found.frequency_hz.tolist()):
        out.channel_table(
            f"At {number(frequency_hz, digits=6)} Hz, phases over {found.reference}",
            ["channel", "RMS", "unit", "phase [deg]", "coherence"],
            [
                [
                    channel.name,
                    with_error(float(abs(found.values[row, column])), float(found.std[row, column])),
                    unit(channel.unit),
                    angle(float(np.angle(found.values[row, column], deg=True))),
                    number(float(found.coherence[row, column]), digits=3),
                ]
                for column, channel in enumerate(found.channels)
            ],
        )
