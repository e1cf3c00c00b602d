"""Live averages beside those of the finished file with the same settings, for each kind of source.

    python benchmarks/bench_live_equal.py

Prints the largest difference over the largest value, and ends with exit code 1 where one is above 1e-12.
"""

import os
import socket
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import foxglove
import numpy as np
from mcap.reader import make_reader

from chladni.apps.demo_log import make_demo_log
from chladni.apps.frf import frf
from chladni.apps.live import live
from chladni.apps.modes import identify_modes
from chladni.apps.psd import psd
from chladni.io.live.followed_log import StandardInput
from chladni.io.live.foxglove import FoxgloveServer
from chladni.io.live.instrument import Instrument, LiveInstrument, Taken
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra

CLOSE = 1e-12
RESOLUTION_HZ = 0.5


def off(mine: Any, theirs: Any) -> float:
    """Largest difference over the largest value; infinite for other shapes."""
    if np.shape(mine) != np.shape(theirs):
        return float("inf")
    known = np.isfinite(theirs)
    return float(np.max(np.abs(mine - theirs)[known]) / np.max(np.abs(theirs[known]))) if known.any() else 0.0


def piped(path: Path) -> StandardInput:
    """Send a log through a pipe."""
    read_end, write_end = os.pipe()

    def write() -> None:
        with os.fdopen(write_end, "wb") as pipe:
            pipe.write(path.read_bytes())

    threading.Thread(target=write, daemon=True).start()
    return StandardInput(read_end)


def served(path: Path) -> FoxgloveServer:
    """Serve the messages of a log by the SDK's own server, with their stamps, at twice their speed."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    context = foxglove.Context()
    server = foxglove.start_server(port=port, context=context, message_backlog_size=1 << 20)
    with path.open("rb") as file:
        messages = list(make_reader(file).iter_messages())
    channels = {}
    for schema, channel, _ in messages:
        if channel.id not in channels:
            described = foxglove.Schema(name=schema.name, encoding=schema.encoding, data=schema.data)
            channels[channel.id] = foxglove.Channel(
                channel.topic, schema=described, message_encoding=channel.message_encoding, context=context
            )
    source = FoxgloveServer(f"ws://127.0.0.1:{port}", patience_s=8.0)
    time.sleep(1.0)

    holding = [context]

    def send() -> None:
        begun_s, start_ns = time.monotonic(), messages[0][2].log_time
        for number, (_, channel, message) in enumerate(messages):
            channels[channel.id].log(message.data, log_time=message.log_time)
            if number % 500 == 0:
                time.sleep(max(0.0, begun_s + (message.log_time - start_ns) / 2e9 - time.monotonic()))
        # Whoever listens may be late.
        source._closed.wait(120.0)  # noqa: SLF001
        server.stop()
        # The context closes its channels when nobody holds it.
        del holding[:]

    threading.Thread(target=send, daemon=True).start()
    return source


class Played(Instrument):
    """An instrument that plays a series."""

    name = "played"

    def __init__(self, series: TimeSeries) -> None:
        self.channels, self.sample_rate_hz = series.channels, series.sample_rate_hz
        self._series, self._next = series, 0

    def start(self) -> None:
        """Nothing is to be done."""

    def read(self, _timeout_s: float) -> Taken | None:
        """Give a quarter of a second."""
        if self._next >= self._series.samples:
            return None
        first, self._next = self._next, self._next + 250
        time.sleep(0.02)
        return Taken(first=first, values=self._series.values[:, first : self._next])

    def stop(self) -> None:
        """Nothing is to be done."""


def main() -> int:
    """Compare, and print the table."""
    made = make_demo_log()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.mcap"
        write_mcap(made.series, path)
        with open_log(path) as log:
            series = log.read()
            density = psd(log, resolution_hz=RESOLUTION_HZ)
            answers = frf(log, references=made.reference, resolution_hz=RESOLUTION_HZ)
            spectra = cross_spectra(log, resolution_hz=RESOLUTION_HZ)
        ways: dict[str, Any] = {
            "file": lambda: str(path),
            "standard input": lambda: piped(path),
            "WebSocket, foxglove-sdk": lambda: served(path),
            "instrument": lambda: LiveInstrument(Played(series)),
        }
        print("| source | samples | PSD | H1 | modes, shapes | frequencies |\n|---|---|---|---|---|---|")
        worst = 0.0
        for name, source in ways.items():
            *_, last = live(source(), references=[made.reference], resolution_hz=RESOLUTION_HZ, patience_s=4.0)
            modes = identify_modes(spectra.select([channel.name for channel in last.modes.channels]))
            order = [channel.name for channel in last.densities[0].channels]
            rows = [channel.name for channel in last.response.responses]
            errors = (
                off(last.densities[0].values, density.select(order).values),
                off(last.response.values, answers.select(rows).values),
                max(off(last.modes.frequency_hz, modes.frequency_hz), off(last.modes.shapes, modes.shapes)),
                off(last.densities[0].frequency_hz, density.frequency_hz),
            )
            worst = max(worst, *errors)
            told = " | ".join(f"{one:.1e}" for one in errors)
            print(f"| {name} | {round(last.time_s * 1000)} | {told} |", flush=True)
    print(f"largest: {worst:.1e} (asked: {CLOSE:g})")
    return 0 if worst <= CLOSE else 1


if __name__ == "__main__":
    sys.exit(main())
