"""``chladni levels`` on logs whose levels are known."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.arm import WRIST

RATE_HZ = 5000.0
BEARING, MOTOR, STILL = "/bearing.accel.linear.x", "/motor.wrench.force.x", "/bearing.accel.linear.y"


def machine(seconds=8.0, rate_hz=RATE_HZ):
    """A bearing at 24.9 Hz and 9.8 m/s^2 peak, a force at 500 Hz, and a channel that never moves."""
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    rows = [9.8 * np.sin(2 * np.pi * 24.9 * time_s), 3.0 * np.sin(2 * np.pi * 500 * time_s), 0 * time_s + 0.1]
    channels = (
        Channel(name=BEARING, unit="m/s^2"),
        Channel(name=MOTOR, unit="N"),
        Channel(name=STILL, unit="m/s^2"),
    )
    return TimeSeries(values=np.stack(rows), sample_rate_hz=rate_hz, channels=channels)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("levels") / "machine.mcap"
    write_mcap([machine()], path, layout="batches")
    return path


def test_programs_get_levels_severity_and_running_levels(run, log):
    outcome = run("levels", log, "--machine", "large-rigid", "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.levels/1"
    bearing, motor = document["channels"]
    assert (bearing["unit"], motor["unit"], motor["severity"]) == ("m/s^2", "N", None)
    (band,) = bearing["bands"]
    assert (band["low_hz"], band["high_hz"], band["samples"]) == (0.0, RATE_HZ / 2, 40_000)
    assert band["rms"] == pytest.approx(9.8 / np.sqrt(2), rel=1e-3)
    assert band["crest_factor"] == pytest.approx(np.sqrt(2), rel=1e-3)
    assert band["kurtosis"] == pytest.approx(1.5, rel=1e-2)
    assert len(band["running"]["time_s"]) == len(band["running"]["rms"]) == 64
    severity = bearing["severity"]
    assert round(severity["velocity_mm_s"], 1) == 44.3
    assert (severity["zone"], severity["boundaries_mm_s"]) == ("D", [2.3, 4.5, 7.1])
    assert (round(severity["displacement_um"]), severity["boundaries_um"]) == (283, [29.0, 57.0, 90.0])
    assert [note.partition(":")[0] for note in document["notes"]] == ["channels that never change are left out"]


def test_a_band_holds_its_tone_and_not_the_other(run, log):
    document = run("levels", log, "--band", 400, 600, "--json", "-").document
    bearing, motor = (one["bands"][0] for one in document["channels"])
    assert motor["rms"] == pytest.approx(3 / np.sqrt(2), rel=1e-3)
    # 24.9 Hz is four octaves below the band.
    assert bearing["rms"] < 1e-3
    assert any(note.startswith("band 400 to 600 Hz: the first and last") for note in document["notes"])


def test_people_get_tables_and_a_table_for_spreadsheets(run, log, tmp_path):
    outcome = run("levels", log, "--machine", "large-rigid", "--csv", tmp_path / "levels.csv")
    assert outcome.code == 0, outcome.err
    assert "Levels about the mean, 0 to 2500 Hz" in outcome.out
    assert (
        "zones of ISO 20816-3 for large-rigid: A/B 2.3, B/C 4.5, C/D 7.1 mm/s; A/B 29, B/C 57, C/D 90 um"
        in outcome.out
    )
    with (tmp_path / "levels.csv").open(encoding="utf-8", newline="") as file:
        _, second = csv.DictReader(file)
    with (tmp_path / "levels_2.csv").open(encoding="utf-8", newline="") as file:
        (first,) = csv.DictReader(file)
    assert float(first["velocity_mm_s"]) == pytest.approx(44.27, abs=0.01)
    assert first["zone"] == "D"
    # Ten samples a period come no nearer to the crest than 18 degrees.
    assert float(second["0 to 2500 Hz peak_to_peak"]) == pytest.approx(6.0 * np.cos(np.deg2rad(18)))


@pytest.mark.nightly
def test_figures_and_report_are_saved_where_asked(run, log, tmp_path):
    outcome = run(
        "levels", log, "--machine", "medium-rigid", "--figures", tmp_path / "f", "--report", tmp_path / "r.html"
    )
    assert outcome.code == 0, outcome.err
    names = {path.stem for path in (tmp_path / "f").glob("*.png")}
    assert names == {"levels-1-1-acceleration", "levels-1-1-force", "severity-1-1"}
    assert "<h2>Levels</h2>" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_a_log_too_slow_or_too_short_for_severity_has_its_levels_all_the_same(run, tmp_path):
    for name, part in {"slow": machine(rate_hz=18.0), "short": machine(seconds=0.4)}.items():
        write_mcap([part], tmp_path / f"{name}.mcap", layout="batches")
        outcome = run("levels", tmp_path / f"{name}.mcap", "--json", "-")
        assert outcome.code == 0, outcome.err
        assert outcome.document["channels"][0]["severity"] is None
        assert any(note.startswith("no severity of ") for note in outcome.document["notes"])


def test_a_large_log_is_measured_block_by_block(run, arm_log, monkeypatch):
    whole = run("levels", arm_log, "--json", "-").document
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    monkeypatch.setattr("chladni.io.source.VALUES_IN_A_BLOCK", 10_000)
    parts = run("levels", arm_log, "--json", "-").document
    for one, other in zip(whole["channels"], parts["channels"], strict=True):
        assert other["name"] == one["name"]
        for name in ("mean", "rms", "peak", "kurtosis"):
            assert other["bands"][0][name] == pytest.approx(one["bands"][0][name], rel=1e-9), name


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--band", "10", "9000"], "must rise and end at half the sample rate"),
        (["--band", "0.1", "10"], "needs an unbroken run of"),
        (["--running", "0"], "64 samples"),
        (["--machine", "huge"], "'huge' is not one of"),
        (["--channel", "/tool.accel.linear.q"], "/tool.accel.linear.q"),
        (["--start", "90"], "between 90.0 s and its end"),
    ],
)
def test_bad_options_are_told_in_one_line(run, arm_log, arguments, words):
    outcome = run("levels", arm_log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1


def test_a_channel_that_is_named_is_told_though_it_is_still(run, tmp_path):
    series = machine(seconds=1.0)
    still = replace(series.select([STILL]), channels=(Channel(name=WRIST, unit="N"),))
    write_mcap([still], tmp_path / "still.mcap")
    refused = run("levels", tmp_path / "still.mcap")
    assert (refused.code, "never change" in refused.err) == (2, True)
    (channel,) = run("levels", tmp_path / "still.mcap", "--channel", WRIST, "--json", "-").document["channels"]
    assert (channel["bands"][0]["rms"], channel["bands"][0]["kurtosis"]) == (0.0, None)


def test_without_the_class_of_the_machine_the_way_to_a_zone_is_told(run, log):
    assert "it needs the machine's class (--machine)" in run("levels", log).out
    assert "it needs the machine's class" not in run("levels", log, "--machine", "large-rigid").out


def test_a_machine_without_a_motion_is_told(run, tmp_path):
    (tmp_path / "a.csv").write_text("time [s],x\n" + "".join(f"{row / 3000},{row % 7}\n" for row in range(3000)))
    outcome = run("levels", tmp_path / "a.csv", "--machine", "large-rigid")
    assert outcome.code == 0, outcome.err
    assert "no severity is told: no channel is in m/s^2 or m/s" in outcome.out.replace("\n", " ")
