"""The logs of a study: files, folders and addresses of stores; each as a file here, with its content's hash."""

import hashlib
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any, BinaryIO, Final

from chladni.io.files.formats import FILE_SUFFIXES, MCAP
from chladni.io.log_info import some_of
from chladni.io.regular_file import open_regular
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.visible import visible

_PIECE_BYTES: Final = 1 << 22
#: A store that sends nothing for so long is taken for dead.
STALL_S: Final = 60.0
_LOOK_EVERY_S: Final = 0.02


class StoreError(LogError):
    """A log that couldn't be reached, for a reason outside the log: it's tried again by the next run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LogAddress:
    """Where a log is.

    Attributes
    ----------
    url
        An absolute path, or an address such as ``s3://bucket/day/a.mcap``.
    stamp
        What changes when the file is written anew: size and time, or what its store tells; empty where unknown.
    size_bytes
        Of the file; 0 where unknown.
    """

    url: str
    stamp: str = ""
    size_bytes: int = 0

    @property
    def told(self) -> str:
        """Its name in tables and messages."""
        return visible(self.url)

    @property
    def is_remote(self) -> bool:
        """Whether it's fetched from a store."""
        return is_address(self.url)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldLog:
    """A log that lies on the disk while it's read.

    Attributes
    ----------
    path
        Where.
    content
        SHA-256 of its bytes, in hexadecimal.
    size_bytes
        Number of its bytes.
    stamp
        What tells it from another file of its name: size and time of a file here, SHA-256 of one that was fetched.
    """

    path: Path
    content: str
    size_bytes: int
    stamp: str


def is_address(word: str) -> bool:
    """Whether a word names something in a store rather than on this disk."""
    scheme, separator, _ = word.partition("://")
    return bool(separator) and scheme not in ("", "file", "local")


def find_logs(words: Sequence[str]) -> tuple[LogAddress, ...]:
    """Find the logs that are meant: files, all logs in a folder and below it, addresses, with ``*`` in them or not.

    Returns
    -------
    tuple of LogAddress
        In the order of their names, each once.

    Raises
    ------
    SetupError
        When a path or an address isn't there, a folder or a pattern holds no log, or what opens an address isn't
        installed.
    StoreError
        When a store can't be listed.
    """
    found: dict[str, LogAddress] = {}
    _require_there([word for word in words if not is_address(word)])
    for word in words:
        for one in _in_store(word) if is_address(word) else _on_disk(word):
            found[one.url] = one
    return tuple(found[url] for url in sorted(found))


def _require_there(words: Sequence[str]) -> None:
    """Refuse slips before any work: the row of a log that never was would stay in the tables."""
    absent = [word for word in words if _is_absent(_path(word))]
    if absent:
        raise SetupError(f"{some_of(absent)}: no such file or folder; correct the path or leave it out")


def _is_absent(path: Path) -> bool:
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return True
    except (OSError, ValueError):
        # Something may be there that can't be read: told as what is wrong with this log.
        return False
    return False


def _path(word: str) -> Path:
    return Path(word.removeprefix("file://").removeprefix("local://"))


def _on_disk(word: str) -> list[LogAddress]:
    path = _path(word)
    if path.is_dir():
        inside = [Path(folder) / name for folder, _, names in os.walk(path) for name in names if _is_log(name)]
        if not inside:
            raise SetupError(f"{word}: holds no log; those that are read end with {MCAP}, {', '.join(FILE_SUFFIXES)}")
        return [_local(one) for one in inside]
    return [_local(path)]


def _is_log(name: str) -> bool:
    return not name.startswith(".") and Path(name).suffix.lower() in (MCAP, *FILE_SUFFIXES)


def _local(path: Path) -> LogAddress:
    # Links are left as they are: a campaign of links is told by their names.
    whole = os.path.abspath(path)  # noqa: PTH100  # resolve() follows links
    try:
        status = Path(whole).stat()
    except (OSError, ValueError):
        # Told when it's read, as what is wrong with this log.
        return LogAddress(url=whole)
    return LogAddress(url=whole, stamp=_stamp(status), size_bytes=status.st_size)


def _stamp(status: os.stat_result) -> str:
    return f"{status.st_size} {status.st_mtime_ns}"


def _in_store(word: str) -> list[LogAddress]:
    system, path = _store(word)
    with _from_store(word, "listed"):
        try:
            if not any(mark in path for mark in "*?["):
                details = [system.info(path)] if not system.isdir(path) else _below(system, path)
            else:
                details = [one for one in system.glob(path, detail=True).values() if one.get("type") == "file"]
        except FileNotFoundError:
            raise SetupError(f"{word}: no such log; look for it in its store") from None
    if not details:
        raise SetupError(f"{word}: holds no log; those that are read end with {MCAP}, {', '.join(FILE_SUFFIXES)}")
    return [_remote(word, one) for one in details]


