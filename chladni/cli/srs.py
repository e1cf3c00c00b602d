"""``chladni srs``: what a shock does to what it shakes."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, unit

if TYPE_CHECKING:
    from chladni.signals.shock_response import ShockResponse


@opens_files
def srs(
    log: options.Log,
    *,
    channel: options.Channels = None,
    q: Annotated[
        float, typer.Option("--q", metavar="Q", help="Amplification at resonance: 10 is 5 % damping.")
    ] = 10.0,
    quantity: Annotated[
        Literal["absolute-acceleration", "relative-displacement", "pseudo-velocity"],
        typer.Option(help="The response of the oscillators that is judged."),
    ] = "absolute-acceleration",
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="LO-HI",
            help="Natural frequencies, in Hz; from one over the log's length to a tenth of the rate if not given.",
            show_default=False,
        ),
    ] = None,
    lines: Annotated[int, typer.Option(metavar="N", help="Natural frequencies an octave.")] = 12,
    offset: Annotated[
        Literal["first", "median", "keep"],
        typer.Option(help="What is taken off, so that oscillators begin at rest: first sample, median, nothing."),
    ] = "first",
    start: options.Start = None,
    end: options.End = None,
    opener: Opener,
    json: options.Json = None,
    csv: options.Csv = None,
    figures: options.Figures = None,
) -> None:
    """Shock response spectra: the largest response of oscillators of every frequency."""
    from chladni.apps.documents import shock_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span
    from chladni.apps.srs import shock_responses

    out = Output.of_log([log, opener.setup], json=json, csv=csv, figures=figures)
    with opener(log) as opened, out.progress(log.name) as progress:
        found = shock_responses(
            opened,
            channels=channel,
            span=Span(start_s=start, end_s=end),
            q=q,
            quantity=quantity,
            band_hz=band,
            lines_an_octave=lines,
            offset=offset,
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    for one in found:
        _print_highest(out, one)
    out.lines((*told, *(note for one in found for note in one.notes)))
    out.csv(found)
    if figures is not None:
        from chladni.viewers.figures.srs import shock_figures

        out.figures("srs", shock_figures(found), figures)
    out.json(shock_document, found)


def _print_highest(out: Output, found: "ShockResponse") -> None:
    # Worked out of all channels each time it's asked for.
    maximax, rows = found.maximax, range(len(found.channels))
    lines = maximax.argmax(axis=1)
    low_hz, high_hz = (number(float(found.frequency_hz[end])) for end in (0, -1))
    out.channel_table(
        f"Shock response, {found.quantity.replace('-', ' ')}, Q = {number(found.q)}, from {low_hz} to {high_hz} Hz",
        ["channel", "maximax", "at [Hz]", "positive", "negative", "unit", "taken off first"],
        [
            [
                found.channels[row].name,
                number(float(maximax[row, lines[row]])),
                number(float(found.frequency_hz[lines[row]])),
                number(float(found.positive[row].max())),
                number(float(found.negative[row].max())),
                unit(found.channels[row].unit),
                number(float(found.offset[row])),
            ]
            for row in rows
        ],
    )
