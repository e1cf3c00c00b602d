"""A Foxglove server of the SDK itself: its messages are those of the log that it records beside."""

import json
import socket
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.io.live.foxglove import FoxgloveServer
from chladni.io.live.live_log import LiveLog
from chladni.io.log import open_log
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries
from tests.io.live.growing import START_NS, joined

foxglove = pytest.importorskip("foxglove")
websockets = pytest.importorskip("websockets")

STEP_NS = 1_000_000
SCHEMA = {"type": "object", "properties": {"x": {"type": "number"}, "y": {"type": "number"}}}


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def collected(live: LiveLog, samples: int, *, seconds: float = 20.0) -> tuple[list[TimeSeries], list[str]]:
    """Blocks until so many samples came and half a second nothing more; and what was told."""
    blocks: list[TimeSeries] = []
    told: list[str] = []
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s and sum(one.samples for one in blocks) < samples:
        got = live.receive(0.05)
        blocks += got.blocks
        told += [one.text for one in got.told]
    blocks += live.finish().blocks
    return blocks, told


def test_messages_of_the_sdks_server_are_those_of_its_own_log(tmp_path: Path) -> None:
    port, context = free_port(), foxglove.Context()
    server = foxglove.start_server(port=port, context=context)
    path = tmp_path / "own.mcap"
    rng = np.random.default_rng(0)
    try:
        with foxglove.open_mcap(path, context=context):
            as_json = foxglove.Channel("/axis", schema=SCHEMA, context=context)
            as_protobuf = foxglove.channels.Vector3Channel("/force", context=context)
            source = FoxgloveServer(f"ws://127.0.0.1:{port}")
            live = LiveLog(source, settle_s=0.5)
            # Subscribed before anything is sent.
            time.sleep(0.5)
            for number in range(1500):
                x, y, z = rng.standard_normal(3)
                at_ns = START_NS + number * STEP_NS
                as_json.log({"x": x, "y": y}, log_time=at_ns)
                as_protobuf.log(foxglove.messages.Vector3(x=x, y=y, z=z), log_time=at_ns)
                if number % 50 == 49:
                    time.sleep(0.01)
            blocks, told = collected(live, 1500)
            live.close()
    finally:
        server.stop()
    assert told == []
    with open_log(path) as log:
        reference = log.read()
    # The server lists its channels in an order of its own.
    names = [one.name for one in blocks[0].channels]
    np.testing.assert_array_equal(joined(blocks), reference.select(names).values)
    assert len(names) == 5
    assert blocks[0].sample_rate_hz == reference.sample_rate_hz == 1000.0


def test_a_server_that_isnt_there_is_told_with_what_to_do() -> None:
    with pytest.raises(LogError, match=r"no Foxglove server answers \(.*\); start one, such as"):
        FoxgloveServer(f"ws://127.0.0.1:{free_port()}")
    with pytest.raises(LogError, match="give ws://HOST:PORT"):
        FoxgloveServer("ws://")


class Made:
    """A server of our own that can be cut off: it offers /a.x and sends messages as it's told to."""

    def __init__(self, port: int = 0) -> None:
        from websockets.sync.server import serve

        self._sockets: list[Any] = []
        self._server = serve(self._serve, "127.0.0.1", port, subprotocols=["foxglove.websocket.v1"], compression=None)
        self.port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()
        self.subscribed = threading.Event()

    def _serve(self, connection: Any) -> None:
        connection.send(json.dumps({"op": "serverInfo", "name": "made", "capabilities": []}))
        offered = {"id": 7, "topic": "/a", "encoding": "json", "schemaName": "a", "schema": json.dumps(SCHEMA)}
        connection.send(json.dumps({"op": "advertise", "channels": [offered]}))
        for frame in connection:
            if json.loads(frame)["op"] == "subscribe":
                self._sockets.append(connection)
                self.subscribed.set()

    def send(self, numbers: range) -> None:
        for number in numbers:
            payload = json.dumps({"x": float(number), "y": -float(number)}).encode()
            frame = struct.pack("<BIQ", 1, 7, START_NS + number * STEP_NS) + payload
            self._sockets[-1].send(frame)

    def cut(self) -> None:
        self.subscribed.clear()
        for connection in self._sockets:
            connection.close()
        self._sockets = []

    def close(self) -> None:
        self._server.shutdown()
        self._thread.join()


@pytest.fixture
def made() -> Iterator[Made]:
    server = Made()
    yield server
    server.close()


def test_a_connection_that_is_lost_is_made_again_and_the_gap_is_marked(made: Made) -> None:
    live = LiveLog(FoxgloveServer(f"ws://127.0.0.1:{made.port}"), settle_s=0.2)
    assert made.subscribed.wait(5)
    made.send(range(500))
    time.sleep(0.1)
    first = live.receive(0.1)
    made.cut()
    assert made.subscribed.wait(5)
    made.send(range(800, 1200))
    time.sleep(0.1)
    blocks, told = collected(live, 1200 - sum(one.samples for one in first.blocks), seconds=3)
    live.close()
    values = joined([*first.blocks, *blocks])[0]
    assert values.size == 1200
    assert np.isnan(values[500:800]).all()
    np.testing.assert_array_equal(values[:500], np.arange(500))
    np.testing.assert_array_equal(values[800:], np.arange(800, 1200))
    assert [text.split(": ", 1)[-1].split(" (")[0].split(" after")[0] for text in told] == [
        "the connection is lost", "connected again", "300 samples of /a missing",
    ]  # fmt: skip


def test_what_cant_be_taken_is_skipped_whole_counted_and_its_place_stays_free(made: Made) -> None:
    source = FoxgloveServer(f"ws://127.0.0.1:{made.port}", waiting_bytes=20_000)
    live = LiveLog(source, settle_s=0.2)
    assert made.subscribed.wait(5)
    made.send(range(300))
    time.sleep(0.2)
    blocks = list(live.receive(0.1).blocks)
    # Nobody receives meanwhile.
    made.send(range(300, 2000))
    time.sleep(0.3)
    got = live.receive(0.1)
    blocks += got.blocks
    told = [one.text for one in got.told]
    made.send(range(2000, 2300))
    time.sleep(0.2)
    more, _ = collected(live, 2300 - sum(one.samples for one in blocks), seconds=3)
    live.close()
    values = joined([*blocks, *more])[0]
    kept = np.isfinite(values)
    np.testing.assert_array_equal(values[kept], np.flatnonzero(kept))
    (sentence,) = [text for text in told if "skipped" in text]
    assert f"{np.count_nonzero(~kept)} messages of /a skipped" in sentence
