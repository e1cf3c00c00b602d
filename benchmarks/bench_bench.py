"""How fast a page of the bench answers: in the server, from key to data in a headless browser, and after a burst."""

import multiprocessing
import os
import shutil
import statistics
import sys
import threading
import time
from collections.abc import Sequence
from itertools import pairwise
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
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

    def begin(self) -> None:
        """Forget what was."""
        self.entries, self.writes, self.readings = [], [], 0

    def watch(self) -> None:
        """Watch the server of this process, from now on."""
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

        KnobScale.value, Desk.accept = timed_value, counted_accept  # type: ignore[assignment]
        WebSocketHandler.write_message = timed_write  # type: ignore[assignment]

    def sent_ms(self, clock: int) -> list[float]:
        """For each turn, milliseconds until its last message; clock 0 of the wall, 1 of the CPU."""
        found = []
        for begun, end in pairwise([*self.entries, (float("inf"), 0.0)]):
            writes = [write for write in self.writes if begun[0] <= write[0] < min(end[0], begun[0] + 0.2)]
            found += [1000 * (max(writes)[clock] - begun[clock])] if writes else []
        return found


def now() -> tuple[float, float]:
    """Wall time, and the server's CPU time, which doesn't grow when other programs have the cores."""
    return time.perf_counter(), time.process_time()


class Server:
    """The bench in a process of its own, as whoever uses it has it: the browser's driver takes none of its time."""

    def __init__(self, names: Sequence[str]) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, names))
        self._process.start()
        self.address: str = self._pipe.recv()

    def ask(self, *words: str) -> Any:
        """Send an order, and wait for its answer."""
        self._pipe.send(words)
        return self._pipe.recv()

    def end(self) -> None:
        """End the process."""
        self._pipe.send(("end",))
        self._process.join(30)


def serve(pipe: Connection, names: Sequence[str]) -> None:
    """Serve pages, and answer the driver's questions about them."""
    server, ready, watch = open_bench([INSTRUMENTS[name] for name in names]), threading.Event(), Stopwatch()
    thread = threading.Thread(target=server.run, args=(ready.set,), daemon=True)
    thread.start()
    ready.wait(30)
    watch.watch()
    pipe.send(server.address)
    while (order := pipe.recv())[0] != "end":
        if order[0] == "begin":
            watch.begin()
            pipe.send(True)
        elif order[0] == "times":
            pipe.send((watch.sent_ms(0), watch.sent_ms(1), watch.readings))
        elif order[0] == "knob":
            pipe.send(knob_that_matters(INSTRUMENTS[order[1]]))
        else:
            pipe.send(reading_ms(INSTRUMENTS[order[1]]))
    server.stop()
    thread.join(10)


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


def first_shown(instrument: Instrument) -> list[str]:
    """Names of the six charts that a page opens with."""
    load_toolkit()
    from chladni.viewers.bench.board import SLOTS, wanted
    from chladni.viewers.bench.instrument_page import first_charts

    return wanted([name for name, _ in read_instrument(instrument).offered], first_charts(instrument))[:SLOTS]


def knob_that_matters(instrument: Instrument) -> int:
    """Place of the first knob that moves a curve: a damper that is nowhere moves none."""
    shown = first_shown(instrument)
    for place, parameter in enumerate(instrument.parameters.values()):
        value = parameter.value + 0.01 * (parameter.high - parameter.low)
        values = {parameter.name: min(value, parameter.maximum)}
        before, after = (read_instrument(instrument, found, charts=shown) for found in ({}, values))
        for old, new in zip(before.charts, after.charts, strict=True):
            for one, other in zip(old.curves, new.curves, strict=True):
                if one.y.shape != other.y.shape or not np.allclose(one.y, other.y, rtol=1e-6, equal_nan=True):
                    return place
    return 0


def reading_ms(instrument: Instrument) -> float:
    """Milliseconds of one reading of the charts that a page opens with, each with another value; median of nine."""
    shown, times = first_shown(instrument), []
    parameter = list(instrument.parameters.values())[knob_that_matters(instrument)]
    for turn in range(9):
        values = {parameter.name: parameter.value + 1e-3 * turn * (parameter.high - parameter.low)}
        begun = time.perf_counter()
        read_instrument(instrument, values, charts=shown)
        times.append(1000 * (time.perf_counter() - begun))
    return statistics.median(times)


def measure(page: Page, server: Server, name: str) -> str:
    """Measure one page and give its row."""
    page.goto(server.address + name)
    handle = page.locator(".noUi-handle").nth(server.ask("knob", name))
    handle.wait_for()
    page.wait_for_timeout(1500)
    page.evaluate(WATCH)
    handle.focus()
    server.ask("begin")
    keys = single_keys(page)
    sent, busy, _ = server.ask("times")
    server.ask("begin")
    after = burst(page)
    readings = server.ask("times")[2]
    cells = [name, f"{server.ask('reading', name):.1f}", spread(sent), spread(busy), spread(keys)]
    return f"| {' | '.join([*cells, f'{after:.0f}', str(readings), f'{os.getloadavg()[0]:.1f}'])} |"


def spread(times: list[float]) -> str:
    """Give median and worst."""
    return f"{statistics.median(times):.1f} / {max(times):.1f}" if times else "-"


def main() -> None:
    """Print the table; names of instruments may be given."""
    names = sys.argv[1:] or list(INSTRUMENTS)
    server = Server(names)
    print(f"Milliseconds, median / worst of {KEYS} presses on a knob; wished: 20 to sent, 50 to data.")
    print("| instrument | reading | callback to sent | same, CPU | key to data | after 30 keys | readings | load |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        for name in names:
            print(measure(page, server, name), flush=True)
        browser.close()
    server.end()


if __name__ == "__main__":
    main()
