"""Writing where the user said: a file appears whole under its name, or not at all; pipes and devices are written to.

Beside a file that is being written lies its part, ``.NAME.<12 hexadecimal digits>.part``. An error or a signal
removes it. After ``kill -9`` or a power cut it stays, until the next writer of the same file finds that nobody holds
its lock.
"""

import os
import re
import secrets
import shutil
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import SpooledTemporaryFile
from types import ModuleType
from typing import BinaryIO, cast

from chladni.signals.errors import LogError

_locks: ModuleType | None
try:
    import fcntl as _locks
except ImportError:
    # Windows: a part that lost its program stays there.
    _locks = None

_RANDOM_BYTES = 6
#: Bytes of a part's name that tell whose it is; the whole must fit what file systems allow, 143 bytes at least.
_NAME_BYTES = 64
#: What is sent to a pipe or a device is collected in memory up to so many bytes, beyond on the disk.
_BYTES_IN_MEMORY = 64 * 1024 * 1024
#: Links in a row after which Linux, too, speaks of a loop.
_MOST_LINKS = 40

#: Parts that this process is writing.
_parts: set[Path] = set()


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where an output goes.

    Attributes
    ----------
    path
        As it was given.
    target
        With all links followed: a link stays, what it points at is replaced.
    status
        Of what is there; None when there is nothing yet.
    descriptor
        Number of the open file that the path stands for, as ``/dev/stdout`` and the shell's ``>(command)`` do.
    """

    path: Path
    target: Path
    status: os.stat_result | None
    descriptor: int | None

    @classmethod
    def of(cls, path: Path | str) -> "Place":
        """Look at a path.

        Raises
        ------
        LogError
            When the operating system can't follow it: no such folder, a loop of links, a name too long, a current
            folder that was removed.
        """
        path = Path(path)
        try:
            descriptor = _descriptor(path)
            if descriptor is not None:
                return cls(path=path, target=path, status=os.fstat(descriptor), descriptor=descriptor)
            target = Path(os.path.realpath(path))
            return cls(path=path, target=target, status=_status(target), descriptor=None)
        except OSError as error:
            raise LogError(_refusal(path, error)) from error

    @property
    def is_stream(self) -> bool:
        """Whether it is written to as it is: a pipe, a device, or a file that is open already."""
        return self.descriptor is not None or (self.status is not None and not stat.S_ISREG(self.status.st_mode))

    @property
    def is_folder(self) -> bool:
        """Whether a folder is there."""
        return self.status is not None and stat.S_ISDIR(self.status.st_mode)

    def is_same(self, other: "Place") -> bool:
        """Whether both are one file under any two names; writing both to one stream harms nothing."""
        if self.is_stream or other.is_stream:
            return False
        if self.status is None or other.status is None:
            return self.target == other.target
        return os.path.samestat(self.status, other.status)


def require_place(path: Path | str, *, overwrite: bool = True) -> Place:
    """Refuse a path at which nothing can be written, before there is anything to write.

    Raises
    ------
    LogError
        When the folder doesn't exist or can't be written to, `path` is a folder or write-protected, or it's a file
        and `overwrite` is false.
    """
    place = Place.of(path)
    if place.is_folder:
        raise LogError(f"{path}: is a folder; name a file in it")
    if place.is_stream:
        return place
    if place.status is not None and not overwrite:
        raise LogError(f"{path}: exists already; ask for overwriting (--overwrite) or name another file")
    if not os.access(place.target.parent, os.W_OK | os.X_OK):
        raise LogError(f"{path}: the folder {place.target.parent} can't be written to; name another")
    if place.status is not None and not os.access(place.target, os.W_OK):
        raise LogError(f"{path}: is write-protected; allow writing (chmod u+w) or name another file")
    return place


@contextmanager
def atomic_path(path: Path | str, *, overwrite: bool = True) -> Iterator[Path]:
    """Lend a path beside `path`, and put what was written there in place when the block ends well.

    It is flushed to the disk and then renamed; a file that is replaced hands on its permissions and owner. On any
    error, a signal included, it is removed and `path` stays as it was.

    Parameters
    ----------
    path
        Where the file is to appear; a symbolic link is followed, so that the link itself stays.
    overwrite
        Whether a file that exists may be replaced.

    Raises
    ------
    LogError
        When nothing can be written there (`require_place`), `path` is a pipe or a device, or the operating system
        refuses the write (disk full, no permission).
    """
    place = require_place(path, overwrite=overwrite)
    if place.is_stream:
        raise LogError(
            f"{path}: is a pipe or a device, which this kind of file can't be sent to; name a file, and send that"
        )
    with _told(place), scratch_path(place.target) as part:
        yield part
        _flush_to_disk(part)
        status = require_place(path, overwrite=overwrite).status
        if status is not None:
            _hand_on(status, part)
        part.replace(place.target)
        # The file is in place: a folder that can't be flushed only matters to a power cut.
        with suppress(OSError):
            _flush_to_disk(place.target.parent)


@contextmanager
def atomic_write(path: Path | str, *, overwrite: bool = True) -> Iterator[BinaryIO]:
    """Open a binary file that appears under `path`, whole, when the block ends well; see `atomic_path`.

    A pipe, a device or a file that is open already (``/dev/stdout``) gets all of it at the end of the block.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_write(Path(folder) / "a.bin") as file:
    ...         _ = file.write(b"whole")
    ...     (Path(folder) / "a.bin").read_bytes()
    b'whole'
    """
    place = require_place(path, overwrite=overwrite)
    if not place.is_stream:
        with atomic_path(path, overwrite=overwrite) as part, part.open("wb") as file:
            yield file
        return
    with _told(place), SpooledTemporaryFile(_BYTES_IN_MEMORY) as whole:
        yield cast("BinaryIO", whole)
        whole.seek(0)
        with _opened(place) as stream:
            shutil.copyfileobj(whole, stream)


@contextmanager
def scratch_path(beside: Path) -> Iterator[Path]:
    """Lend the path of an empty file in the folder of `beside`, and remove what is there in the end.

    Parts of `beside` that crashed programs left are removed, too.
    """
    _remove_abandoned(beside)
    part = beside.with_name(f"{_part_prefix(beside)}{secrets.token_hex(_RANDOM_BYTES)}.part")
    # First of all: a signal may come at any line from here on.
    _parts.add(part)
    held = None
    try:
        held = _created(part, private=beside.exists())
        yield part
    finally:
        part.unlink(missing_ok=True)
        _parts.discard(part)
        if held is not None:
            os.close(held)


def remove_parts() -> None:
    """Remove every part that this process is writing, for a process that ends here and now."""
    for part in tuple(_parts):
        with suppress(OSError):
            part.unlink(missing_ok=True)


@contextmanager
def _told(place: Place) -> Iterator[None]:
    """Make a `LogError` of what the operating system says of the target."""
    try:
        yield
    except OSError as error:
        if error.filename is not None and not _is_part_of(place, Path(str(error.filename))):
            raise  # about another file, which the block was reading
        raise LogError(
            f"{place.path}: can't be written: {error.strerror or error}; nothing was left behind"
        ) from error


def _is_part_of(place: Place, path: Path) -> bool:
    return path in (place.path, place.target, place.target.parent) or (
        path.parent == place.target.parent and path.name.startswith(_part_prefix(place.target))
    )


def _status(target: Path) -> os.stat_result | None:
    try:
        return target.stat()
    except FileNotFoundError:
        target.parent.stat()
        return None


def _descriptor(path: Path) -> int | None:
    """Give the number of this process's open file that a path leads to, None for any other path.

    Not by opening it: Linux would open the file a second time, from its start.
    """
    for _ in range(_MOST_LINKS):
        folder = os.path.realpath(path.parent)
        if folder in ("/dev/fd", f"/proc/{os.getpid()}/fd") and path.name.isdecimal():
            return int(path.name)
        if not path.is_symlink():
            return None
        path = Path(folder) / path.readlink()
    return None


def _refusal(path: Path, error: OSError) -> str:
    if not isinstance(error, FileNotFoundError):
        return f"{path}: can't be written: {error.strerror or error}; name another file"
    if error.filename is None:
        return f"{path}: the current folder was removed; change to one that is there (cd)"
    return f"{path}: there is no folder {Path(os.path.realpath(path)).parent}; make it, or name another"


def _opened(place: Place) -> BinaryIO:
    if place.descriptor is None:
        # Not made, should it have gone meanwhile.
        return os.fdopen(os.open(place.path, os.O_WRONLY), "wb")
    for told in (sys.stdout, sys.stderr):
        if told is not None:
            told.flush()
    return os.fdopen(os.dup(place.descriptor), "wb")


def _part_prefix(target: Path) -> str:
    if target in _parts:
        # What is beside a part is found with it.
        return target.name.removesuffix("part")
    return f".{os.fsencode(target.name)[:_NAME_BYTES].decode(errors='ignore')}."


def _created(part: Path, *, private: bool) -> int | None:
    """Make the part, hold its lock, and give the descriptor that holds it."""
    while True:
        descriptor = os.open(part, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600 if private else 0o666)
        if _locks is None:
            os.close(descriptor)
            return None
        # Where a file system has no locks, nobody can take this one for abandoned.
        with suppress(OSError):
            _locks.flock(descriptor, _locks.LOCK_EX)
        if part.exists():
            return descriptor
        # Another writer held the lock before we did, and took the part for abandoned.
        os.close(descriptor)


def _remove_abandoned(target: Path) -> None:
    """Remove parts of `target` whose lock nobody holds: their programs were killed."""
    if _locks is None:
        return
    kind = re.compile(re.escape(_part_prefix(target)) + rf"([0-9a-f]{{{2 * _RANDOM_BYTES}}}\.)+part")
    # A folder that can't be listed may still be written to.
    with suppress(OSError):
        for part in target.parent.iterdir():
            if kind.fullmatch(part.name):
                with suppress(OSError):
                    _remove_unheld(part, _locks)


def _remove_unheld(part: Path, locks: ModuleType) -> None:
    descriptor = os.open(part, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        locks.flock(descriptor, locks.LOCK_EX | locks.LOCK_NB)
        part.unlink()
    finally:
        os.close(descriptor)


def _hand_on(status: os.stat_result, part: Path) -> None:
    """Give the part the owner and the permissions of the file that it replaces."""
    # Only root may give files away; others may choose among their groups.
    with suppress(OSError):
        os.chown(part, status.st_uid, status.st_gid)
    part.chmod(stat.S_IMODE(status.st_mode))


def _flush_to_disk(path: Path) -> None:
    # Renaming is only safe against a power cut when both the data and the folder's entry are on the disk. Windows
    # can't open a folder, and flushes its entries itself.
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
