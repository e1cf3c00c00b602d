"""Jobs off the page's thread, with a document that keeps its callbacks until the test runs them."""

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.pause import Pause

if TYPE_CHECKING:
    from concurrent.futures import Future


class Document:
    """What `Latest` and `Pause` need of a served document."""

    session_context = "served"

    def __init__(self) -> None:
        self.ticks: list[Callable[[], None]] = []
        self.timeouts: list[tuple[Callable[[], None], int]] = []

    def add_next_tick_callback(self, callback: Callable[[], None]) -> None:
        self.ticks.append(callback)

    def add_timeout_callback(self, callback: Callable[[], None], milliseconds: int) -> None:
        self.timeouts.append((callback, milliseconds))

    def run_tick(self) -> None:
        """Wait for the next callback and run it, as the page's thread would."""
        for _ in range(1000):
            if self.ticks:
                self.ticks.pop(0)()
                return
            time.sleep(0.005)
        raise AssertionError("nothing was delivered")


def test_of_jobs_that_wait_only_the_last_is_run() -> None:
    document: Any = Document()
    latest = Latest(document)
    ran: list[int] = []
    got: list[int] = []
    go = threading.Event()

    def job(number: int) -> int:
        go.wait(10)
        ran.append(number)
        return number

    for number in range(30):
        latest.submit(lambda number=number: job(number), lambda future: got.append(future.result()))
    go.set()
    document.run_tick()
    document.run_tick()
    assert ran == got == [0, 29]
    latest.close()


def test_the_next_job_waits_until_the_last_result_is_on_the_page() -> None:
    document: Any = Document()
    latest = Latest(document)
    ran: list[str] = []
    latest.submit(lambda: ran.append("first"), lambda _: None)
    latest.submit(lambda: ran.append("second"), lambda _: None)
    while not document.ticks:
        time.sleep(0.005)
    assert ran == ["first"]
    document.run_tick()
    document.run_tick()
    assert ran == ["first", "second"]
    latest.close()


def test_an_error_is_delivered_and_work_goes_on() -> None:
    document: Any = Document()
    latest = Latest(document)
    got: list[Any] = []
    latest.submit(lambda: 1 / 0, lambda future: got.append(type(future.exception())))
    document.run_tick()
    latest.submit(lambda: 7, lambda future: got.append(future.result()))
    document.run_tick()
    assert got == [ZeroDivisionError, 7]
    latest.close()


def test_nothing_is_delivered_after_closing() -> None:
    document: Any = Document()
    latest = Latest(document)
    go, done = threading.Event(), threading.Event()
    latest.submit(lambda: (go.wait(10), done.set()), lambda _: None)
    latest.close()
    latest.submit(lambda: None, lambda _: None)
    go.set()
    assert done.wait(10)
    time.sleep(0.05)
    assert document.ticks == []


def test_without_a_server_the_result_is_there_at_once() -> None:
    latest = Latest(None)
    got: list[Future[int]] = []
    latest.submit(lambda: 3, got.append)
    assert got[0].result() == 3
    latest.close()


def test_before_the_page_is_loaded_results_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    loads: list[Callable[[], None]] = []
    monkeypatch.setattr("panel.state.onload", loads.append)
    document: Any = Document()
    latest = Latest(document)
    got: list[int] = []
    latest.submit(lambda: 1, lambda future: got.append(future.result()))
    latest.settle(10)
    # In the page from the beginning.
    assert got == [1]
    latest.submit(lambda: 2, lambda future: got.append(future.result()))
    latest.settle(10)
    latest.submit(lambda: time.sleep(0.05) or 3, lambda future: got.append(future.result()))
    latest.settle(0)
    while latest._held is None:
        time.sleep(0.005)
    assert got == [1, 2]
    assert document.ticks == []
    loads[0]()
    assert got == [1, 2, 3]
    latest.close()


def test_a_pause_waits_for_rest() -> None:
    document: Any = Document()
    acted: list[int] = []
    pause = Pause(document, seconds=0.4, action=lambda: acted.append(1))
    pause.touch()
    pause.touch()
    assert [milliseconds for _, milliseconds in document.timeouts] == [400, 400]
    for callback, _ in document.timeouts:
        callback()
    assert acted == [1]


def test_a_pause_without_a_server_acts_at_once() -> None:
    acted: list[int] = []
    Pause(None, seconds=9.0, action=lambda: acted.append(1)).touch()
    assert acted == [1]
