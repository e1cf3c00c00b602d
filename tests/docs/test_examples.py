"""The examples that take longest; `.ci/run` runs the others."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.nightly
def test_both_things_that_a_mujoco_model_forgot_are_named(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
    command = [sys.executable, EXAMPLES / "two_joint_arm_in_mujoco.py", tmp_path / "arm.png"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert re.search(r"friction at elbow .* and a delay of 6\.\d+ .*at shoulder_motor", said)
    assert (tmp_path / "arm.png").is_file()


@pytest.mark.nightly
def test_an_effect_of_ones_own_is_named() -> None:
    command = [sys.executable, EXAMPLES / "own_effect_in_a_diagnosis.py"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert re.search(r"Most likely cubic drag of (199|200|201)\.", said)


@pytest.mark.nightly
def test_friction_is_named_among_the_whole_catalogue() -> None:
    command = [sys.executable, EXAMPLES / "what_a_model_forgot.py"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert re.search(r"Most likely Coulomb friction of [78]\.[0-9].* at elbow", said)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("example", "answer"),
    [
        ("gap_of_a_robot_axis.py", r"friction of [12][0-9.]+ .*at guide"),
        ("gap_of_a_circuit.py", r"explained 0\.[0-5][0-9]* mV"),
        ("gap_of_a_damper.py", r"mr_10mm_1A: .*hysteresis"),
    ],
)
def test_measured_machines_get_the_answer_of_their_papers(shared_data: Path, example: str, answer: str) -> None:
    assert (shared_data / "models").is_dir()
    said = subprocess.run([sys.executable, EXAMPLES / example], capture_output=True, text=True, check=True).stdout
    assert re.search(answer, said)
