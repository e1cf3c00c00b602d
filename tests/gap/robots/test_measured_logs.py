"""What measured robots are known to lack: `benchmarks/bench_robot_logs.py` prints all of it."""

from pathlib import Path

import pytest

import chladni
from chladni.gap.records.diagnosis import Diagnosis

pytest.importorskip("mujoco")
pytestmark = pytest.mark.nightly


def found_of(shared_data: Path, description: str, log: str) -> Diagnosis:
    folder = shared_data / "robots"
    return chladni.diagnose_gap(folder / description, folder / f"{log}.mcap")


def numbers(found: Diagnosis, word: str, name: str) -> dict[str, float]:
    """By site."""
    return {one.site: one.parameters[name].value for one in found.causes if one.effect == word}


def test_an_arm_whose_wrist_gears_run_in_one_another(shared_data: Path) -> None:
    found = found_of(shared_data, "tx40.urdf", "tx40")
    dry, wet = numbers(found, "coulomb_friction", "force"), numbers(found, "viscous_friction", "coefficient")
    for joint, known in enumerate((7.14, 8.26, 6.34, 2.48, 3.03), 1):
        assert dry[f"joint_{joint}"] == pytest.approx(known, rel=0.10)
    for joint, known in enumerate((8.05, 5.53, 1.97, 1.11), 1):
        assert wet[f"joint_{joint}"] == pytest.approx(known, rel=0.05)
    # The drives' own identification: 1.95 N m and 0.62 N m s/rad.
    assert dry["joint_5~joint_6"] == pytest.approx(1.95, rel=0.15)
    assert wet["joint_5~joint_6"] == pytest.approx(0.62, rel=0.10)


def test_servos_whose_gains_nobody_says_are_unknown_where_runs_deny_what_torques_suggest(shared_data: Path) -> None:
    found = found_of(shared_data, "so101.urdf", "so101_sage_single_joint_elbow")
    # Fitted gains of a joint that hardly moves are any: positions come out no better with what torques suggest.
    assert found.gap.by == "windows"
    assert (found.verdict, found.causes) == ("unknown", ())
    assert "What the torques suggest isn't named" in (found.advice or "")
