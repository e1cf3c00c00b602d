"""``chladni gap``: its answer, its files, its refusals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.models.files.model_file import load_model
from chladni.signals.channel import Channel
from tests import made_diagnosis as made
from tests.cli.conftest import Run
from tests.gap_stand_in import StandIn, put_in_place
from tests.viewers.rrd import Contents

UNSTABLE = """
format = "chladni.model/1"
name = "axis"
kind = "structure"
body = [{ name = "carriage", mass = 10.0 }]
joint = [{ name = "guide", between = ["ground", "carriage"], stiffness = 0.0, damping = 30.0 }]
input = [{ name = "motor", at = "carriage" }]
output = [{ name = "position", measures = "displacement", at = "carriage", channel = "/position.value" }]

[[controller]]
name = "loop"
reference = "/command.value"
feedback = "position"
law = "pi"
gains = { kp = 2000.0, ki = 9000.0 }
drives = "motor"
"""


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    return put_in_place(monkeypatch, made.diagnosis())


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("gap")
    write_mcap(made.log_series(), folder / "arm.mcap")
    return made.write_arm_model(folder), folder / "arm.mcap"


def test_the_summary_reads_as_an_answer(run: Run, engine: StandIn, files: tuple[Path, Path]) -> None:
    outcome = run("gap", *files)
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert lines[0] == "Most likely Coulomb friction of 8.10 ± 0.20 N at elbow (97 %)."
    # The terminal breaks it.
    assert " ".join(one.strip() for one in lines[1:3]).startswith(
        "It explains 93 % of the gap that tuning leaves; adding it brings the error from 28 % to 1.0 % on stretches "
        "that no fit saw, noise 1.0 %."
    )
    for words in (
        "acc_wrist", "8 to 16", "elbow.velocity", "hysteresis", "-130.2", "not determined", "Measure next",
        "Repeat at half the level", "alone would have named hysteresis at elbow", "was held.",
    ):  # fmt: skip
        assert words in outcome.out
    # It didn't move by more than its sigma.
    assert "shoulder.stiffness" not in outcome.out


@pytest.mark.parametrize("kind", made.every_kind())
def test_any_verdict_is_an_answer(
    run: Run, monkeypatch: pytest.MonkeyPatch, files: tuple[Path, Path], kind: str
) -> None:
    put_in_place(monkeypatch, made.every_kind()[kind])
    outcome = run("gap", *files, "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["verdict"] == made.every_kind()[kind].verdict
    assert "acc_wrist" in outcome.err


def test_options_reach_the_diagnosis(run: Run, engine: StandIn, files: tuple[Path, Path]) -> None:
    assert run("gap", *files, "--without", "delay", "--without", "lag", "--seed", 4, "--end", 2).code == 0
    assert engine.options["leave_out"] == frozenset({"delay", "lag"})
    assert engine.options["seed"] == 4
    assert engine.measurements[0].duration_s == 2.0


def test_several_logs_are_taken_together(run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path) -> None:
    write_mcap(made.log_series(), tmp_path / "loud.mcap")
    assert run("gap", *files, tmp_path / "loud.mcap").code == 0
    assert [one.log for one in engine.measurements] == ["arm.mcap", "loud.mcap"]


def test_what_warns_of_the_model_is_said_once_before_the_answer(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    # A PI loop around a free carriage, far beyond the gain at which it still holds.
    model = tmp_path / "axis.toml"
    model.write_text(UNSTABLE, encoding="utf-8")
    log = made.log_series()
    channels = (Channel(name="/command.value", unit="m"), Channel(name="/position.value", unit="m"))
    for name in ("quiet", "loud"):
        write_mcap(replace(log, values=log.values[:2], channels=channels), tmp_path / f"{name}.mcap")
    outcome = run("gap", model, tmp_path / "quiet.mcap", tmp_path / "loud.mcap")
    assert outcome.code == 0, outcome.err
    assert outcome.out.startswith("Warning: model 'axis' is unstable: a pole at ")
    assert outcome.out.count("is unstable") == 1


def test_the_explained_model_is_written(run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path) -> None:
    target = tmp_path / "explained.toml"
    outcome = run("gap", *files, "--write-model", target)
    assert (outcome.code, f"model: {target}" in outcome.out) == (0, True)
    assert [one.effect for one in load_model(target).effects] == ["coulomb_friction"]


def test_a_floor_that_shakes_is_written_too(
    run: Run, monkeypatch: pytest.MonkeyPatch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    put_in_place(monkeypatch, made.every_kind()["floor"])
    outcome = run("gap", *files, "--write-model", tmp_path / "explained.toml")
    assert outcome.code == 0, outcome.err
    (floor,) = load_model(tmp_path / "explained.toml").effects
    assert (floor.effect, floor.values["level"], floor.values["band"]) == ("base_vibration", 0.31, 40.0)


def test_a_diagnosis_is_not_lost_where_its_model_cannot_be_written(
    run: Run, monkeypatch: pytest.MonkeyPatch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    put_in_place(monkeypatch, replace(made.diagnosis(), causes=(made.friction(parameters={}),)))
    target, document = tmp_path / "explained.toml", tmp_path / "found.json"
    outcome = run("gap", *files, "--write-model", target, "--json", document)
    assert (outcome.code, outcome.err.count("\n"), target.exists()) == (2, 1, False)
    assert "explained.toml: not written, a model file can't hold what was found; coulomb_friction" in outcome.err
    assert json.loads(document.read_text(encoding="utf-8"))["verdict"] == "effect"
    assert "Most likely Coulomb friction" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--without", "coulomb_fricton"], "did you mean coulomb_friction"),
        (["--without", "frictoin"], "did you mean coulomb_friction or stribeck_friction?"),
        (["--start", "5", "--end", "2"], "the window from 5.0 s to 2.0 s is empty; let it end after its start"),
        (["--figure", "gap.bmp"], "--figure writes .png, .svg or .pdf"),
        (["--json", "none/gap.json"], "/none; make it, or name another"),
        (["--html", "gap.htmx"], "--html writes .html or .htm"),
        (["--save", "none/gap.rrd"], "/none; make it, or name another"),
        (["--write-model", "none/gap.toml"], "/none; make it, or name another"),
        (["--seed", "-1"], "--seed"),
        (["--start", "9"], "9"),
        (["--simulated", "x.mcap"], "2 measured logs and 1 simulated log: give --simulated once for each"),
    ],
)
def test_mistakes_are_told_in_one_line_before_anything_is_diagnosed(
    run: Run, engine: StandIn, files: tuple[Path, Path], arguments: list[str], words: str
) -> None:
    outcome = run("gap", *files, *arguments)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert words in outcome.err
    assert engine.model is None


def test_what_was_lost_of_a_log_stands_right_below_the_answer(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    assert "\nUsed: 8 s of arm.mcap, at 500 Hz.\n\n" in run("gap", *files).out
    torn = tmp_path / "torn.mcap"
    series = made.log_series()
    values = series.values.copy()
    values[0, 500] = np.nan
    write_mcap(replace(series, values=values), torn)
    torn.write_bytes(torn.read_bytes()[:-10])
    shown = run("gap", files[0], torn).out
    answer = shown[: shown.index("\n\n")]
    assert "Used: 6.998 s of the 8 s of torn.mcap, at 500 Hz.\n- Damage" in answer
    assert "torn.mcap lacks 1 sample" in answer
    # Once: what stands above isn't repeated among the remarks.
    assert shown.count("Damage") == answer.count("Damage")
    assert "was held." in shown[len(answer) :]


def test_a_model_without_input_is_told_before_the_answer(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    text = files[0].read_text(encoding="utf-8")
    undriven = tmp_path / "undriven.toml"
    undriven.write_text(text[: text.index("[[input]]")] + text[text.index("[[output]]") :], encoding="utf-8")
    first, rest = run("gap", undriven, files[1]).out.split("\n", 1)
    assert first.startswith("Warning: model 'arm' has no [[input]]: in it only what starts in motion moves")
    assert "has no [[input]]" not in rest


def test_a_log_with_a_hole_is_refused_with_the_part_that_is_whole(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    series = made.log_series()
    values = series.values.copy()
    values[:, 2 * values.shape[1] // 5 : 3 * values.shape[1] // 5] = np.nan
    holed = tmp_path / "holed.mcap"
    write_mcap(replace(series, values=values), holed)
    refused = run("gap", files[0], holed, "--start", 0.5)
    assert refused.code == 2
    # What it says to do is what works.
    options = refused.err.partition("(--start")[2].partition(")")[0].split()
    found = run("gap", files[0], holed, "--start", *options)
    assert "Used: 3.2 s of holed.mcap" in found.out


def test_no_option_replaces_the_model_or_the_log(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    model, log = files
    held = model.read_bytes(), log.read_bytes()
    (tmp_path / "link.json").symlink_to(log)
    for option, path in (
        ("--write-model", model),
        ("--html", log),
        ("--json", log),
        ("--json", tmp_path / "link.json"),
    ):
        outcome = run("gap", *files, option, path)
        assert (outcome.code, outcome.err.count("\n"), engine.model) == (2, 1, None)
    assert (model.read_bytes(), log.read_bytes()) == held


@pytest.mark.parametrize("missing", [0, 1])
def test_a_file_that_is_not_there_is_told(run: Run, engine: StandIn, files: tuple[Path, Path], missing: int) -> None:
    given = list(files)
    given[missing] = given[missing].with_name("absent.toml")
    outcome = run("gap", *given)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "absent.toml" in outcome.err


@pytest.mark.nightly
def test_pictures_are_written_where_they_were_asked_for(
    run: Run, engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    outcome = run(
        "gap", *files, "--html", tmp_path / "gap.html", "--save", tmp_path / "gap.rrd",
        "--figure", tmp_path / "gap.svg", "--figures", tmp_path / "figures",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "Most likely Coulomb friction" in (tmp_path / "gap.html").read_text(encoding="utf-8")
    assert (tmp_path / "gap.rrd").stat().st_size > 0
    assert (tmp_path / "gap.svg").read_bytes().startswith(b"<?xml")
    assert {path.name for path in (tmp_path / "figures").iterdir()} >= {"restoring-force.png", "signals.svg"}
    for name in ("gap.html", "gap.rrd", "gap.svg", "restoring-force.png"):
        assert name in outcome.out.replace("\n", "")


def test_one_sensor_tells_no_sites_and_no_page_pretends_to(
    run: Run, monkeypatch: pytest.MonkeyPatch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    found = made.unknown()
    assert found.left is not None
    where, left = (replace(one, sites=()) for one in (found.where, found.left))
    put_in_place(monkeypatch, replace(found, where=where, left=left))
    outcome = run("gap", *files, "--save", tmp_path / "gap.rrd")
    assert outcome.code == 0, outcome.err
    assert "85 % of what they leave lies between" in outcome.out
    assert "at one site can explain" not in outcome.out
    assert "/structure/joints" not in Contents(tmp_path / "gap.rrd").entities()


def test_a_simulated_log_takes_the_place_of_a_model(run: Run, files: tuple[Path, Path], tmp_path: Path) -> None:
    nominal = made.nominal_run()
    series = replace(made.log_series(), values=np.vstack([nominal.inputs.values, nominal.outputs.values]))
    write_mcap(series, tmp_path / "theirs.mcap")
    outcome = run("gap", "--simulated", tmp_path / "theirs.mcap", files[1], "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["format"] == "chladni.gap-comparison/1"
    assert "theirs.mcap is 28 % from arm.mcap" in outcome.err
    assert "taken for inputs: /shaker.wrench.force.x" in outcome.err
    assert "Error of the simulation, over the RMS of each output" in outcome.err
    assert "tuned" not in outcome.err


@pytest.mark.nightly
def test_several_levels_are_compared_each_with_its_simulation(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    nominal = made.nominal_run()
    theirs = replace(made.log_series(), values=np.vstack([nominal.inputs.values, nominal.outputs.values]))
    ours = made.log_series()
    # A machine of twice the input and twice the output is linear, whatever else it is.
    for name, series, level in (("loud", ours, 2.0), ("theirs", theirs, 1.0), ("theirs_loud", theirs, 2.0)):
        write_mcap(replace(series, values=level * series.values), tmp_path / f"{name}.mcap")
    outcome = run(
        "gap", files[1], tmp_path / "loud.mcap", "--simulated", tmp_path / "theirs.mcap", "--simulated",
        tmp_path / "theirs_loud.mcap", "--json", "-", "--figures", tmp_path / "drawn", "--html",
        tmp_path / "gap.html",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    for words in ("theirs.mcap is 28 % from arm.mcap", "theirs_loud.mcap is 28 % from loud.mcap"):
        assert words in outcome.err
    assert "the gap is 28 % (noise at most 2.6 %) at 40 RMS of /shaker.wrench.force.x, 28 %" in outcome.err
    assert [one["logs"] for one in outcome.document["further"]] == [["loud.mcap"]]
    drawn = {path.name for path in (tmp_path / "drawn").iterdir()}
    assert {"1-arm-mcap-signals.png", "2-loud-mcap-gap-map.svg"} <= drawn
    assert "loud.mcap: Where and when it lies" in (tmp_path / "gap.html").read_text(encoding="utf-8")


def test_what_a_comparison_leaves_out_is_looked_for_where_it_is(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    rng = np.random.default_rng(0)
    channels = tuple(Channel(name=f"/rig/accel_{n}", unit="m/s^2") for n in range(9))
    series = replace(made.log_series(), channels=channels, values=rng.standard_normal((9, 4000)))
    write_mcap(series, tmp_path / "ours.mcap", layout="batches")
    write_mcap(replace(series, values=1.1 * series.values), tmp_path / "theirs.mcap", layout="batches")
    outcome = run("gap", "--simulated", tmp_path / "theirs.mcap", tmp_path / "ours.mcap")
    assert outcome.code == 0, outcome.err
    assert "and 3 more; all are in the JSON document (--json FILE)" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{model}"], "no log to hold against the model"),
        (["{log}", "{log}"], "is a log; give a model file first, or --simulated"),
        (["--simulated", "{log}", "{log}", "--save", "a.rrd"], "--save: takes a model"),
        (["--simulated", "{log}", "{log}", "--without", "lag"], "--without: takes a model"),
    ],
)
def test_models_and_logs_in_the_wrong_place_are_told(
    run: Run, engine: StandIn, files: tuple[Path, Path], arguments: list[str], words: str
) -> None:
    model, log = files
    outcome = run("gap", *(one.format(model=model, log=log) for one in arguments))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert words in outcome.err


def test_the_step_is_shown_while_one_waits(
    run: Run, engine: StandIn, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.cli.output.PROGRESS_AFTER_S", -1.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    shown = run("gap", *files).err
    assert "arm: explaining" in shown
    # A step may take long: the seconds that count up tell it from one that hangs.
    assert "0:00:00" in shown
