"""Reads at a position of a file, and says in plain words when a file is no MCAP log at all."""

import os
import stat
import threading
from contextlib import suppress
from pathlib import Path

from chladni.io.mcap.records import MAGIC
from chladni.io.regular_file import require_regular
from chladni.signals.errors import LogError
from chladni.signals.visible import visible
from chladni.signals.wording import near_words

_WINDOW_BYTES = 4 * 1024
_CONVERTED = "rosbags-convert --src {} --dst out --dst-storage mcap"
# What people open by mistake, by the first bytes, and what helps.
_OTHER_FORMATS = (
    (b"#ROSBAG", f"a ROS 1 bag; '{_CONVERTED.format('in.bag')}' (pip install rosbags) writes an MCAP log of it"),
    (
        b"SQLite format 3\0",
        f"a ROS 2 .db3 bag; '{_CONVERTED.format('FOLDER')}' (pip install rosbags) writes an MCAP log of its folder",
    ),
    (b"\x1f\x8b", "a file compressed with gzip; unpack it with gunzip first"),
    (b"\x28\xb5\x2f\xfd", "a file compressed with zstd; unpack it with 'zstd -d' first"),
    (b"\x04\x22\x4d\x18", "a file compressed with lz4; unpack it with 'lz4 -d' first"),
    (b"BZh", "a file compressed with bzip2; unpack it with bunzip2 first"),
    (b"\xfd7zXZ", "a file compressed with xz; unpack it with unxz first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive; unpack it first"),
    (b"PK\x03\x04", "a zip archive, or an Excel workbook; unpack the one, save the other as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook; save it as CSV"),
    (b"\x89HDF", "an HDF5 file; save its arrays as .npz or .parquet, with their times or their rate"),
    (b"\x89MCAP", "another version of MCAP, of which only version 0 is known"),
)
# What programs that take a file for text make of the magic; it holds a high bit and both line ends to show this.
_TEXT_MODE = (
    (MAGIC.replace(b"\n", b"\r\n"), "0a became 0d 0a"),
    (MAGIC.replace(b"\r", b"\n"), "0d became 0a"),
    (MAGIC.replace(b"\r", b""), "0d 0a became 0a"),
    (MAGIC.replace(b"\n", b""), "0d 0a became 0d"),
    (bytes([MAGIC[0] & 0x7F]) + MAGIC[1:], "8 bits became 7"),
    (MAGIC.decode("latin-1").encode(), "89 became UTF-8"),
    ("\ufffd".encode() + MAGIC[1:], "89 became the replacement character of UTF-8"),
)
_SEARCHED_BYTES = 1 << 20
#: Line feeds that all follow a carriage return, the two in the magics among them: 1 in 65 536 by chance.
_FEWEST_LINE_FEEDS = 4


def looks_like(start: bytes) -> str:
    """Say what people open by mistake that begins with these bytes, and what helps; nothing where none does."""
    return next((hint for magic, hint in _OTHER_FORMATS if start.startswith(magic)), "")


class LogFile:
    """A file read by position, never mapped: a file cut short while it is read can't end the process.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    LogError
        When the file can't be opened or doesn't start as MCAP does.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            # A named pipe would block in open() until someone writes to it.
            if not stat.S_ISREG(path.stat().st_mode):
                require_regular(path, LogError)
            self._file = path.open("rb", buffering=0)
        except OSError as error:
            raise LogError(f"{path}: can't be opened: {error.strerror or error}{_beside(path)}") from error
        self.size = os.fstat(self._file.fileno()).st_size
        self._lock = threading.Lock()
        try:
            self._check_magic()
        except LogError:
            self.close()
            raise

    def _check_magic(self) -> None:
        if self.size == 0:
            raise LogError(f"{self.path}: the file is empty; expected an MCAP log")
        start = self.read(0, 16)
        if start.startswith(MAGIC):
            return
        for magic, change in _TEXT_MODE:
            if start.startswith(magic):
                raise self._text_mode_error(f"{change} in its first bytes")
        if hint := looks_like(start):
            raise LogError(f"{self.path}: not a log as it is; it looks like {hint}")
        raise LogError(
            f"{self.path}: not an MCAP log: starts with {start[:8].hex(' ')}, expected the MCAP magic "
            f"{MAGIC.hex(' ')}"
        )

    def require_lone_line_feeds(self) -> None:
        """Refuse a file, known to be damaged, in which every line feed follows a carriage return.

        Raises
        ------
        LogError
            Such are the bytes of a text; a program that took the log for one has put carriage returns everywhere.
        """
        start = self.read(0, _SEARCHED_BYTES)
        feeds = start.count(b"\n")
        if feeds >= _FEWEST_LINE_FEEDS and start.count(b"\r\n") == feeds:
            raise self._text_mode_error(f"all {feeds} bytes 0a in its first {len(start)} stand behind 0d")

    def _text_mode_error(self, sign: str) -> LogError:
        return LogError(
            f"{self.path}: changed by a text-mode transfer (git's autocrlf, FTP in ASCII mode): {sign}; copy the "
            "file again in binary mode, and in git mark it as binary: '*.mcap binary' in .gitattributes"
        )

    def read(self, offset: int, size: int) -> bytes:
        """Return ``size`` bytes at ``offset``, fewer only where the file ends."""
        size = max(0, min(size, self.size - offset))
        parts = []
        with self._lock:
            if self._file.closed:
                raise LogError(f"{self.path}: the log is closed; open it again to read on")
            try:
                self._file.seek(offset)
                while size > 0 and (part := self._file.read(size)):
                    parts.append(part)
                    size -= len(part)
            except OSError as error:
                raise LogError(f"{self.path}: can't be read at byte {offset}: {error.strerror or error}") from error
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class Window:
    """Reads headers that lie close together from a stretch read ahead."""

    def __init__(self, file: LogFile) -> None:
        self._file = file
        self._bytes = b""
        self._offset = 0

    def read(self, offset: int, size: int) -> bytes:
        """Return ``size`` bytes at ``offset``, fewer only where the file ends."""
        start = offset - self._offset
        if start < 0 or start + size > len(self._bytes):
            self.load(offset, max(size, _WINDOW_BYTES))
            start = 0
        return self._bytes[start : start + size]

    def load(self, offset: int, size: int) -> None:
        """Read a stretch ahead."""
        self._bytes = self._file.read(offset, size)
        self._offset = offset

    def view_if_loaded(self, offset: int, size: int) -> memoryview | None:
        """Return ``size`` bytes at ``offset`` without copying, None unless all were read ahead."""
        start = offset - self._offset
        if start < 0 or start + size > len(self._bytes):
            return None
        return memoryview(self._bytes)[start : start + size]

    def peek(self, offset: int, size: int) -> bytes:
        """Return a few bytes like `read` and keep what was read ahead."""
        view = self.view_if_loaded(offset, size)
        return self._file.read(offset, size) if view is None else bytes(view)


def _beside(path: Path) -> str:
    """Name the file of a folder that a missing one may be a slip of; else ask for the path."""
    if path.exists():
        return ""
    with suppress(OSError):
        if near := near_words(path.name, sorted(one.name for one in path.parent.iterdir())):
            return f"; did you mean {visible(str(path.with_name(near[0])))}?"
    return "; give the path of a log"
