"""Arguments and options that several commands share."""

import re
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperCommand

from chladni.signals.text_reading import real_number

if TYPE_CHECKING:
    from chladni.apps.sources import Span
    from chladni.apps.spectra import Averaging
    from chladni.cli.output import Output
    from chladni.signals.join import JoinMethod
    from chladni.spectral.bands import EstimateT

_NUMBER = r"(\+?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_BAND = re.compile(rf"{_NUMBER}[-:]{_NUMBER}", re.ASCII)

Log = Annotated[
    Path,
    typer.Argument(metavar="LOG", help="An MCAP log, or a data file of any kind that is read.", show_default=False),
]
Logs = Annotated[
    list[Path],
    typer.Argument(
        metavar="LOG...",
        help="An MCAP log, or a data file of any kind that is read; several are drawn over one another.",
        show_default=False,
    ),
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
Csv = Annotated[
    str | None,
    typer.Option(
        "--csv", metavar="FILE", help="Write the values as a table; - for standard output.", show_default=False
    ),
]


def _only(role: str) -> Any:
    return typer.Option(
        f"--{role}",
        metavar="NAME",
        help=f"Only this {role}, by name, label, unique ending (ch1) or pattern ('*/accel.x'); may be repeated.",
        show_default=False,
    )


Channels = Annotated[list[str] | None, _only("channel")]
References = Annotated[
    list[str] | None,
    typer.Option(
        "--reference",
        metavar="NAME",
        help="Channel of the excitation, named as a channel is; may be repeated. A force is taken if not given.",
        show_default=False,
    ),
]
Responses = Annotated[list[str] | None, _only("response")]
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
Fmax = Annotated[
    float | None,
    typer.Option("--fmax", metavar="HZ", help="Leave out all that is above, levels included.", show_default=False),
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
Static = Annotated[
    bool, typer.Option("--static", help="Put pictures in the report, not plots that zoom: a smaller file, no script.")
]
Decibels = Annotated[bool, typer.Option("--db", help="Number levels in decibels, in figures and report.")]
LogFrequency = Annotated[
    bool, typer.Option("--log-frequency", help="Divide frequency logarithmically, in figures and report.")
]
Figures = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Save the figures as PNG and SVG.", show_default=False),
]


def _known_units(units: list[str] | None) -> list[str] | None:
    """Refuse a unit that can't be one before a log is read for minutes."""
    from chladni.signals.shown_units import units_by_quantity

    units_by_quantity(units or ())
    return units


Unit = Annotated[
    list[str] | None,
    typer.Option(
        "--unit",
        metavar="UNIT",
        help="Count channels of this quantity so: g, mm/s, kN, ...; once for each quantity. SI if not given.",
        show_default=False,
        callback=_known_units,
    ),
]
Band = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--band", metavar="LO-HI", help="Leave out all outside, in Hz, levels and peaks included.", show_default=False
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Averages:
    """How spectra are averaged."""

    resolution: Resolution = None
    window: Window = None
    overlap: Overlap = None

    def averaging(self) -> "Averaging":
        """Give it as estimates take it."""
        from chladni.apps.spectra import Averaging

        return Averaging(resolution_hz=self.resolution, window=self.window, overlap=self.overlap)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Which lines of a spectrum are told, and in which units."""

    band: Band = None
    fmax: Fmax = None
    unit: Unit = None

    def of(self, estimates: "Sequence[EstimateT]") -> "tuple[EstimateT, ...]":
        """Give the estimates of one log so."""
        from chladni.signals.shown_units import all_in_units
        from chladni.spectral.bands import within

        cut = [within(one, band_hz=self.band, highest_hz=self.fmax) for one in estimates]
        return all_in_units(cut, self.unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Which part of a log is read."""

    start: Start = None
    end: End = None

    def span(self, *, join: "JoinMethod" = "auto") -> "Span":
        """Give it as estimates take it."""
        from chladni.apps.sources import Span

        return Span(start_s=self.start, end_s=self.end, join=join)


@dataclass(frozen=True, slots=True, kw_only=True)
class Looks:
    """How the axes of pictures are divided."""

    db: Decibels = False
    log_frequency: LogFrequency = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """Where a command writes."""

    json: Json = None
    csv: Csv = None
    figures: Figures = None
    report: Report = None
    static: Static = False

    def output(
        self,
        reads: Sequence[Path | None],
        looks: Looks | None = None,
        *,
        others: Mapping[str, Path | None] | None = None,
    ) -> "Output":
        """Give the output of a command that reads `reads`, once all that it will write is known to have its place."""
        from chladni.cli.output import Output
        from chladni.cli.places import require_drawn

        if looks is not None:
            require_drawn({"--db": looks.db, "--log-frequency": looks.log_frequency}, [self.figures, self.report])
        return Output.of_log(
            reads,
            json=self.json,
            csv=self.csv,
            figures=self.figures,
            report=self.report,
            static=self.static,
            others=others,
        )


class Command(TyperCommand):
    """A command whose bands are one word or two: ``--band 5-50``, ``--band 5:50``, ``--band 5 50``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line, with bands of one word as two."""
        # Of all options, bands alone are two values. A line that is being completed may break off in one.
        bands = {name for one in self.params if one.nargs == 2 for name in one.opts}
        return super().parse_args(ctx, args if ctx.resilient_parsing else with_parted_bands(args, bands))


def with_parted_bands(words: Sequence[str], options: Collection[str]) -> list[str]:
    """Give the words of a command line with the bands after `options` as two words each.

    Raises
    ------
    BadParameter
        When an option is followed by anything else than a band.

    Examples
    --------
    >>> with_parted_bands(["a.mcap", "--band", "5-50", "--count", "3"], ["--band"])
    ['a.mcap', '--band', '5', '50', '--count', '3']
    >>> with_parted_bands(["--band=1e-1:2.5"], ["--band"]), with_parted_bands(["--band", "5", "50"], ["--band"])
    (['--band', '1e-1', '2.5'], ['--band', '5', '50'])
    """
    left, parted = deque(words), list[str]()
    while left and left[0] != "--":
        name, equals, value = left[0].partition("=")
        if name not in options:
            parted.append(left.popleft())
            continue
        left.popleft()
        if equals:
            left.appendleft(value)
        parted += (name, *_band(name, left))
    return [*parted, *left]


def _band(option: str, left: deque[str]) -> list[str]:
    """Take the ends of a band off the words that are left."""
    word = left.popleft() if left else ""
    if together := _BAND.fullmatch(word):
        return _rising(option, list(together.groups()))
    apart = [word, *islice(left, 1)]
    numbers: list[float] = []
    with suppress(ValueError):
        numbers = [*map(real_number, apart)]
    if len(numbers) == 2:
        left.popleft()
        return _rising(option, apart)
    raise typer.BadParameter(f"{option} {word!r} is no band; give its ends in Hz, such as {option} 5-50")


def _rising(option: str, ends: list[str]) -> list[str]:
    low, high = ends
    if real_number(low) >= real_number(high):
        raise typer.BadParameter(
            f"{option}: a band from {low} to {high} Hz doesn't rise; give the lower end first, then a higher one"
        )
    return ends
