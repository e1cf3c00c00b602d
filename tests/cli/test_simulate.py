import json
from pathlib import Path

import pytest

from chladni.io.log import open_log
from chladni.models.instruments.catalogue import INSTRUMENTS
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

SCHEME = """format = "chladni.model/1"
name = "loop"
kind = "scheme"
[[input]]
name = "reference"
unit = "V"
[[block]]
name = "plant"
num = [2.0]
den = [0.7, 1.0]
input = ["reference"]
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


def test_a_log_that_was_cut_off_says_so(run: Run, model: Path, tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    assert run("simulate", model, "--out", whole, "--seconds", 20, "--rate", 1000, "--noise", 0.1).code == 0
    content = whole.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    sound = run("simulate", model, "--log", whole, "--out", tmp_path / "first.mcap")
    damaged = run("simulate", model, "--log", cut, "--out", tmp_path / "second.mcap")
    assert (sound.code, damaged.code) == (0, 0)
    assert "cut off" in damaged.out
    assert "cut off" not in sound.out


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
        (["--noise", "-1"], "must not be negative"),
        (["--rate", "-1"], "rate -1.0 must be finite and positive"),
        (["--rate", "inf"], "rate inf must be finite and positive"),
        (["--rate", "1e12"], "rate 1e+12 Hz: a log's stamps count nanoseconds"),
        (["--effect", "coulomb_friction@spring:force=3 m"], "'3 m' is in m, the parameter in N"),
        (["--effect", "clipping@acc:limit=3 N"], "'3 N' is in N, the parameter in m/s^2"),
        (["--effect", "coulomb_friction@spring:force=much"], "force=much: quantity 'much'"),
        (["--effect", "coulomb_friction@spring:force=1,force=2"], "force is given twice"),
        (["--set", "mass.mass=heavy"], "--set mass.mass=heavy: quantity 'heavy'"),
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


def test_an_effects_numbers_take_units_of_its_site(run: Run, model: Path, tmp_path: Path) -> None:
    effects = ("--effect", "coulomb_friction@spring:force=0.005 kN", "--effect", "clipping@acc:limit=2 g")
    outcome = run("simulate", model, "--out", tmp_path / "a.mcap", "--seconds", 1, "--json", "-", *effects)
    assert outcome.code == 0, outcome.err
    friction, clipping = (effect["parameters"] for effect in outcome.document["effects"])
    assert (friction["force"], clipping["limit"]) == pytest.approx((5.0, 19.6133), rel=1e-12)


def test_units_at_a_schemes_block_are_taken_as_they_come(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "loop.toml"
    path.write_text(SCHEME)
    arguments = ("--seconds", 1, "--json", "-", "--effect", "saturation@plant:limit=20 mV")
    document = run("simulate", path, "--out", tmp_path / "a.mcap", *arguments).document
    assert document["effects"][0]["parameters"]["limit"] == 0.02


@pytest.mark.parametrize(
    ("name", "words"),
    [("log.csv", "ends with .mcap"), ("none/log.mcap", "there is no folder"), ("folder.mcap", "is a folder")],
)
def test_a_place_that_cant_hold_the_log_is_told_before_the_simulation(
    run: Run, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: str
) -> None:
    (tmp_path / "folder.mcap").mkdir()
    monkeypatch.setattr("chladni.apps.simulated_log.simulate_log", lambda *_, **__: pytest.fail("it was simulated"))
    outcome = run("simulate", model, "--out", tmp_path / name)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert words in outcome.err
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["folder.mcap", "one.toml"]


def test_a_drive_from_a_file_is_driven_as_on_its_page(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "press.toml"
    path.write_text('format = "chladni.model/1"\nname = "press"\nkind = "drive"\ndrive = "pneumatic-motor"\n')
    out = tmp_path / "press.mcap"

    def level(*arguments: str) -> float:
        document = run("simulate", path, "--out", out, "--seconds", 1, "--json", "-", *arguments).document
        return float(document["excitation"]["level"])

    assert level() == INSTRUMENTS["pneumatic-motor"].step_size
    # Of other inputs no usual size is known.
    assert level("--at", "load") == 1.0
    assert level("--level", "3e-5") == 3e-5
