"""Modes of a log that is still being written: looked for beside the averages, and followed from look to look."""

import time
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from chladni.apps.modes import Wanted, modes_of_spectra
from chladni.modal.operational.mode_tracking import ModeTracker
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.live_state import TrackedMode
from chladni.signals.mode_set import ModeSet

#: Work of each kind that renews averages takes at most this share of the time.
SHARE: Final = 0.1


class Schedule:
    """Says when it's time again for some work, so that it takes a bounded share of the time."""

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._next_s = 0.0

    @property
    def due(self) -> bool:
        """Whether it is time."""
        return time.monotonic() >= self._next_s

    def done(self, took_s: float) -> None:
        """Note that the work was done, and how long it took."""
        self._next_s = time.monotonic() + max(self._every_s, took_s / SHARE)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeLook:
    """Modes found at one look; None where an average tells none yet."""

    whole: ModeSet | None
    recent: ModeSet | None
    time_s: float
    took_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeJob:
    """Averages from which modes are to be identified: over all, and of the present."""

    whole: CrossSpectra
    recent: CrossSpectra
    wanted: Wanted
    time_s: float

    @in_one_thread()
    def look(self) -> ModeLook:
        """Identify the modes of both averages."""
        begun_s = time.monotonic()
        whole = self._of(self.whole)
        recent = whole if self.recent is self.whole else self._of(self.recent)
        return ModeLook(whole=whole, recent=recent, time_s=self.time_s, took_s=time.monotonic() - begun_s)

    def _of(self, spectra: CrossSpectra) -> ModeSet | None:
        try:
            return modes_of_spectra(spectra, method=None, wanted=self.wanted)
        except EstimateError:
            # Mostly too few averages yet; at the end there is a note on it.
            return None


class ModeLooks:
    """Looks for modes in a thread, one look at a time, and follows what they find.

    Parameters
    ----------
    worker
        Whose thread it is.
    every_s
        Time between two looks, at least.
    """

    def __init__(self, worker: Executor, *, every_s: float) -> None:
        self._worker = worker
        self._schedule = Schedule(every_s)
        self._running: Future[ModeLook] | None = None
        self._tracker = ModeTracker()

    @property
    def due(self) -> bool:
        """Whether it is time for another look."""
        return self._running is None and self._schedule.due

    @property
    def tracked(self) -> tuple[TrackedMode, ...]:
        """Modes of the present."""
        return self._tracker.modes

    def begin(self, job: ModeJob) -> None:
        """Look in the thread."""
        self._running = self._worker.submit(job.look)

    def finished(self, *, wait: bool) -> tuple[ModeLook, ...]:
        """Give the look that was begun, once it's done; with `wait`, in any case."""
        if self._running is None or not (wait or self._running.done()):
            return ()
        look, self._running = self._running.result(), None
        self._schedule.done(look.took_s)
        return (look,)

    def follow(self, look: ModeLook) -> tuple[str, ...]:
        """Take the modes of a look; give sentences on what changed beyond error bars."""
        return () if look.recent is None else self._tracker.look(look.recent, look.time_s)
