"""What a worker does: a batch of logs, each by all steps of the recipe, to the bytes of their tables."""

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from chladni import __version__
from chladni.apps.study.rows import Rows, rows_of
from chladni.apps.study.steps import DOCUMENTS
from chladni.io.files.formats import fitting_options
from chladni.io.log import Log, open_log
from chladni.io.setup import Setup, load_setup
from chladni.io.study.logs import HeldLog, LogAddress, StoreError, held
from chladni.io.study.recipe import Attached, Recipe
from chladni.io.study.tables import packed, tables_of
from chladni.signals.errors import ChladniError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.visible import document_text

_NS_PER_S: Final = 1_000_000_000
#: A clock that was never set begins at the Unix epoch.
_FIRST_DAY_NS: Final = 366 * 86_400 * _NS_PER_S
#: An option that a message advises; those of a whole command that it gives stay as they are.
_OPTION: Final = re.compile(r"chladni [a-z]+ [^;]*|--[a-z][a-z-]*")
_KEYS: Final = {
    "--setup": "setup", "--rate": "[open] sample_rate_hz", "--time": "[open] time", "--time-unit": "[open] time_unit",
    "--stamp": "[open] stamp", "--unit": "[open] units", "--channel": "channels", "--reference": "references",
    "--response": "responses", "--resolution": "resolution_hz", "--start": "start_s", "--end": "end_s",
    "--join": "join", "--operational": "operational = true", "--state": "state", "--command": "command",
    "--without": "leave_out",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Task:
    """A log to be done.

    Attributes
    ----------
    url
        See `LogAddress`.
    known
        SHA-256 of the content whose rows are there; None where none are.
    """

    url: str
    known: str | None = None


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
    prepared = _prepared(recipe)
    rows: Rows = {}
    with in_one_thread():
        for task in tasks:
            for table, found in _log_rows(prepared, task).items():
                rows.setdefault(table, []).extend(found)
    return packed(tables_of(rows))


class _Prepared:
    """A recipe with what it names loaded, kept for the batches to come."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        # Errors name the file as the user does, not as it was laid down here.
        self._folder = TemporaryDirectory(prefix="chladni-recipe-")
        self.setup: Setup | None = None
        if recipe.setup is not None:
            self.setup = load_setup(self._laid_down(recipe.setup))
        self.model: Any = None
        if recipe.model is not None:
            self.model = self._loaded(recipe.model)

    def told(self, text: str) -> str:
        """Give a message with files called as the user calls them, and keys of the recipe in place of options."""
        text = _OPTION.sub(lambda found: _KEYS.get(found[0], found[0]), text)
        for one in (self.recipe.setup, self.recipe.model):
            if one is not None:
                text = text.replace(str(self._path(one)), one.path)
        return text

    def open(self, path: Path) -> Log:
        """Open a log as the recipe says; of its keys, those that are for this kind of file."""
        told: dict[str, Any] = self.recipe.file.open.model_dump(exclude_none=True)
        return open_log(path, setup=self.setup, **fitting_options(path, told))

    def _path(self, attached: Attached) -> Path:
        return Path(self._folder.name) / Path(attached.path).name

    def _laid_down(self, attached: Attached) -> Path:
        path = self._path(attached)
        path.write_text(attached.text, encoding="utf-8")
        return path

    def _loaded(self, attached: Attached) -> Any:
        from chladni.gap.kept_memory import keep_memory
        from chladni.models.files.model_file import load_model
        from chladni.robots.loading import is_robot_file, load_robot

        keep_memory()
        path = self._laid_down(attached)
        # A robot's description names further files beside it: workers need the same folder.
        return load_robot(attached.path, meshes=False) if is_robot_file(path) else load_model(path)


@lru_cache(maxsize=4)
def _prepared(recipe: str) -> _Prepared:
    return _Prepared(Recipe.from_json(recipe))


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


def _log_rows(prepared: _Prepared, task: Task) -> Rows:
    began_s, cpu_s = time.perf_counter(), time.process_time()
    found = _Found(LogAddress(url=task.url))
    unchanged = False
    with _told(prepared, found, "read"), ExitStack() as stack:
        log = stack.enter_context(held(found.address))
        found.content, found.size_bytes = log.content, log.size_bytes
        unchanged = log.content == task.known
        if not unchanged:
            _work(prepared, log, found)
    effort = {
        "seconds": time.perf_counter() - began_s,
        "cpu_s": time.process_time() - cpu_s,
        "content": found.content,
        "unchanged": unchanged,
    }
    rows: Rows = {"effort": [effort]}
    if not unchanged or found.failures:
        rows |= _all_rows(prepared.recipe, found)
    return {
        table: [{"log": found.address.told, "day": found.day, **row} for row in made] for table, made in rows.items()
    }


def _work(prepared: _Prepared, held_log: HeldLog, found: _Found) -> None:
    with _told(prepared, found, "open", fetched=held_log), prepared.open(held_log.path) as log:
        found.channels, found.begins_ns = len(log.channels), log.start_time_ns
        for step in prepared.recipe.steps:
            with _told(prepared, found, step, fetched=held_log):
                asked = getattr(prepared.recipe.file, step)
                found.documents[step] = DOCUMENTS[step](log, asked, prepared.model)
        if "info" in found.documents:
            found.duration_s = found.documents["info"]["duration_s"]
        found.damage = len(log.damage)


@contextmanager
def _told(prepared: _Prepared, found: _Found, step: str, *, fetched: HeldLog | None = None) -> Iterator[None]:
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
        found.failures.append({"step": step, "kind": kind, "reason": prepared.told(reason)})


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
