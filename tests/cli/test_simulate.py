import json
from pathlib import Path

import pytest

from chladni.io.log import open_log
from tests.cli.conftest import Run

MODEL = """format = "chladni.model/1"
name = "one"
kind = "structure"
[[body]]
name = "mass"
mass = 2.0
[[joint]]
name = "spring"
between = ["ground", "mass"]
stiffness = 8000.0
damping = 8.0
[[input]]
name = "hammer"
at = "mass"
channel = "/hammer.wrench.force.x"
[[output]]
name = "acc"
measures = "acceleration"
at = "mass"
channel = "/mass.accel.linear.x"
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "one.toml"
    path.write_text(MODEL)
    return path


def test_a_log_and_its_truth_are_written(run: Run, model: Path, tmp_path: Path) -> None:
    out = tmp_path / "one.mcap"
    outcome = run("simulate", model, "--out", out, "--seconds", 4, "--rate", 400, "--level", 3, "--seed", 7)
    assert outcome.code == 0, outcome.err
    assert "4 s at 400 Hz" in outcome.out
    truth = json.loads((tmp_path / "one.truth.json").read_text())
    assert (truth["seed"], truth["duration_s"], truth["sample_rate_hz"]) == (7, 4.0, 400.0)
    with open_log(out) as log:
        assert {channel.name for channel in log.channels} == {"/hammer.wrench.force.x", "/mass.accel.linear.x"}


def test_settings_and_effects_go_into_the_truth(run: Run, model: Path, tmp_path: Path) -> None:
    outcome = run(
        "simulate", model, "--out", tmp_path / "one.mcap", "--seconds", 2, "--json", "-",
        "--set", "spring.stiffness=9 N/mm", "--effect", "coulomb_friction@spring:force=0.5",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.simulate/1"
    assert document["parameters"]["spring.stiffness"]["value"] == 9000.0
    assert [(one["effect"], one["site"]) for one in document["effects"]] == [("coulomb_friction", "spring")]
    assert document["nrmse_percent"] == {}


def test_a_log_drives_the_model_and_is_held_beside_it(run: Run, model: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    assert run("simulate", model, "--out", first, "--seconds", 4, "--noise", 0.03).code == 0
    document = run("simulate", model, "--log", first, "--out", second, "--json", "-").document
    # What is left is the noise that the first log's sensor had.
    assert document["nrmse_percent"]["/mass.accel.linear.x"] == pytest.approx(3.0, rel=0.1)
    assert document["excitation"] == {"kind": "log"}


def test_the_same_seed_gives_the_same_bytes(run: Run, model: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        arguments = ("--out", tmp_path / f"{name}.mcap", "--seconds", 1, "--noise", 0.1, "--seed", 5)
        assert run("simulate", model, *arguments).code == 0
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--at", "hamer"], "no input 'hamer'; inputs: hammer"),
        (["--effect", "coulomb_friction"], "not of the form EFFECT@SITE"),
        (["--effect", "coulomb_fricton@spring:force=1"], "coulomb_friction"),
        (["--effect", "coulomb_friction@sprng:force=1"], "sprng"),
        (["--effect", "coulomb_friction@spring:force"], "not of the form NAME=VALUE"),
        (["--input", "step", "--band", "1", "2"], "no meaning for step"),
        (["--log", "x.mcap", "--rate", "100"], "--rate has no meaning with --log"),
        (["--noise", "-1"], "must not be negative"),
        (["--rate", "-1"], "rate -1.0 must be finite and positive"),
    ],
)
def test_mistakes_are_told_in_one_line_and_nothing_is_written(
    run: Run, model: Path, tmp_path: Path, arguments: list[str], words: str
) -> None:
    out = tmp_path / "one.mcap"
    outcome = run("simulate", model, "--out", out, *arguments)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert words in outcome.err
    assert not out.exists()
