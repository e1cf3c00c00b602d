"""The robot arm's log, written in real time by a recorder and followed live in rerun: a picture every 5 s.

    python benchmarks/live_pictures.py --out /tmp/pictures --seconds 40

Takes rerun's viewer without a window, which needs Debian's mesa-vulkan-drivers.
"""

import argparse
import socket
import subprocess
import sys
import tempfile
import threading
import time
from io import BytesIO
from pathlib import Path
from uuid import uuid4

import rerun_cli
from mcap.reader import make_reader
from mcap.writer import Writer
from rerun.experimental import ViewerClient

from chladni.apps.demo_log import make_demo_log
from chladni.apps.live import live
from chladni.io.mcap.writer import write_mcap
from chladni.viewers.rerun.live import LiveDrawing, rehearse
from chladni.viewers.rerun.live_targets import live_recording

EVERY_S = 5.0
# The log is written in its own time, and lasts so long.
LOG_S = 60.0


def in_small_chunks(path: Path) -> bytes:
    """Give the log as a recorder writes it that lets others follow: a chunk a fraction of a second."""
    held = BytesIO()
    writer = Writer(held, chunk_size=1 << 14)
    writer.start()
    ids: dict[int, int] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.id not in ids:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, number, dict(channel.metadata)
                )
            writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time)
    writer.finish()
    return held.getvalue()


def record(content: bytes, path: Path) -> None:
    """Write a log as its recorder did: as many bytes a second as it has."""
    begun_s, written = time.monotonic(), 0
    with path.open("ab", buffering=0) as file:
        while written < len(content):
            due = int(len(content) * min(1.0, (time.monotonic() - begun_s) / LOG_S))
            file.write(content[written:due])
            written = due
            time.sleep(0.02)


def main() -> int:
    """Play, look, and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=40.0)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    program = Path(rerun_cli.__file__).parent / "rerun"
    viewer = subprocess.Popen(  # rerun's own program
        [program, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", "1600x1000",
         "--hide-welcome-screen"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        return play(options, port)
    finally:
        viewer.kill()
        viewer.wait()


def play(options: argparse.Namespace, port: int) -> int:
    """Follow the log while it is written, and take a picture now and then."""
    rehearse()
    for _ in range(100):
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            break
        except OSError:
            time.sleep(0.2)
    client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
    recording = live_recording(str(uuid4()))
    recording.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy")
    drawing, next_s = LiveDrawing(recording), EVERY_S
    with tempfile.TemporaryDirectory() as folder:
        write_mcap(make_demo_log().series, Path(folder) / "whole.mcap", layout="messages")
        path = Path(folder) / "arm.mcap"
        path.touch()
        content = in_small_chunks(Path(folder) / "whole.mcap")
        threading.Thread(target=record, args=(content, path), daemon=True).start()
        for state in live(path, resolution_hz=0.5, patience_s=5.0):
            if drawing.draw(state):
                drawing.arrange()
            recording.flush(timeout_sec=5.0)
            if state.time_s >= next_s:
                time.sleep(0.3)
                (options.out / f"live_{next_s:02.0f}.png").write_bytes(client.take_screenshot())
                print(f"{next_s:.0f} s of the log", flush=True)
                next_s += EVERY_S
            if state.time_s > options.seconds:
                return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
