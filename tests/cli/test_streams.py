"""Standard streams that are full, closed or without a reader, and outputs that are streams: seen from a shell.

A start of the program takes most of a second: what needs no streams of its own runs in this process, and one of each
kind here. Every kind of stream is written to in ``tests/io/test_places_to_write.py``.
"""

import json
import os
import resource
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from chladni.apps.stopping import LISTENER
from chladni.cli.main import INTERRUPTED, SUCCESS, UNUSABLE, main
from chladni.io.mcap.container import McapContainer
from chladni.io.mcap.writer import write_mcap
from tests.arm import short_arm
from tests.cli.conftest import Run

pytestmark = [
    pytest.mark.skipif(not Path("/dev/full").exists(), reason="devices of Linux"),
    pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash"),
]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of the arm's log."""
    path = tmp_path_factory.mktemp("streams") / "arm.mcap"
    write_mcap([one.window(end_s=1.0) for one in short_arm().series], path)
    return path


def shell(line: str, **variables: object) -> "subprocess.CompletedProcess[str]":
    """Run a line of bash in which ``chladni`` is this program; its code is the command's."""
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}, "PYTHON": sys.executable}
    line = 'chladni() { "$PYTHON" -m chladni "$@"; }; ' + line
    return subprocess.run(["bash", "-o", "pipefail", "-c", line], env=environment, capture_output=True, text=True,
                          errors="surrogateescape", check=False, timeout=100)  # fmt: skip


@pytest.mark.parametrize("command", ["--version", "info $LOG", "info $LOG --json -"])
def test_a_full_standard_output_is_one_line(log: Path, command: str) -> None:
    done = shell(f"chladni {command} >/dev/full", LOG=log)
    assert done.returncode == UNUSABLE
    *tables, line = done.stderr.splitlines()
    assert line.startswith("chladni: ")
    assert "No space left on device" in line
    # Beside a document on standard output, standard error has the tables.
    assert not tables or "--json -" in command
    assert "Traceback" not in done.stderr


def test_a_closed_standard_output_is_silence_unless_it_was_asked_for(log: Path, tmp_path: Path) -> None:
    done = shell("chladni info $LOG --json $OUT >&-", LOG=log, OUT=tmp_path / "a.json")
    assert (done.returncode, done.stderr) == (SUCCESS, "")
    assert json.loads((tmp_path / "a.json").read_text())["format"] == "chladni.info/1"
    done = shell("chladni info $LOG --json - >&-", LOG=log)
    assert done.returncode == UNUSABLE
    assert done.stderr == "chladni: standard output is closed: it can't take the document of --json -; name a file\n"


def test_without_standard_error_the_code_tells() -> None:
    done = shell("chladni info none.mcap 2>/dev/full")
    assert (done.returncode, done.stdout, done.stderr) == (UNUSABLE, "", "")


@pytest.mark.parametrize(
    "closed", ["<&- >&- 2>&-", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("<&-", ">&-", "2>&-"))]
)
def test_no_log_is_opened_under_the_number_of_a_closed_stream(log: Path, tmp_path: Path, closed: str) -> None:
    """What a library of C prints would go into it."""
    done = shell(f"chladni convert $LOG $OUT {closed}", LOG=log, OUT=tmp_path / "a.mcap")
    assert done.returncode == SUCCESS
    with McapContainer.open(tmp_path / "a.mcap") as written:
        for _ in written.batches(set(written.channels)):
            pass
        assert not written.damage


@pytest.mark.parametrize(
    ("target", "redirect"), [("-", ""), pytest.param("/dev/stderr", "2>&1 >/dev/null", marks=pytest.mark.nightly)]
)
def test_a_document_goes_into_a_stream(log: Path, target: str, redirect: str) -> None:
    done = shell(f"chladni info $LOG --json {target} {redirect}", LOG=log)
    assert done.returncode == SUCCESS
    # Tables may stand beside it, where both go to one place.
    start = done.stdout.index("{\n")
    assert json.loads(done.stdout[start : done.stdout.rindex("\n}") + 2])["format"] == "chladni.info/1"


def test_standard_output_in_a_file_is_not_replaced(log: Path, tmp_path: Path) -> None:
    done = shell("{ echo before; chladni info $LOG --json /dev/stdout; echo after; } > $OUT", LOG=log,
                 OUT=tmp_path / "a.txt")  # fmt: skip
    before, *document, after = (tmp_path / "a.txt").read_text().splitlines()
    assert (done.returncode, before, after) == (0, "before", "after")
    assert json.loads("\n".join(document))["format"] == "chladni.info/1"


