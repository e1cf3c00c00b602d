"""Live sources that fail in the midst: everything that is missing is told, and each run ends.

    python benchmarks/bench_live_faults.py --runs 200 --seed 1

A run is made from seed and number. It fails where a sample that was sent is neither averaged nor told of, and where
it does not end within a minute. Of a log that was cut, or whose recorder was killed, the reader `mcap` says
which messages are whole. Full disks are small ones made for the purpose (tmpfs), which takes root.
`bench_study_faults.py` does the same for studies: their workers are killed there.
"""

import argparse
import json
import random
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from io import BytesIO
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from small_disk import small_disk
from websockets.sync.server import serve

from chladni.apps.live import live
from chladni.io.live.foxglove import FoxgloveServer
from chladni.io.live.mcap_stream import McapStream
from chladni.io.live.reception import MessageSource, Reception
from chladni.signals.live_state import LiveState
from chladni.viewers.rerun.live_targets import Painter, RecordingFile

START_NS, STEP_NS, COUNT = 1_700_000_000_000_000_000, 1_000_000, 4000
PATIENCE_S = 60.0
# A program that appends a file to another, so many bytes at a time.
RECORDER = """
import sys, time
source, target, size, total = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
with open(source, "rb") as there, open(target, "ab", buffering=0) as here:
    there.seek(1000)
    while part := there.read(size):
        here.write(part)
        time.sleep(2.0 * size / total)
"""
# What each fault must at least say.
FAULTS = {
    "cut": "source",
    "stall": None,
    "jump": "clock",
    "killed recorder": "source",
    "dead socket": "source",
    "full disk": "source",
    # A bit of an index harms no message.
    "damage": None,
    # Where it comes within the piece that tells the others' clock it isn't late; nothing of it may be missing.
    "late topic": None,
    "dead topic": "silent",
    "closed viewer": "source",
    "lost messages": "gap",
}
DEFINITION = (
    b"std_msgs/Header header\nfloat64 x\n"
    + b"=" * 80
    + b"\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + b"=" * 80
    + b"\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)


def message(stamp_ns: int, value: float) -> bytes:
    """A header and a number, as ROS 2 writes them."""
    head = struct.pack("<4sIII4s", b"\0\1\0\0", stamp_ns // 10**9, stamp_ns % 10**9, 1, b"\0\0\0\0")
    return head + struct.pack("<d", value)


def log_of(folder: Path, stamps: Any, keep: Any) -> bytes:
    """A log of the topics /a and /b, with stamps of their own, without the messages that `keep` refuses."""
    path = folder / "made.mcap"
    noise = np.random.default_rng(0).standard_normal((2, COUNT))
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 14)
        writer.start()
        schema = writer.register_schema("test/msg/One", "ros2msg", DEFINITION)
        ids = [writer.register_channel(topic, "cdr", schema) for topic in ("/a", "/b")]
        for number, stamp_ns in enumerate(stamps.tolist()):
            log_ns = START_NS + number * STEP_NS
            for row, channel in enumerate(ids):
                if keep[row, number]:
                    writer.add_message(channel, log_ns, message(stamp_ns, float(noise[row, number])), log_ns)
        writer.finish()
    return path.read_bytes()


class Pieces(MessageSource):
    """Bytes of a log in random pieces, with a pause where it stalls."""

    def __init__(self, content: bytes, rng: random.Random, *, stalls: bool) -> None:
        self.name, self._stream = "made", McapStream("made")
        self._content, self._rng, self._place = content, rng, 0
        self._stall = rng.randrange(len(content)) if stalls else None

    @property
    def channels(self) -> Any:
        """Channels so far."""
        return self._stream.channels

    def receive(self, _timeout_s: float) -> Reception:
        """Give the next piece."""
        if self._stall is not None and self._place > self._stall:
            self._stall = None
            time.sleep(self._rng.random())
            return Reception()
        if self._place >= len(self._content):
            return self._stream.finish()
        part = self._content[self._place : self._place + self._rng.choice((1, 700, 20_000, 100_000))]
        self._place += len(part)
        return self._stream.feed(part)

    def close(self) -> None:
        """Nothing is open."""


class CutOff:
    """A Foxglove server that is cut off in the midst, and goes on behind what it sent meanwhile to nobody."""

    def __init__(self, place: int, missed: int) -> None:
        self._place, self._missed, self._sent = place, missed, 0
        self._server = serve(self._talk, "127.0.0.1", 0, subprotocols=["foxglove.websocket.v1"], compression=None)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()
        self.source = FoxgloveServer(f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}", patience_s=3.0)

    def _talk(self, connection: Any) -> None:
        schema = json.dumps({"type": "object", "properties": {"x": {"type": "number"}}})
        offered = {"id": 1, "topic": "/a", "encoding": "json", "schemaName": "a", "schema": schema}
        connection.send(json.dumps({"op": "advertise", "channels": [offered]}))
        connection.recv()
        again = self._sent > 0
        for number in range(self._sent, COUNT if again else self._place):
            payload = json.dumps({"x": float(number % 17)}).encode()
            connection.send(struct.pack("<BIQ", 1, 1, START_NS + number * STEP_NS) + payload)
        self._sent = COUNT if again else self._place + self._missed
        if again:
            time.sleep(8.0)

    def close(self) -> None:
        """End the server."""
        self._server.shutdown()


class ClosedSoon(RecordingFile):
    """A viewer that is closed after so many pictures."""

    def __init__(self, path: Path, pictures: int) -> None:
        super().__init__(path)
        self._pictures = pictures

    def draw(self, states: Sequence[LiveState]) -> None:
        """Draw while it is open."""
        super().draw(states)
        self._pictures -= len(states)
        if self._pictures < 0:
            raise OSError("it was closed")


def judged(fault: str, rng: random.Random, folder: Path) -> str:
    """Let one run have its fault; ``told`` where every sample that is missing was told of."""
    stamps, keep = START_NS + np.arange(COUNT) * STEP_NS, np.ones((2, COUNT), bool)
    place = rng.randrange(2500, COUNT - 300)
    if fault == "jump":
        stamps[place:] += rng.choice((-1, 1)) * rng.randrange(2_000_000_000, 5_000_000_000_000)
    if fault == "late topic":
        keep[1, :place] = False
    if fault == "dead topic":
        keep[1, 500 + rng.randrange(1000) :] = False
    if fault == "lost messages":
        keep[rng.randrange(2), place : place + rng.randrange(2, 200)] = False
    content = log_of(folder, stamps, keep)
    if fault == "cut":
        content = content[: rng.randrange(len(content) // 2, len(content) * 9 // 10)]
    if fault == "damage":
        changed = bytearray(content)
        changed[rng.randrange(len(content) // 2, len(content) * 3 // 4)] ^= 1 << rng.randrange(8)
        content = bytes(changed)
    sent = {"/a.x": int(keep[0].sum()), "/b.x": int(keep[1].sum())}
    if fault == "dead socket":
        server = CutOff(place, rng.randrange(300))
        try:
            return verdict(fault, server.source, [], {"/a.x": COUNT})
        finally:
            server.close()
    if fault == "killed recorder":
        with killed(folder, content, rng) as path:
            return verdict(fault, path, [], sent, whole=lambda: whole_messages(path.read_bytes()))
    source = Pieces(content, rng, stalls=fault == "stall")
    if fault == "full disk":
        with small_disk(folder / "disk", rng.randrange(20, 60)):
            return verdict(fault, source, [Painter(RecordingFile(folder / "disk" / "a.rrd"))], sent)
    painters = [Painter(ClosedSoon(folder / "a.rrd", rng.randrange(2)))] if fault == "closed viewer" else []
    # Of a log that was damaged the reader `mcap` gives up at the damage.
    return verdict(fault, source, painters, sent, whole=lambda: whole_messages(content))


@contextmanager
def killed(folder: Path, content: bytes, rng: random.Random) -> Iterator[Path]:
    """Have a program write a log bit by bit, and kill it in the midst."""
    path = folder / "growing.mcap"
    path.write_bytes(content[:1000])
    sizes = [str(rng.choice((999, 7000, 40_000))), str(len(content))]
    recorder = subprocess.Popen([sys.executable, "-S", "-c", RECORDER, folder / "made.mcap", path, *sizes])
    threading.Timer(rng.uniform(0.2, 1.6), recorder.kill).start()
    try:
        yield path
    finally:
        recorder.kill()
        recorder.wait()


def whole_messages(content: bytes) -> Counter[str]:
    """Count the messages of each topic that stand whole in a log, as far as the reader `mcap` comes."""
    counts, topics = Counter[str](), dict[int, str]()
    with suppress(Exception):
        for record in StreamReader(BytesIO(content), validate_crcs=True).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                counts[f"{topics[record.channel_id]}.x"] += 1
    return counts


def verdict(
    fault: str,
    source: MessageSource | Path,
    painters: list[Painter],
    sent: dict[str, int],
    whole: Callable[[], Counter[str]] = Counter,
) -> str:
    """Follow the source to its end, and count what came and what was told."""
    kinds, came = Counter[str](), Counter[str]()
    for state in live(source, modes_every_s=0, patience_s=3.0 if isinstance(source, Path) else None):
        kinds.update(event.kind for event in state.events)
        kinds.update("source" for painter in painters for _ in painter.show(state))
        for series in state.series:
            known = np.ones(series.values.shape, bool) if series.valid is None else series.valid
            for channel, row in zip(series.channels, known, strict=True):
                came[channel.name] += int(np.count_nonzero(row))
    kinds.update("source" for painter in painters for _ in painter.close())
    asked = FAULTS[fault]
    if asked is not None and not kinds[asked]:
        return f"nothing was told of it: {dict(kinds)}"
    lost = {name: sent[name] - came[name] for name in sent if came[name] != sent[name]}
    if lost and not (kinds["source"] or kinds["gap"] or kinds["late"]):
        return f"missing in silence: {lost}"
    # Two stamps far from all others, at the end of what tells the clock, are no time; of three it's one that was set.
    strays = fault == "jump" and kinds["late"] and max(lost.values(), default=0) <= 2
    # Bytes that never came, or came broken, and messages that nobody received, are all else that may be missing.
    broken = fault in ("cut", "damage", "dead socket", "killed recorder")
    if lost and (not (broken or strays) or min(lost.values()) < 0):
        return f"missing: {lost}, told: {dict(kinds)}"
    needed = whole() if broken else {}
    unread = {name: f"{came[name]} of {count}" for name, count in needed.items() if came[name] < count}
    return f"whole in the log, but missing: {unread}" if unread else "told"


def attempt(seed: int, number: int) -> tuple[int, str, str]:
    """Let one run have its fault; its number, its fault, and ``told``, ``hangs`` or what went wrong."""
    fault = list(FAULTS)[number % len(FAULTS)]
    rng = random.Random(seed * 100_003 + number)  # noqa: S311  # faults, no secrets
    # A run that ends by an error prints it, and leaves this.
    outcome = ["error"]

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            outcome.append(judged(fault, rng, Path(folder)))

    worker = threading.Thread(target=run, daemon=True)
    worker.start()
    worker.join(timeout=PATIENCE_S)
    return number, fault, "hangs" if worker.is_alive() else outcome[-1]


def main() -> int:
    """Run after run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    outcomes = Counter[str]()
    with Pool(options.processes, maxtasksperchild=20) as pool:
        for number, fault, outcome in pool.imap_unordered(
            partial(attempt, options.seed), range(options.runs), chunksize=1
        ):
            outcomes[outcome if outcome in ("told", "hangs") else "silent"] += 1
            if outcome != "told":
                print(f"  run {number}, {fault}: {outcome}", flush=True)
    silent, hung = outcomes["silent"], outcomes["hangs"]
    print(f"| runs | faults | silent losses | hangs |\n|{'---|' * 4}")
    print(f"| {options.runs} | {len(FAULTS)} kinds | {silent} (asked: 0) | {hung} (asked: 0) |")
    return 1 if silent or hung else 0


if __name__ == "__main__":
    sys.exit(main())
