"""``chladni study``: one recipe over many logs, on all cores or on a cluster."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import count
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.apps.study.study import StudyReport

Recipe = Annotated[
    Path,
    typer.Argument(metavar="RECIPE.toml", help="What is done with each log, see docs/study.md.", show_default=False),
]
Logs = Annotated[
    list[str],
    typer.Argument(
        metavar="LOGS...",
        help="Logs, folders of logs, and addresses such as s3://bucket/day/*.mcap.",
        show_default=False,
    ),
]
Out = Annotated[
    Path,
    typer.Option(
        "--out", metavar="DIR", help="Folder of the results; one that is there is gone on with.", show_default=False
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Processes of this machine; one a core if not given.", show_default=False),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Of a Dask scheduler: tls://HOST:PORT, or tcp://127.0.0.1:PORT on this machine.",
        show_default=False,
    ),
]
Authority = Annotated[
    Path | None, typer.Option("--tls-ca", metavar="FILE.pem", help="Authority of the cluster.", show_default=False)
]
Certificate = Annotated[
    Path | None, typer.Option("--tls-cert", metavar="FILE.pem", help="Certificate for it.", show_default=False)
]
Key = Annotated[Path | None, typer.Option("--tls-key", metavar="FILE.pem", help="Its key.", show_default=False)]


def study(
    recipe: Recipe,
    logs: Logs,
    *,
    out: Out,
    workers: Workers = None,
    scheduler: Scheduler = None,
    tls_ca: Authority = None,
    tls_cert: Certificate = None,
    tls_key: Key = None,
    dashboard: Annotated[
        bool, typer.Option("--dashboard", help="Serve Dask's page of the work, on this machine only.")
    ] = False,
    json: options.Json = None,
) -> None:
    """Run a recipe over many logs, and write tables that DuckDB, pandas and others read; begun again it goes on."""
    from chladni.apps.study.cluster import Keys, cluster
    from chladni.apps.study.study import run_study
    from chladni.io.study.logs import find_logs
    from chladni.io.study.recipe import load_recipe

    require_places(reads=[recipe], writes={"--json": json}, folders={"--out": out})
    to = Output(json)
    loaded = load_recipe(recipe)
    found = find_logs(logs)
    keys = Keys(authority=tls_ca, certificate=tls_cert, key=tls_key)
    with cluster(workers=workers, scheduler=scheduler, keys=keys, dashboard=dashboard) as client:
        if dashboard:
            to.line(f"dashboard: {client.dashboard_link}")
        with to.progress(recipe.name) as progress:
            report = run_study(loaded, found, out, client=client, progress=progress)
    _print(to, out, report)
    to.json(
        {
            "format": "chladni.study-run/1", "logs": report.logs, "there": report.there, "done": report.done,
            "unchanged": report.unchanged, "seconds": report.seconds, "cpu_s": report.cpu_s,
            "failures": [{"log": log, "step": step, "reason": why} for log, step, why in report.failures],
        }
    )  # fmt: skip


def _print(to: Output, out: Path, report: "StudyReport") -> None:
    from chladni.io.study.tables import SCHEMAS

    there = f"; {count(report.there + report.unchanged)} were done already" if report.there + report.unchanged else ""
    to.line(f"{counted(report.done, 'log')} done{there}: {out}")
    if report.failures:
        to.table(
            f"{counted(len(report.failures), 'failure')}; the other steps and logs are done",
            ["log", "step", "reason"],
            [[Path(log).name, step, reason] for log, step, reason in sorted(report.failures)],
        )
    to.line(f"ask for rows: chladni query {out} SQL; tables are {', '.join(SCHEMAS)}")
