import numpy as np
import pytest

from tests.arm import FORCE, TOOL, WRIST, short_arm
from tests.make_logs import write_driven


def test_the_document_holds_what_was_promised(run, arm_log):
    document = run("frf", arm_log, "--reference", FORCE, "--json", "-").document
    assert document["format"] == "chladni.frf/1"
    assert len(document["functions"]) == 5
    lines = len(document["frequency_hz"])
    for function in document["functions"]:
        assert set(function) >= {"response", "reference", "unit", "real", "imag", "std", "coherence", "excited"}
        assert {len(function[key]) for key in ("real", "imag", "std", "coherence", "excited")} == {lines}
    assert document["functions"][0]["unit"] == "(m/s^2)/N"


def test_the_response_is_the_exact_one_within_its_own_uncertainty(run, arm_log):
    document = run(
        "frf", arm_log, "--reference", FORCE, "--response", TOOL, "--resolution", 0.5, "--json", "-"
    ).document
    (function,) = document["functions"]
    frequency_hz = np.array(document["frequency_hz"])
    # Away from resonances and antiresonances, where half a hertz of resolution is fine enough.
    band = (frequency_hz > 120) & (frequency_hz < 150)
    found = np.hypot(function["real"], function["imag"])[band]
    std = np.array(function["std"])[band]
    exact = np.abs(short_arm().accelerance("tool", frequency_hz[band]))
    assert np.sqrt(np.mean(((found - exact) / std) ** 2)) == pytest.approx(1.0, abs=0.6)
    assert np.array(function["excited"])[band].all()
    assert not np.array(function["excited"])[frequency_hz > 310].any()


def test_people_get_peaks_with_phase_and_coherence(run, arm_log):
    outcome = run("frf", arm_log, "--reference", FORCE, "--response", WRIST, "--resolution", 0.5)
    assert "H1: " in outcome.out
    assert f"Peaks of the magnitude over {FORCE}" in outcome.out
    assert WRIST in outcome.out
    assert "are not excited" in outcome.out


def test_no_peak_is_said(run, arm_log):
    outcome = run("frf", arm_log, "--reference", TOOL, "--response", TOOL.replace("tool", "wrist"), "--end", "0.5",
                  "--resolution", 8)  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "eak" in outcome.out


@pytest.mark.parametrize("estimator", ["H2", "Hv"])
def test_other_estimators(run, arm_log, estimator):
    document = run("frf", arm_log, "--reference", FORCE, "--response", TOOL, "--estimator", estimator, "--json", "-")
    assert document.document["estimator"] == estimator


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--reference", "/shaker.wrench.force.q"], "/shaker.wrench.force.q"),
        (["--reference", FORCE, "--estimator", "H3"], "'H3'"),
    ],
)
def test_bad_options_are_told_in_one_line(run, arm_log, arguments, words):
    outcome = run("frf", arm_log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1


def test_commands_are_held_by_themselves_and_other_ways_can_be_named(run, tmp_path):
    path = tmp_path / "drive.mcap"
    write_driven(path)
    named = [
        "frf",
        path,
        "--reference",
        "/drive.data",
        "--response",
        "/encoder.data",
        "--resolution",
        0.5,
        "--json",
        "-",
    ]
    held = run(*named)
    assert held.code == 0, held.err
    assert "/drive.data: held between samples at 250 Hz (its message type is a command)" in " ".join(held.err.split())
    assert held.document["frequency_hz"][-1] == 125.0
    smooth = run(*named, "--join", "band-limited")
    assert smooth.document["frequency_hz"][-1] == 25.0
    assert "band-limited resampling" in " ".join(smooth.err.split())
    assert run(*named, "--join", "linear").code == 2
