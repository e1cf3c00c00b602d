"""A study: a recipe over many logs on a cluster, to a folder of tables."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from chladni.apps.study.cluster import Connect
from chladni.apps.study.engine import Answer, Engine
from chladni.apps.study.parts import MOST_PARTS, Sums, parts_of, share, sum_part
from chladni.apps.study.work import Task, work_on
from chladni.io.study.folder import StudyFolder, opened_folder
from chladni.io.study.logs import LogAddress, find_logs
from chladni.io.study.recipe import Recipe
from chladni.io.study.tables import packed, tables_of

Progress = Callable[[float], None]
#: Between two times that what is done is put into the tables, at least.
SETTLE_EVERY_S: Final = 30.0


@dataclass(slots=True, kw_only=True)
class StudyReport:
    """What a run did.

    Attributes
    ----------
    logs
        That were asked for.
    there
        Whose rows were there already.
    done
        Whose rows were made now.
    unchanged
        That were read, and found to be what was done already.
    unread
        Of those done, that couldn't be read at all.
    damaged
        Of those done, in which something is lost or damaged.
    failures
        ``(log, step, reason)`` of what went wrong now.
    seconds, cpu_s
        Spent on logs by all workers together.
    """

    logs: int
    there: int
    done: int = 0
    unchanged: int = 0
    unread: int = 0
    damaged: int = 0
    failures: list[tuple[str, str, str]] = field(default_factory=list)
    seconds: float = 0.0
    cpu_s: float = 0.0


def run_study(
    recipe: Recipe,
    logs: Sequence[str],
    out: Path | str,
    *,
    connect: Connect,
    progress: Progress = lambda _share: None,
) -> StudyReport:
    """Do what a recipe says with each log whose rows aren't there yet.

    Parameters
    ----------
    recipe
        From `chladni.io.study.recipe.load_recipe`.
    logs
        Files, folders and addresses, see `chladni.io.study.logs.find_logs`.
    out
        Folder of the results; made, or gone on with.
    connect
        Gives a client of workers, see `chladni.apps.study.cluster.cluster`; asked when there is something to do.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    SetupError
        When the folder holds another study, the cluster goes away, there is no log, or a path isn't there.
    LogError
        When the folder can't be written to. What is done stays.
    """
    addresses = find_logs(logs)
    text = recipe.to_json()
    with opened_folder(Path(out), recipe.identity, text) as folder:
        waiting = [one for one in addresses if not _is_done(folder, one)]
        report = StudyReport(logs=len(addresses), there=len(addresses) - len(waiting))
        if waiting:
            with connect() as client:
                _run(Engine(client, partial(work_on, text)), folder, recipe, waiting, report, progress)
        folder.settle()
    return report


def _is_done(folder: StudyFolder, address: LogAddress) -> bool:
    done = folder.done.get(address.told)
    return done is not None and bool(address.stamp) and done.stamp == address.stamp


def _run(
    engine: Engine[Task],
    folder: StudyFolder,
    recipe: Recipe,
    waiting: Sequence[LogAddress],
    report: StudyReport,
    progress: Progress,
) -> None:
    stamps = {one.url: one for one in waiting}
    for place, answer in enumerate(_answers(engine, folder, waiting, recipe, report), 1):
        addresses = [stamps.pop(task.url) for task in answer.items]
        content = answer.content if answer.content is not None else _given_up(answer)
        tables = folder.take(
            content, {one.told: one.stamp for one in addresses}, source=f"the worker's answer {place}"
        )
        _note(engine, report, {name: table.to_pylist() for name, table in tables.items() if name in _NOTED})
        folder.settle(every_s=SETTLE_EVERY_S)
        progress(1 - len(stamps) / len(waiting))
    if stamps:
        raise AssertionError(f"{len(stamps)} logs have no answer, {next(iter(stamps))} among them")


_NOTED: Final = ("effort", "logs", "failures")


def _answers(
    engine: Engine[Task], folder: StudyFolder, waiting: Sequence[LogAddress], recipe: Recipe, report: StudyReport
) -> Iterator[Answer[Task]]:
    """Do all logs; those that are so large that workers share them come last, one after another."""
    large = {one for one in waiting if parts_of(one, recipe.steps, MOST_PARTS) > 1}
    yield from engine.run(_task(folder, one) for one in waiting if one not in large)
    work = partial(sum_part, recipe.to_json())
    for one in sorted(large, key=lambda one: one.url):
        # Asked for each time: clusters may start workers when there is work.
        parts = parts_of(one, recipe.steps, engine.threads())
        sums = share(engine.client, work, one.url, parts) if parts > 1 else ()
        report.seconds += sum(part.seconds for part in sums)
        report.cpu_s += sum(part.cpu_s for part in sums)
        yield from engine.run([_task(folder, one, sums)])


def _task(folder: StudyFolder, address: LogAddress, sums: Sequence[Sums] = ()) -> Task:
    known = folder.done.get(address.told)
    return Task(
        address.url,
        None if known is None else known.content,
        sums=tuple(one.content for one in sums),
        seen=sums[0].seen if sums else "",
    )


def _note(engine: Engine[Task], report: StudyReport, tables: dict[str, list[dict[str, Any]]]) -> None:
    for one in tables.get("effort", ()):
        engine.note_seconds(one["seconds"])
        report.seconds += one["seconds"]
        report.cpu_s += one["cpu_s"]
        report.unchanged += bool(one["unchanged"])
    for one in tables.get("logs", ()):
        report.done += 1
        report.unread += one["status"] == "failed"
        report.damaged += bool(one["damage"])
    report.failures += [(one["log"], one["step"], one["reason"]) for one in tables.get("failures", ())]


def _given_up(answer: Answer[Task]) -> bytes:
    """Rows of logs that no worker could do: they are tried again by the next run."""
    from chladni import __version__

    logs = [LogAddress(url=task.url).told for task in answer.items]
    return packed(
        tables_of(
            {
                "logs": [{"log": log, "status": "failed", "failures": 1, "version": __version__} for log in logs],
                "failures": [{"log": log, "step": "read", "kind": "worker", "reason": answer.reason} for log in logs],
            }
        )
    )
