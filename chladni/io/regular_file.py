"""Opening files that a user names: regular ones alone, and no more of them than is sane."""

import stat
from pathlib import Path
from typing import BinaryIO

from chladni.signals.errors import ChladniError
from chladni.signals.visible import visible

_KINDS = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def open_regular(path: Path, kind: type[ChladniError]) -> BinaryIO:
    """Open a file to read its bytes.

    A named pipe would block until someone writes to it, and a device may never end.

    Raises
    ------
    ChladniError
        Of the kind given, when there is no such file, it can't be read, or is no regular file.
    """
    require_regular(path, kind)
    try:
        return path.open("rb")
    except OSError as error:
        raise kind(f"{path}: can't be read: {error.strerror or error}") from None


def require_regular(path: Path, kind: type[ChladniError]) -> None:
    """Refuse what isn't there, or is no regular file, as `open_regular` does."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise kind(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        # A name may hold what no file's does.
        raise kind(f"{path}: can't be read: {getattr(error, 'strerror', None) or error}") from None
    if not stat.S_ISREG(mode):
        if stat.S_ISDIR(mode):
            raise kind(f"{path}: is a folder; name a file in it{_such_as(path)}")
        found = next((what for is_it, what in _KINDS if is_it(mode)), "no regular file")
        raise kind(f"{path}: is {found}; files alone are read: write what it gives into one, and name that")


def _such_as(folder: Path) -> str:
    """Name the first of the logs in a folder, and for a recording in several files what puts them together."""
    try:
        parts = sorted(folder.glob("*.mcap"))
    except OSError:
        return ""
    merge = f"; 'mcap merge' makes one file of its {len(parts)} .mcap files" if len(parts) > 1 else ""
    return f", such as {visible(parts[0].name)}{merge}" if parts else ""


def read_text(path: Path, most_bytes: int, kind: type[ChladniError]) -> str:
    """Read a text in UTF-8, a byte order mark left out.

    Raises
    ------
    ChladniError
        Of the kind given, as `open_regular`, and when the file is larger than `most_bytes` or isn't UTF-8.
    """
    with open_regular(path, kind) as file:
        try:
            raw = file.read(most_bytes + 1)
        except OSError as error:
            raise kind(f"{path}: can't be read: {error.strerror or error}") from None
    if len(raw) > most_bytes:
        raise kind(f"{path}: is larger than {most_bytes} bytes, the most that a file of this kind may have")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise kind(f"{path}:{line}: byte {raw[error.start]:#04x} isn't UTF-8; save the file as UTF-8") from None
