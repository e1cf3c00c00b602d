"""An MCAP log that a recorder is still writing: a file that is followed, and standard input."""

import os
import queue
import stat
import sys
import threading
import time
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from chladni.io.live.mcap_stream import McapStream
from chladni.io.live.reception import MessageSource, Reception
from chladni.io.mcap.channel_registry import McapChannel
from chladni.io.mcap.limits import Limits
from chladni.signals.errors import LogError

#: Bytes read at a time: more than a recorder's chunk, little beside memory.
PART_BYTES: Final = 1 << 20
#: How often a file is looked at that has given nothing new.
LOOK_S: Final = 0.01
#: A source that gives nothing for so long is told of.
STALL_S: Final = 5.0
#: Parts of a pipe that wait for the reader.
PARTS_AHEAD: Final = 16


class Silence:
    """Tells of a source that gives nothing for long, and of its return.

    Parameters
    ----------
    name
        Of the source.
    patience_s
        After so long the source counts as ended; None waits for ever.
    """

    def __init__(self, name: str, patience_s: float | None) -> None:
        self.patience_s = patience_s
        self._name = name
        self._since_s = time.monotonic()
        self._told = False

    def heard(self, something: bool) -> tuple[str, ...]:
        """Note whether something came; give what there is to tell."""
        now_s = time.monotonic()
        quiet_s = now_s - self._since_s
        if something:
            self._since_s, told, self._told = now_s, self._told, False
            return (f"{self._name}: goes on after {quiet_s:.1f} s",) if told else ()
        if quiet_s > STALL_S and not self._told:
            self._told = True
            until = "Ctrl-C ends" if self.patience_s is None else f"it ends after {self.patience_s:g} s"
            return (f"{self._name}: nothing came for {STALL_S:g} s; waiting for more ({until})",)
        return ()

    @property
    def over(self) -> bool:
        """Whether patience has run out."""
        return self.patience_s is not None and time.monotonic() - self._since_s > self.patience_s


class _McapSource(MessageSource):
    """Bytes of an MCAP log as they come."""

    def __init__(self, name: str, *, limits: Limits | None, patience_s: float | None) -> None:
        self.name = name
        self._stream = McapStream(name, limits=limits)
        self._silence = Silence(name, patience_s)

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """Channels defined so far."""
        return self._stream.channels

    def receive(self, timeout_s: float) -> Reception:
        """Give what has come; see `MessageSource`."""
        before = self._stream.wanted
        content, over = self._read(timeout_s)
        found = self._stream.feed(content) if content else Reception()
        # Space that isn't written yet is read, and read again.
        told = (*self._silence.heard(self._stream.wanted > before), *found.told)
        if found.ended:
            return Reception(batches=found.batches, told=told, ended=True)
        why = over or (f"nothing came for {self._silence.patience_s:g} s" if self._silence.over else None)
        if why is None:
            return Reception(batches=found.batches, told=told)
        end = self._stream.finish()
        reason = () if why == "end" else (f"{self.name}: {why}",)
        return Reception(batches=found.batches, told=(*told, *reason, *end.told), ended=True)

    @abstractmethod
    def _read(self, timeout_s: float) -> tuple[bytes, str | None]:
        """Give the next bytes, and why there are no more; ``end`` where nothing is to be said of that."""


class FollowedFile(_McapSource):
    """A file that grows.

    Parameters
    ----------
    path
        The file.
    limits
        What may be held in memory on the word of the log.
    patience_s
        Seconds without new bytes after which a log without footer counts as ended; None waits for ever.

    Raises
    ------
    LogError
        When the file can't be opened.
    """

    def __init__(self, path: Path | str, *, limits: Limits | None = None, patience_s: float | None = None) -> None:
        self._path = Path(path)
        super().__init__(self._path.name, limits=limits, patience_s=patience_s)
        try:
            # A named pipe would block in open() until someone writes to it.
            if not stat.S_ISREG(self._path.stat().st_mode):
                raise LogError(f"{path}: not a file; give an MCAP log, - for standard input, or ws://HOST:PORT")
            self._file = self._path.open("rb", buffering=0)
        except FileNotFoundError as error:
            raise LogError(f"{path}: there is no such file; start its recorder first, or name another log") from error
        except OSError as error:
            raise LogError(f"{path}: can't be opened: {error.strerror or error}") from error
        # The same place read again is space that isn't written yet: then it's looked at now and then only.
        self._before, self._ready_s = -1, 0.0

    def _read(self, timeout_s: float) -> tuple[bytes, str | None]:
        end_s = time.monotonic() + timeout_s
        while True:
            offset = self._stream.wanted
            try:
                size = os.fstat(self._file.fileno()).st_size
                if size < offset:
                    return b"", f"became shorter while it was followed: {size} bytes, {offset} were read; it was cut"
                content = os.pread(self._file.fileno(), PART_BYTES, offset) if size > offset else b""
            except OSError as error:
                return b"", f"can't be read at byte {offset}: {error.strerror or error}"
            if self._ready_s > time.monotonic():
                content = b""
            if content or time.monotonic() >= end_s:
                self._ready_s = time.monotonic() + (LOOK_S if offset == self._before else 0.0)
                self._before = offset
                return content, None
            time.sleep(min(LOOK_S, max(0.0, end_s - time.monotonic())))

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class StandardInput(_McapSource):
    """An MCAP log on standard input; whoever writes it waits while it isn't read.

    Parameters
    ----------
    descriptor
        Number of the open file; None for standard input.
    limits, patience_s
        As for `FollowedFile`.
    """

    def __init__(
        self, descriptor: int | None = None, *, limits: Limits | None = None, patience_s: float | None = None
    ) -> None:
        super().__init__("standard input", limits=limits, patience_s=patience_s)
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._parts: queue.Queue[bytes | OSError] = queue.Queue(PARTS_AHEAD)
        self._closed = threading.Event()
        threading.Thread(target=self._fill, name="standard input", daemon=True).start()

    def _fill(self) -> None:
        while not self._closed.is_set():
            try:
                part: bytes | OSError = os.read(self._descriptor, PART_BYTES)
            except OSError as error:
                part = error
            self._parts.put(part)
            if not part or isinstance(part, OSError):
                return

    def _read(self, timeout_s: float) -> tuple[bytes, str | None]:
        try:
            part = self._parts.get(timeout=max(timeout_s, 1e-3))
        except queue.Empty:
            return b"", None
        if isinstance(part, OSError):
            return b"", f"can't be read: {part.strerror or part}"
        return part, None if part else "end"

    def close(self) -> None:
        """Stop reading."""
        self._closed.set()
