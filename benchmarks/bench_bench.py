"""How fast a page of the bench answers: in the server, from key to data in a headless browser, and after a burst."""

import shutil
import statistics
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

from playwright.sync_api import Page, sync_playwright

from chladni.apps.bench import open_bench
from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.core.instrument import Instrument
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.viewers.bench.toolkit import load_toolkit

ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
KEYS, BURST = 25, 30
# When the data of a chart are in the browser: each source of curves tells when its data change.
WATCH = """() => {
  window.arrivals = []; window.pressed = [];
  window.addEventListener("keydown", () => window.pressed.push(performance.now()), true);
  for (const model of Bokeh.documents[0]._all_models.values()) {
    if (model.type === "ColumnDataSource") {
      model.properties.data.change.connect(() => window.arrivals.push(performance.now()));
    }
  }
}"""


class Stopwatch:
    """Times of the server: when a knob's callback begins, when a message is written."""

    def __init__(self) -> None:
        self.entries: list[tuple[float, float]] = []
        self.writes: list[tuple[float, float]] = []
        self.readings = 0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Watch the server of this process."""
        from tornado.websocket import WebSocketHandler

        from chladni.viewers.bench.desk import Desk
        from chladni.viewers.bench.knob_scale import KnobScale

        value, accept, write = KnobScale.value, Desk.accept, WebSocketHandler.write_message

        def timed_value(scale: KnobScale, place: float) -> float:
            # The first thing that the callback of a slider does.
            self.entries.append(now())
            return value(scale, place)

        def counted_accept(desk: Desk, *arguments: Any) -> None:
            self.readings += 1
            accept(desk, *arguments)

        def timed_write(socket: Any, *arguments: Any, **options: Any) -> Any:
            if isinstance(arguments[0], bytes) or '"events"' in arguments[0]:
                # A patch; everything else is an acknowledgement, or the head of a message.
                self.writes.append(now())
            return write(socket, *arguments, **options)

        KnobScale.value, Desk.accept = timed_value, counted_accept  # type: ignore[method-assign]
        WebSocketHandler.write_message = timed_write  # type: ignore[method-assign]
        try:
            yield
        finally:
            KnobScale.value, Desk.accept = value, accept  # type: ignore[method-assign]
            WebSocketHandler.write_message = write  # type: ignore[method-assign]

    def sent_ms(self, clock: int) -> list[float]:
        """For each turn, milliseconds until its last message; clock 0 of the wall, 1 of the CPU."""
        found = []
        for begun, end in pairwise([*self.entries, (float("inf"), 0.0)]):
            writes = [write for write in self.writes if begun[0] <= write[0] < min(end[0], begun[0] + 0.2)]
            found += [1000 * (max(writes)[clock] - begun[clock])] if writes else []
        return found


def now() -> tuple[float, float]:
    """Wall time, and the server's CPU time, which doesn't grow when other programs have the cores."""
    # The browser is driven from the main thread, whose own time is none of the server's.
    driver = time.pthread_getcpuclockid(threading.main_thread().ident or 0)
    return time.perf_counter(), time.process_time() - time.clock_gettime(driver)


def single_keys(page: Page) -> list[float]:
    """Milliseconds from each of some key presses to the last source of curves that it changed."""
    found = []
    for number in range(KEYS):
        page.evaluate("() => { window.arrivals = []; window.pressed = []; }")
        page.keyboard.press("ArrowRight" if number < KEYS // 2 else "ArrowLeft")
        page.wait_for_timeout(200)
        pressed, arrivals = page.evaluate("() => [window.pressed, window.arrivals]")
        if pressed and arrivals:
            found.append(max(arrivals) - pressed[0])
    return found


def burst(page: Page) -> float:
    """Milliseconds from the last of 30 key presses, a held key's rate, to the last change of a curve."""
    page.evaluate("() => { window.arrivals = []; window.pressed = []; }")
    for number in range(BURST):
        page.keyboard.press("ArrowRight" if number % 2 else "ArrowLeft")
        page.wait_for_timeout(33)
    page.wait_for_timeout(1500)
    pressed, arrivals = page.evaluate("() => [window.pressed, window.arrivals]")
    return float(max(arrivals) - pressed[-1]) if arrivals else float("nan")


def reading_ms(instrument: Instrument) -> float:
    """Milliseconds of one reading of the six charts that a page opens with, the least of a few."""
    load_toolkit()
    from chladni.viewers.bench.board import SLOTS, wanted
    from chladni.viewers.bench.instrument_page import first_charts

    first, times = first_charts(instrument), []
    shown = wanted([name for name, _ in read_instrument(instrument).offered], first)[:SLOTS]
    for _ in range(5):
        begun = time.perf_counter()
        read_instrument(instrument, charts=shown)
        times.append(1000 * (time.perf_counter() - begun))
    return min(times)


def measure(page: Page, address: str, instrument: Instrument) -> str:
    """Measure one page and give its row."""
    page.goto(address + instrument.name)
    handle = page.locator(".noUi-handle").first
    handle.wait_for()
    page.wait_for_timeout(1500)
    page.evaluate(WATCH)
    handle.focus()
    watch = Stopwatch()
    with watch.running():
        keys = single_keys(page)
    sent, busy = watch.sent_ms(0), watch.sent_ms(1)
    held = Stopwatch()
    with held.running():
        after = burst(page)
    cells = [instrument.name, f"{reading_ms(instrument):.1f}", spread(sent), spread(busy), spread(keys)]
    cells += [f"{after:.0f}", str(held.readings)]
    return f"| {' | '.join(cells)} |"


def spread(times: list[float]) -> str:
    """Give median and worst."""
    return f"{statistics.median(times):.1f} / {max(times):.1f}" if times else "-"


def main() -> None:
    """Print the table; names of instruments may be given."""
    chosen = [INSTRUMENTS[name] for name in sys.argv[1:] or INSTRUMENTS]
    server, ready = open_bench(chosen), threading.Event()
    thread = threading.Thread(target=server.run, args=(ready.set,), daemon=True)
    thread.start()
    ready.wait(30)
    print(
        "Milliseconds, median / worst of",
        KEYS,
        "key presses on the first knob; wished: 20 to sent, 50 to data.",
    )
    print(
        "| instrument | reading | callback to sent | same, CPU | key to data | after a burst of 30 | readings in it |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        for instrument in chosen:
            print(measure(page, server.address, instrument), flush=True)
        browser.close()
    server.stop()
    thread.join(10)


if __name__ == "__main__":
    main()