def _below(system: Any, path: str) -> list[dict[str, Any]]:
    found = system.find(path, detail=True)
    return [one for name, one in found.items() if _is_log(PurePosixPath(name).name)]


def _remote(word: str, details: dict[str, Any]) -> LogAddress:
    name = str(details["name"])
    # Stores name things with their bucket and without the scheme; http names them whole.
    url = name if "://" in name else f"{word.partition('://')[0]}://{name.lstrip('/')}"
    marks = [
        str(details[key]) for key in ("size", "ETag", "etag", "LastModified", "mtime", "md5Hash") if key in details
    ]
    return LogAddress(url=url, stamp=" ".join(marks), size_bytes=int(details.get("size") or 0))


def _store(url: str) -> tuple[Any, str]:
    """Open the store of an address, with the settings and credentials of fsspec's own configuration."""
    try:
        import fsspec
    except ImportError:
        raise SetupError(
            f"{url}: addresses of stores need fsspec, which isn't installed; pip install 'chladni[cluster]'"
        ) from None
    try:
        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise SetupError(f"{url}: {error}; install it on this machine and on every worker") from error
    except ValueError as error:
        raise SetupError(f"{url}: {error!s:.200}; give an address such as s3://bucket/day/*.mcap") from error
    return system, str(path)


@contextmanager
def _from_store(url: str, done: str) -> Iterator[None]:
    """Make a `StoreError` of whatever a store's library raises: those of s3, gcs and http share no base."""
    try:
        yield
    except ChladniError:
        raise
    except Exception as error:
        why = " ".join(str(error).split())
        kind = "" if isinstance(error, OSError) and why else f"{type(error).__name__}: "
        told = f"{kind}{why:.300}".removesuffix(": ")
        raise StoreError(f"{visible(url)}: can't be {done}: {told}; the next run tries again") from error


@contextmanager
def held(address: LogAddress, *, hashed: bool = True) -> Iterator[HeldLog]:
    """Lend a log as a file on this disk; what was fetched is removed afterwards.

    A local file is read for its hash, unless that isn't wanted: then its content is an empty text.

    Raises
    ------
    LogError
        When there is no such file, or it's no regular one.
    StoreError
        When its store can't be reached, this disk is full, or a local file changed while it was read.
    """
    if address.is_remote:
        with TemporaryDirectory(prefix="chladni-") as folder:
            yield _fetched(address, Path(folder))
        return
    path = Path(address.url)
    with open_regular(path, LogError) as file:
        status = os.fstat(file.fileno())
        before, size, content = _stamp(status), status.st_size, ""
        if hashed:
            copy = _Copy()
            copy.run(file)
            size, content = copy.size, copy.digest.hexdigest()
    yield HeldLog(path=path, content=content, size_bytes=size, stamp=before)
    if _stamp(path.stat()) != before:
        raise StoreError(f"{address.told}: changed while it was read; run again when its recorder has closed it")


def _fetched(address: LogAddress, folder: Path) -> HeldLog:
    system, inside = _store(address.url)
    # The name is kept: messages tell it, and its end tells the kind.
    path = folder / (PurePosixPath(inside.rstrip("/")).name.partition("?")[0] or "log.mcap")
    copy = _Copy(target=path)
    with _from_store(address.url, "fetched"):
        copy.run_unless_stalled(lambda: system.open(inside, "rb"))
    content = copy.digest.hexdigest()
    return HeldLog(path=path, content=content, size_bytes=copy.size, stamp=content)


@dataclass(slots=True, kw_only=True)
class _Copy:
    """Reads a file from its start to its end, with the hash of its content; into another file where one is given."""

    target: Path | None = None
    digest: Any = field(default_factory=hashlib.sha256)
    size: int = 0
    _error: BaseException | None = None

    def run(self, source: BinaryIO) -> None:
        """Read all of it."""
        with nullcontext() if self.target is None else self.target.open("wb") as target:
            while piece := source.read(_PIECE_BYTES):
                self.digest.update(piece)
                self.size += len(piece)
                if target is not None:
                    target.write(piece)

    def run_unless_stalled(self, opening: Callable[[], AbstractContextManager[BinaryIO]]) -> None:
        """Read all of it, unless nothing comes for `STALL_S`: stores have time limits of their own, or none."""

        def work() -> None:
            try:
                with opening() as source:
                    self.run(source)
            except BaseException as error:  # noqa: BLE001  # raised below: half a log would pass for a whole one
                self._error = error

        # Not waited for when this process ends: what hangs may hang for ever.
        thread = Thread(target=work, daemon=True, name="chladni-fetch")
        thread.start()
        known, since_s = -1, time.monotonic()
        while thread.is_alive():
            thread.join(_LOOK_EVERY_S)
            if self.size != known:
                known, since_s = self.size, time.monotonic()
            elif time.monotonic() - since_s > STALL_S:
                raise TimeoutError(f"nothing came for {STALL_S:g} s")
        if self._error is not None:
            raise self._error
