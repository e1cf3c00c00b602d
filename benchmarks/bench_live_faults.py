"""Live sources that fail in the midst: everything that is missing is told, and each run ends.

    python benchmarks/bench_live_faults.py --runs 100 --seed 1

A run is made from seed and number. It fails where a sample that was sent is neither averaged nor told of, and where
it doesn't end within a minute.
"""

import argparse
import json
import random
import struct
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from websockets.sync.server import serve

from chladni.apps.live import live
from chladni.io.live.foxglove import FoxgloveServer
from chladni.io.live.mcap_stream import McapStream
from chladni.io.live.reception import MessageSource, Reception
from chladni.signals.live_state import LiveState
from chladni.viewers.rerun.live_targets import Painter, RecordingFile

START_NS, STEP_NS, COUNT = 1_700_000_000_000_000_000, 1_000_000, 4000
PATIENCE_S = 60.0
# What each fault must at least say.
FAULTS = {
    "cut": "source",
    "stall": None,
    "jump": "clock",
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


class FullSoon(RecordingFile):
    """A recording on a disk that is full after so many bytes."""

    def __init__(self, path: Path, room: int) -> None:
        super().__init__(path)
        self._room = room

    def draw(self, states: Sequence[LiveState]) -> None:
        """Draw while there is room."""
        super().draw(states)
        if self._way.written > self._room:
            raise OSError(28, "No space left on device")


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
    painters = []
    if fault == "full disk":
        painters = [Painter(FullSoon(folder / "a.rrd", rng.randrange(20_000, 60_000)))]
    if fault == "closed viewer":
        painters = [Painter(ClosedSoon(folder / "a.rrd", rng.randrange(2)))]
    if fault != "dead socket":
        source = Pieces(content, rng, stalls=fault == "stall")
        return verdict(fault, source, painters, {"/a.x": int(keep[0].sum()), "/b.x": int(keep[1].sum())})
    server = CutOff(place, rng.randrange(300))
    try:
        return verdict(fault, server.source, painters, {"/a.x": COUNT})
    finally:
        server.close()


def verdict(fault: str, source: MessageSource, painters: list[Painter], sent: dict[str, int]) -> str:
    """Follow the source to its end, and count what came and what was told."""
    kinds, came = Counter[str](), Counter[str]()
    for state in live(source, modes_every_s=0):
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
    if lost and not (kinds["source"] or kinds["gap"]):
        return f"missing in silence: {lost}"
    # Bytes that never came, or came broken, and messages that nobody received, are all that may be missing.
    if lost and (fault not in ("cut", "damage", "dead socket") or min(lost.values()) < 0):
        return f"missing: {lost}, told: {dict(kinds)}"
    return "told"


def main() -> int:
    """Run after run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    silent = hung = 0
    for number in range(options.runs):
        fault = list(FAULTS)[number % len(FAULTS)]
        rng = random.Random(options.seed * 100_003 + number)  # noqa: S311  # faults, no secrets
        outcome: list[str] = []

        def run(fault: str = fault, rng: random.Random = rng, outcome: list[str] = outcome) -> None:
            with tempfile.TemporaryDirectory() as folder:
                outcome.append(judged(fault, rng, Path(folder)))

        worker = threading.Thread(target=run, daemon=True)
        worker.start()
        worker.join(timeout=PATIENCE_S)
        hung += worker.is_alive()
        # A run that ended by an error has printed it, and has no outcome.
        silent += not worker.is_alive() and outcome != ["told"]
        if outcome != ["told"]:
            print(f"  run {number}, {fault}: {outcome or ('hangs' if worker.is_alive() else 'error')}", flush=True)
    print(f"| runs | faults | silent losses | hangs |\n|{'---|' * 4}")
    print(f"| {options.runs} | {len(FAULTS)} kinds | {silent} (asked: 0) | {hung} (asked: 0) |")
    return 1 if silent or hung else 0


if __name__ == "__main__":
    sys.exit(main())
