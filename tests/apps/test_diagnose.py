"""What `diagnose_gap` hands to the diagnosis, and what it adds to the answer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.apps.diagnose import diagnosis_json
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.models.effects.catalogue import CATALOGUE
from chladni.signals.errors import LogError, SetupError
from tests import made_diagnosis as made
from tests.gap_stand_in import StandIn, put_in_place


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    return put_in_place(monkeypatch, made.diagnosis())


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Model and log of the arm that rubs."""
    log = tmp_path / "arm.mcap"
    write_mcap(made.log_series(), log)
    return made.write_arm_model(tmp_path), log


def test_inputs_and_outputs_come_from_the_log_by_the_models_channels(
    engine: StandIn, files: tuple[Path, Path]
) -> None:
    model, log = files
    found = chladni.diagnose_gap(model, log)
    (measurement,) = engine.measurements
    assert measurement.log == "arm.mcap"
    assert measurement.output_names == ("acc_column", "acc_wrist")
    np.testing.assert_allclose(measurement.outputs, made.measured(), rtol=1e-12)
    np.testing.assert_allclose(measurement.inputs, made.drive().values, rtol=1e-12)
    assert found.verdict == "effect"


def test_models_logs_and_series_are_taken_as_they_come(engine: StandIn, files: tuple[Path, Path]) -> None:
    model, log = files
    with open_log(log) as opened:
        chladni.diagnose_gap(chladni.load_model(model), [opened, made.log_series(), str(log)])
    assert [one.log for one in engine.measurements] == [str(log), "series 2", str(log)]
    assert len({one.samples for one in engine.measurements}) == 1


