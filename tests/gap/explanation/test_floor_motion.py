"""How strong a floor shakes and in which band is what the sensors recover of it."""

import numpy as np
import pytest

from chladni.gap.explanation.floor_motion import floor_motion
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.base_vibration import BASE_VIBRATION, flat_band
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

LEVEL, LOW_HZ, HIGH_HZ = 5.0, 20.0, 150.0


def test_level_and_band_are_those_of_the_floor() -> None:
    floor = attached("base_vibration", "ground", {"level": LEVEL, "band": HIGH_HZ, "band_start": LOW_HZ})
    log, noise = measured(three_bodies().with_effects((floor,)), band_noise(6000, rms=150.0), noise=0.01)
    nominal = three_bodies()
    problem = LinearProblem(nominal, log, noise, Tunables.of(nominal), all_lines(log.samples, RATE_HZ))
    found = floor_motion(
        problem, Site(name="ground", kind="ground"), np.zeros(len(problem.tunables.names)), BASE_VIBRATION
    )
    # The record's ends ring, and where the sensors' noise hides the floor it's held back.
    assert found["level"].value == pytest.approx(LEVEL, rel=0.1)
    assert found["band"].value == pytest.approx(HIGH_HZ, rel=0.1)
    assert found["band_start"].value == pytest.approx(LOW_HZ, abs=0.1 * (HIGH_HZ - LOW_HZ))
    assert [one.unit for one in found.values()] == ["m/s^2", "Hz", "Hz"]
    # No spread of it is known.
    assert all(one.std is None for one in found.values())


@pytest.mark.parametrize("samples", [999, 1000])
def test_a_band_never_leaves_what_a_sample_rate_holds(samples: int) -> None:
    white = np.zeros(samples)
    white[0] = 1.0
    low_hz, high_hz = flat_band(white, 100.0)
    assert 0.0 <= low_hz < 0.2
    assert 49.8 < high_hz <= 50.0
