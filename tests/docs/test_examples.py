"""The example that takes minutes; `.ci/run` runs the others."""

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
