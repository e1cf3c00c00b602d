"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated, Literal

import typer

Log = Annotated[Path, typer.Argument(metavar="LOG", help="An MCAP log.", show_default=False)]
Setup = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Setup file: points, directions, units, sensitivities.", show_default=False),
]
Stamp = Annotated[
    Literal["auto", "header", "publish", "log"],
    typer.Option(help="Which time of a message is its sample time: its own stamp, when published, when logged."),
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
Time = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="Of a data file: the column that holds the times; none: none does.", show_default=False
    ),
]
TimeUnit = Annotated[
    str | None,
    typer.Option(
        metavar="UNIT",
        help="What its numbers count: s, ms, us, ns, min, h, days, excel or datenum.",
        show_default=False,
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


def reading(time: str | None, time_unit: str | None) -> dict[str, str]:
    """Give the options of a file's reader that are set."""
    given = {"time": time, "time_unit": time_unit}
    return {name: text for name, text in given.items() if text is not None}
