"""Processes that work on a campaign."""

import os
import signal
import time
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest

from chladni.apps.processes import workers
from chladni.apps.stopping import Stopped
from chladni.signals.errors import SetupError

# Longer than it takes to be told to stop, short enough to wait for when nobody tells; or not worth a word.
LONG_S, SHORT_S = 5.0, 0.2


def _case(begun: Path, done: Path, seconds: float) -> None:
    begun.touch()
    time.sleep(seconds)
    done.touch()


def _work_until(error: BaseException, begun: Path, done: Path, seconds: float) -> None:
    with workers(2) as executor:
        assert executor is not None
        executor.submit(_case, begun, done, seconds)
        while not begun.exists():
            time.sleep(0.01)
        raise error


@pytest.mark.parametrize("error", [KeyboardInterrupt(), Stopped(15), BrokenProcessPool()])
def test_who_is_ended_does_not_wait_for_the_cases_under_way(tmp_path: Path, error: BaseException) -> None:
    # A process that was ended from outside, as where memory is short, is told with what to do.
    told = SetupError if isinstance(error, BrokenProcessPool) else type(error)
    with pytest.raises(told):
        _work_until(error, tmp_path / "begun", tmp_path / "done", LONG_S)
    assert not (tmp_path / "done").exists()


def test_a_mistake_lets_the_cases_under_way_end(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="elsewhere"):
        _work_until(ValueError("elsewhere"), tmp_path / "begun", tmp_path / "done", SHORT_S)
    assert (tmp_path / "done").exists()


def _end_when(there: Path, begun: Path) -> None:
    """Wait for a file, then be ended from outside."""
    begun.touch()
    while not there.exists():
        time.sleep(0.01)
    os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))


def _work_until_one_is_ended(begun: Path, done: Path) -> None:
    with workers(2) as executor:
        assert executor is not None
        working = executor.submit(_case, begun, done, LONG_S)
        executor.submit(_end_when, begun, begun.with_name("ends"))
        working.result()


def test_whoever_is_ended_from_outside_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def start_slowly(process: BaseProcess) -> None:
        time.sleep(0.2)
        start(process)

    # The pool's own thread begins to wait before the second process is there.
    start = BaseProcess.start
    monkeypatch.setattr(BaseProcess, "start", start_slowly)
    with pytest.raises(SetupError, match="a process was ended from outside"):
        _work_until_one_is_ended(tmp_path / "begun", tmp_path / "done")
    assert not (tmp_path / "done").exists()


def test_jobs_below_one_are_refused() -> None:
    with pytest.raises(SetupError, match="jobs 0"), workers(0):
        pass


def test_one_job_is_this_process() -> None:
    with workers(1) as executor:
        assert executor is None
