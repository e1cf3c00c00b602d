"""Of a floor that shakes each sensor is foretold by the others, as well as their noise lets them."""

import numpy as np
import pytest

from chladni.gap.diagnosis.shaken_ground import predicted_by_others
from chladni.gap.location.profile import profile_at
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

GROUND = Site(name="ground", kind="ground")
LEVEL, LOW_HZ, HIGH_HZ = 5.0, 5.0, 150.0
FLOOR = attached("base_vibration", "ground", {"level": LEVEL, "band": HIGH_HZ, "band_start": LOW_HZ})


def foretold(model, outputs, noise):
    """RMS over that of the noise of what is left of each sensor: by the others, by the model alone, and at best."""
    log, floor = measured(model, band_noise(6000, rms=150.0), outputs=outputs, noise=noise)
    nominal = three_bodies()
    lines = all_lines(log.samples, RATE_HZ)
    problem = LinearProblem(nominal, log, floor, Tunables.of(nominal), lines)
    found = profile_at(problem, (GROUND,), np.zeros(len(problem.tunables.names)))
    view = problem.view(found.z)
    alone = lines.signal(view.response(found.transient, ()))[:, 0]
    strength = np.abs(problem.pattern(view, GROUND)[:, 0]) ** 2
    # Of the floor's own spectrum, with all that noise leaves open of it.
    inside = (lines.frequency_hz > LOW_HZ) & (lines.frequency_hz < HIGH_HZ)
    power = np.where(inside, LEVEL**2 / (2.0 * (HIGH_HZ - LOW_HZ) / RATE_HZ), 0.0)
    open_to_others = power / (1.0 + (strength.sum(axis=0) - strength) * power)
    left = np.sqrt(1.0 + np.mean(strength * open_to_others, axis=1))
    by_others = predicted_by_others(problem, found)
    return (*(np.std(log.outputs - one, axis=1) / floor.rms for one in (by_others, alone)), left)


def test_each_sensor_is_foretold_as_well_as_the_noise_of_the_others_lets_it():
    by_others, alone, best = foretold(three_bodies().with_effects((FLOOR,)), [0, 1, 2], noise=0.01)
    assert np.all(alone > 15.0)
    np.testing.assert_allclose(by_others, best, rtol=0.2)


@pytest.mark.parametrize("noise", [0.01, 0.2])
def test_where_the_other_sensor_hardly_feels_the_floor_its_noise_is_not_magnified(noise):
    # At the first body's antiresonances nothing of the head's motion shows there.
    by_others, alone, best = foretold(three_bodies().with_effects((FLOOR,)), [0, 2], noise=noise)
    assert np.all(by_others < alone)
    np.testing.assert_allclose(by_others, best, rtol=0.2)


def test_of_a_floor_that_stands_still_nothing_is_foretold_that_is_not_there():
    by_others, alone, _ = foretold(three_bodies(), [0, 2], noise=0.05)
    assert np.all(by_others < alone)
