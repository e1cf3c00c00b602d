"""Signals that ask a process to end."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
PATIENCE_S = 60.0

WRITING = """
import sys, time
from chladni.apps.stopping import LISTENER
from chladni.io.atomic import atomic_write
LISTENER.listen()
with atomic_write(sys.argv[1]) as file:
    file.write(b"half")
    file.flush()
    print("writing", flush=True)
    {wait}
"""
WAITS = {
    "sleeps": "time.sleep(60)",
    # As a library that calls back from C does.
    "swallows": "\n    while True:\n        try: time.sleep(60)\n        except BaseException: pass",
}
WORKERS = """
import os, sys, time
from chladni.apps.processes import workers
def case(path):
    open(path, "w").write(str(os.getpid()))
    time.sleep(60)
if __name__ == "__main__":
    from chladni.apps.stopping import LISTENER
    LISTENER.listen()
    with workers(2) as executor:
        list(executor.map(case, [sys.argv[1] + "1", sys.argv[1] + "2"]))
"""


def until(done: Callable[[], bool]) -> bool:
    """Wait for something that takes as long as this machine has other things to do."""
    end_s = time.monotonic() + PATIENCE_S
    while not done() and time.monotonic() < end_s:
        time.sleep(0.02)
    return done()


def started(code: str, *arguments: object, ignored: signal.Signals | None = None) -> "subprocess.Popen[str]":
    """Start Python, with a signal ignored as nohup does."""
    before = None if ignored is None else signal.signal(ignored, signal.SIG_IGN)
    try:
        return subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, start_new_session=True)  # fmt: skip
    finally:
        if ignored is not None:
            signal.signal(ignored, before)


def is_there(pid: int) -> bool:
    """Whether a process runs; one that nobody has asked for its code doesn't."""
    told = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False).stdout
    return bool(told.strip()) and not told.startswith("Z")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_leaves_no_part_and_the_file_as_it_was(tmp_path: Path, number: signal.Signals) -> None:
    (tmp_path / "a").write_text("old")
    with started(WRITING.format(wait=WAITS["sleeps"]), tmp_path / "a") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        process.send_signal(number)
        code = process.wait(PATIENCE_S)
    # Python ends by SIGINT itself when nobody takes its KeyboardInterrupt; the command does.
    assert code == (-number if number == signal.SIGINT else 128 + number)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a", "old")]


def test_who_swallows_the_first_signal_ends_all_the_same(tmp_path: Path) -> None:
    with started(WRITING.format(wait=WAITS["swallows"]), tmp_path / "a") as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.terminate()
        # `timeout` sends it to the process and to its group: that is one request.
        process.terminate()
        assert process.wait(PATIENCE_S) == 128 + signal.SIGTERM
    assert list(tmp_path.iterdir()) == []


def test_what_is_ignored_stays_ignored(tmp_path: Path) -> None:
    wait = "sys.stdin.close(); time.sleep(0.5)"
    with started(WRITING.format(wait=wait), tmp_path / "a", ignored=signal.SIGHUP) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGHUP)
        assert process.wait(PATIENCE_S) == 0
    assert (tmp_path / "a").read_text() == "half"


@pytest.mark.parametrize(
    ("number", "whom"),
    [
        (signal.SIGTERM, "parent"),
        (signal.SIGHUP, "group"),
        (signal.SIGKILL, "parent"),
        pytest.param(signal.SIGTERM, "group", marks=pytest.mark.nightly),
        pytest.param(signal.SIGINT, "parent", marks=pytest.mark.nightly),
        pytest.param(signal.SIGINT, "group", marks=pytest.mark.nightly),
    ],
)
def test_workers_end_with_their_parent(tmp_path: Path, number: signal.Signals, whom: str) -> None:
    script, begun = tmp_path / "campaign.py", [tmp_path / "case1", tmp_path / "case2"]
    script.write_text(WORKERS)
    with subprocess.Popen([sys.executable, script, tmp_path / "case"], stderr=subprocess.PIPE, text=True,
                          start_new_session=True) as process:  # fmt: skip
        assert until(lambda: all(path.is_file() and path.read_text() for path in begun))
        pids = [int(path.read_text()) for path in begun]
        if whom == "parent":
            process.send_signal(number)
        else:
            os.killpg(process.pid, number)
        process.wait(PATIENCE_S)
        assert until(lambda: not any(map(is_there, pids)))
        _, told = process.communicate(timeout=PATIENCE_S)
    # Python tells of an interruption that nobody took; the command takes it.
    assert number in (signal.SIGINT, signal.SIGKILL) or "Traceback" not in told
