"""Values as tables of numbers: what they hold, and where they may go."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import chladni
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.cli.conftest import Run

RATE_HZ = 200.0
FORCE, TIP = "/rig.force", "/rig.tip"


def noise(rate_hz: float, *channels: Channel) -> TimeSeries:
    values = np.random.default_rng(5).standard_normal((len(channels), 4000))
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=channels)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "rig.mcap"
    write_mcap([noise(RATE_HZ, Channel(name=FORCE, unit="N"), Channel(name=TIP, unit="m/s^2"))], path)
    return path


@pytest.fixture
def two_grids(tmp_path: Path) -> Path:
    path = tmp_path / "two.mcap"
    parts = [noise(RATE_HZ, Channel(name="/a.x", unit="m/s^2")), noise(130.0, Channel(name="/b.x", unit="m/s^2"))]
    write_mcap(parts, path)
    return path


def columns(text: str) -> dict[str, list[str]]:
    first, *rows = csv.reader(text.splitlines())
    return {name: [row[place] for row in rows] for place, name in enumerate(first)}


def numbers(cells: list[str]) -> list[float]:
    return [float(one) for one in cells]


@pytest.mark.parametrize(
    ("command", "rows", "column", "keys"),
    [
        ("psd", "frequency_hz", f"{FORCE} [N^2/Hz]", ("channels", "psd")),
        ("cepstrum", "quefrency_s", FORCE, ("channels", "cepstrum")),
        ("srs", "frequency_hz", f"{TIP} [m/s^2]", ("channels", "maximax")),
    ],
)
def test_a_table_holds_the_numbers_of_the_document(
    run: Run, log: Path, tmp_path: Path, command: str, rows: str, column: str, keys: tuple[str, str]
) -> None:
    outcome = run(command, log, "--csv", tmp_path / "a.csv", "--json", "-")
    assert outcome.code == 0, outcome.err
    assert f"table: {tmp_path / 'a.csv'}" in outcome.err
    table, found = columns((tmp_path / "a.csv").read_text()), outcome.document
    one = found[keys[0]][0]
    assert next(iter(table)) == rows
    assert numbers(table[rows]) == one.get(rows, found.get(rows))
    assert numbers(table[column]) == one[keys[1]]


def test_octaves_are_a_table(run: Run, log: Path, tmp_path: Path) -> None:
    found = run("octaves", log, "--csv", tmp_path / "a.csv", "--json", "-").document
    table = columns((tmp_path / "a.csv").read_text())
    bands = found["channels"][1]["bands"]
    assert numbers(table["mid_hz"]) == [one["mid_hz"] for one in bands]
    assert numbers(table[f"{TIP} [m/s^2]"]) == [one["rms"] for one in bands]


def test_a_frequency_response_is_real_and_imaginary_parts_with_coherence(run: Run, log: Path, tmp_path: Path) -> None:
    found = run("frf", log, "--csv", tmp_path / "a.csv", "--json", "-").document
    table = columns((tmp_path / "a.csv").read_text())
    (function,) = found["functions"]
    for part in ("real", "imag"):
        assert numbers(table[f"{TIP} / {FORCE} {part} [(m/s^2)/N]"]) == function[part]
    assert numbers(table["frequency_hz"]) == found["frequency_hz"]
    assert f"{TIP} coherence" in table


def test_alone_on_standard_output(run: Run, log: Path, tmp_path: Path) -> None:
    run("psd", log, "--csv", tmp_path / "a.csv")
    for target in ("-", "/dev/stdout"):
        outcome = run("psd", log, "--csv", target)
        assert outcome.code == 0, outcome.err
        assert outcome.out.splitlines() == (tmp_path / "a.csv").read_text().splitlines()
        assert "Levels: " in outcome.err
    refused = run("psd", log, "--csv", "-", "--json", "-")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "--json and --csv would mix on standard output; name a file for one of them" in refused.err


def test_sampling_grids_have_a_table_each(run: Run, two_grids: Path, tmp_path: Path) -> None:
    outcome = run("psd", two_grids, "--csv", tmp_path / "a.csv")
    assert outcome.code == 0, outcome.err
    assert set(columns((tmp_path / "a.csv").read_text())) >= {"/a.x [(m/s^2)^2/Hz]"}
    assert set(columns((tmp_path / "a_2.csv").read_text())) >= {"/b.x [(m/s^2)^2/Hz]"}
    refused = run("psd", two_grids, "--csv", "-")
    assert (refused.code, refused.out) == (2, "")
    assert "a stream takes one table, and there are 2 of different axes; name a file" in refused.err
    followed = run("psd", two_grids, "--csv", "-", "--channel", "/a.x")
    assert followed.out == (tmp_path / "a.csv").read_bytes().decode()


def test_a_second_table_replaces_nothing_that_is_read(run: Run, two_grids: Path, tmp_path: Path) -> None:
    log = two_grids.rename(tmp_path / "a_2.csv").rename(tmp_path / "a_2.mcap")
    kept = log.read_bytes()
    refused = run("psd", log, "--csv", tmp_path / "a.mcap")
    assert refused.code == 2
    assert "is read by this command, and table 2 of --csv would replace it" in refused.err
    assert log.read_bytes() == kept
    assert not (tmp_path / "a.mcap").exists()


def test_modes_are_the_table_that_the_value_gives(run: Run, tmp_path: Path) -> None:
    channels = (Channel(name=FORCE, unit="N"), Channel(name=TIP, unit="m/s^2"))
    force = np.random.default_rng(3).standard_normal(8000)
    pole = 0.98 * np.exp(2j * np.pi * 20 / RATE_HZ)
    tip = lfilter([1.0, -2.0, 1.0], np.poly([pole, pole.conjugate()]).real, force)
    tip += 1e-3 * np.random.default_rng(4).standard_normal(8000)
    write_mcap(
        TimeSeries(values=np.stack([force, tip]), sample_rate_hz=RATE_HZ, channels=channels), tmp_path / "m.mcap"
    )
    log = tmp_path / "m.mcap"
    outcome = run("modes", log, "--reference", FORCE, "--csv", tmp_path / "a.csv", "--json", "-")
    assert outcome.code == 0, outcome.err
    table, found = columns((tmp_path / "a.csv").read_text()), outcome.document["modes"]
    assert found
    assert numbers(table["mode"]) == [one + 1 for one in range(len(found))]
    assert numbers(table["frequency_hz"]) == [one["frequency_hz"] for one in found]
    assert numbers(table[f"{TIP} shapes real"]) == [one["shape"][0]["real"] for one in found]
    checks = columns((tmp_path / "a_2.csv").read_text())
    assert checks.keys() == {"mode", "mpc", "mpd_deg", "mean_phase_deg"}
    chladni.identify_modes(log, references=FORCE).to_csv(tmp_path / "python.csv")
    assert (tmp_path / "python.csv").read_bytes() == (tmp_path / "a.csv").read_bytes()
    assert run("modes", log, "--reference", FORCE, "--csv", "-").out == (tmp_path / "a.csv").read_bytes().decode()
