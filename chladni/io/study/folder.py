"""The folder of a study: journals of batches that are done, and the Parquet tables that they are put into.

::

    DIR/study.json                              what it is, and of which recipe
    DIR/<table>/day=2026-11-27/part-0.parquet   rows, sorted; days are UTC
    DIR/.study/journal/<name>.arrows            batches that aren't in the tables yet
    DIR/.study/stamps.parquet                   by which an unchanged log is known without reading it

Only the program that runs the study writes here. Each file appears whole. What a crash leaves is a journal, which is
put into the tables again: that changes nothing where it is in them already.
"""

import json
import os
import secrets
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import parquet

from chladni import __version__
from chladni.io.atomic import atomic_path, atomic_write
from chladni.io.folder import made_folder
from chladni.io.study.tables import ORDER, SCHEMAS, unpacked
from chladni.signals.errors import LogError, SetupError

FOLDER_FORMAT: Final = "chladni.study-results/1"
#: Reasons that lie in the log itself; all others are tried again.
FINAL: Final = ("log",)
#: What a partition of unknown day is called by Hive, and so by DuckDB, Spark and Arrow.
NO_DAY: Final = "__HIVE_DEFAULT_PARTITION__"
_STAMPS: Final = pa.schema([("log", pa.string()), ("stamp", pa.string()), ("content", pa.string())])
_MOST_JSON: Final = 1 << 20


@dataclass(slots=True)
class Done:
    """A log that needn't be done again.

    Attributes
    ----------
    content
        SHA-256 of what was read.
    stamp
        Its `LogAddress.stamp` then; empty where that isn't known.
    """

    content: str
    stamp: str = ""


