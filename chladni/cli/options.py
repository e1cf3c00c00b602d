"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated, Literal

import typer

Log = Annotated[
    Path,
    typer.Argument(metavar="LOG", help="An MCAP log, or a data file of any kind that is read.", show_default=False),
]
Rate = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="True rate of the samples, for what the stamps leave open.", show_default=False),
]
Json = Annotated[
    str | None,
    typer.Option(
        "--json", metavar="FILE", help="Write the result as JSON; - for standard output.", show_default=False
    ),
]
Channels = Annotated[
    list[str] | None,
    typer.Option("--channel", metavar="PATH", help="Only this channel; may be repeated.", show_default=False),
]
Resolution = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Distance of the frequency lines; chosen by the log's length if not given."),
]
Window = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Any SciPy window; hann, or whole periods where the excitation is periodic."),
]
Overlap = Annotated[
    float | None, typer.Option(metavar="SHARE", help="Overlap of segments, 0 to 1; 0.5 if not given.")
]
Start = Annotated[float | None, typer.Option(metavar="S", help="Seconds from the log's start.", show_default=False)]
End = Annotated[float | None, typer.Option(metavar="S", help="Seconds from the log's start.", show_default=False)]
Join = Annotated[
    Literal["auto", "hold", "band-limited"],
    typer.Option(
        help="How channels of several sampling grids become one; auto holds commands and staircases between samples."
    ),
]
Report = Annotated[
    Path | None,
    typer.Option(metavar="FILE.html", help="Write a self-contained HTML report.", show_default=False),
]
Figures = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Save the figures as PNG and SVG.", show_default=False),
]
