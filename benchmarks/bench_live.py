"""Live: what it costs, how late it is, and whether its memory grows.

    python benchmarks/bench_live.py latency          # 12 channels x 5 kHz: from a message's arrival to rerun's stream
    python benchmarks/bench_live.py load             # 64 channels x 25.6 kHz on two cores
    python benchmarks/bench_live.py day --hours 24   # 12 channels x 1 kHz fed fast: resident memory

`bench_live_equal.py` sets averages beside those of the finished file, `bench_live_faults.py` lets things go wrong.
Each prints a table, and ends with exit code 1 where a number misses what is asked of it.
"""

import argparse
import os
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Channel as McapChannelRecord
from mcap.records import Header, Schema

from chladni.apps.live import live
from chladni.cli.live import TURN_S
from chladni.io.live.reception import MessageSource, Reception, Samples
from chladni.io.mcap.records import MAGIC
from chladni.signals.channel import Channel
from chladni.signals.geometry import Geometry
from chladni.signals.live_state import LiveState
from chladni.signals.process_memory import return_memory
from chladni.signals.time_series import TimeSeries
from chladni.viewers.rerun.live_targets import Painter, RecordingFile

START_NS = 1_700_000_000_000_000_000
#: The first minute, in which channels, modes and pictures come to be, and the time that tells what is held then.
SETTLED_S, TOLD_S = 60.0, 10.0
#: Processor seconds for a second of data on two cores, with a quarter to spare.
MOST_BUSY_S = 1.5


class Generator:
    """Blocks of samples made as they are asked for: an instrument that never waits."""

    name = "made"
    geometry = Geometry()
    silent_channels: tuple[str, ...] = ()

    def __init__(self, channels: int, rate_hz: float, seconds: float, *, block_s: float) -> None:
        self.channels = tuple(Channel(name=f"/a{n}.x", unit="m/s^2") for n in range(channels))
        self.rate, self.block = rate_hz, round(block_s * rate_hz)
        self.blocks = round(seconds * rate_hz / self.block)
        self.noise = np.random.default_rng(0).standard_normal((channels, 16 * self.block)).astype(np.float32)
        self.number = 0

    def rate_hz(self, _channels: Any, /, **_options: bool) -> float | None:
        """The rate is exact."""
        return None

    def receive(self, _timeout_s: float) -> Samples:
        """Give the next block."""
        if self.number >= self.blocks:
            return Samples(ended=True)
        first = self.number % 16 * self.block
        series = TimeSeries(
            values=self.noise[:, first : first + self.block],
            sample_rate_hz=self.rate,
            channels=self.channels,
            start_time_ns=START_NS + round(self.number * self.block / self.rate * 1e9),
        )
        self.number += 1
        return Samples(blocks=(series,))

    def finish(self) -> Samples:
        """Nothing is held."""
        return Samples(ended=True)

    def close(self) -> None:
        """Nothing is open."""