@dataclass(slots=True)
class StudyFolder:
    """The folder of a study, open for writing; made by `opened_folder`.

    Attributes
    ----------
    path
        The folder.
    done
        What needs no further work, by the name of the log.
    """

    path: Path
    done: dict[str, Done] = field(default_factory=dict)
    _days: dict[str, set[str]] = field(default_factory=dict)
    _waiting: list[Path] = field(default_factory=list)
    _since_s: float = field(default_factory=time.monotonic)
    _took_s: float = 0.0

    @property
    def _journal(self) -> Path:
        return self.path / ".study" / "journal"

    def take(self, content: bytes, stamps: Mapping[str, str], *, source: str) -> Mapping[str, pa.Table]:
        """Keep the answer of a batch for good, and give its tables.

        Parameters
        ----------
        content
            As `chladni.io.study.tables.packed` made it.
        stamps
            Of its logs, by name.
        source
            Who gave it, for messages.

        Raises
        ------
        LogError
            When it can't be written, or isn't what a worker gives.
        """
        tables = unpacked(content, source=source)
        path = self._journal / f"{time.time_ns():020d}-{secrets.token_hex(4)}.arrows"
        with atomic_write(path) as file:
            file.write(content)
        self._waiting.append(path)
        self._note(tables, stamps)
        return tables

    def settle(self, *, every_s: float = 0.0) -> None:
        """Put journals into the tables.

        Parameters
        ----------
        every_s
            Only when the last time is so long ago, and ten times as long as it took; 0 puts them there now.
        """
        began_s = time.monotonic()
        if not self._waiting or began_s - self._since_s < max(every_s, 10 * self._took_s if every_s else 0.0):
            return
        self._put_into_tables()
        self._write_stamps()
        for path in self._waiting:
            path.unlink(missing_ok=True)
        self._waiting.clear()
        self._since_s = time.monotonic()
        self._took_s = self._since_s - began_s

    # --- what is there ---

    def read_back(self) -> None:
        """Learn what is done from the tables and from journals that an earlier run left, and settle these."""
        for path in (self.path / "logs").glob("day=*/part-*.parquet"):
            table = parquet.read_table(path, columns=["log", "content", "status"], partitioning=None)
            day = path.parent.name.removeprefix("day=")
            for log, content in zip(table["log"].to_pylist(), table["content"].to_pylist(), strict=True):
                self._days.setdefault(log, set()).add(day)
                if content is not None:
                    self.done[log] = Done(content)
        for path in (self.path / "failures").glob("day=*/part-*.parquet"):
            table = parquet.read_table(path, columns=["log", "kind"], partitioning=None)
            self._forget_unfinished(table)
        with suppress(FileNotFoundError):
            stamps = parquet.read_table(self.path / ".study" / "stamps.parquet", partitioning=None)
            for log, stamp, content in zip(*(stamps[name].to_pylist() for name in _STAMPS.names), strict=True):
                if log in self.done and self.done[log].content == content:
                    self.done[log].stamp = stamp
        self._waiting = sorted(self._journal.glob("*.arrows"))
        for path in self._waiting:
            self._note(unpacked(path.read_bytes(), source=str(path)), {})
        self.settle()

    def _note(self, tables: Mapping[str, pa.Table], stamps: Mapping[str, str]) -> None:
        if (logs := tables.get("logs")) is not None:
            for log, content in zip(logs["log"].to_pylist(), logs["content"].to_pylist(), strict=True):
                if content is None:
                    self.done.pop(log, None)
                else:
                    self.done[log] = Done(content, stamps.get(log, ""))
        if (effort := tables.get("effort")) is not None:
            for log, content in zip(effort["log"].to_pylist(), effort["content"].to_pylist(), strict=True):
                if log in stamps and log in self.done and self.done[log].content == content:
                    self.done[log].stamp = stamps[log]
        if (failures := tables.get("failures")) is not None:
            self._forget_unfinished(failures)

    def _forget_unfinished(self, failures: pa.Table) -> None:
        for log, kind in zip(failures["log"].to_pylist(), failures["kind"].to_pylist(), strict=True):
            if kind not in FINAL:
                self.done.pop(log, None)

    # --- putting journals into tables ---

    def _put_into_tables(self) -> None:
        # A log that was done twice counts as it was last; what it was before may lie in another day.
        newest: dict[str, Path] = {}
        days: dict[Path, set[str]] = {}
        for path in self._waiting:
            logs = unpacked(path.read_bytes(), source=str(path)).get("logs")
            if logs is None:
                continue
            newest |= dict.fromkeys(logs["log"].to_pylist(), path)
            days[path] = {_day_name(day) for day in logs["day"].to_pylist()}
        mine: dict[Path, list[str]] = {}
        for log, path in newest.items():
            mine.setdefault(path, []).append(log)
        touched = {day for found in days.values() for day in found}
        touched |= {day for log in newest for day in self._days.get(log, ())}
        for day in sorted(touched):
            fresh = {path: mine.get(path, []) for path, found in days.items() if day in found}
            self._rewrite_day(day, fresh, pa.array(list(newest), pa.string()))

    def _rewrite_day(self, day: str, journals: Mapping[Path, list[str]], replaced: pa.Array) -> None:
        """Put the rows of the logs that each journal is the last to tell of in place of older ones."""
        added: dict[str, list[pa.Table]] = {name: [] for name in SCHEMAS}
        for path, logs in journals.items():
            mine = pa.array(logs, pa.string())
            for name, table in unpacked(path.read_bytes(), source=str(path)).items():
                if name in ORDER:
                    kept = pc.and_(pc.is_in(table["log"], mine), _is_day(table["day"], day))
                    added[name].append(table.filter(kept))
            for log in logs:
                # Where it is from now on: noted only once per day that holds a row of it.
                self._days.setdefault(log, set()).add(day)
        for name, tables in added.items():
            self._rewrite(name, day, tables, replaced)

    def _rewrite(self, name: str, day: str, added: list[pa.Table], replaced: pa.Array) -> None:
        path = self.path / name / f"day={day}" / "part-0.parquet"
        parts = [table.drop_columns("day") for table in added if table.num_rows]
        if path.exists():
            old = parquet.read_table(path, partitioning=None)
            kept = old.filter(pc.invert(pc.is_in(old["log"], replaced)))
            if not parts and kept.num_rows == old.num_rows:
                return
            parts.insert(0, kept)
        if not parts:
            return
        columns = SCHEMAS[name].remove(SCHEMAS[name].get_field_index("day"))
        # What is read back has lists whose items are called otherwise.
        whole = pa.concat_tables([part.cast(columns) for part in parts])
        if not whole.num_rows:
            path.unlink(missing_ok=True)
            return
        made_folder(path.parent)
        # In one piece: where pieces end decides how pages are cut, and equal rows are to be equal files.
        whole = whole.sort_by([(column, "ascending") for column in ORDER[name]]).combine_chunks()
        with atomic_path(path) as part:
            parquet.write_table(whole, part, compression="zstd", write_page_checksum=True)

    def _write_stamps(self) -> None:
        known = sorted((log, one) for log, one in self.done.items() if one.stamp)
        columns = [[log for log, _ in known], [one.stamp for _, one in known], [one.content for _, one in known]]
        table = pa.Table.from_arrays([pa.array(one, pa.string()) for one in columns], schema=_STAMPS)
        with atomic_path(self.path / ".study" / "stamps.parquet") as part:
            parquet.write_table(table, part)


