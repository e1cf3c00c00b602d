"""A bench that serves in a thread, and a browser to look at it with."""

import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip


def needs_chromium(test: Any) -> Any:
    """Mark a test that needs chromium."""
    missing = pytest.mark.skipif(CHROMIUM is None, reason="no chromium; on Debian: apt install chromium")
    return pytest.mark.browser(missing(test))


@contextmanager
def running(server: Any) -> Iterator[Any]:
    """Run a server in a thread until the block ends."""
    ready = threading.Event()
    # Bokeh and Panel warn of things in their own modules; a thread's warnings would end up in no test anyway.
    thread = threading.Thread(target=server.run, args=(ready.set,), daemon=True)
    thread.start()
    assert ready.wait(30)
    try:
        yield server
    finally:
        server.stop()
        thread.join(10)
        assert not thread.is_alive()


@contextmanager
def browsing(*arguments: str) -> Iterator[Any]:
    """Give a page of 1280 x 800 that keeps what it complains of in ``page.complaints``, and every request."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS, *arguments])
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.complaints, page.asked = [], []  # type: ignore[attr-defined]
        page.on(
            "console", lambda told: page.complaints.append(told.text) if told.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("request", lambda request: page.asked.append(request.url))
        yield page
        chromium.close()


def open_page(page: Any, address: str) -> Any:
    """Open an instrument's page and wait until its first chart is drawn."""
    page.goto(address)
    page.locator(".noUi-handle").first.wait_for()
    page.locator(".bk-Canvas, canvas").first.wait_for()
    return page


def curves(page: Any) -> list[float]:
    """Sum of each chart's curves as the browser holds them: changes when a curve does."""
    return page.evaluate(
        """() => [...Bokeh.documents[0]._all_models.values()]
          .filter((model) => model.type === "ColumnDataSource" && model.data.ys && model.data.ys.length)
          .map((model) => [...model.data.ys].flatMap((ys) => [...ys]).reduce((a, b) => a + (b || 0), 0))"""
    )


def until_drawn(page: Any, count: int) -> int:
    """Wait until there are so many curves, for as long as a busy machine may take; give how many there are."""
    for _ in range(200):
        if len(curves(page)) == count:
            break
        page.wait_for_timeout(25)
    return len(curves(page))


def until_back(page: Any, start: list[float]) -> bool:
    """Wait until the curves are those again, for as long as a busy machine may take; tell whether they are."""
    for _ in range(200):
        if curves(page) == start:
            return True
        page.wait_for_timeout(25)
    return False


def until_changed(page: Any, before: list[float]) -> list[float]:
    """Wait until some curve differs, for as long as a busy machine may take."""
    for _ in range(200):
        now = curves(page)
        if now != before:
            return now
        page.wait_for_timeout(25)
    return curves(page)
