"""Wrong units are doubted before anything else is believed."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.apps.diagnose import diagnose_gap
from chladni.gap.comparison.scale_doubt import scale_doubt
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.arm import arm, measured

RNG = np.random.default_rng(0)
SIGNALS = RNG.standard_normal((2, 400))


def test_what_agrees_within_a_factor_is_not_doubted() -> None:
    assert scale_doubt(SIGNALS, SIGNALS * [[0.1], [10.0]], ["a", "b"]) is None


def test_the_output_that_differs_most_is_named_with_its_factor() -> None:
    found = scale_doubt(SIGNALS, SIGNALS * [[50.0], [0.001]], ["a", "b"])
    assert found is not None
    assert found.startswith("At b the model as it is gives 0.001 times what was measured")


def test_another_signal_tells_nothing() -> None:
    assert scale_doubt(SIGNALS, 1e3 * SIGNALS[::-1], ["a", "b"]) is None


def test_what_stands_still_is_told_elsewhere() -> None:
    assert scale_doubt(SIGNALS * 0.0, SIGNALS, ["a", "b"]) is None
    assert scale_doubt(SIGNALS, SIGNALS * 0.0, ["a", "b"]) is None


@pytest.mark.parametrize(("factor", "words"), [(700.0, "mm for m"), (1 / 1500, "mm for m"), (1e6, "um for m")])
def test_what_is_about_a_prefix_is_told_as_one(factor: float, words: str) -> None:
    found = scale_doubt(SIGNALS, factor * SIGNALS, ["a", "b"])
    assert found is not None
    assert f"; about the factor of a prefix such as {words}" in found


@pytest.mark.nightly
def test_a_log_in_millimetres_is_told_in_the_advice() -> None:
    log = measured(seconds=3.0)
    found = diagnose(arm(), [replace(log, outputs=1e3 * log.outputs)], leave_out=frozenset(CATALOGUE))
    assert found.advice is not None
    assert found.advice.startswith("At acc_")
    assert "times what was measured: check its channel and unit" in found.advice


def emps(tmp_path: Path, shared_data: Path, *, mass: str = "95.0", scale: Sequence[float] = (1.0, 1.0)) -> str:
    """Advice on six seconds of a free axis, whose position and force are read in other units."""
    text = (shared_data / "models" / "emps.toml").read_text(encoding="utf-8")
    model = tmp_path / "axis.toml"
    model.write_text(text.replace("mass = 95.0", f"mass = {mass}"), encoding="utf-8")
    with chladni.open_log(shared_data / "emps.mcap") as log:
        series = log.read(["/axis.position[0]", "/axis.effort[0]"], end_s=6.0)
    scaled = replace(series, values=series.values * np.array(scale)[:, None])
    # What is told rests on no search for a second cause.
    return diagnose_gap(model, scaled, leave_out=sorted(CATALOGUE.keys() - {"gain_error", "added_mass"})).advice or ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "times"),
    [
        pytest.param((1e3, 1.0), "0.0014", marks=pytest.mark.nightly),
        pytest.param((1.0, 1e3), "1400", marks=pytest.mark.nightly),
        pytest.param((1.0, 1e-3), "0.0014", marks=pytest.mark.nightly),
    ],
)
def test_a_free_axis_in_another_unit_is_told_first(
    tmp_path: Path, shared_data: Path, scale: tuple[float, float], times: str
) -> None:
    found = emps(tmp_path, shared_data, scale=scale)
    assert found.startswith(f"At position the model as it is gives {times}")


@pytest.mark.nightly
@pytest.mark.slow
def test_a_free_axis_in_its_own_units_is_not_doubted(tmp_path: Path, shared_data: Path) -> None:
    found = emps(tmp_path, shared_data)
    assert "unit" not in found


@pytest.mark.nightly
@pytest.mark.slow
def test_a_mass_a_thousand_times_too_small_is_told(tmp_path: Path, shared_data: Path) -> None:
    found = emps(tmp_path, shared_data, mass="0.095")
    assert found.startswith("What is added at carriage is ")
    assert "the 0.095 kg that the model has there: check that number and its unit" in found
