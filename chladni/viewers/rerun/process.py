"""The rerun program as a child process that listens on this computer only."""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import IO
from urllib.parse import quote

import rerun as rr

from chladni.signals.errors import SetupError
from chladni.viewers.rerun.drawing import new_recording

Drawing = Callable[[rr.RecordingStream], None]
"""Writes all of something and its blueprint into a recording that is connected already."""

LOOPBACK = "127.0.0.1"
PATIENCE_S = 30.0
POLL_S = 0.05

# Ends the program when told to (SIGTERM), or when the other end of its input is closed, as any death of ours does.
_GUARD = """
import os, signal, subprocess, sys, threading
program = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
def end(*_):
    program.terminate()
    threading.Timer(3.0, program.kill).start()
def wait_for_parent():
    sys.stdin.buffer.read()
    end()
signal.signal(signal.SIGTERM, end)
threading.Thread(target=wait_for_parent, daemon=True).start()
code = program.wait()
# Not by way of the interpreter's end, which waits for timers.
os._exit(code if code >= 0 else 128 - code)
"""


def page_address(page_port: int, data_port: int) -> str:
    """Give the address of rerun's page that shows what comes to a port; dark, for which our colours are chosen."""
    data = quote(f"rerun+http://{LOOPBACK}:{data_port}/proxy", safe="")
    return f"http://{LOOPBACK}:{page_port}/?url={data}&theme=dark"


def start(
    options: Sequence[str], *, ports: Sequence[int], detached: bool, settle_s: float = 0.0
) -> "subprocess.Popen[bytes]":
    """Start rerun bound to loopback and wait until it listens on all `ports`; only a `detached` one outlives us.

    Python's own servers (``rr.serve_grpc`` and its kin) bind every interface and can't be told otherwise, and so
    does ``rr.spawn``; only the program takes an address. With `settle_s` it must also live that long after it
    listens: the windowed viewer listens before it finds out that it has no display.

    Raises
    ------
    SetupError
        When the program ends, or doesn't listen in time; the message has the last thing it said.
    """
    with tempfile.TemporaryFile() as said:
        command = [_executable(), "--bind", LOOPBACK, "--hide-welcome-screen", *options]
        if not detached:
            command = [sys.executable, "-I", "-S", "-c", _GUARD, *command]
        process = subprocess.Popen(  # noqa: S603  # the program and all options are ours
            command,
            stdin=subprocess.DEVNULL if detached else subprocess.PIPE,
            stdout=said,
            stderr=said,
            start_new_session=detached,
            # What the SDK itself sets when it starts the viewer: no questions about usage statistics.
            env={**os.environ, "RERUN_APP_ONLY": "true"},
        )
        try:
            _wait_for(process, ports, said, settle_s)
        # Ctrl-C too must not leave a server behind.
        except BaseException:
            stop(process)
            raise
    return process


def stop(process: "subprocess.Popen[bytes]") -> None:
    """End the process and wait for it; one that has ended already is fine."""
    process.terminate()
    try:
        process.wait(timeout=5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdin is not None:
        process.stdin.close()


def send(drawing: Drawing, port: int) -> None:
    """Draw into the program that listens on `port`, and wait until it has everything."""
    recording = new_recording()
    recording.connect_grpc(f"rerun+http://{LOOPBACK}:{port}/proxy")
    drawing(recording)
    # Data still on its way would be lost when Python ends.
    recording.flush()
    recording.disconnect()


def free_port() -> int:
    """Find a port of loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _wait_for(process: "subprocess.Popen[bytes]", ports: Sequence[int], said: IO[bytes], settle_s: float) -> None:
    deadline = time.monotonic() + PATIENCE_S
    settled = None
    while settled is None or time.monotonic() < settled:
        if process.poll() is not None:
            raise SetupError(
                f"the rerun viewer ended with code {process.returncode}: {_last_words(said)};"
                " write a file instead (--save OUT.rrd) or serve it to a browser (--web)"
            )
        if settled is None and all(_listens(port) for port in ports):
            settled = time.monotonic() + settle_s
        if settled is None and time.monotonic() > deadline:
            raise SetupError(f"the rerun viewer didn't listen within {PATIENCE_S:g} s; write a file instead")
        time.sleep(POLL_S)


def _listens(port: int) -> bool:
    try:
        socket.create_connection((LOOPBACK, port), timeout=1).close()
    except OSError:
        return False
    return True


def _last_words(said: IO[bytes]) -> str:
    said.seek(0)
    lines = [line.strip() for line in said.read().decode(errors="replace").splitlines() if line.strip()]
    complaints = [line for line in lines if "error" in line.lower()]
    return [*complaints[-1:], *lines[-1:], "it said nothing"][0][-200:]


def _executable() -> str:
    # The `rerun` on the PATH is a script that starts this program as its child: stopping it would orphan the child.
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise SetupError("the rerun viewer isn't installed; run `pip install rerun-sdk`")
    folder = Path(package.origin).parent
    names = {"win32": "rerun.exe", "darwin": "Rerun.app/Contents/MacOS/Rerun"}
    bundled = folder / names.get(sys.platform, "rerun")
    return str(bundled if bundled.exists() else folder / "rerun")
