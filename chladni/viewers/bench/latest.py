"""Work off the page's thread, of which only the latest order counts."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Any

from bokeh.document import Document

from chladni.viewers.bench.parts import pn

Job = Callable[[], Any]
Deliver = Callable[["Future[Any]"], None]


class Latest:
    """Runs one job at a time on a thread; of the jobs that wait meanwhile only the last is run.

    So thirty key presses during one slow computation cost one more computation, not thirty.

    Parameters
    ----------
    document
        The page, on whose thread results are delivered, once the browser has it; None, or a document that no server
        holds (a notebook, a test), waits for each job instead.
    """

    def __init__(self, document: Document | None) -> None:
        served = document is not None and document.session_context is not None
        self._document = document if served else None
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="chladni-bench")
        self._changed = threading.Condition()
        self._waiting: tuple[Job, Deliver] | None = None
        self._held: tuple[Deliver, Future[Any]] | None = None
        self._busy = self._closed = self._loaded = False
        if served:
            # A document takes callbacks of other threads only when its session stands; earlier ones may get lost.
            pn.state.onload(self._load)

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Run `job` when the thread is free, then ``deliver(future)`` on the page's thread."""
        if self._document is None:
            # On the thread all the same: one way for exceptions, served or not.
            future = self._pool.submit(job)
            wait([future])
            deliver(future)
            return
        with self._changed:
            self._waiting = (job, deliver)
            if self._busy:
                return
            self._busy = True
            self._start()

    def settle(self, seconds: float) -> None:
        """Wait a moment while the page is being made: what is ready then is in it from the beginning."""
        if self._document is None:
            return
        with self._changed:
            self._changed.wait_for(lambda: self._held is not None, timeout=seconds)
        self._deliver_held()

    def close(self) -> None:
        """Take no more jobs; the one that runs ends without being delivered."""
        with self._changed:
            self._waiting = self._held = None
            self._closed = self._busy = True
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _load(self) -> None:
        with self._changed:
            self._loaded = True
        self._deliver_held()

    def _start(self) -> None:
        """Hand the waiting job to the thread; the lock is held."""
        if self._waiting is None or self._closed:
            self._busy = self._closed
            return
        job, deliver = self._waiting
        self._waiting = None
        self._pool.submit(job).add_done_callback(partial(self._finish, deliver))

    def _finish(self, deliver: Deliver, future: "Future[Any]") -> None:
        with self._changed:
            # Nobody is there to see it.
            if self._closed or self._document is None:
                return
            if not self._loaded:
                self._held = (deliver, future)
                self._changed.notify_all()
                return
        self._document.add_next_tick_callback(partial(self._deliver, deliver, future))

    def _deliver_held(self) -> None:
        with self._changed:
            held, self._held = self._held, None
        if held is not None:
            self._deliver(*held)

    def _deliver(self, deliver: Deliver, future: "Future[Any]") -> None:
        # The next job starts only when this one is on the page: results can't pile up in front of a slow page.
        try:
            deliver(future)
        finally:
            with self._changed:
                self._start()