def test_logs_of_one_name_are_told_apart_by_their_folders(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    model, log = files
    other = tmp_path / "loud" / "arm.mcap"
    other.parent.mkdir()
    other.write_bytes(log.read_bytes())
    chladni.diagnose_gap(model, [log, other])
    assert [one.log for one in engine.measurements] == [str(log), str(other)]


def test_a_part_of_the_log_is_a_part(engine: StandIn, files: tuple[Path, Path]) -> None:
    chladni.diagnose_gap(*files, start_s=1.0, end_s=3.0)
    chladni.diagnose_gap(files[0], made.log_series(), start_s=1.0, end_s=3.0)
    assert engine.measurements[0].samples == 2 * made.RATE_HZ


def test_how_much_of_each_log_was_used_is_told(engine: StandIn, files: tuple[Path, Path]) -> None:
    series = made.log_series()
    values = series.values.copy()
    values[0, values.shape[1] // 4] = np.nan
    found = chladni.diagnose_gap(files[0], [files[1], replace(series, values=values)])
    whole, cut = found.used
    assert (whole.log, whole.used_s, whole.losses) == ("arm.mcap", whole.recorded_s, ())
    assert cut.recorded_s == whole.recorded_s
    assert cut.used_s == pytest.approx(0.75 * whole.recorded_s, abs=2 / made.RATE_HZ)
    assert "series 2 lacks 1 sample" in cut.losses[0]
    # Readers of the document find it where limits always were.
    assert cut.losses[0] in found.remarks


def test_what_a_torn_log_lost_is_a_loss(engine: StandIn, files: tuple[Path, Path], tmp_path: Path) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(files[1].read_bytes()[:-2000])
    (use,) = chladni.diagnose_gap(files[0], torn).used
    assert use.losses[0].startswith("Damage")


def test_effects_to_leave_out_and_of_ones_own_reach_the_diagnosis(engine: StandIn, files: tuple[Path, Path]) -> None:
    brake = replace(CATALOGUE["quadratic_damping"], name="magnetic_brake")
    chladni.diagnose_gap(*files, leave_out=["hysteresis", "magnetic_brake"], own_effects=[brake], seed=7)
    assert engine.options == {
        "leave_out": frozenset({"hysteresis", "magnetic_brake"}), "own_effects": (brake,), "seed": 7
    }  # fmt: skip


def test_an_effect_that_does_not_exist_cant_be_left_out(engine: StandIn, files: tuple[Path, Path]) -> None:
    with pytest.raises(SetupError, match="did you mean coulomb_friction"):
        chladni.diagnose_gap(*files, leave_out=["coulomb_fricton"])
    assert engine.model is None


def test_progress_is_passed_on(engine: StandIn, files: tuple[Path, Path]) -> None:
    told = []
    chladni.diagnose_gap(*files, progress=lambda step, share: told.append((step, share)))
    assert told == [("explaining", 0.5)]


def test_what_limits_the_log_stands_before_what_limits_the_answer(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    model, log = files
    held = made.log_series().select(["/shaker.wrench.force.x", "/wrist.accel.linear.x"])
    write_mcap(held, tmp_path / "few.mcap")
    remarks = chladni.diagnose_gap(model, tmp_path / "few.mcap").remarks
    assert "output 'acc_column' is left out" in remarks[0]
    assert remarks[-1] == made.diagnosis().remarks[-1]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-2000])
    assert any("Damage" in remark for remark in chladni.diagnose_gap(model, cut).remarks)


def test_a_log_of_something_else_is_told_with_both_sides(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    channel = replace(made.drive().channels[0], name="/fan.speed.x")
    write_mcap(made.drive().with_channels([channel]), tmp_path / "fan.mcap")
    with pytest.raises(LogError, match=r"fan\.mcap: holds no channel that model 'arm' listens to; it holds /fan"):
        chladni.diagnose_gap(files[0], tmp_path / "fan.mcap")


def test_a_wrong_input_channel_is_told_with_all_that_the_log_holds(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    force, *outputs = made.log_series().channels
    renamed = made.log_series().with_channels([replace(force, name="/input.value"), *outputs])
    write_mcap(renamed, tmp_path / "renamed.mcap")
    with pytest.raises(LogError, match=r"which the log doesn't hold; it holds /input\.value, /column\.accel"):
        chladni.diagnose_gap(files[0], tmp_path / "renamed.mcap")


def test_a_log_of_which_nothing_can_be_read_is_told_with_its_damage(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    stump = tmp_path / "stump.mcap"
    stump.write_bytes(files[1].read_bytes()[:200])
    with pytest.raises(LogError, match=r"stump\.mcap: holds no channel that can be read; Damage"):
        chladni.diagnose_gap(files[0], stump)


def test_without_a_log_there_is_nothing_to_say(engine: StandIn, files: tuple[Path, Path]) -> None:
    with pytest.raises(SetupError, match="no log"):
        chladni.diagnose_gap(files[0], [])


def test_the_withheld_check_gets_the_document(engine: StandIn, files: tuple[Path, Path]) -> None:
    model, log = files
    document = diagnosis_json(model, [log], leave_out=frozenset({"delay"}), seed=3)
    assert document["format"] == "chladni.gap/1"
    assert document["verdict"] == "effect"
    assert engine.options["leave_out"] == frozenset({"delay"})
    assert engine.options["seed"] == 3


@pytest.mark.parametrize(
    ("model", "log", "shape", "rate_hz"),
    [("emps", "emps", (1, 24841), 1000.0), ("emps_closed_loop", "emps_pulses", (2, 24841), 1000.0)],
)
def test_measured_logs_find_their_models_signals(
    engine: StandIn, shared_data: Path, model: str, log: str, shape: tuple[int, int], rate_hz: float
) -> None:
    chladni.diagnose_gap(shared_data / "models" / f"{model}.toml", shared_data / f"{log}.mcap")
    (measurement,) = engine.measurements
    assert measurement.outputs.shape == shape
    assert measurement.sample_rate_hz == pytest.approx(rate_hz, rel=1e-6)
    assert np.ptp(measurement.inputs) > 0


def test_a_model_of_another_machine_is_refused(engine: StandIn, shared_data: Path) -> None:
    with pytest.raises(LogError, match=r"emps\.mcap: holds no channel that model 'silverbox' listens to"):
        chladni.diagnose_gap(shared_data / "models" / "silverbox.toml", shared_data / "emps.mcap")


def slow_force(tmp_path: Path) -> Path:
    """The arm's log with a force that was commanded at half the rate, and stands still for samples on end."""
    series, path = made.log_series(), tmp_path / "slow.mcap"
    stairs = np.repeat(series.values[:1, ::20], 10, axis=1)[:, : series.samples // 2]
    force = replace(series, values=stairs, channels=series.channels[:1], sample_rate_hz=made.RATE_HZ / 2)
    write_mcap([force, replace(series, values=series.values[1:], channels=series.channels[1:])], path)
    return path


def test_a_command_of_a_lower_rate_is_held_on_the_grid_of_the_sensors(
    engine: StandIn, files: tuple[Path, Path], tmp_path: Path
) -> None:
    found = chladni.diagnose_gap(files[0], slow_force(tmp_path))
    assert engine.measurements[0].sample_rate_hz == made.RATE_HZ
    inputs = engine.measurements[0].inputs[0]
    np.testing.assert_allclose(inputs, np.repeat(made.log_series().values[0, ::20], 20)[: inputs.size])
    assert any("held between samples at 500 Hz (its samples are a staircase)" in one for one in found.remarks)
