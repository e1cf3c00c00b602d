"""Atomic writing: a file appears whole under its name, or not at all."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from chladni.signals.errors import LogError


@contextmanager
def atomic_path(path: Path | str, *, overwrite: bool = True) -> Iterator[Path]:
    """Lend a temporary path beside `path`, and put what was written there in place when the block ends well.

    The temporary file has the suffix of `path`, for libraries that choose the format by it. It is flushed to the
    disk and then renamed. On any error, Ctrl-C included, it is removed and `path` stays as it was.

    Parameters
    ----------
    path
        Where the file is to appear; a symbolic link is followed, so that the link itself stays.
    overwrite
        Whether a file that exists may be replaced.

    Raises
    ------
    LogError
        When the folder doesn't exist, `path` is a folder, `path` exists and `overwrite` is false, or the operating
        system refuses the write (disk full, no permission).
    """
    target = Path(path).resolve()
    _require_writable(target, overwrite=overwrite)
    temporary = target.with_name(f".{target.stem[:64]}.{secrets.token_hex(6)}{target.suffix}")
    try:
        yield temporary
        _flush_to_disk(temporary)
        _require_writable(target, overwrite=overwrite)
        temporary.replace(target)
        _flush_to_disk(target.parent)
    except OSError as error:
        if error.filename not in (None, str(temporary), str(target), str(target.parent)):
            raise  # about another file, which the block was reading
        raise LogError(f"{path}: can't be written: {error.strerror or error}; nothing was left behind") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_write(path: Path | str, *, overwrite: bool = True) -> Iterator[BinaryIO]:
    """Open a binary file that appears under `path`, whole, when the block ends well; see `atomic_path`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_write(Path(folder) / "a.bin") as file:
    ...         _ = file.write(b"whole")
    ...     (Path(folder) / "a.bin").read_bytes()
    b'whole'
    """
    with atomic_path(path, overwrite=overwrite) as temporary, temporary.open("xb") as file:
        yield file


def _require_writable(target: Path, *, overwrite: bool) -> None:
    if not target.parent.is_dir():
        raise LogError(f"{target}: the folder {target.parent} doesn't exist; make it first")
    if target.is_dir():
        raise LogError(f"{target}: is a folder; name a file in it")
    if target.exists() and not overwrite:
        raise LogError(f"{target}: exists already; ask for overwriting or name another file")


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
