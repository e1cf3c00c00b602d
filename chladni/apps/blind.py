"""The withheld check with this project's own diagnosis, on all cores."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from typing import Any

from chladni.apps.diagnose import diagnosis_json
from chladni.apps.stopping import begin_worker
from chladni.gap.blind.composition import composition_of
from chladni.gap.blind.make import make_cases
from chladni.gap.blind.run import RunReport, run_cases
from chladni.gap.blind.score import score_cases
from chladni.gap.kept_memory import keep_memory
from chladni.signals.errors import SetupError

Progress = Callable[[float], None]


def make_campaign(
    directory: Path,
    *,
    count: int,
    seed: int,
    kinds: Sequence[str] = (),
    jobs: int | None = None,
    progress: Progress = lambda _share: None,
) -> int:
    """Make a campaign, or what is missing of it; give the number of cases made.

    Parameters
    ----------
    directory
        Where cases and truths go, see `chladni.gap.blind.make.make_cases`.
    count, seed
        Number of cases, and where everything random in them comes from.
    kinds
        How many of which kind in proportion, see `chladni.gap.blind.composition.composition_of`.
    jobs
        Processes; as many as the machine has cores if None.
    progress
        Gets the share done.
    """
    composition = composition_of(kinds)
    with workers(jobs) as executor:
        return make_cases(
            directory, count=count, seed=seed, composition=composition, executor=executor, progress=progress
        )


def run_campaign(
    directory: Path, *, seed: int = 0, jobs: int | None = None, progress: Progress = lambda _share: None
) -> RunReport:
    """Diagnose every case that has no result yet; the truth isn't opened.

    Parameters
    ----------
    directory, seed
        See `chladni.gap.blind.run.run_cases`.
    jobs
        Processes; as many as the machine has cores if None.
    progress
        Gets the share done.
    """
    with workers(jobs) as executor:
        return run_cases(directory, diagnosis_json, seed=seed, executor=executor, progress=progress)


def score_campaign(directory: Path) -> Mapping[str, Any]:
    """Verify the seals, mark the answers, write ``score.json`` and give its content."""
    return score_cases(directory)


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
        for process in frozenset(multiprocessing.active_children()) - others:
            process.terminate()
        if not isinstance(error, BrokenProcessPool):
            raise
        raise SetupError(
            "a process was ended from outside, as happens where memory is short; what is done stays: run it again to "
            "go on, with fewer processes (--jobs)"
        ) from error
    finally:
        # After a mistake nobody wants the cases that haven't begun.
        pool.shutdown(cancel_futures=True)


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
