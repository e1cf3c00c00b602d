"""Where a live source is drawn to: a recording of bounded size, the viewer's window, a browser."""

import os
import queue
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, TYPE_CHECKING, Final, Self
from uuid import uuid4

import rerun as rr

from chladni.signals.errors import LogError
from chladni.signals.live_state import LiveState
from chladni.viewers.display import require_display
from chladni.viewers.rerun.drawing import APPLICATION
from chladni.viewers.rerun.lifetimes import end_unused_streams
from chladni.viewers.rerun.live import LiveDrawing, rehearse
from chladni.viewers.rerun.process import LOOPBACK, free_port, page_address, start, stop
from chladni.viewers.rerun.waiting_states import WaitingStates

if TYPE_CHECKING:
    from subprocess import Popen

#: States written at a time, between looks at the size of the file.
TOGETHER: Final = 4
#: A recording may hold its source up for so long at a state: longer than any disk needs that works.
PATIENCE_S: Final = 1.0
#: At the end a viewer gets so long to take what waits for it.
LAST_S: Final = 5.0
#: Memory that a viewer may take; then it forgets the oldest.
VIEWER_MEMORY: Final = "2GB"


def live_recording(recording_id: str) -> rr.RecordingStream:
    """Open an empty recording, whose rows go out as soon as they are asked for."""
    recording = rr.RecordingStream(
        APPLICATION, recording_id=recording_id, batcher_config=rr.ChunkBatcherConfig.LOW_LATENCY()
    )
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    return recording


class Target(ABC):
    """Takes states one after another, in a thread of its own."""

    what: str
    #: How long the source may be held up by it.
    patience_s: float = 0.0

    @abstractmethod
    def prepare(self) -> None:
        """Do what takes long the first time."""

    @abstractmethod
    def draw(self, states: Sequence[LiveState], /) -> None:
        """Draw the states that wait, and send them on."""

    @abstractmethod
    def close(self) -> None:
        """Send what is left, and let go."""


class RecordingFile(Target):
    """A recording that grows, in two files at most: the present one, and the one before it.

    Parameters
    ----------
    path
        The present file, replaced if it's there. The one before it has ``.earlier`` before its suffix.
    keep_bytes
        Both together take so many bytes at most; None for no bound.

    Raises
    ------
    LogError
        When the file can't be written.
    """

    what = "the recording"
    patience_s = PATIENCE_S

    def __init__(self, path: Path | str, *, keep_bytes: int | None = None) -> None:
        self.path = Path(path)
        self.earlier = self.path.with_suffix(f".earlier{self.path.suffix}")
        self._most = None if keep_bytes is None else keep_bytes // 2
        self._id = str(uuid4())
        self._begin()

    def _begin(self) -> None:
        self._recording = live_recording(self._id)
        self._way = _WayToFile(self.path)
        self._recording.save(self._way.entrance)
        self._drawing = LiveDrawing(self._recording)
        self._drawn = False

    def prepare(self) -> None:
        """Draw something that nobody sees: what is imported for it takes seconds."""
        rehearse()
        self._recording.flush(timeout_sec=LAST_S)

    def draw(self, states: Sequence[LiveState]) -> None:
        """Draw states; OSError when the disk is full."""
        self._drawn = True
        for first in range(0, len(states), TOGETHER):
            for state in states[first : first + TOGETHER]:
                self._drawing.draw(state, curves=state is states[-1])
            self._recording.flush(timeout_sec=LAST_S)
            self._way.require_sound()
            if self._most is not None and self._way.written > self._most:
                self._turn(states[-1])

    def _turn(self, state: LiveState) -> None:
        """Go on in a new file, which holds all averages again; the one before the present goes."""
        self._finish()
        self.earlier.unlink(missing_ok=True)
        self.path.replace(self.earlier)
        self._begin()
        end_unused_streams()
        self._drawn = True
        # Its samples, a moment long, are in both files.
        self._drawing.draw(replace(state, events=()))

    def _finish(self) -> None:
        # The blueprint goes last: rerun 0.41 has lost rows that followed one in a file (rerun issue 12769).
        if self._drawn:
            self._drawing.arrange()
        self._recording.flush(timeout_sec=LAST_S)
        self._recording.disconnect()
        self._way.close()

    def close(self) -> None:
        """Write blueprint and end; OSError when the disk is full."""
        self._finish()


