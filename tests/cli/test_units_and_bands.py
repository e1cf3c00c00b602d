"""--unit, --band and --estimator: what is told, where, and how it's counted."""

import csv
from pathlib import Path

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.cli.conftest import Run

G = 9.80665
RATE_HZ = 1000.0
FORCE, TIP = "/rig/cell.force", "/rig/tip.accel"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tones of 1 g at 40 Hz and 2 g at 160 Hz, the second only in the second half."""
    rng, time_s = np.random.default_rng(2), np.arange(20_000) / RATE_HZ
    force = rng.standard_normal(time_s.size)
    late = time_s >= 10
    tip = G * (np.sin(2 * np.pi * 40 * time_s) + 2 * late * np.sin(2 * np.pi * 160 * time_s)) + 0.01 * force
    channels = (Channel(name=FORCE, unit="N"), Channel(name=TIP, unit="m/s^2"), Channel(name="/rig.dead", unit="m"))
    values = np.stack([force, tip, np.zeros(time_s.size)])
    path = tmp_path_factory.mktemp("units") / "rig.mcap"
    write_mcap([TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)], path)
    return path


def rms(document: dict, name: str) -> tuple[float, str]:
    (one,) = [one for one in document["channels"] if one["name"] == name]
    return one["rms"], one["channel_unit"]


def rows_of(table: Path) -> list[list[str]]:
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_a_density_in_g_and_in_a_band(run: Run, log: Path) -> None:
    document = run("psd", log, "--unit", "g", "--json", "-").document
    # The sine of 1 g all the time, and of 2 g half of it.
    assert rms(document, TIP) == (pytest.approx(np.sqrt(0.5 + 1.0), rel=0.01), "g")
    assert rms(document, FORCE)[1] == "N"
    outcome = run("psd", log, "--unit", "g", "--band", "10-100", "--json", "-")
    assert rms(outcome.document, TIP)[0] == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert min(outcome.document["frequency_hz"]) >= 10
    assert max(outcome.document["frequency_hz"]) <= 100
    (tip,) = [one for one in outcome.document["channels"] if one["name"] == TIP]
    assert tip["peaks"][0]["frequency_hz"] == pytest.approx(40, abs=0.5)
    assert all(peak["frequency_hz"] < 100 for peak in tip["peaks"])
    assert "g^2/Hz" in run("psd", log, "--unit", "g").out


@pytest.mark.parametrize("command", ["psd", "waterfall", "levels", "frf"])
def test_another_quantity_is_refused_in_one_line(run: Run, log: Path, command: str) -> None:
    outcome = run(command, log, "--unit", "mm/s")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "--unit mm/s is one of m/s, and no channel is in m/s; what fits: " in outcome.err
    assert "g, m/s^2 or mm/s^2" in outcome.err
    # What it advises works.
    assert run(command, log, "--unit", "mm/s^2").code == 0


@pytest.mark.parametrize(
    ("units", "says"),
    [(["furlong"], "unit 'furlong': not known; units look like"), (["g", "mm/s^2"], "of one quantity")],
)
@pytest.mark.parametrize("command", ["psd", "modes", "levels", "frf"])
def test_what_can_be_no_unit_is_told_before_a_log_is_opened(
    run: Run, command: str, units: list[str], says: str
) -> None:
    outcome = run(command, "isn't there.mcap", *(word for unit in units for word in ("--unit", unit)))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert says in outcome.err


@pytest.mark.parametrize(
    ("command", "reading"),
    [
        ("psd", "psd.densities"),
        ("waterfall", "waterfalls.measure_waterfalls"),
        ("levels", "levels.measure_levels"),
        ("frf", "frf.transfer"),
        ("modes", "modal_study.modal_study"),
    ],
)
def test_a_quantity_that_no_channel_has_is_refused_before_samples_are_read(
    run: Run, log: Path, monkeypatch: pytest.MonkeyPatch, command: str, reading: str
) -> None:
    def read(*_: object, **__: object) -> None:
        raise AssertionError("samples were read")

    monkeypatch.setattr(f"chladni.apps.{reading}", read)
    outcome = run(command, log, "--unit", "kg")
    assert outcome.code == 2
    assert "--unit kg: no channel is in kg; what fits: " in outcome.err


def test_a_band_without_lines_is_refused(run: Run, log: Path) -> None:
    outcome = run("psd", log, "--band", "900-1000")
    assert outcome.code == 2
    assert "--band 900-1000 Hz leaves fewer than two lines: they go from 0 to 500 Hz" in outcome.err


def test_estimators_by_any_letter(run: Run, log: Path) -> None:
    found = {name: run("frf", log, "--estimator", name, "--json", "-").document for name in ("h1", "H2", "hv")}
    assert [one["estimator"] for one in found.values()] == ["H1", "H2", "Hv"]
    tip = {name: one["functions"][0] for name, one in found.items()}
    # |H1| <= |Hv| <= |H2|, and they part where noise is.
    size = {name: np.hypot(one["real"], one["imag"])[5:] for name, one in tip.items()}
    assert np.all(size["h1"] <= size["hv"] * (1 + 1e-9))
    assert np.all(size["hv"] <= size["H2"] * (1 + 1e-9))


def test_a_waterfall_tells_when(run: Run, log: Path, tmp_path: Path) -> None:
    table = tmp_path / "fall.csv"
    outcome = run(
        "waterfall", log, "--channel", "tip.accel", "--unit", "g", "--band", "100-200", "--csv", table,
        "--figures", tmp_path, "--json", "-", "--resolution", 2,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    document = outcome.document
    (tip,) = document["channels"]
    assert (document["format"], tip["psd_unit"]) == ("chladni.waterfall/1", "g^2/Hz")
    time_s, frequency_hz, psd = (np.array(one) for one in (document["time_s"], document["frequency_hz"], tip["psd"]))
    assert psd.shape == (time_s.size, frequency_hz.size)
    level = np.sqrt(psd.sum(axis=1) * (frequency_hz[1] - frequency_hz[0]))
    np.testing.assert_allclose(level[time_s > 10.5], np.sqrt(2), rtol=0.01)
    assert np.all(level[time_s < 9.5] < 0.01)
    rows = rows_of(table)
    assert rows[0][0] == "time_s"
    assert rows[0][1] == f"{TIP} / {frequency_hz[0]} [g^2/Hz]"
    assert len(rows) == time_s.size + 1
    assert {path.suffix for path in tmp_path.glob("waterfall*")} == {".png", ".svg"}
    assert "160" in outcome.err


def test_constant_channels_are_left_out_of_a_waterfall_and_told(run: Run, log: Path) -> None:
    outcome = run("waterfall", log)
    assert "channels that never change are left out: /rig.dead" in outcome.out


def test_levels_in_the_unit_asked_for_as_a_table(run: Run, log: Path, tmp_path: Path) -> None:
    table = tmp_path / "levels.csv"
    outcome = run("levels", log, "--channel", "tip.accel", "--unit", "g", "--csv", table, "--json", "-")
    assert outcome.code == 0, outcome.err
    (band,) = outcome.document["channels"][0]["bands"]
    assert band["rms"] == pytest.approx(np.sqrt(1.5), rel=0.01)
    header, row = rows_of(table)
    cells = dict(zip(header, row, strict=True))
    assert (cells["channels"], cells["unit"]) == (TIP, "g")
    assert float(cells["0 to 500 Hz rms"]) == band["rms"]
    header, row = rows_of(tmp_path / "levels_2.csv")
    assert "velocity_mm_s" in header


def test_an_envelope_as_a_table(run: Run, log: Path, tmp_path: Path) -> None:
    table = tmp_path / "envelope.csv"
    outcome = run("envelope", log, "--channel", "tip.accel", "--band", "100-200", "--csv", table, "--json", "-")
    assert outcome.code == 0, outcome.err
    rows = rows_of(table)
    (one,) = outcome.document["channels"]
    assert [float(row[0]) for row in rows[1:]] == one["frequency_hz"]
    assert [float(row[1]) for row in rows[1:]] == one["amplitude"]
