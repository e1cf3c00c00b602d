"""``chladni delay``: how much later motion arrives."""

from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, with_error

if TYPE_CHECKING:
    from chladni.signals.cross_correlation import TimeDelays

MS = 1e3


@opens_files
def delay(
    log: options.Log,
    *,
    reference: Annotated[
        str, typer.Option(metavar="NAME", help="Channel that the others are held against.", show_default=False)
    ],
    response: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Only this channel; may be repeated. All of its unit if not given.",
            show_default=False,
        ),
    ] = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LO-HI", help="Frequencies to use, in Hz.", show_default=False),
    ] = None,
    longest: Annotated[
        float | None,
        typer.Option(metavar="S", help="Longest delay; a tenth of the log if not given.", show_default=False),
    ] = None,
    resolution: options.Resolution = None,
    start: options.Start = None,
    end: options.End = None,
    join: options.Join = "auto",
    opener: Opener,
    json: options.Json = None,
    figures: options.Figures = None,
) -> None:
    """Time delays between points, with their uncertainty."""
    from chladni.apps.delay import log_delays
    from chladni.apps.documents import delay_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span

    out = Output.of_log([log, opener.setup], json=json, figures=figures)
    with opener(log) as opened:
        found = log_delays(
            opened,
            reference=reference,
            responses=response,
            band_hz=band,
            longest_delay_s=longest,
            resolution_hz=resolution,
            span=Span(start_s=start, end_s=end, join=join),
        )
        told = reading_sentences(opened, everything=False)
    _print_delays(out, found)
    out.lines((*told, *found.notes))
    if figures is not None:
        from chladni.viewers.figures.correlation import delay_figures

        out.figures("delay", delay_figures(found), figures)
    out.json(delay_document, found)


def _print_delays(out: Output, found: "TimeDelays") -> None:
    out.channel_table(
        f"Delay after {found.reference.name}, from {number(found.band_hz[0])} to {number(found.band_hz[1])} Hz",
        ["channel", "delay [ms]", "mean coherence", "sign"],
        [
            [
                channel.name,
                with_error(MS * float(found.delay_s[row]), MS * float(found.std_s[row])),
                number(float(found.coherence[row]), digits=3),
                "opposite" if found.inverted[row] else "same",
            ]
            for row, channel in enumerate(found.responses)
        ],
    )
