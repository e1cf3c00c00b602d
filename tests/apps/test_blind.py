"""Processes that work on a campaign."""

import time
from pathlib import Path

import pytest

from chladni.apps.blind import workers

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


def test_ctrl_c_does_not_wait_for_the_cases_under_way(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        _work_until(KeyboardInterrupt(), tmp_path / "begun", tmp_path / "done")
    assert not (tmp_path / "done").exists()


def test_a_mistake_lets_the_cases_under_way_end(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="elsewhere"):
        _work_until(ValueError("elsewhere"), tmp_path / "begun", tmp_path / "done")
    assert (tmp_path / "done").exists()
