"""``chladni gap``: where a model and a log disagree, what was left out, and how far the gap closes."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.gap_rows import print_diagnosis
from chladni.cli.output import Output

if TYPE_CHECKING:
    from chladni.gap.records.diagnosis import Diagnosis
    from chladni.models.core.model import Model
    from chladni.viewers.gap_evidence import GapEvidence

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")


def gap(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="A model file: what the simulation believes.", show_default=False)
    ],
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="Logs of the machine; several levels tell more.", show_default=False),
    ],
    *,
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT", help="Leave this effect out; may be repeated.", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of everything random.")] = 0,
    start: options.Start = None,
    end: options.End = None,
    setup: options.Setup = None,
    stamp: options.Stamp = "auto",
    json: options.Json = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--html", "--report", metavar="FILE.html", help="Write a self-contained HTML report.", show_default=False
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(metavar="OUT.png", help="Write one sheet with the evidence, as PNG, SVG or PDF.",
                     show_default=False),
    ] = None,
    figures: options.Figures = None,
    save: Annotated[
        Path | None, typer.Option(metavar="OUT.rrd", help="Write a rerun recording.", show_default=False)
    ] = None,
    write_model: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml", help="Write the model, tuned and with the effects that were found.",
            show_default=False,
        ),
    ] = None,
) -> None:  # fmt: skip
    """Where a model and a log disagree, which effect was left out, and how far the gap closes with it."""
    from chladni.apps.diagnose import diagnose_gap
    from chladni.apps.gap_document import gap_document
    from chladni.io.log import open_log
    from chladni.models.files.model_file import load_model

    # A diagnosis takes its time: it shouldn't be lost to a misspelt folder.
    _require_places(figure, report, save, write_model)
    out = Output(json)
    believed = load_model(model)
    with ExitStack() as opened, out.progress(believed.name) as progress:
        found = diagnose_gap(
            believed,
            [opened.enter_context(open_log(log, setup=setup, stamp=stamp)) for log in logs],
            leave_out=without or (),
            seed=seed,
            start_s=start,
            end_s=end,
            progress=lambda step, share: progress(share, step),
        )
    print_diagnosis(out, found)
    _draw(out, found, believed, report=report, figure=figure, figures=figures, save=save)
    if write_model is not None:
        _write_model(out, believed, found, write_model)
    out.json(gap_document(found))


def _require_places(figure: Path | None, *others: Path | None) -> None:
    """Refuse files that can't be written, before anything is computed."""
    from chladni.signals.errors import LogError, SetupError

    if figure is not None and figure.suffix.lower() not in FIGURE_SUFFIXES:
        raise SetupError(f"{figure}: a figure is one of {', '.join(FIGURE_SUFFIXES)}; give such a name")
    for path in (figure, *others):
        if path is not None and not path.resolve().parent.is_dir():
            raise LogError(f"{path}: there is no folder {path.parent}; make it, or name another")


def _draw(
    out: Output,
    found: "Diagnosis",
    model: "Model",
    *,
    report: Path | None,
    figure: Path | None,
    figures: Path | None,
    save: Path | None,
) -> None:
    """Write the pictures that were asked for, and say where they are."""
    if not any((report, figure, figures, save)):
        return
    from chladni.apps.gap_evidence import gap_evidence

    evidence = gap_evidence(found)
    if report is not None or figures is not None:
        _draw_album(out, evidence, report=report, figures=figures)
    if figure is not None:
        from chladni.viewers.figures.gap_sheet import save_gap_sheet

        save_gap_sheet(evidence, figure)
        out.line(f"figure: {figure}")
    if save is not None:
        from chladni.apps.gap_structure import structure_sketch
        from chladni.viewers.rerun.gap import write_gap_rrd

        write_gap_rrd(evidence, save, sketch=structure_sketch(model, found.where))
        out.line(f"recording: {save}")


def _draw_album(out: Output, evidence: "GapEvidence", *, report: Path | None, figures: Path | None) -> None:
    from chladni.viewers.figures.gap import gap_album

    album = gap_album(evidence)
    if figures is not None:
        from chladni.viewers.figures.saving import save_album

        for path in save_album(album, figures):
            out.line(f"figure: {path}")
    if report is not None:
        from chladni.viewers.report.gap import write_gap_report

        write_gap_report(evidence, report, album=album)
        out.line(f"report: {report}")


def _write_model(out: Output, model: "Model", found: "Diagnosis", path: Path) -> None:
    from chladni.apps.explained_model import explained_model
    from chladni.models.files.model_file import write_model

    write_model(explained_model(model, found), path)
    out.line(f"model: {path}")
