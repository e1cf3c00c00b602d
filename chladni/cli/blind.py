"""``chladni blind make|run|score``: the diagnosis on cases whose cause is sealed."""

from pathlib import Path
from typing import Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import count as counted
from chladni.signals.wording import counted as cases

# As many as one reads.
MOST_MISSED = 30

blind = typer.Typer(
    name="blind",
    help="Check the diagnosis on machines whose hidden effects are sealed: make them, run it, score it.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the campaign.", show_default=False)]
Jobs = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Processes; one a core if not given.", show_default=False),
]
Kinds = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KIND=N",
        help="Share of a kind of cases, and of no others: effect, none, parameters, two, three, faint, leave_out, "
        "outside, topology, value, value_and_effect, all_joints, "
        "ordinary, gains, as far as the generator draws them; may be repeated. Its usual ones if not given.",
        show_default=False,
    ),
]


@blind.command()
def make(
    directory: Folder,
    *,
    count: Annotated[int, typer.Option(metavar="N", min=1, help="Number of cases.")] = 200,
    seed: Annotated[
        int, typer.Option(metavar="N", min=0, help="Start of the random numbers; the same seed gives the same cases.")
    ] = 0,
    generator: Annotated[
        str, typer.Option(metavar="NAME", help="What draws the machines: chains, networks, robots.")
    ] = "chains",
    robots: Annotated[
        bool, typer.Option("--robots", help="Robots with JointState logs: --generator robots.")
    ] = False,
    kind: Kinds = None,
    jobs: Jobs = None,
    json: options.Json = None,
) -> None:
    """Make cases: random machines with hidden effects, and their sealed truths; what is there stays."""
    from chladni.apps.blind import make_campaign

    require_places(reads=(), writes={"--json": json}, folders={"DIR": directory})
    to = Output(json)
    generator = "robots" if robots else generator
    with to.progress("making cases") as show:
        made = make_campaign(
            directory, count=count, seed=seed, generator=generator, kinds=kind or (), jobs=jobs, progress=show
        )
    there = f"; {counted(count - made)} of {counted(count)} were there" if made < count else ""
    to.line(f"made {cases(made, 'case')} in {directory / 'cases'}{there}")
    to.line(f"their truths are in {directory / 'truth'}: move it away before the run, and back for the score")
    to.json(lambda: {"format": "chladni.blind-make/1", "directory": str(directory), "count": count, "seed": seed,
             "generator": generator, "made": made})  # fmt: skip


@blind.command()
def run(
    directory: Folder,
    *,
    seed: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, help="Start of the diagnosis's random numbers; the same seed gives the same answer."
        ),
    ] = 0,
    jobs: Jobs = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Of a Dask scheduler whose workers see DIR, in place of processes: tls://HOST:PORT.",
            show_default=False,
        ),
    ] = None,
    json: options.Json = None,
) -> None:
    """Diagnose every case that has no result yet; the truths are never opened."""
    from functools import partial

    from chladni.apps.blind import run_campaign
    from chladni.apps.study.cluster import cluster
    from chladni.gap.kept_memory import keep_memory

    require_places(reads=(), writes={"--json": json}, folders={"DIR": directory})
    to = Output(json)
    # With one job this process is the worker.
    keep_memory()
    with to.progress("diagnosing") as show:
        connect = None if scheduler is None else partial(cluster, workers=jobs, scheduler=scheduler)
        report = run_campaign(directory, seed=seed, jobs=jobs, connect=connect, progress=show)
    to.line(f"diagnosed {counted(report.done)} cases; {counted(report.there)} had a result")
    if report.failed:
        to.lines([f"Warning: no answer for {', '.join(report.failed)}; their results say why"])
    to.json(lambda: {"format": "chladni.blind-run/1", "done": report.done, "there": report.there,
             "failed": list(report.failed)})  # fmt: skip


@blind.command()
def score(
    directory: Folder,
    *,
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR2", help="The same cases, answered by another version: what differs.", show_default=False
        ),
    ] = None,
    figures: options.Figures = None,
    json: options.Json = None,
) -> None:
    """Verify the seals and hold the answers against the truths."""
    from chladni.apps.blind import score_campaign
    from chladni_withheld.score_table import (
        HEADER,
        PAIRED_HEADER,
        changed_rows,
        confusion_rows,
        detection_rows,
        missed_rows,
        paired_rows,
        reliability_rows,
        score_rows,
    )

    require_places(reads=(), writes={"--json": json}, folders={"--figures": figures})
    to = Output(json)
    found = score_campaign(directory, against=against)
    to.table(f"Score of {found['cases']} cases", HEADER, score_rows(found))
    for title, (header, rows) in (
        ("Families: hidden and named", confusion_rows(found["confusion_family"])),
        ("Reliability of the probabilities", reliability_rows(found)),
        ("Detection of faint effects", detection_rows(found)),
    ):
        to.table(title, header, rows)
    header, missed = missed_rows(found)
    if missed:
        more = f", the first {MOST_MISSED}; all are in score.json" if len(missed) > MOST_MISSED else ""
        to.table(f"Answered wrongly: {len(missed)}{more}", header, missed[:MOST_MISSED])
    if against is not None:
        told = found["against"]
        to.table(f"Against {against}, {counted(told['pairs'])} pairs", PAIRED_HEADER, paired_rows(told))
        header, changed = changed_rows(told)
        if changed:
            to.table(f"Right in one of the two only: {len(changed)}", header, changed)
    if found["missing"]:
        to.lines([f"Warning: {len(found['missing'])} cases have no result yet; chladni blind run {directory}"])
    to.line(f"wrote {directory / 'score.json'}")
    if figures is not None:
        from chladni.apps.campaign_pictures import campaign_album
        from chladni.viewers.figures.saving import save_album

        for path in save_album(campaign_album(found), figures):
            to.line(f"figure: {path}")
    to.json(lambda: found)
