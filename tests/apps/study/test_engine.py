"""Batches against a cluster that loses workers, with a stand-in that loses them at will."""

import logging
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from typing import Any

import pytest

from chladni.apps.study import engine as engines
from chladni.apps.study.cluster import quiet, require_safe
from chladni.apps.study.engine import Engine
from chladni.signals.errors import SetupError

scheduler = pytest.importorskip("distributed.scheduler")


class StandInFuture:
    """A future that has ended."""

    def __init__(
        self, key: str, status: str, result: Any = None, error: Exception | None = None, *, deaf: bool = False
    ) -> None:
        self.key, self.status, self._result, self._error, self._deaf = key, status, result, error, deaf

    def add_done_callback(self, function: Callable[["StandInFuture"], None]) -> None:
        function(self)

    def result(self, **_: float) -> Any:
        if isinstance(self._result, Exception):
            raise self._result
        return self._result

    def exception(self, **_: float) -> Exception | None:
        if self._deaf and self._error is not None:
            raise self._error
        return self._error

    def cancelled(self) -> bool:
        return self.status == "cancelled"

    def cancel(self, **_: str) -> None:
        pass


class StandInClient:
    """A cluster of one worker, which a batch with a deadly item ends."""

    def __init__(self, deadly: Callable[[Sequence[int], int], str | None], *, workers: int = 1) -> None:
        self.status, self._deadly, self._workers, self.tries = "running", deadly, workers, 0

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(map(str, range(self._workers)), 1)

    def submit(self, work: Callable[[Sequence[int]], bytes], items: Sequence[int], *, key: str, **_: bool) -> Any:
        self.tries += 1
        match self._deadly(items, self.tries):
            case "killed":
                error = scheduler.KilledWorker(key, None, 2)
                return StandInFuture(key, "error", error=error)
            case "cancelled":
                return StandInFuture(key, "cancelled")
            case "answer lost":
                return StandInFuture(key, "finished", result=OSError("the worker has gone"))
            case "killed for its answer":
                # Dask computes what went with its worker again, and that may end the next worker, too.
                return StandInFuture(key, "finished", result=scheduler.KilledWorker(key, None, 2))
            case "cancelled for its answer":
                return StandInFuture(key, "finished", result=CancelledError(key))
            case "unknown":
                return StandInFuture(key, "error", error=OSError("the scheduler has gone"), deaf=True)
        return StandInFuture(key, "finished", result=work(items))


def answers(client: StandInClient, items: int, *, seconds: float = 0.1) -> tuple[list[int], list[int]]:
    engine: Engine[int] = Engine(client, bytes)  # type: ignore[arg-type]  # stands in for Dask's
    engine.note_seconds(seconds)
    done, given_up = [], []
    for answer in engine.run(range(items)):
        if answer.content is None:
            assert "worker was ended" in answer.reason
            given_up += answer.items
        else:
            assert answer.content == bytes(answer.items)
            done += answer.items
    return sorted(done), sorted(given_up)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "PATIENCE_S", 0.2)
    monkeypatch.setattr(engines, "_LOOK_EVERY_S", 0.01)


def test_every_item_has_one_answer() -> None:
    assert answers(StandInClient(lambda *_: None), 100) == ([*range(100)], [])


def test_an_item_that_ends_workers_is_given_up_and_those_beside_it_are_done() -> None:
    client = StandInClient(lambda items, _: "killed" if 17 in items else None)
    assert answers(client, 50) == ([one for one in range(50) if one != 17], [17])


@pytest.mark.parametrize(
    "how", ["killed", "cancelled", "answer lost", "killed for its answer", "cancelled for its answer", "unknown"]
)
def test_what_was_lost_once_is_done_again(how: str) -> None:
    client = StandInClient(lambda _, tries: how if tries in (1, 3) else None)
    assert answers(client, 60) == ([*range(60)], [])


def test_batches_take_about_as_long_as_they_should() -> None:
    client = StandInClient(lambda *_: None)
    answers(client, 200, seconds=0.04)
    assert client.tries == 200 * 0.04 / engines.BATCH_S


def test_a_cluster_without_workers_is_told_and_not_waited_for() -> None:
    class Silent(StandInClient):
        def submit(self, *_: Any, key: str, **__: Any) -> Any:
            future = StandInFuture(key, "pending")
            future.add_done_callback = lambda _: None  # type: ignore[method-assign]  # never ends
            return future

    with pytest.raises(SetupError, match=r"no worker for 0\.2 s; what is done stays"):
        answers(Silent(lambda *_: None, workers=0), 3)
    gone = Silent(lambda *_: None)
    threading.Timer(0.05, setattr, (gone, "status", "closed")).start()
    with pytest.raises(SetupError, match="the scheduler has gone; what is done stays"):
        answers(gone, 3)


def refused(address: str) -> bool:
    try:
        require_safe(address)
    except SetupError as error:
        return "tls://HOST:PORT" in str(error)
    return False


def test_an_address_that_leaves_the_machine_needs_tls() -> None:
    safe = ["tcp://127.0.0.1:8786", "tcp://[::1]:8786", "tcp://localhost:1", "tls://far:1"]
    unsafe = ["tcp://far:8786", "tcp://10.0.0.1:1", "ws://127.0.0.1:1", "far:8786", "tcp://0.0.0.0:1"]
    assert [one for one in [*safe, *unsafe] if refused(one)] == unsafe


class Heard(logging.Handler):
    """Keeps what a logger says."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(record.getMessage())


# Dask gives the second a handler of its own, which quieting the first leaves alone.
@pytest.mark.parametrize("name", ["distributed", "distributed.client", "tornado.application", "asyncio"])
def test_a_user_is_shown_no_words_of_dask(name: str) -> None:
    logger, heard = logging.getLogger(name), Heard()
    logger.addHandler(heard)
    try:
        with quiet():
            logger.critical("Couldn't gather 1 keys")
        logger.critical("heard again")
    finally:
        logger.removeHandler(heard)
    assert heard.said == ["heard again"]
