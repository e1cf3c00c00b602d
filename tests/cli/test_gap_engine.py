"""``chladni gap`` from files to answer, the diagnosis itself included."""

import json
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chladni
from chladni.apps.study.study import run_study
from chladni.io.mcap.writer import write_mcap
from chladni.io.study.recipe import load_recipe
from chladni.models.effects.catalogue import CATALOGUE
from tests import made_diagnosis as made
from tests.cli.conftest import Outcome, Run

# All words would only make it slower.
WITHOUT = [part for word in sorted(CATALOGUE) if word != "gain_error" for part in ("--without", word)]
SAMPLES, GAIN = 1500, 1.2


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The two-jointed arm, and a log of it whose last sensor shows a fifth too much."""
    folder = tmp_path_factory.mktemp("gap")
    run = made.nominal_run()
    rng = np.random.default_rng(2)
    outputs = run.outputs.values[:, :SAMPLES]
    outputs = outputs + made.NOISE * outputs.std(axis=1, keepdims=True) * rng.standard_normal(outputs.shape)
    outputs[-1] *= GAIN
    channels = (*run.inputs.channels, *run.outputs.channels)
    log = replace(made.log_series(), values=np.vstack([run.inputs.values[:, :SAMPLES], outputs]), channels=channels)
    write_mcap(log, folder / "arm.mcap")
    return made.write_arm_model(folder), folder / "arm.mcap"


def diagnosed(run: Run, files: tuple[Path, Path], target: object, *more: object) -> Outcome:
    outcome = run("gap", *files, *WITHOUT, "--json", target, *more)
    assert outcome.code == 0, outcome.err
    return outcome


@pytest.mark.nightly
def test_a_sensor_that_shows_too_much_is_named_and_the_model_written_with_it(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    explained = tmp_path / "explained.toml"
    found = diagnosed(run, files, "-", "--write-model", explained)
    (cause,) = found.document["causes"]
    assert (found.document["verdict"], cause["effect"], cause["site"]) == ("effect", "gain_error", "acc_wrist")
    assert cause["parameters"]["gain"]["value"] == pytest.approx(GAIN, rel=0.02)
    assert found.document["gap"]["closed"] > 0.98
    assert "at acc_wrist" in found.err.splitlines()[0]
    names = found.document["correlation"]["names"]
    assert names == list(found.document["tuned_parameters"])
    assert [len(row) for row in found.document["correlation"]["matrix"]] == [len(names)] * len(names)
    # Nothing is left to be found of the model that was written.
    again = diagnosed(run, (explained, files[1]), "-").document
    assert (again["verdict"], again["causes"]) == ("none", [])


@pytest.mark.nightly
def test_a_study_gives_the_document_of_the_command_to_the_byte(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    distributed, _ = pytest.importorskip("distributed"), pytest.importorskip("duckdb")
    model, log = files
    single = tmp_path / "single.json"
    diagnosed(run, files, single, "--seed", 3)
    recipe = tmp_path / "recipe.toml"
    leave_out = [word for word in sorted(CATALOGUE) if word != "gain_error"]
    recipe.write_text(
        f'format = "chladni.study/1"\ndocuments = true\n[gap]\nmodel = "{model}"\nseed = 3\nleave_out = {leave_out}\n'
    )
    quiet: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with distributed.Client(n_workers=1, threads_per_worker=1, processes=False, **quiet) as client:
        told = run_study(load_recipe(recipe), [str(log)], tmp_path / "out", connect=partial(nullcontext, client))
    assert (told.done, told.failures) == (1, [])
    found = chladni.results(tmp_path / "out")
    [row] = found.table("documents").to_pylist()
    assert row["document"] == single.read_text()
    document = json.loads(row["document"])
    [gap], [cause] = found.table("gaps").to_pylist(), found.table("causes").to_pylist()
    assert (gap["verdict"], gap["closed"]) == ("effect", document["gap"]["closed"])
    assert (cause["effect"], cause["site"], cause["share"]) == (
        "gain_error", "acc_wrist", document["causes"][0]["share"]
    )  # fmt: skip
    assert json.loads(cause["parameters"]) == document["causes"][0]["parameters"]


def test_channels_at_different_rates_are_refused_with_what_to_do(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    series, slow = made.log_series(), tmp_path / "slow.mcap"
    driven = replace(series, values=series.values[:1], channels=series.channels[:1])
    half = made.RATE_HZ / 2
    seen = replace(series, values=series.values[1:, ::2], channels=series.channels[1:], sample_rate_hz=half)
    write_mcap([driven, seen], slow)
    outcome = run("gap", files[0], slow)
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert "/shaker.wrench.force.x at 500 Hz" in outcome.err
    assert "at 250 Hz; bring them to one" in outcome.err
    assert "chladni convert slow.mcap OUT.mcap --resample 500" in outcome.err
    assert "--join band-limited" in outcome.err
