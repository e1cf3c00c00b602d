"""Every instrument there is, on its page."""

from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from chladni.apps.bench import open_bench, tools
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.viewers.bench.toolkit import load_toolkit
from tests.viewers.bench.serving import browsing, curves, needs_chromium, open_page, running, until_changed

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
# In a browser all that are no element, and one element: the pages of elements differ in their knobs only.
DIFFERENT = [*(name for name in INSTRUMENTS if not name.startswith("element-")), "element-pt2"]


def among(names: Sequence[str]) -> pytest.MarkDecorator:
    """Run a test of these instruments, and by hand of all others."""
    return pytest.mark.parametrize(
        "name", [name if name in names else pytest.param(name, marks=pytest.mark.nightly) for name in INSTRUMENTS]
    )


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with running(open_bench(INSTRUMENTS.values())) as server:
        yield server.address


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with browsing() as page:
        yield page


@needs_chromium
@pytest.mark.nightly
@pytest.mark.parametrize("name", INSTRUMENTS)
def test_the_page_opens_without_complaint_and_a_knob_moves_its_curves(browser: Any, address: str, name: str) -> None:
    browser.complaints.clear()
    page = open_page(browser, address + name)
    before = curves(page)
    # The arm's first knob is of a damper that isn't there unless it is switched on.
    page.locator(".noUi-handle").nth(1 if name == "robot-arm" else 0).focus()
    page.keyboard.press("PageUp")
    after = until_changed(page, before)
    if after == before:
        # A knob at the end of its range turns the other way only.
        page.keyboard.press("PageDown")
        after = until_changed(page, before)
    assert after != before
    assert browser.complaints == []


@among(DIFFERENT)
def test_the_charts_of_every_instrument_can_be_drawn(name: str) -> None:
    load_toolkit()
    from chladni.viewers.bench.board import SLOTS, Board
    from chladni.viewers.bench.theme import LIGHT

    instrument = INSTRUMENTS[name]
    options = {option.name: option.default for option in instrument.options}
    reading = tools().read(instrument, instrument.parameters.numbers(), options, None)
    board = Board(LIGHT)
    board.show(reading.charts)
    assert len(board.slots) == min(SLOTS, len(reading.charts)) >= 3
    shown = {slot.name: slot.tile for slot in board.slots}
    for chart in reading.charts:
        if chart.name in shown:
            tile = shown[chart.name]
            drawn = len(tile.lines.data["label"]) + len(set(tile.points.data["label"]))
            # A proportional element has no poles: a curve without points is none on the chart.
            assert drawn == sum(not curve.points or curve.x.size > 0 for curve in chart.curves)