def resident_mb() -> float:
    """Memory of this process at present."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def day(options: argparse.Namespace) -> bool:
    """Feed a day of 12 channels x 1 kHz fast, with a recording, and print the memory every hour of it."""
    source = Generator(12, 1000.0, options.hours * 3600, block_s=options.block)
    begun_s, settled, later, hour = time.monotonic(), list[float](), list[float](), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        painter = Painter(RecordingFile(Path(folder) / "day.rrd", keep_bytes=100_000_000))
        print(f"| fed | wall | processor | resident memory since the line before: median, most |\n|{'---|' * 4}")
        next_s = 0.0
        for state in live(source):
            for told in (*(one.text for one in state.events), *painter.show(state)):
                print(f"{state.time_s:9.0f} s: {told}")
            passed_s = time.monotonic() - begun_s
            hour.append(resident_mb())
            if passed_s > SETTLED_S and not state.ended:
                # Between two marks it counts as well. One moment alone may be one at which much was just let go.
                (settled if passed_s < SETTLED_S + TOLD_S else later).append(hour[-1])
            if state.time_s >= next_s:
                next_s += 3600.0
                print(
                    f"| {state.time_s / 3600:.2f} h | {time.monotonic() - begun_s:.0f} s "
                    f"| {time.process_time():.0f} s | {np.median(hour):.1f}, {max(hour):.1f} MB |",
                    flush=True,
                )
                hour.clear()
        print(*painter.close(), sep="\n")
        kept_mb = sum(path.stat().st_size for path in Path(folder).iterdir()) / 1e6
    settled_mb = np.median(settled)
    growth = max(later) / settled_mb - 1
    print(
        f"\n| fed | wall | memory after a minute | later: least, median, most | growth | recording |\n|{'---|' * 6}"
    )
    print(
        f"| {state.time_s / 3600:.1f} h | {time.monotonic() - begun_s:.0f} s | {settled_mb:.0f} MB "
        f"| {min(later):.0f}, {np.median(later):.0f}, {max(later):.0f} MB | {100 * growth:.1f} % (asked: 5) "
        f"| {kept_mb:.0f} MB (asked: 100) |"
    )
    return bool(growth <= 0.05)


_HEADER = (
    b"================================================================================\n"
    b"MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    b"================================================================================\n"
    b"MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)


def _definition(kind: str, count: int) -> bytes:
    return f"std_msgs/Header header\n{kind}[{count}] values\n".encode() + _HEADER


class GrowingLog:
    """An MCAP log of one topic, a message with a stamp and `channels` numbers for each sample."""

    def __init__(self, path: Path, channels: int, rate_hz: float) -> None:
        self._rate_hz, self._written = rate_hz, 0
        payload = [("head", "V4"), ("sec", "<u4"), ("nanosec", "<u4"), ("frame", "V8"), ("values", "<f4", channels)]
        stamps = [("log_ns", "<u8"), ("publish_ns", "<u8")]
        record = [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), *stamps, *payload]
        self._messages = np.zeros(round(rate_hz), np.dtype(record))
        self._messages["opcode"], self._messages["length"] = 5, self._messages.itemsize - 9
        self._messages["channel"] = 1
        self._messages["head"], self._messages["frame"] = b"\0\1\0\0", b"\1\0\0\0\0\0\0\0"
        noise = np.random.default_rng(0).standard_normal((self._messages.size, channels))
        self._messages["values"] = noise
        begun = RecordBuilder()
        Header(profile="ros2", library="chladni").write(begun)
        Schema(id=1, name="test/msg/Many", encoding="ros2msg", data=_definition("float32", channels)).write(begun)
        McapChannelRecord(id=1, topic="/a", message_encoding="cdr", metadata={}, schema_id=1).write(begun)
        self._file = path.open("wb", buffering=0)
        self._file.write(MAGIC + begun.end())

    @property
    def samples(self) -> int:
        """Samples of each channel so far."""
        return self._written

    def write(self, samples: int) -> None:
        """Append samples, at most as many as a second has."""
        number = self._written + np.arange(samples)
        at_ns = START_NS + np.round(number / self._rate_hz * 1e9).astype(np.int64)
        some = self._messages[:samples]
        some["sequence"], some["log_ns"], some["publish_ns"] = number, at_ns, at_ns
        some["sec"], some["nanosec"] = at_ns // 10**9, at_ns % 10**9
        self._file.write(some.tobytes())
        self._written += samples

    def play(self, seconds: float, *, step_s: float) -> None:
        """Append so many seconds as they pass."""
        begun_s = time.monotonic()
        for number in range(round(seconds / step_s)):
            time.sleep(max(0.0, begun_s + (number + 1) * step_s - time.monotonic()))
            self.write(round(step_s * self._rate_hz))
        self.end()

    def end(self) -> None:
        """Write the end of the data and an empty footer."""
        self._file.write(struct.pack("<BQI", 15, 4, 0) + struct.pack("<BQQQI", 2, 20, 0, 0, 0) + MAGIC)
        self._file.close()


def load(options: argparse.Namespace) -> bool:
    """Follow a log of 64 channels x 25.6 kHz, message by message, with a recording, and see whether it keeps up."""
    channels, rate_hz, settled_s = 64, 25_600.0, 3.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "load.mcap"
        log = GrowingLog(path, channels, rate_hz)
        if options.fast:
            for _ in range(round(options.seconds)):
                log.write(round(rate_hz))
            log.end()
        else:
            threading.Thread(target=log.play, args=(options.seconds,), kwargs={"step_s": 0.02}, daemon=True).start()
        painter = Painter(RecordingFile(Path(folder) / "load.rrd", keep_bytes=1_000_000_000))
        told: list[str] = []
        marks: list[tuple[float, float, float]] = []
        for state in live(path, references=["/a.values[0]"]):
            told += [*(one.text for one in state.events), *painter.show(state)]
            # What is imported and held at the beginning, and written at the end, comes once.
            if state.time_s > settled_s and not state.ended:
                marks.append((state.time_s, time.process_time(), time.monotonic()))
        told += painter.close()
    fed_s, used_s, took_s = (last - first for first, last in zip(marks[0], marks[-1], strict=True))
    samples = round(state.time_s * rate_hz)
    print(f"| channels | fed | wall | processor, of two cores | lost | told |\n|{'---|' * 6}")
    print(
        f"| {channels} x {rate_hz:g} Hz | {fed_s:.1f} s | {took_s:.1f} s | {used_s / fed_s:.2f} s a second of data "
        f"(asked: below {MOST_BUSY_S}) | {log.samples - samples} samples | {'; '.join(told) or 'nothing'} |"
    )
    # This computer may have other work: then what counts is the processor's time, and not when it was given.
    return log.samples == samples and used_s < MOST_BUSY_S * fed_s


class Arrivals(MessageSource):
    """JSON-free messages of 12 numbers at 5 kHz, each with the moment at which it arrived."""

    def __init__(self, seconds: float) -> None:
        from chladni.io.mcap.channel_registry import McapChannel, McapSchema

        self.name = "made"
        text = _definition("float64", 12)
        schema = McapSchema(id=1, name="test/msg/Twelve", encoding="ros2msg", data=text)
        self._channels = {1: McapChannel(id=1, topic="/a", message_encoding="cdr", metadata={}, schema=schema)}
        self._lock, self._held = threading.Lock(), list[tuple[bytes, int]]()
        self.arrived: list[float] = []
        self._count = round(seconds * 5000)
        self._done = threading.Event()
        threading.Thread(target=self._make, daemon=True).start()

    def _make(self) -> None:
        rng = np.random.default_rng(0)
        begun_s = time.monotonic()
        for number in range(self._count):
            wait_s = begun_s + number / 5000 - time.monotonic()
            if wait_s > 1e-3:
                time.sleep(wait_s)
            at_ns = START_NS + number * 200_000
            head = struct.pack("<4sIII4s", b"\0\1\0\0", at_ns // 10**9, at_ns % 10**9, 1, b"\0\0\0\0")
            payload = head + rng.standard_normal(12).astype("<f8").tobytes()
            with self._lock:
                self._held.append((payload, at_ns))
                self.arrived.append(time.monotonic())
        self._done.set()

    @property
    def channels(self) -> Any:
        """The one channel of messages."""
        return self._channels

    def receive(self, timeout_s: float) -> Reception:
        """Give what has come."""
        from chladni.io.live.held_messages import joined_messages

        end_s = time.monotonic() + timeout_s
        while not self._held and time.monotonic() < end_s and not self._done.is_set():
            time.sleep(0.002)
        with self._lock:
            held, self._held = self._held, []
        if not held:
            return Reception(ended=self._done.is_set())
        return Reception(batches=(joined_messages(1, [one for one, _ in held], [at for _, at in held], sequence=0),))

    def close(self) -> None:
        """Nothing is open."""


class Watched(RecordingFile):
    """A recording that notes when the samples of each state were in rerun's stream."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.seen: list[tuple[int, int, float]] = []

    def draw(self, states: Sequence[LiveState]) -> None:
        """Draw, and note when it was done."""
        super().draw(states)
        now_s = time.monotonic()
        for series in [one for state in states for one in state.series]:
            first = round((series.start_time_ns - START_NS) / 200_000)
            self.seen.append((first, first + series.samples, now_s))


