"""Processes that work on a campaign."""

import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from chladni.apps.blind import workers
from chladni.apps.stopping import Stopped
from chladni.signals.errors import SetupError

# Longer than it takes to be told to stop, short enough to wait for when nobody tells.
CASE_S = 5.0


def _case(begun: Path, done: Path) -> None:
    begun.touch()
    time.sleep(CASE_S)
    done.touch()


def _work_until(error: BaseException, begun: Path, done: Path) -> None:
    with workers(2) as executor:
        assert executor is not None
        executor.submit(_case, begun, done)
        while not begun.exists():
            time.sleep(0.01)
        raise error


@pytest.mark.parametrize("error", [KeyboardInterrupt(), Stopped(15), BrokenProcessPool()])
def test_who_is_ended_does_not_wait_for_the_cases_under_way(tmp_path: Path, error: BaseException) -> None:
    # A process that was ended from outside, as where memory is short, is told with what to do.
    told = SetupError if isinstance(error, BrokenProcessPool) else type(error)
    with pytest.raises(told):
        _work_until(error, tmp_path / "begun", tmp_path / "done")
    assert not (tmp_path / "done").exists()


def test_a_mistake_lets_the_cases_under_way_end(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="elsewhere"):
        _work_until(ValueError("elsewhere"), tmp_path / "begun", tmp_path / "done")
    assert (tmp_path / "done").exists()
