"""``chladni live``: from a log on disk or on standard input to recording, report and document."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from chladni.apps.psd import psd
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.arm import write_arm
from tests.cli.conftest import Run


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("arm")
    write_arm(folder)
    return folder / "arm.mcap"


@pytest.mark.nightly
def test_a_finished_log_ends_by_its_footer_with_everything_written(run: Run, arm: Path, tmp_path: Path) -> None:
    found = run(
        "live", arm, "--save", tmp_path / "a.rrd", "--json", "-", "--report", tmp_path / "a.html", "--resolution", "2"
    )
    assert found.code == 0
    document = found.document
    assert document["format"] == "chladni.live/1"
    reference = psd(arm, resolution_hz=2.0)
    names = [one["name"] for one in document["psd"]["channels"]]
    for channel, values in zip(reference.channels, reference.values, strict=True):
        mine = document["psd"]["channels"][names.index(channel.name)]
        np.testing.assert_allclose(mine["psd"], values, rtol=1e-12)
    assert (tmp_path / "a.rrd").stat().st_size > 10_000
    assert "<html" in (tmp_path / "a.html").read_text()


def _line(text: str, part: str) -> str:
    return next(line for line in text.splitlines() if part in line)


def test_levels_are_printed_with_their_units(run: Run, tmp_path: Path) -> None:
    rows = np.random.default_rng(0).standard_normal((2, 2000))
    rows[1] = 3.0
    channels = (Channel(name="/motor.torque", unit="N m"), Channel(name="/motor.position", unit="rad"))
    write_mcap([TimeSeries(values=rows, sample_rate_hz=100.0, channels=channels)], tmp_path / "motor.mcap")
    found = run("live", tmp_path / "motor.mcap", "--no-view", "--modes-every", "0", "--report", tmp_path / "a.html")
    table = found.out.split("Levels after")[1]
    heading, torque = (_line(table, one) for one in ("crest factor", "/motor.torque"))
    assert heading.split()[:4] == ["channel", "RMS", "unit", "peak"]
    assert float(torque.split()[1]) == pytest.approx(rows[0].std(), rel=0.02)
    assert " N m " in torque
    # A table of zeros hides the rest; the report says what is left out.
    assert "/motor.position" not in table
    assert "channels that never change are left out: /motor.position" in (tmp_path / "a.html").read_text()


def test_options_that_cant_be_are_one_line(run: Run, arm: Path, tmp_path: Path) -> None:
    for words, told in (
        (("--stamp", "never"), "'never' is not one of 'auto', 'header', 'publish', 'log'"),
        (("--keep", "1"), "--keep 1 MB is too little"),
        (("--save", tmp_path / "a.rrd", "--web"), "give one of them"),
        (("--time-constant", "0"), "time_constant_s is 0"),
        (("--channel", "/nowhere.x"), "no topic starts /nowhere.x; there are: /arm"),
    ):
        found = run("live", arm, "--no-view", *words)
        assert found.code == 2
        assert told in found.err
        assert found.err.count("\n") == 1


def test_a_source_that_isnt_there_costs_no_recording(run: Run, tmp_path: Path) -> None:
    kept = tmp_path / "yesterday.rrd"
    kept.write_bytes(b"yesterday's")
    for words in (("--save", kept), ()):
        # Without --save the viewer would be opened, which fails where there is no display.
        found = run("live", tmp_path / "nowhere.mcap", *words)
        assert found.code == 2
        assert "nowhere.mcap: there is no such file; start its recorder first" in found.err
        assert found.err.count("\n") == 1
        assert "recording" not in found.out
    assert kept.read_bytes() == b"yesterday's"


def test_ctrl_c_leaves_recording_and_document(arm: Path, tmp_path: Path) -> None:
    """A recorder that writes half of its log into our standard input, and then nothing."""
    content = arm.read_bytes()
    command = [
        sys.executable,
        "-m",
        "chladni",
        "live",
        "-",
        "--save",
        tmp_path / "a.rrd",
        "--json",
        tmp_path / "a.json",
    ]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdin.write(content[: 2 * len(content) // 3])
        process.stdin.flush()
        # The first line says that samples came.
        process.stdout.readline()
        time.sleep(0.5)
        os.kill(process.pid, signal.SIGINT)
        process.wait(timeout=120)
        assert process.stderr.read() == b"\nending: the last averages are written; Ctrl-C again ends without them\n"
    assert process.returncode == 0
    document = json.loads((tmp_path / "a.json").read_text())
    assert document["duration_s"] > 1
    assert document["psd"]["channels"]
    assert (tmp_path / "a.rrd").stat().st_size > 10_000
