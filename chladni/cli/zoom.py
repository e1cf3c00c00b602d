"""``chladni zoom``: amplitudes of tones in a narrow band."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum


@opens_files
def zoom(
    log: options.Log,
    *,
    band: Annotated[tuple[float, float], typer.Option(metavar="LO-HI", help="The band, in Hz.", show_default=False)],
    lines: Annotated[int, typer.Option(metavar="N", help="Lines in it.")] = 2000,
    quantity: Annotated[Literal["peak", "rms"], typer.Option(help="What of a tone is told.")] = "peak",
    channel: options.Channels = None,
    window: Annotated[str, typer.Option(metavar="NAME", help="Any SciPy window.")] = "hann",
    start: options.Start = None,
    end: options.End = None,
    opener: Opener,
    json: options.Json = None,
    figures: options.Figures = None,
) -> None:
    """Amplitudes of the whole log on fine lines in a band."""
    from chladni.apps.documents import zoom_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span
    from chladni.apps.zoom import zoomed

    out = Output.of_log([log, opener.setup], json=json, figures=figures)
    with opener(log) as opened, out.progress(log.name) as progress:
        span = Span(start_s=start, end_s=end)
        found = zoomed(
            opened,
            channels=channel,
            span=span,
            progress=progress,
            band_hz=band,
            lines=lines,
            window=window,
            quantity=quantity,
        )
        told = reading_sentences(opened, everything=channel is None)
    _print_highest(out, found)
    out.lines((*told, *dict.fromkeys(note for one in found for note in one.provenance.notes)))
    if figures is not None:
        _save_figures(out, found, figures)
    out.json(zoom_document, found)


def _print_highest(out: Output, found: "Sequence[AmplitudeSpectrum]") -> None:
    first = found[0]
    out.channel_table(
        f"Highest line from {number(float(first.frequency_hz[0]))} to {number(float(first.frequency_hz[-1]))} Hz",
        ["channel", "frequency [Hz]", f"{first.quantity} amplitude", "unit"],
        [
            [
                channel.name,
                number(float(one.frequency_hz[one.values[row].argmax()]), digits=7),
                number(float(one.values[row].max())),
                unit(channel.unit),
            ]
            for one in found
            for row, channel in enumerate(one.channels)
        ],
    )


def _save_figures(out: Output, found: "Sequence[AmplitudeSpectrum]", folder: Path) -> None:
    from chladni.viewers.figures.amplitude import amplitude_figures

    drawn = {f"zoom {place} {name}": figure for place, one in enumerate(found, start=1)
             for name, figure in amplitude_figures(one).items()}  # fmt: skip
    out.figures("zoom", drawn, folder)
