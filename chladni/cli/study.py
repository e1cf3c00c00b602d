"""``chladni study``: one recipe over many logs, on all cores or on a cluster."""

from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, count, number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from distributed import Client

    from chladni.apps.study.cluster import Keys
    from chladni.apps.study.limits import Verdict
    from chladni.apps.study.study import StudyReport
    from chladni.apps.study.trends import Trends

#: Exit code where something left its band.
OUTSIDE = 3
# As many as one reads; the tables hold all.
MOST_CHANGES, MOST_FAILURES = 30, 30
ALL_FAILURES = "select log, step, reason from failures"
ALL_DAMAGE = "select log, sentence from findings join logs using (log) where damage > 0 and step = 'info'"

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
Dashboard = Annotated[bool, typer.Option("--dashboard", help="Serve Dask's page of the work, on this machine only.")]
Baseline = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="An earlier study: what differs from it is outside its band.", show_default=False
    ),
]
Report = Annotated[
    Path | None,
    typer.Option("--html", "--report", metavar="FILE.html", help="Write a page of trends.", show_default=False),
]
Save = Annotated[
    Path | None,
    typer.Option(metavar="OUT.rrd", help="Write trends as a rerun recording over dates.", show_default=False),
]


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
    dashboard: Dashboard = False,
    baseline: Baseline = None,
    report: Report = None,
    save: Save = None,
    json: options.Json = None,
) -> None:
    """Run a recipe over many logs, to tables for DuckDB and pandas; begun again it goes on.

    Modes, levels, lines and causes are followed over the logs. The exit code is 3 when something left its band.
    """
    from chladni.apps.study.cluster import Keys
    from chladni.apps.study.limits import judge
    from chladni.apps.study.study import run_study
    from chladni.apps.study.trends import follow
    from chladni.io.study.recipe import load_recipe
    from chladni.io.study.results import results
    from chladni.signals.errors import EstimateError

    require_places(reads=[recipe], writes={"--json": json, "--html": report, "--save": save}, folders={"--out": out})
    to = Output(json)
    loaded, earlier = load_recipe(recipe), None if baseline is None else results(baseline)
    connect = partial(
        _connected, to, workers, scheduler, Keys(authority=tls_ca, certificate=tls_cert, key=tls_key), dashboard
    )
    with to.progress(recipe.name) as progress:
        ran = run_study(loaded, logs, out, connect=connect, progress=progress)
    _print(to, out, ran)
    followed = follow(results(out), loaded.file.trend)
    before = None if earlier is None else follow(earlier, loaded.file.trend)
    verdict = judge(followed, loaded.file.limit, before)
    _print_trends(to, followed, verdict)
    _write(to, out, followed, verdict, report=report, save=save)
    _send(to, ran, followed, verdict)
    if not followed.logs:
        raise EstimateError(f"{out}: no log was read; see why above, or in the table of failures")
    if verdict.outside:
        raise typer.Exit(OUTSIDE)


@contextmanager
def _connected(
    to: Output, workers: int | None, scheduler: str | None, keys: "Keys", dashboard: bool
) -> "Iterator[Client]":
    from chladni.apps.study.cluster import cluster

    with cluster(workers=workers, scheduler=scheduler, keys=keys, dashboard=dashboard) as client:
        if dashboard:
            to.line(f"dashboard: {client.dashboard_link}")
        yield client


def _print(to: Output, out: Path, report: "StudyReport") -> None:
    from chladni.io.study.tables import SCHEMAS

    before = report.there + report.unchanged
    there = f"; {count(before)} {'was' if before == 1 else 'were'} done already" if before else ""
    unread = f", {count(report.unread)} of them couldn't be read" if report.unread else ""
    to.line(f"{counted(report.done, 'log')} done{unread}{there}: {out}")
    if report.failures:
        to.line(f"{counted(len(report.failures), 'failure')}; the other steps and logs are done", style="bold")
        told = [f"{Path(log).name}, {step}: {reason}" for log, step, reason in sorted(report.failures)]
        to.lines(told[:MOST_FAILURES])
        if len(told) > MOST_FAILURES:
            to.line(f'all of them: chladni query {out} "{ALL_FAILURES}"')
    if report.damaged:
        # What is left of a log that was cut has rows like any other.
        to.line(f"{counted(report.damaged, 'log')} with damage, whose rows are of what is whole:")
        to.line(f'what is lost: chladni query {out} "{ALL_DAMAGE}"')
    to.line(f"ask for rows: chladni query {out} SQL; tables are {', '.join(SCHEMAS)}")