def test_the_null_device_stays_one(run: Run, log: Path, tmp_path: Path) -> None:
    try:
        os.mknod(tmp_path / "null", 0o666 | stat.S_IFCHR, os.makedev(1, 3))
    except PermissionError:
        (tmp_path / "null").symlink_to(os.devnull)
    assert run("info", log, "--json", tmp_path / "null").code == SUCCESS
    assert stat.S_ISCHR((tmp_path / "null").stat().st_mode)


def test_a_pipe_with_a_name_is_fed(log: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    done = shell("cat $PIPE & chladni convert $LOG $PIPE >/dev/null", LOG=log, PIPE=pipe)
    assert done.returncode == SUCCESS, done.stderr
    assert done.stdout
    assert pipe.is_fifo()


def test_a_name_that_is_no_text_is_told_in_json(run: Run, log: Path, tmp_path: Path) -> None:
    odd = tmp_path / "x\udcff.mcap"
    try:
        shutil.copy(log, odd)
    except (OSError, UnicodeError):
        pytest.skip("not a name here")
    done = shell("chladni convert $LOG $OUT --json -", LOG=odd, OUT=tmp_path / "y\udcff.csv")
    assert done.returncode == SUCCESS, done.stderr
    assert run("convert", odd, tmp_path / "y\udcff.csv", "--overwrite", "--json", tmp_path / "a.json").code == SUCCESS
    for text in (done.stdout, (tmp_path / "a.json").read_text()):
        assert json.loads(text)["target"] == str(tmp_path / "y\udcff.csv")


def test_universal_files_need_no_temporary_folder(
    run: Run, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/nonexistent")
    done = run("convert", log, tmp_path / "a.uff")
    assert done.code == SUCCESS, done.err
    assert [path.name for path in tmp_path.iterdir()] == ["a.uff"]


@contextmanager
def files_up_to(size_bytes: int) -> Iterator[None]:
    """Let no file of this process grow beyond a size: Python hears of it as of a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("suffix", ["csv", "mat", "npz", "wav", "mcap", "arrow", "parquet"])
def test_a_disk_that_fills_up_is_one_line_and_leaves_nothing(
    run: Run, log: Path, tmp_path: Path, suffix: str
) -> None:
    options = ["--channel", "/tool.accel.linear.x"] if suffix != "mcap" else []
    with files_up_to(4096):
        done = run("convert", log, tmp_path / f"a.{suffix}", *options)
    assert done.code == UNUSABLE, (done.out, done.err)
    assert (done.out, done.err.count("\n")) == ("", 1)
    assert list(tmp_path.iterdir()) == []


# pyuff leaves its file open, of which Python tells; Arrow is C++, which could print.
@pytest.mark.parametrize("suffix", ["uff", pytest.param("parquet", marks=pytest.mark.nightly)])
def test_a_library_says_nothing_of_its_own_where_a_disk_fills_up(log: Path, tmp_path: Path, suffix: str) -> None:
    done = shell(f"ulimit -f 4; chladni convert $LOG $OUT/a.{suffix} --channel /tool.accel.linear.x", LOG=log,
                 OUT=tmp_path)  # fmt: skip
    assert done.returncode == UNUSABLE, (done.stdout, done.stderr)
    assert (done.stdout, done.stderr.count("\n")) == ("", 1)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGHUP, 129, marks=pytest.mark.nightly),
        (signal.SIGINT, INTERRUPTED),
    ],
)
def test_a_command_that_is_ended_says_so_in_one_line(log: Path, tmp_path: Path, number: int, code: int) -> None:
    # A pipe without a reader: there it waits.
    os.mkfifo(tmp_path / "pipe.json")
    with subprocess.Popen(
        [sys.executable, "-m", "chladni", "info", log, "--json", tmp_path / "pipe.json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(number)
        _, told = process.communicate(timeout=60)
    assert process.returncode == code
    how = "interrupted" if number == signal.SIGINT else f"ended by {signal.Signals(number).name}"
    assert told == f"chladni: {how}; every file is whole, or as it was before\n"


def test_a_library_that_makes_an_error_of_a_signal_is_no_defect(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a bare ``except`` does, pyuff's among them."""

    def swallow(*_: object, **__: object) -> None:
        monkeypatch.setattr(LISTENER, "heard", int(signal.SIGTERM))
        raise ValueError("something went wrong")

    monkeypatch.setattr("chladni.cli.main._program", lambda: swallow)
    assert main(["info"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "chladni: ended by SIGTERM; every file is whole, or as it was before\n"


def test_what_the_system_refuses_is_no_defect(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(24, "Too many open files", "some.file")

    monkeypatch.setattr("chladni.cli.main._program", lambda: refuse)
    assert main(["info"]) == UNUSABLE
    assert capsys.readouterr().err == "chladni: some.file: the operating system refuses: Too many open files\n"
