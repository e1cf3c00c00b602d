"""``chladni ods`` and ``chladni delay`` on a tone and noise that arrive late."""

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, SAMPLES, LATE = 500.0, 20_000, 7
BASE, ARM, FORCE = "/base.x", "/arm.x", "/cell.f"


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Noise and a tone of 40 Hz at the base, seven samples later and opposite at the arm."""
    rng = np.random.default_rng(1)
    t = np.arange(SAMPLES + LATE) / RATE_HZ
    whole = rng.standard_normal(t.size) + 4 * np.cos(2 * np.pi * 40 * t)
    arm = -0.5 * whole[:SAMPLES] + 0.05 * rng.standard_normal(SAMPLES)
    rows = ((BASE, "m/s^2", whole[LATE:]), (ARM, "m/s^2", arm), (FORCE, "N", rng.standard_normal(SAMPLES)))
    path = tmp_path_factory.mktemp("walk") / "walk.mcap"
    write_mcap(
        [
            TimeSeries(
                values=np.stack([values for _, _, values in rows]),
                sample_rate_hz=RATE_HZ,
                channels=tuple(Channel(name=name, unit=unit) for name, unit, _ in rows),
            )
        ],
        path,
        layout="batches",
    )
    return path


def test_a_shape_is_that_of_the_tone(run, walk, tmp_path):
    options = ("--reference", BASE, "--resolution", 1, "--json", "-", "--figures", tmp_path)
    outcome = run("ods", walk, *options)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["reference"]) == ("chladni.ods/1", BASE)
    (shape,) = document["shapes"]
    assert shape["frequency_hz"] == 40.0
    parts = {part["channel"]: part for part in shape["shape"]}
    assert parts[BASE]["phase_deg"] == 0
    assert parts[BASE]["rms"] == pytest.approx(4 / np.sqrt(2), rel=0.02)
    assert parts[ARM]["rms"] == pytest.approx(2 / np.sqrt(2), rel=0.02)
    # Seven samples of 2 ms are 201.6 degrees of 40 Hz, and the sign turns.
    assert parts[ARM]["phase_deg"] == pytest.approx(180 - 201.6, abs=1)
    assert {path.name for path in tmp_path.glob("*.png")} == {"ods-acceleration.png", "ods-force.png"}


def test_a_delay_is_found_with_its_sign(run, walk, tmp_path):
    options = ("--reference", BASE, "--longest", 0.1, "--json", "-", "--figures", tmp_path)
    outcome = run("delay", walk, *options)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.delay/1"
    (found,) = document["delays"]
    assert (found["response"], found["inverted"]) == (ARM, True)
    assert abs(found["delay_s"] - LATE / RATE_HZ) < 4 * found["std_s"] < 1e-4
    assert "opposite" in run("delay", walk, "--reference", BASE, "--response", ARM, "--longest", 0.1).out
    assert (tmp_path / "correlation.png").exists()


@pytest.mark.parametrize(
    ("command", "options", "words"),
    [
        ("ods", ("--reference", "/bse.x"), "/bse.x"),
        ("ods", ("--reference", BASE, "--frequency", 300), "walk.mcap: 300 Hz lies outside the spectrum"),
        ("delay", ("--reference", BASE, "--band", 300, 100), "walk.mcap: a band from 300 to 100 Hz"),
        ("delay", ("--reference", FORCE), "walk.mcap: nothing that changes is in N as /cell.f is"),
        ("delay", ("--reference", BASE, "--response", FORCE), "isn't coherent with /base.x"),
    ],
)
def test_bad_options_are_told_in_one_line(run, walk, command, options, words):
    refused = run(command, walk, *options)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


@pytest.mark.parametrize(
    ("command", "listed", "numbers"),
    [("srs", "channels", "maximax"), ("zoom --band 35-45 --lines 50", "channels", "amplitude")],
)
def test_a_large_log_is_read_in_blocks(run, walk, monkeypatch, command, listed, numbers):
    asked = (*command.split()[:1], walk, *command.split()[1:], "--channel", BASE, "--channel", ARM, "--json", "-")
    whole = run(*asked).document[listed]
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    monkeypatch.setattr("chladni.io.source.VALUES_IN_A_BLOCK", 3000)
    parts = run(*asked).document[listed]
    assert [one["name"] for one in parts] == [one["name"] for one in whole] == [BASE, ARM]
    for one, other in zip(parts, whole, strict=True):
        np.testing.assert_allclose(one[numbers], other[numbers], rtol=1e-9)


@pytest.mark.parametrize(
    "command", [f"delay --reference {BASE}", f"delay --reference {BASE} --response {ARM}", f"orders --ridge {BASE}"]
)
def test_what_needs_a_whole_record_names_the_part_that_fits(run, walk, monkeypatch, command):
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    monkeypatch.setattr("chladni.apps.sources.MOST_VALUES", 12_000)
    first, *rest = command.split()
    refused = run(first, walk, *rest, "--channel", ARM) if first == "orders" else run(first, walk, *rest)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "4e+04 of 2 channels are more than the 12000 that fit in memory" in refused.err
    assert "a part of 12 s or less (--start, --end)" in refused.err
    if first == "delay":
        advised = run(first, walk, *rest, "--end", 12)
        assert advised.code == 0, advised.err
