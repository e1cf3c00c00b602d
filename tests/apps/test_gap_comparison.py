"""A simulated log against a measured one."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.apps.gap_comparison import GapComparison, compare_with_simulated, comparison_document
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries
from tests import made_diagnosis as made


def simulated() -> TimeSeries:
    run = made.nominal_run()
    values = np.vstack([run.inputs.values, run.outputs.values])
    return replace(made.log_series(), values=values)


def compared(measured: Path, other: Path, **span: float) -> GapComparison:
    with open_log(measured) as ours, open_log(other) as theirs:
        return compare_with_simulated(ours, theirs, **span)


@pytest.fixture
def logs(tmp_path: Path) -> tuple[Path, Path]:
    write_mcap(made.log_series(), tmp_path / "measured.mcap")
    write_mcap(simulated(), tmp_path / "simulated.mcap")
    return tmp_path / "measured.mcap", tmp_path / "simulated.mcap"


def test_the_gap_is_what_the_simulation_leaves(logs: tuple[Path, Path]) -> None:
    found = compared(*logs)
    assert found.gap == pytest.approx(made.pooled(made.measured() - made.nominal_run().outputs.values), rel=1e-6)
    assert found.inputs == ("/shaker.wrench.force.x",)
    assert {channel.name for channel in found.where.channels} == {"/column.accel.linear.x", "/wrist.accel.linear.x"}
    assert found.noise < found.gap
    assert found.where.sites == ()


def test_a_part_is_compared_alone(logs: tuple[Path, Path]) -> None:
    found = compared(*logs, start_s=2.0, end_s=6.0)
    part = slice(round(2 * made.RATE_HZ), round(6 * made.RATE_HZ))
    measured, nominal = made.measured()[:, part], made.nominal_run().outputs.values[:, part]
    error = np.mean((measured - nominal) ** 2, axis=1) / np.mean(measured**2, axis=1)
    assert found.gap == pytest.approx(np.sqrt(error.mean()), rel=1e-6)


def test_the_document_holds_where_and_how_far(logs: tuple[Path, Path]) -> None:
    document = json.loads(json.dumps(comparison_document(compared(*logs)), allow_nan=False))
    assert document["format"] == "chladni.gap-comparison/1"
    assert (document["simulated"], document["logs"]) == ("simulated.mcap", ["measured.mcap"])
    assert set(document["where"]) == {"channels", "bands", "sites", "regimes", "times"}
    assert set(document["gap"]) == {"before", "noise"}


def test_logs_of_different_things_are_told(logs: tuple[Path, Path], tmp_path: Path) -> None:
    other = replace(made.drive().channels[0], name="/fan.speed.x")
    write_mcap(made.drive().with_channels([other]), tmp_path / "fan.mcap")
    with pytest.raises(LogError, match="share no channel"):
        compared(logs[0], tmp_path / "fan.mcap")
    with pytest.raises(LogError, match="is the same"):
        compared(logs[0], logs[0])


def test_rates_that_differ_are_told(logs: tuple[Path, Path], tmp_path: Path) -> None:
    write_mcap(replace(simulated(), sample_rate_hz=400.0), tmp_path / "slow.mcap")
    with pytest.raises(LogError, match="500 Hz"):
        compared(logs[0], tmp_path / "slow.mcap")