class _WayToFile:
    """What rerun writes, on its way to a file through our own hands.

    On a full disk rerun's file sink only logs the loss, and a later flush waits for ever. So it writes into a pipe,
    and what comes out of that is written here, where an error is seen.

    Parameters
    ----------
    path
        The file.

    Attributes
    ----------
    entrance
        Where rerun is to write.
    written
        Bytes in the file.
    """

    def __init__(self, path: Path) -> None:
        self.written = 0
        self._error: OSError | None = None
        self._thread: threading.Thread | None = None
        if not hasattr(os, "mkfifo"):
            # Windows has no such pipes: there rerun writes the file itself.
            self.entrance = str(path)
            return
        try:
            self._file: IO[bytes] = path.open("wb", buffering=0)
        except OSError as error:
            raise LogError(f"{path}: can't be written: {error.strerror or error}") from error
        self._folder = TemporaryDirectory(prefix="chladni-")
        self.entrance = str(Path(self._folder.name) / "recording.rrd")
        os.mkfifo(self.entrance, 0o600)
        self._thread = threading.Thread(target=self._carry, name="recording", daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        with Path(self.entrance).open("rb", buffering=0) as pipe, self._file:
            while content := pipe.read(1 << 20):
                if self._error is None:
                    self._write(memoryview(content))

    def _write(self, content: memoryview) -> None:
        try:
            while content:
                count = self._file.write(content) or 0
                self.written += count
                content = content[count:]
        except OSError as error:
            # What comes after it is let go, so that rerun doesn't wait.
            self._error = error

    def require_sound(self) -> None:
        """Raise the error that the file gave, if it gave one."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Wait until all is in the file, once rerun has let go; OSError when it isn't."""
        if self._thread is not None:
            self._thread.join(timeout=LAST_S)
            self._folder.cleanup()
        self.require_sound()


class Viewer(Target):
    """The viewer's own window, or a server for a browser, on this computer only.

    Parameters
    ----------
    web
        Whether to serve a browser.

    Attributes
    ----------
    address
        What to open in a browser; None for a window.

    Raises
    ------
    SetupError
        When the viewer doesn't start, as on a computer without a display.
    """

    what = "the viewer"

    def __init__(self, *, web: bool = False) -> None:
        if not web:
            require_display()
        data_port, page_port = free_port(), free_port()
        options = ["--port", str(data_port), "--memory-limit", VIEWER_MEMORY]
        ports = [data_port]
        self.address: str | None = None
        if web:
            options += ["--serve-web", "--web-viewer-port", str(page_port), "--server-memory-limit", "512MB"]
            ports.append(page_port)
            self.address = page_address(page_port, data_port)
        self._process: Popen[bytes] = start(options, ports=ports, detached=not web, settle_s=0.0 if web else 1.0)
        self._web = web
        self._recording = live_recording(str(uuid4()))
        self._recording.connect_grpc(f"rerun+http://{LOOPBACK}:{data_port}/proxy")
        self._drawing = LiveDrawing(self._recording)

    def prepare(self) -> None:
        """Draw something that nobody sees: what is imported for it takes seconds."""
        rehearse()

    @property
    def open(self) -> bool:
        """Whether the viewer still runs."""
        return self._process.poll() is None

    def draw(self, states: Sequence[LiveState]) -> None:
        """Draw states; OSError when the viewer was closed."""
        if not self.open:
            raise OSError("it was closed")
        grown = [self._drawing.draw(state, curves=state is states[-1]) for state in states]
        if any(grown):
            self._drawing.arrange()
        # Waits for the viewer, or the queue between would grow without end.
        self._recording.flush(timeout_sec=PATIENCE_S)

    def wait(self) -> None:
        """Wait until the viewer ends by itself."""
        self._process.wait()

    def close(self) -> None:
        """Let the connection go; the window stays open, the server ends."""
        self._recording.disconnect()
        if self._web:
            stop(self._process)


class Painter:
    """Draws states to a target in a thread, so that a slow one doesn't hold up the averages.

    Parameters
    ----------
    target
        Where to.
    """

    def __init__(self, target: Target) -> None:
        self.target = target
        self._waiting = WaitingStates()
        self._told: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._left_out_s = 0.0
        self._failed = threading.Event()
        self._thread = threading.Thread(target=self._run, name=target.what, daemon=True)
        self._thread.start()

    def show(self, state: LiveState) -> tuple[str, ...]:
        """Hand a state on; give what there is to tell of the target since the last time."""
        told = []
        while not self._told.empty():
            told.append(self._told.get())
        if self._failed.is_set():
            return tuple(told)
        if not self._waiting.put(state, patience_s=self.target.patience_s):
            if not self._left_out_s:
                told.append(f"{self.target.what} can't follow: pictures are left out of it; the averages go on")
            self._left_out_s += sum(one.duration_s for one in state.series[:1])
        elif self._left_out_s:
            told.append(f"{self.target.what} follows again; {self._left_out_s:.3g} s are missing in it")
            self._left_out_s = 0.0
        return tuple(told)

    def close(self) -> tuple[str, ...]:
        """Draw what waits, and let go of the target; give what there is to tell."""
        self._waiting.end()
        self._thread.join(timeout=LAST_S * (1 if self.target.patience_s == 0 else 12))
        told = []
        if self._thread.is_alive():
            told.append(f"{self.target.what} didn't take its end in time; it lacks the last pictures")
        while not self._told.empty():
            told.append(self._told.get())
        return tuple(told)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _run(self) -> None:
        self._try(self.target.prepare)
        while states := self._waiting.take():
            if not self._failed.is_set():
                self._try(partial(self.target.draw, states))
            # Their memory is let go of before the next ones are waited for.
            states.clear()
        self._try(self.target.close)

    def _try(self, work: Callable[[], None]) -> None:
        """Do some work of the target; the first error is told, and nothing is drawn from then on."""
        try:
            work()
        except Exception as error:  # noqa: BLE001  # a day's averages don't end by a picture, whatever is wrong with it
            if self._failed.is_set():
                return
            self._failed.set()
            why = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
            self._told.put(f"{self.target.what} ended: {why or error}; the averages go on without it")