def latency(options: argparse.Namespace) -> bool:
    """From the arrival of a message to the moment at which rerun's bytes of it are written."""
    source = Arrivals(options.seconds)
    with tempfile.TemporaryDirectory() as folder:
        target = Watched(Path(folder) / "a.rrd")
        painter = Painter(target)
        told = [text for state in live(source) for text in painter.show(state)]
        told += painter.close()
    late = np.full(len(source.arrived), np.nan)
    for first, last, at_s in target.seen:
        late[first:last] = at_s - np.array(source.arrived[first:last])
    # The beginning is held until channels and clocks are known.
    settled = late[(4 * 5000) :]
    median, most = np.nanmedian(settled), np.nanpercentile(settled, 99)
    print(f"| messages | drawn | median | 99 % | largest | told |\n|{'---|' * 6}")
    print(
        f"| {late.size} | {np.isfinite(late).sum()} | {1e3 * median:.0f} ms (asked: 50) | {1e3 * most:.0f} ms "
        f"(asked: 200) | {1e3 * np.nanmax(settled):.0f} ms | {'; '.join(told) or 'nothing'} |"
    )
    return bool(median <= 0.05 and most <= 0.2 and np.isfinite(late).all())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["latency", "load", "day"])
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--block", type=float, default=10.0, help="day: seconds that come at a time")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--fast", action="store_true", help="load: as fast as it goes, for the processor's time")
    options = parser.parse_args()
    # As the command does.
    return_memory()
    sys.setswitchinterval(TURN_S)
    ways: dict[str, Callable[[argparse.Namespace], bool]] = {"latency": latency, "load": load, "day": day}
    return 0 if ways[options.what](options) else 1


if __name__ == "__main__":
    sys.exit(main())
