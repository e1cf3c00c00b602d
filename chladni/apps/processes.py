"""Processes that work on cases side by side: none outlives whoever started it, none ends unnoticed.

This module imports little, so that a worker listens to signals before it imports what it works with.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from multiprocessing.resource_tracker import ensure_running

from chladni.apps.stopping import end_at_once, on_signals
from chladni.gap.kept_memory import keep_memory
from chladni.signals.errors import SetupError

LOOK_EVERY_S = 0.25


@contextmanager
def workers(jobs: int | None) -> Iterator[Executor | None]:
    """Give processes to work with; None for one, which is this process.

    Ctrl-C and a signal that ends this process end them in the midst of their work; so does its death by any other
    cause, within seconds.

    Raises
    ------
    SetupError
        When `jobs` is below one, or a process was ended from outside.
    """
    count = (os.cpu_count() or 1) if jobs is None else jobs
    if count < 1:
        raise SetupError(f"jobs {count} must be at least 1")
    if count == 1:
        yield None
        return
    _track_semaphores()
    others = frozenset(multiprocessing.active_children())
    done = threading.Event()
    threading.Thread(target=_look_after, args=(others, done), daemon=True, name="chladni-workers").start()
    # A forked child of a process with threads may wait for a lock that nobody holds any more.
    pool = ProcessPoolExecutor(
        count,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=begin_worker,
        initargs=(keep_memory,),
    )
    try:
        yield pool
    except (BrokenProcessPool, KeyboardInterrupt, SystemExit) as error:
        # A case under way may take a minute, and is done again when the campaign goes on: its file isn't there.
        _end(frozenset(multiprocessing.active_children()) - others)
        if not isinstance(error, BrokenProcessPool):
            raise
        raise SetupError(
            "a process was ended from outside, as happens where memory is short; what is done stays: run it again to "
            "go on, with fewer processes (--jobs)"
        ) from error
    finally:
        done.set()
        # After a mistake nobody wants the cases that haven't begun.
        pool.shutdown(cancel_futures=True)


def _look_after(others: frozenset[BaseProcess], done: threading.Event) -> None:
    """End all workers when one has ended before the work is done: the pool notices one of them at least.

    By itself it waits for those that it had when it last had something to do. One that was started later may be gone
    for as long as another case takes.
    """
    seen: frozenset[BaseProcess] = frozenset()
    while not done.wait(LOOK_EVERY_S):
        seen |= frozenset(multiprocessing.active_children()) - others
        if any(process.exitcode is not None for process in seen):
            _end(seen)
            return


def _end(processes: frozenset[BaseProcess]) -> None:
    for process in processes:
        process.terminate()


def _track_semaphores() -> None:
    """Start the process that Python has beside its workers, deaf to SIGHUP as it is to SIGINT and SIGTERM.

    A terminal that closes ends the whole group; without that process the pool can't be taken down in peace.
    """
    if not hasattr(signal, "SIGHUP"):
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGHUP,))
    try:
        # What is blocked stays so in the processes that are started.
        ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def begin_worker(*then: Callable[[], object]) -> None:
    """Let a worker process end at SIGTERM and SIGHUP, and when the process that started it ends, in whatever way.

    Not by Linux's PR_SET_PDEATHSIG: other systems have none, and it would leave parts of files.

    Parameters
    ----------
    then
        What else a worker begins with.
    """
    # A terminal interrupts the whole group: each process would give its case up, begin the next, and say so.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    on_signals(end_at_once, "SIGTERM", "SIGHUP")
    threading.Thread(target=_wait_for_parent, daemon=True, name="chladni-parent").start()
    for begin in then:
        begin()


def _wait_for_parent() -> None:
    # The parent holds the other end of a pipe, which the system closes with it.
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        end_at_once(signal.SIGTERM)
