"""``chladni octaves`` on a microphone and an accelerometer whose tones are known."""

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ = 8000.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    time_s = np.arange(round(16 * RATE_HZ)) / RATE_HZ
    tones = np.stack([np.sqrt(2) * np.sin(2 * np.pi * 100 * time_s), 3 * np.sin(2 * np.pi * 1000 * time_s)])
    values = tones + 1e-4 * np.random.default_rng(1).standard_normal(tones.shape)
    channels = (Channel(name="sound", unit="Pa"), Channel(name="casing", unit="m/s^2"))
    path = tmp_path_factory.mktemp("octaves") / "log.mcap"
    write_mcap([TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)], path, layout="batches")
    return path


def test_programs_get_bands_with_their_frequencies_and_levels(run, log):
    outcome = run("octaves", log, "--weighting", "A", "--low", 40, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["fraction"], document["weighting"]) == ("chladni.octaves/1", 3, "A")
    sound, casing = document["channels"]
    bands = {band["nominal_hz"]: band for band in sound["bands"]}
    assert min(bands) == 50
    assert bands[100]["level_db"] == pytest.approx(93.98 - 19.15, abs=0.02)
    assert (sound["decibel_reference"], casing["decibel_reference"]) == (20e-6, 1e-6)
    assert sound["level_db"] == pytest.approx(93.98 - 19.15, abs=0.02)
    assert casing["rms"] == pytest.approx(3 / np.sqrt(2), rel=1e-3)


@pytest.mark.nightly
@pytest.mark.parametrize(("fraction", "called"), [(1, "octave"), (12, "1/12 octave")])
def test_people_get_a_table_a_quantity(run, log, tmp_path, fraction, called):
    outcome = run("octaves", log, "--fraction", fraction, "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    assert f"Levels in {called} bands, dB over 20 uPa" in outcome.out
    assert f"Levels in {called} bands, RMS in m/s^2" in outcome.out
    (total, _) = [line.split() for line in outcome.out.splitlines() if line.startswith("all")]
    assert total == ["all", "94.0"]
    assert {path.stem for path in tmp_path.glob("*.png")} == {"octaves-1-pressure", "octaves-1-acceleration"}


def test_a_large_log_is_averaged_block_by_block(run, log, monkeypatch):
    whole = run("octaves", log, "--json", "-").document
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    monkeypatch.setattr("chladni.io.source.VALUES_IN_A_BLOCK", 10_000)
    parts = run("octaves", log, "--json", "-").document
    for one, other in zip(whole["channels"], parts["channels"], strict=True):
        assert [band["rms"] for band in other["bands"]] == pytest.approx([band["rms"] for band in one["bands"]])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--low", "0.01"], "needs segments of"),
        (["--low", "-1"], "bands can't begin at -1 Hz"),
        (["--low", "3900"], "no 1/3 octave band lies between"),
        (["--fraction", "0"], "--fraction"),
        (["--weighting", "B"], "'B' is not one of"),
    ],
)
def test_bad_options_are_told_in_one_line(run, log, arguments, words):
    outcome = run("octaves", log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1
