"""What commands say of dead channels, and of what was asked for wrongly: in one line, with what to do."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.cli.conftest import Run

RATE_HZ = 1000.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tone in noise, a channel that never moves, a speed that rises from 10 to 30 Hz."""
    time_s = np.arange(10_000) / RATE_HZ
    moved = np.sin(2 * np.pi * 50 * time_s) + 0.1 * np.random.default_rng(1).standard_normal(time_s.size)
    values = np.stack([moved, np.zeros(time_s.size), 10 + 2 * time_s])
    units = {"/m.a": "m/s^2", "/m.dead": "m/s^2", "/m.speed": "Hz"}
    channels = tuple(Channel(name=name, unit=unit) for name, unit in units.items())
    path = tmp_path_factory.mktemp("told") / "m.mcap"
    write_mcap([TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)], path)
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ("levels", "--channel", "dead"),
        ("srs", "--channel", "dead"),
        ("zoom", "--band", "40-60", "--channel", "dead"),
        ("frf", "--reference", "m.a", "--response", "dead"),
    ],
)
def test_a_channel_that_never_changes_is_told(run: Run, log: Path, arguments: tuple[str, ...]) -> None:
    outcome = run(arguments[0], log, *arguments[1:])
    assert outcome.code == 0, outcome.err
    assert "/m.dead never changes: zeros are for want of motion, as of a sensor that isn't connected" in outcome.out
    assert "-0 " not in outcome.out


@pytest.mark.parametrize(
    ("arguments", "moving"), [(("srs",), ("m.a",)), (("zoom", "--band", "40-60"), ("m.a", "m.speed"))]
)
def test_of_all_channels_one_that_never_changes_is_left_out(
    run: Run, log: Path, arguments: tuple[str, ...], moving: tuple[str, ...]
) -> None:
    every = run(arguments[0], log, *arguments[1:])
    named = run(arguments[0], log, *arguments[1:], *(word for name in moving for word in ("--channel", name)))
    assert (every.code, "dead" in every.out) == (0, False)
    assert every.out == named.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("octaves", "--low", "-1"),
            "bands can't begin at -1 Hz: take more than 0 and less than half",
        ),
        (("octaves", "--low", "5000"), "bands can't begin at 5000 Hz"),
        (("srs", "--band", "1-10000"), "half the sample rate, 500 Hz, and 1 to 10000 Hz were asked for"),
        (("psd", "--start", "100"), "between 100.0 s and its end (the log ends at 9.999 s; begin before that)"),
        (("envelope", "--channel", "m.a", "--band", "300-300.1"), "Measure longer, or take a wider band"),
        (("orders", "--speed", "speed", "--order", "1000"), "order 1000 is above what the samples show: at 10."),
    ],
)
def test_what_was_asked_for_wrongly(run: Run, log: Path, arguments: tuple[str, ...], message: str) -> None:
    outcome = run(arguments[0], log, *arguments[1:])
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert message in outcome.err


def test_a_missing_log_may_be_a_slip(run: Run, log: Path) -> None:
    assert f"did you mean {log}?" in run("psd", log.with_suffix(".mcaq")).err
    assert "; give the path of a log" in run("psd", log.parent / "entirely-different.xyz").err.replace("\n", " ")


def test_a_line_of_a_bearing_is_found_only_where_it_stands_out(run: Run, log: Path) -> None:
    outcome = run("envelope", log, "--channel", "m.a", "--band", "100-400", "--shaft", 10, "--bearing",
                  "elements=9,ball=7.94,pitch=39.04")  # fmt: skip
    assert outcome.code == 0, outcome.err
    (row,) = [line.split() for line in outcome.out.splitlines() if line.startswith("BPFO")]
    assert row[:3] == ["BPFO", "35.848", "-"]
