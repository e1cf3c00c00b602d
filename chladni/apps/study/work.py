"""What a worker does: a batch of logs, each by all steps of the recipe, to the bytes of their tables."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from typing import Any, Final

from chladni import __version__
from chladni.apps.documents import Document
from chladni.apps.shares import NeedsWholeError
from chladni.apps.study.parts import read_sums
from chladni.apps.study.prepared import Prepared, prepared
from chladni.apps.study.rows import Rows, rows_of
from chladni.apps.study.steps import DIVIDED, DOCUMENTS
from chladni.io.log import Log
from chladni.io.study.logs import HeldLog, LogAddress, StoreError, held
from chladni.io.study.recipe import Recipe
from chladni.io.study.tables import packed, tables_of
from chladni.signals.errors import ChladniError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.visible import document_text

_NS_PER_S: Final = 1_000_000_000
#: A clock that was never set begins at the Unix epoch.
_FIRST_DAY_NS: Final = 366 * 86_400 * _NS_PER_S


@dataclass(frozen=True, slots=True)
class Task:
    """A log to be done.

    Attributes
    ----------
    url
        See `LogAddress`.
    known
        SHA-256 of the content whose rows are there; None where none are.
    sums, seen
        Of a log that was shared: what its parts gave, and of what file.
    """

    url: str
    known: str | None = None
    sums: tuple[bytes, ...] = ()
    seen: str = ""


def work_on(recipe: str, tasks: Sequence[Task]) -> bytes:
    """Do a batch of logs; nothing that a log holds, or that goes wrong with one, ends it.

    Parameters
    ----------
    recipe
        `Recipe.to_json`.
    tasks
        The logs.

    Returns
    -------
    bytes
        `packed` tables. A log whose content is the known one has a row of ``effort`` alone.
    """
    ready = prepared(recipe)
    rows: Rows = {}
    with in_one_thread():
        for task in tasks:
            for table, found in _log_rows(ready, task).items():
                rows.setdefault(table, []).extend(found)
    return packed(tables_of(rows))


@dataclass(slots=True)
class _Found:
    """What becomes known of a log on the way."""

    address: LogAddress
    content: str | None = None
    size_bytes: int | None = None
    begins_ns: int | None = None
    channels: int | None = None
    damage: int | None = None
    duration_s: float | None = None
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    failures: list[dict[str, Any]] = field(default_factory=list)

    @property
    def day(self) -> date | None:
        """UTC, of its first sample."""
        if self.begins_ns is None or self.begins_ns < _FIRST_DAY_NS:
            return None
        try:
            return datetime.fromtimestamp(self.begins_ns / _NS_PER_S, UTC).date()
        except (OverflowError, ValueError):
            return None


def _log_rows(ready: Prepared, task: Task) -> Rows:
    began_s, cpu_s = time.perf_counter(), time.process_time()
    found = _Found(LogAddress(url=task.url))
    unchanged = False
    with _told(ready, found, "read"), ExitStack() as stack:
        log = stack.enter_context(held(found.address))
        found.content, found.size_bytes = log.content, log.size_bytes
        unchanged = log.content == task.known
        if not unchanged:
            _work(ready, log, found, task.sums if log.stamp == task.seen else ())
    effort = {
        "seconds": time.perf_counter() - began_s,
        "cpu_s": time.process_time() - cpu_s,
        "content": found.content,
        "unchanged": unchanged,
    }
    rows: Rows = {"effort": [effort]}
    if not unchanged or found.failures:
        rows |= _all_rows(ready.recipe, found)
    return {
        table: [{"log": found.address.told, "day": found.day, **row} for row in made] for table, made in rows.items()
    }


def _work(ready: Prepared, held_log: HeldLog, found: _Found, sums: Sequence[bytes]) -> None:
    with _told(ready, found, "open", fetched=held_log), ready.open(held_log.path) as log:
        found.channels, found.begins_ns = len(log.channels), log.start_time_ns
        for step in ready.recipe.steps:
            with _told(ready, found, step, fetched=held_log):
                found.documents[step] = _document(ready, log, step, sums)
        if "info" in found.documents:
            found.duration_s = found.documents["info"]["duration_s"]
        found.damage = len(log.damage)


def _document(ready: Prepared, log: Log, step: str, sums: Sequence[bytes]) -> Document:
    asked = getattr(ready.recipe.file, step)
    if sums and step in DIVIDED:
        with suppress(NeedsWholeError):
            return DOCUMENTS[step](log, asked, ready.model, read_sums(sums, step))
    return DOCUMENTS[step](log, asked, ready.model)


@contextmanager
def _told(ready: Prepared, found: _Found, step: str, *, fetched: HeldLog | None = None) -> Iterator[None]:
    """Make a failure of what goes wrong: one step's, and the others go on.

    A defect of ours is one, too: among ten thousand logs it's better told than the end of the study.
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001  # what it was stands in the table of failures
        reason = str(error) or type(error).__name__
        if fetched is not None and found.address.is_remote:
            reason = reason.replace(str(fetched.path), found.address.told)
        kind = _kind(error)
        if kind == "defect":
            reason = f"defect of chladni ({type(error).__name__}): {reason}"
        found.failures.append({"step": step, "kind": kind, "reason": ready.told(reason)})


def _kind(error: Exception) -> str:
    match error:
        case StoreError():
            return "store"
        case ChladniError():
            return "log"
        case MemoryError():
            return "memory"
        case OSError():
            return "system"
    return "defect"


def _all_rows(recipe: Recipe, found: _Found) -> Rows:
    rows = rows_of(found.documents)
    rows["failures"] = found.failures
    if recipe.file.documents:
        rows["documents"] = [
            {"step": step, "document": document_text(document)} for step, document in found.documents.items()
        ]
    rows["logs"] = [
        {
            "content": found.content,
            "status": _status(found),
            "begins": None if found.day is None else found.begins_ns,
            "duration_s": found.duration_s,
            "size_bytes": found.size_bytes,
            "channels": found.channels,
            "damage": found.damage,
            "failures": len(found.failures),
            "version": __version__,
        }
    ]
    return rows


def _status(found: _Found) -> str:
    if not found.documents:
        return "failed"
    return "partly" if found.failures else "done"