def _day_name(day: date | None) -> str:
    return NO_DAY if day is None else day.isoformat()


def _is_day(days: pa.ChunkedArray, day: str) -> pa.ChunkedArray:
    if day == NO_DAY:
        return pc.is_null(days)
    return pc.fill_null(pc.equal(days, pa.scalar(date.fromisoformat(day), pa.date32())), False)


@contextmanager
def opened_folder(path: Path, identity: str, recipe: str) -> Iterator[StudyFolder]:
    """Open the folder of a study to go on with it, or make it.

    Parameters
    ----------
    path
        The folder.
    identity
        Of the recipe, see `Recipe.identity`.
    recipe
        The recipe's text, kept for whoever reads the results.

    Raises
    ------
    SetupError
        When the folder is that of another recipe, holds something else, or another program writes to it.
    LogError
        When it can't be written.
    """
    told = _told(path)
    if told is None:
        if path.is_dir() and any(path.iterdir()):
            raise SetupError(f"{path}: holds files, and no study; name another folder, or one that isn't there")
    elif told["recipe_sha256"] != identity:
        raise SetupError(
            f"{path}: holds results of another recipe (it's kept in {path / 'study.json'}); name another folder, or "
            "go on with that recipe"
        )
    made_folder(path / ".study" / "journal")
    with _alone(path):
        if told is None or told["version"] != __version__:
            content = {"format": FOLDER_FORMAT, "version": __version__, "recipe_sha256": identity, "recipe": recipe}
            with atomic_write(path / "study.json") as file:
                file.write((json.dumps(content, indent=1) + "\n").encode())
        folder = StudyFolder(path=path)
        folder.read_back()
        yield folder


def _told(path: Path) -> dict[str, Any] | None:
    """Give what ``study.json`` says; None where there is none."""
    try:
        with (path / "study.json").open("rb") as file:
            content = json.loads(file.read(_MOST_JSON))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise LogError(f"{path / 'study.json'}: can't be read: {error!s:.200}; name another folder") from error
    if not isinstance(content, dict) or content.get("format") != FOLDER_FORMAT:
        raise SetupError(f"{path / 'study.json'}: isn't of format {FOLDER_FORMAT}; name the folder of a study")
    return content


def require_study(path: Path) -> dict[str, Any]:
    """Give what ``study.json`` of a folder says; `SetupError` when it's no folder of a study."""
    told = _told(path)
    if told is None:
        raise SetupError(f"{path}: is no folder of a study; name what chladni study wrote with --out")
    return told


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the folder for this program alone; a lock that a dead program left is none."""
    descriptor = os.open(path / ".study" / "lock", os.O_CREAT | os.O_RDWR, 0o600)
    try:
        try:
            _lock(descriptor)
        except OSError as error:
            raise SetupError(f"{path}: another program is at work on this study; wait for it, or end it") from error
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    try:
        import fcntl
    except ImportError:
        # Windows refuses a second writer of one file by itself.
        return
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
