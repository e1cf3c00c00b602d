"""``chladni envelope`` on a bearing whose outer ring is struck."""

import pytest

from chladni.io.mcap.writer import write_mcap
from tests.spectral.test_envelope import SHAFT_HZ, SKF_6205, struck

BEARING = ("--bearing", "elements=9,ball=0.3126,pitch=1.537", "--shaft", SHAFT_HZ)
BPFO_HZ = SKF_6205.frequencies_hz(SHAFT_HZ)["BPFO"]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("envelope") / "bearing.mcap"
    write_mcap([struck(BPFO_HZ)], path, layout="batches")
    return path


def test_programs_get_the_spectrum_its_band_and_the_lines_of_the_bearing(run, log):
    outcome = run("envelope", log, *BEARING, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.envelope/1"
    (channel,) = document["channels"]
    assert channel["low_hz"] < 4200 < channel["high_hz"]
    assert channel["spectral_kurtosis"] > 1
    spacing_hz = channel["frequency_hz"][1]
    assert channel["peaks"][0]["frequency_hz"] == pytest.approx(BPFO_HZ, abs=spacing_hz)
    faults = {fault["name"]: fault for fault in channel["faults"]}
    assert faults["BPFO"]["found_hz"] == pytest.approx(BPFO_HZ, abs=spacing_hz)
    assert faults["BPFO"]["over_background"] > 10 > 3 > faults["BPFI"]["over_background"]
    assert len(channel["kurtogram"]["low_hz"]) == len(channel["kurtogram"]["spectral_kurtosis"])


def test_people_get_the_band_the_lines_and_a_picture(run, log, tmp_path):
    outcome = run("envelope", log, *BEARING, "--figures", tmp_path / "f", "--report", tmp_path / "r.html")
    assert outcome.code == 0, outcome.err
    assert "a bearing's frequencies" in outcome.out
    assert "BPFO" in outcome.out
    assert {path.stem for path in (tmp_path / "f").glob("*.png")} == {"envelope-1"}
    assert "<h2>Envelope spectra</h2>" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_a_band_can_be_named_and_a_large_log_is_read_block_by_block(run, log, monkeypatch):
    for arguments in (("--band", 3500, 5000), ()):
        whole = run("envelope", log, *arguments, "--json", "-").document["channels"][0]
        with monkeypatch.context() as patch:
            patch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
            patch.setattr("chladni.io.source.VALUES_IN_A_BLOCK", 30_000)
            parts = run("envelope", log, *arguments, "--json", "-").document["channels"][0]
        assert (parts["low_hz"], parts["high_hz"]) == (whole["low_hz"], whole["high_hz"])
        assert parts["amplitude"] == pytest.approx(whole["amplitude"], rel=1e-6)
        assert (whole["kurtogram"] is None) == bool(arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--bearing", "9,7.94,39"], "is not of the form elements=N,ball=MM,pitch=MM,angle=DEG"),
        (["--bearing", "elements=nine,ball=1,pitch=2"], "is not of the form"),
        (["--bearing", "elements=9.5,ball=1,pitch=2"], "is not of the form"),
        (["--bearing", "elements=9,ball=3,pitch=2", "--shaft", "25"], "smaller than the circle"),
        (["--bearing", "elements=9,ball=1,pitch=2"], "give the shaft's revolutions a second, too"),
        (["--shaft", "25"], "give the bearing's geometry, too"),
        (["--band", "4000", "40000"], "must rise and end at half the sample rate"),
        (["--resolution", "0.001"], "needs segments of 1000 s, but the record is 6 s long"),
    ],
)
def test_bad_options_are_told_in_one_line(run, log, arguments, words):
    outcome = run("envelope", log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1
