"""``chladni demo``: the tour on data made on the spot."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import number, unit, with_error
from chladni.viewers.display import has_display

if TYPE_CHECKING:
    from chladni.apps.demo import Comparison


def demo(
    *,
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Where everything is written.")] = Path(
        "chladni-demo"
    ),
    open_viewer: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the viewer where there is a display.")
    ] = True,
    json: options.Json = None,
) -> None:
    """Make a robot arm's log with known truth, analyse it, and show what was found beside the truth."""
    from chladni.apps.demo import run_tour

    require_places(reads=(), writes={"--json": json}, folders={"--out": out})
    to = Output(json)
    with to.progress("tour") as progress:
        tour = run_tour(out, progress=progress)
    to.line("A robot arm shaken at its tool for a minute; five accelerometers, one with lost messages.", style="bold")
    to.lines(tour.study.findings)
    to.table("Found beside the truth", ["what", "found", "truth", "unit"], [_row(one) for one in tour.comparisons])
    for path in tour.files:
        to.line(f"wrote {path}")
    to.json(
        lambda: {
            "format": "chladni.demo/1",
            "comparisons": [
                {"what": one.what, "found": one.found, "std": one.std, "truth": one.truth, "unit": one.unit}
                for one in tour.comparisons
            ],
            "files": [str(path) for path in tour.files],
        }
    )
    if open_viewer and has_display():
        from chladni.viewers.rerun import spawn

        spawn(tour.study)
    else:
        to.line(f"look at it with: chladni view {tour.files[2]} --setup {tour.files[3]} --web")


def _row(one: "Comparison") -> list[str]:
    found = "not found" if one.found is None else with_error(one.found, one.std)
    return [one.what, found, number(one.truth, digits=7), unit(one.unit)]
