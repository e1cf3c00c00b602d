"""One machine, logged in several ways: rates, stamps and the start pose change nothing of the answer."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import chladni
from tests.robots.machines import STEP_S, arm, commands
from tests.robots.made import JointTopic, write_joints

pytest.importorskip("mujoco")
pytestmark = pytest.mark.nightly

SECONDS, JOINTS = 16.0, ("shoulder", "elbow")
FRICTION, DELAY_S = 2.0, 0.012


@dataclass(frozen=True, kw_only=True)
class Way:
    """Rates of states and commands, Hz; when the first command comes; how far from its command the machine starts."""

    state_hz: float = 250.0
    command_hz: float = 250.0
    command_at_s: float = 0.0
    away_rad: float = 0.0

    def log(self, folder: Path) -> Path:
        """Run the machine, and write its bag."""
        import mujoco

        late = round(DELAY_S / STEP_S)
        machine = arm(folder, "machine/arm.xml", shoulder=f' frictionloss="{FRICTION}"').model
        data, count = mujoco.MjData(machine), round(SECONDS / STEP_S)
        asked = commands(SECONDS, self.command_hz)
        every, first = round(1.0 / self.command_hz / STEP_S), round(self.command_at_s / STEP_S)
        data.qpos[:] = asked[:, 0] + self.away_rad
        position = np.empty((2, count))
        for step in range(count):
            position[:, step] = data.qpos
            data.ctrl[:] = asked[:, min(max(step - first - late, 0) // every, asked.shape[1] - 1)]
            mujoco.mj_step(machine, data)
        states = position[:, :: round(1.0 / self.state_hz / STEP_S)]
        return write_joints(
            folder / "arm.mcap",
            [
                JointTopic("/joint_states", states, rate_hz=self.state_hz, names=JOINTS),
                JointTopic(
                    "/joint_commands", asked, rate_hz=self.command_hz, names=JOINTS, offset_s=self.command_at_s
                ),
            ],
        )


@pytest.mark.parametrize(
    "way",
    [
        pytest.param(Way(state_hz=125.0, command_hz=50.0), id="states at 125 Hz, commands at 50 Hz"),
        pytest.param(Way(command_at_s=0.002), id="stamps 2 ms apart"),
        pytest.param(Way(away_rad=0.3), id="another start pose"),
        pytest.param(Way(), id="one grid"),
    ],
)
def test_the_answer_is_the_same(way: Way, tmp_path: Path) -> None:
    found = chladni.diagnose_gap(arm(tmp_path).description, way.log(tmp_path))
    numbers = {(one.effect, one.site): next(iter(one.parameters.values())).value for one in found.causes}
    assert numbers.keys() == {("coulomb_friction", "shoulder"), ("delay", "all commands")}
    assert numbers["coulomb_friction", "shoulder"] == pytest.approx(FRICTION, rel=0.05)
    assert numbers["delay", "all commands"] == pytest.approx(DELAY_S, abs=1e-3)
    assert all(one.probability > 0.6 for one in found.causes)
