"""Pieces of a diagnosis, worked on by several threads."""

import multiprocessing
import os
import time
from threading import Barrier, Event, current_thread

import numpy as np
import pytest

from chladni.gap import side_by_side as module
from chladni.gap.side_by_side import side_by_side, threads


@pytest.fixture
def three_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "threads", lambda: 3)


@pytest.mark.usefixtures("three_threads")
def test_pieces_are_worked_on_at_once_and_come_back_in_their_order() -> None:
    # A barrier that three must reach: one thread alone would wait in vain.
    together = Barrier(3, timeout=30.0)

    def work(piece: int) -> int:
        together.wait()
        return -piece

    assert side_by_side(work, range(6)) == [0, -1, -2, -3, -4, -5]


@pytest.mark.usefixtures("three_threads")
def test_the_caller_hears_how_far_it_is() -> None:
    told: list[float] = []
    names: set[str] = set()

    def progress(share: float) -> None:
        told.append(share)
        names.add(current_thread().name)

    side_by_side(abs, [-1, -2, -3, -4], progress)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert names == {current_thread().name}


@pytest.mark.usefixtures("three_threads")
def test_the_first_error_by_order_is_raised_and_no_further_piece_is_begun() -> None:
    together, begun = Barrier(3, timeout=30.0), []

    def work(piece: int) -> int:
        begun.append(piece)
        if piece < 3:
            together.wait()
        if piece in (1, 2):
            raise ValueError(f"piece {piece}")
        # Long enough for the others' errors to be heard of.
        time.sleep(0.01)
        return piece

    with pytest.raises(ValueError, match="piece 1"):
        side_by_side(work, range(1000))
    # Those three, and what the thread that had no error took before it heard of the others'.
    assert len(begun) < 1000


@pytest.mark.usefixtures("three_threads")
def test_pieces_of_a_piece_stay_in_its_thread() -> None:
    def inner(_piece: int) -> str:
        return current_thread().name

    def outer(_piece: int) -> set[str]:
        return {current_thread().name, *side_by_side(inner, range(4))}

    assert all(len(names) == 1 for names in side_by_side(outer, range(6)))


@pytest.mark.usefixtures("three_threads")
def test_how_numpy_takes_errors_goes_along() -> None:
    together = Barrier(3, timeout=30.0)

    def work(_piece: int) -> str:
        together.wait()
        return np.geterr()["over"]

    with np.errstate(over="raise"):
        assert side_by_side(work, range(3)) == ["raise"] * 3


@pytest.mark.usefixtures("three_threads")
def test_who_interrupts_gets_out_at_once() -> None:
    caller, interrupted = current_thread(), Event()

    def work(_piece: int) -> None:
        if current_thread() is caller:
            interrupted.set()
            raise KeyboardInterrupt
        interrupted.wait(30.0)

    with pytest.raises(KeyboardInterrupt):
        side_by_side(work, range(1000))


def test_a_process_that_another_one_started_takes_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    assert threads() == 3
    monkeypatch.setattr(multiprocessing, "parent_process", object)
    assert threads() == 1