def _print_trends(to: Output, followed: "Trends", verdict: "Verdict") -> None:
    from chladni.apps.study.trends import trend_sentences

    changes = trend_sentences(followed.trends)
    if followed.trends:
        to.line(f"{counted(len(followed.trends), 'trend')} followed, {counted(len(changes), 'change')} found")
    to.lines([*changes[:MOST_CHANGES], *followed.notes, *verdict.missing])
    if verdict.outside:
        header, rows = _outside(verdict)
        told = f"{counted(len(rows), 'value')}, by {counted(verdict.checked, 'check')}"
        to.table(f"Outside the band: {told}", header, rows)
    elif verdict.checked:
        to.line(f"all within their bands: {counted(verdict.checked, 'check')}")


def _outside(verdict: "Verdict", *, as_written: "Callable[[str], str]" = str) -> tuple[list[str], list[list[str]]]:
    rows = [
        [
            one.what,
            Path(one.log).name or "latest level",
            with_error(one.value, one.std),
            unit(as_written(one.unit)),
            f"{_end(one.low)} to {_end(one.high)}",
            one.rule,
        ]
        for one in verdict.outside
    ]
    return ["quantity", "log", "value", "unit", "band", "whose"], rows


def _end(bound: float) -> str:
    told = number(bound)
    return "any" if told == NOTHING else told


def _write(
    to: Output, out: Path, followed: "Trends", verdict: "Verdict", *, report: Path | None, save: Path | None
) -> None:
    from chladni.apps.study.trends import LEAST_TO_CHANGE, trend_sentences
    from chladni.signals.unit_text import printed_unit

    # A page and a recording write units as their pictures do.
    changes = trend_sentences(followed.trends, unit=printed_unit)
    if followed.trends and all(len(one.logs) < LEAST_TO_CHANGE for one in followed.trends):
        changes = (f"No change can be told from scatter yet: that takes {LEAST_TO_CHANGE} logs of a trend.",)
    title = f"{out.name}: {counted(followed.logs, 'log')}"
    if report is not None:
        from chladni.viewers.report.trends import TrendPage, write_trend_report

        page = TrendPage(
            title=title,
            trends=followed.trends,
            changes=changes,
            tables={"Outside the band": _outside(verdict, as_written=printed_unit)},
            notes=(*followed.notes, *verdict.missing),
        )
        to.line(f"report: {write_trend_report(page, report)}")
    if save is not None:
        from chladni.viewers.rerun.trends import write_trend_rrd

        to.line(f"recording: {write_trend_rrd(followed.trends, changes, save, name=title)}")


def _send(to: Output, ran: "StudyReport", followed: "Trends", verdict: "Verdict") -> None:
    from dataclasses import asdict

    from chladni.apps.documents import finite
    from chladni.apps.study.trends import trends_document

    outside = [
        {key: finite(value) if isinstance(value, float) else value for key, value in asdict(one).items()}
        for one in verdict.outside
    ]
    to.json(
        lambda: {
            "format": "chladni.study-run/1", "logs": ran.logs, "there": ran.there, "done": ran.done,
            "unread": ran.unread, "damaged": ran.damaged, "unchanged": ran.unchanged,
            "seconds": ran.seconds, "cpu_s": ran.cpu_s,
            "failures": [{"log": log, "step": step, "reason": why} for log, step, why in ran.failures],
            "followed": trends_document(followed),
            "outside": outside, "checked": verdict.checked, "missing": list(verdict.missing),
        }
    )  # fmt: skip
