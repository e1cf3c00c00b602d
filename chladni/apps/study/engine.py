"""Batches of work on a cluster: a bounded number at a time, those of lost workers again, none waited for in vain."""

import queue
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from itertools import islice
from statistics import median
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from chladni.signals.errors import SetupError

if TYPE_CHECKING:
    from distributed import Client, Future

Item = TypeVar("Item")

#: A batch is to take so long: a task costs the scheduler a millisecond or two; with a worker its batch is lost.
BATCH_S: Final = 2.0
MOST_IN_BATCH: Final = 200
#: Batches a worker's thread has at hand, so that it never waits for the next one.
AHEAD: Final = 2
#: Times that a log may end its worker before it's given up.
MOST_LOSSES: Final = 2
#: How long without any worker, or without the scheduler, before the run ends.
PATIENCE_S: Final = 60.0
ASK_EVERY_S: Final = 2.0
_LOOK_EVERY_S: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer(Generic[Item]):
    """What became of a batch.

    Attributes
    ----------
    items
        The batch.
    content
        What the work gave; None where it was given up.
    reason
        Why it was given up.
    """

    items: tuple[Item, ...]
    content: bytes | None = None
    reason: str = ""


@dataclass(slots=True)
class _Batch(Generic[Item]):
    items: tuple[Item, ...]
    losses: int = 0


@dataclass(slots=True)
class Engine(Generic[Item]):
    """Does work on items in batches on a cluster.

    Attributes
    ----------
    client
        See `chladni.apps.study.cluster.cluster`.
    work
        Function of a module, of a sequence of items; gives bytes, and raises only for a defect.
    batch_s
        How long a batch is to take.
    """

    client: "Client"
    work: Callable[[Sequence[Item]], bytes]
    batch_s: float = BATCH_S
    _ended: "queue.SimpleQueue[Future]" = field(default_factory=queue.SimpleQueue)
    _running: "dict[str, tuple[Future, _Batch[Item]]]" = field(default_factory=dict)
    _again: "deque[_Batch[Item]]" = field(default_factory=deque)
    _seconds: "deque[float]" = field(default_factory=lambda: deque(maxlen=50))
    _known_threads: int = 0
    _ask_at_s: float = 0.0
    _submitted: int = 0

    def run(self, items: Iterable[Item]) -> Iterator[Answer[Item]]:
        """Do the work on all items, and give what became of each batch as it ends, in any order.

        Raises
        ------
        SetupError
            When there is no worker, or the scheduler has gone.
        """
        waiting = iter(items)
        try:
            while True:
                self._fill(waiting)
                if not self._running:
                    return
                answer = self._answer(self._next())
                if answer is not None:
                    yield answer
        finally:
            # Whoever stops in the midst leaves no work behind on a cluster of others.
            for future, _ in self._running.values():
                future.cancel(reason="the study has ended")

    def note_seconds(self, seconds: float) -> None:
        """Learn what one item took, which decides the size of later batches."""
        self._seconds.append(seconds)

    def _fill(self, waiting: Iterator[Item]) -> None:
        room = AHEAD * max(1, self.threads()) - len(self._running)
        while room > 0:
            batch = self._again.popleft() if self._again else self._new(waiting)
            if batch is None:
                return
            self._submit(batch)
            room -= 1

    def _new(self, waiting: Iterator[Item]) -> _Batch[Item] | None:
        each_s = median(self._seconds) if self._seconds else self.batch_s
        size = min(MOST_IN_BATCH, max(1, round(self.batch_s / max(each_s, 1e-4))))
        items = tuple(islice(waiting, size))
        return _Batch(items) if items else None

    def _submit(self, batch: _Batch[Item]) -> None:
        self._submitted += 1
        key = f"chladni-{id(self)}-{self._submitted}"
        # What is pure would be taken from another run's memory; retries are counted here.
        future = self.client.submit(self.work, list(batch.items), key=key, pure=False)
        self._running[key] = (future, batch)
        future.add_done_callback(self._ended.put)

    def threads(self) -> int:
        """Threads of all workers; asked for now and then, since workers come and go."""
        now_s = time.monotonic()
        if now_s >= self._ask_at_s:
            try:
                self._known_threads = sum(int(one) for one in self.client.nthreads().values())
            except OSError:
                # The scheduler doesn't answer.
                self._known_threads = 0
            self._ask_at_s = now_s + ASK_EVERY_S
        return self._known_threads

    def _next(self) -> "Future":
        alive_s = time.monotonic()
        while True:
            try:
                return self._ended.get(timeout=_LOOK_EVERY_S)
            except queue.Empty:
                pass
            if self.client.status == "closed":
                raise SetupError("the scheduler has gone; what is done stays: run it again to go on")
            if self.client.status == "running" and self.threads():
                alive_s = time.monotonic()
            elif time.monotonic() - alive_s > PATIENCE_S:
                what = "no worker" if self.client.status == "running" else "no scheduler"
                raise SetupError(
                    f"{what} for {PATIENCE_S:g} s; what is done stays: start one, and run it again to go on"
                )

    def _answer(self, future: "Future") -> Answer[Item] | None:
        entry = self._running.pop(str(future.key), None)
        if entry is None:
            return None
        _, batch = entry
        if future.status != "finished":
            return self._lost(batch, future)
        from distributed.scheduler import KilledWorker

        try:
            content: bytes = future.result(timeout=PATIENCE_S)
        except (OSError, ValueError, CancelledError, KilledWorker) as error:
            # The worker that held the answer went with it, and perhaps the one that was to compute it again.
            return self._lost(batch, future, error)
        return Answer(items=batch.items, content=content)

    def _lost(self, batch: _Batch[Item], future: "Future", error: Exception | None = None) -> Answer[Item] | None:
        if future.status == "cancelled" or future.cancelled():
            self._again.append(batch)
            # A scheduler that comes back has forgotten all.
            time.sleep(_LOOK_EVERY_S)
            return None
        if len(batch.items) > 1:
            # One of them is to blame, and the others aren't.
            self._again.extend(_Batch((item,), batch.losses) for item in batch.items)
            return None
        batch.losses += 1
        if batch.losses < MOST_LOSSES:
            self._again.append(batch)
            return None
        return Answer(items=batch.items, reason=self._reason(future, error))

    def _reason(self, future: "Future", error: Exception | None) -> str:
        from distributed.scheduler import KilledWorker

        try:
            error = error or future.exception(timeout=PATIENCE_S)
        except (OSError, RuntimeError) as unknown:
            # The scheduler doesn't answer, or the client has been closed.
            error = unknown
        if isinstance(error, KilledWorker):
            return "its worker was ended each time, as happens where memory is short; try it on a larger machine"
        return f"the worker failed ({type(error).__name__}): {' '.join(str(error).split()):.300}"
