"""The noise behind an unknown force is that of the sensors, however little a model's own error lets it be seen."""

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from tests.gap.arm import arm, measured, with_outputs


# Below what a model is granted to be wrong by, and above.
@pytest.mark.parametrize("noise", [pytest.param(0.001, marks=pytest.mark.nightly), 0.02])
def test_a_floor_behind_a_force_is_that_of_the_noise(noise: float) -> None:
    late = chladni.attached("delay", "shaker", {"delay": 0.003})
    log = measured((late,), seconds=4.0, noise=noise)
    found = locate(arm(), log, estimate_noise(log), Tunables.of(arm())).problem.noise
    np.testing.assert_allclose(found.rms, noise * log.outputs.std(axis=1), rtol=0.25)


def test_two_sensors_dont_lower_each_others_floor() -> None:
    # Another hold than the model's leaves a little everywhere, and a force somewhere explains it.
    held = arm().with_holds({"shaker": "zoh"})
    log = with_outputs(measured((), seconds=3.0, noise=0.02, model=held, seed=1), ("acc_arm", "acc_wrist"))
    before = estimate_noise(log)
    found = locate(arm(), log, before, Tunables.of(arm())).problem.noise
    assert np.all(found.rms > 0.98 * before.rms)
