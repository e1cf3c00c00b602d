"""``chladni view``: everything in rerun."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.logs import log_names
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.viewers.display import has_display, require_display

if TYPE_CHECKING:
    from chladni.signals.study import Study


@opens_files
def view(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="MCAP logs or data files, one or more.", show_default=False)
    ],
    *,
    channel: options.Channels = None,
    reference: options.References = None,
    resolution: options.Resolution = None,
    part: options.Part,
    opener: Opener,
    save: Annotated[
        Path | None,
        typer.Option(metavar="OUT.rrd", help="Write a recording instead of opening a viewer.", show_default=False),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Serve to a browser on this computer only.")] = False,
    json: options.Json = None,
    figures: options.Figures = None,
    report: options.Report = None,
    static: options.Static = False,
) -> None:
    """Waveforms, spectra, waterfalls and transfer functions in rerun."""
    from chladni.apps.analyse import analyse
    from chladni.apps.show import gather
    from chladni.signals.errors import SetupError

    if save is not None and web:
        raise SetupError("--save writes a file and --web serves a page; give one of them")
    only_window = save is None and not web and report is None and figures is None
    out = Output.of_log(
        [*logs, opener.setup], json=json, figures=figures, report=report, static=static, others={"--save": save}
    )
    opening, studies = opener.among(logs), []
    for title, log in zip(log_names(logs), logs, strict=True):
        with opening(log) as opened, out.progress(title) as progress:
            if only_window:
                # Nothing would come of the work.
                require_display()
            found = analyse(
                opened,
                channels=channel,
                references=reference,
                resolution_hz=resolution,
                start_s=part.start,
                end_s=part.end,
                progress=progress,
            )
            studies.append(replace(found, title=title))
    study = gather(*studies)
    out.lines(study.findings)
    out.pictures(*studies, figures=figures, report=report)
    _show(study, out, save=save, web=web)


def _show(study: "Study", out: Output, *, save: Path | None, web: bool) -> None:
    from chladni.viewers.rerun import serve_web, spawn, write_rrd

    document = {"format": "chladni.view/1", "path": None, "address": None, "findings": list(study.findings)}
    if save is not None:
        path = str(write_rrd(study, save))
        out.line(f"recording: {path}")
        out.json(lambda: document | {"path": path})
    elif web:
        with serve_web(study) as server:
            out.line(f"{server.address}")
            out.line("Open this address in a browser on this computer (nobody else can reach it); Ctrl-C ends.")
            out.json(lambda: document | {"address": server.address})
            server.wait()
    else:
        if has_display():
            spawn(study)
        else:
            out.line("No window can be opened here. --save OUT.rrd writes a recording, --web serves a page.")
        out.json(lambda: document)
