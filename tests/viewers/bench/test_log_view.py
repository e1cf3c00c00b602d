"""Which log's curves are on the page, without a server, where everything happens at once."""

from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from chladni.viewers.bench.toolkit import load_toolkit
from tests.viewers.bench.stand_in import OSCILLATOR, open_log, tools

load_toolkit()

from chladni.viewers.bench.desk import Desk  # noqa: E402  # Panel's adapter is set first
from chladni.viewers.bench.dropper import MOST_BYTES  # noqa: E402
from chladni.viewers.bench.log_view import LogView  # noqa: E402
from chladni.viewers.bench.theme import theme  # noqa: E402

GOOD = b"log\n/cell.force\n/rod.position"


def made(**changes: Any) -> LogView:
    view = LogView(Desk(OSCILLATOR), tools(**changes), theme=theme("light"), document=None, path=None)
    view.show(True)
    return view


@pytest.fixture
def view() -> Iterator[LogView]:
    one = made()
    yield one
    one.close()


def drop(view: LogView, content: bytes, name: str = "press.mcap") -> None:
    piece = {"name": name, "chunk": 1, "total_chunks": 1, "data": content}
    view.dropper._process_event(SimpleNamespace(event_name="upload_event", data=piece))


def texts(view: LogView) -> str:
    return " ".join(str(part.object) for part in view.view if hasattr(part, "object"))


def assert_nothing_is_compared(view: LogView) -> None:
    assert view.board.shown() == ()
    assert list(view.board.view.objects) == []
    assert "NRMSE" not in texts(view)


def test_a_log_that_cant_be_read_takes_the_former_ones_curves_away(view: LogView) -> None:
    drop(view, GOOD)
    assert [chart.name for chart in view.board.shown()] == ["log.time"]
    assert "NRMSE" in texts(view)
    assert view._log is not None
    former: Any = view._log
    drop(view, b"rubbish", "later.mcap")
    # The place where logs are dropped says later.mcap: what stands below would pass for it.
    assert_nothing_is_compared(view)
    assert "later.mcap: is no log; record it as MCAP" in texts(view)
    assert view.selects == {}
    assert not any("measured" in str(type(part)) for part in view._choices.objects)
    assert list(view._choices.objects) == []
    assert not former.path.exists()
    # Nor does a knob that is turned bring them back.
    view.follow()
    assert_nothing_is_compared(view)
    drop(view, GOOD)
    assert [chart.name for chart in view.board.shown()] == ["log.time"]


def test_a_log_that_is_too_large_takes_them_away_too(view: LogView) -> None:
    drop(view, GOOD)
    drop(view, bytes(MOST_BYTES + 1), "huge.mcap")
    assert_nothing_is_compared(view)
    assert "huge.mcap: larger than 64 MB" in texts(view)


def test_a_log_without_what_is_needed_doesnt_keep_the_former_ones_curves(view: LogView) -> None:
    drop(view, GOOD)
    drop(view, b"log\n/cell.force", "force-only.mcap")
    assert_nothing_is_compared(view)
    assert "force-only.mcap: no output is measured; choose the channel of one" in texts(view)
    # Its channels are offered all the same.
    assert set(view.selects) == {"force", "position"}


def test_an_answer_about_a_log_that_is_gone_isnt_shown(view: LogView) -> None:
    drop(view, GOOD)
    former, answer = view._log, Future[Any]()
    answer.set_result(view._tools.compare(OSCILLATOR.model(), former, {"position": "x"}, 0.0, 1.0))
    late = partial(view._compared, former)
    drop(view, b"rubbish", "later.mcap")
    late(answer)
    assert_nothing_is_compared(view)


def test_what_a_log_has_lost_is_said_beside_the_comparison_and_beside_a_refusal() -> None:
    lost = "Damage at byte 42 (Chunk): the file ends within the chunk; an unknown number of messages lost."

    def damaged(path: Path, title: str, private: bool) -> Any:
        return replace(open_log(path, title, private), damage=(lost,))

    view = made(open_log=damaged)
    drop(view, GOOD)
    assert lost in texts(view)
    assert [chart.name for chart in view.board.shown()] == ["log.time"]
    view.selects["position"].value = view.selects["position"].values[0]
    assert "no output is measured" in texts(view)
    assert lost in texts(view)
    view.close()
