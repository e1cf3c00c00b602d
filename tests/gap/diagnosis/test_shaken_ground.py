"""A floor that shakes has a motion of its own for every sample: it's told only where nothing else can be."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.shaken_ground import floor_motion, shaken_by
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.base_vibration import BASE_VIBRATION, flat_band
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

FLOOR = attached("base_vibration", "ground", {"level": 5.0, "band": 150.0, "band_start": 5.0})
SPRING = attached("hardening_stiffness", "j0", {"cubic": 1e12})


def studied(effect: AttachedEffect) -> tuple[Study, Contestant]:
    """The study of a chain on one joint, and its best parameters alone."""
    log, _ = measured(three_bodies().with_effects((effect,)), band_noise(6000, rms=150.0))
    study = study_of(three_bodies(), log, leave_out=frozenset(), own={})
    return study, Search(study).nothing


@pytest.fixture(scope="module")
def shaken() -> tuple[Study, Contestant]:
    return studied(FLOOR)


@pytest.mark.nightly
def test_a_floor_that_shakes_is_told_with_the_joint_that_it_acts_through(shaken) -> None:
    study, tuned = shaken
    found = shaken_by(study, tuned)
    assert found is not None
    assert found.group == ("ground", "j0", "b0")
    left, before = (np.std(study.measurement.outputs - one) for one in (found.predicted, tuned.fit.outputs))
    assert left < 0.3 * before
    # As the floor was made.
    assert found.parameters["level"].value == pytest.approx(5.0, rel=0.1)
    assert found.parameters["band"].value == pytest.approx(150.0, rel=0.1)


@pytest.mark.nightly
def test_what_the_model_alone_tells_better_than_other_sensors_is_no_floor(shaken) -> None:
    study, tuned = shaken
    near = replace(tuned, fit=replace(tuned.fit, outputs=study.measurement.outputs))
    assert shaken_by(study, near) is None


@pytest.mark.nightly
def test_where_a_force_on_another_body_does_as_well_no_floor_is_told(shaken) -> None:
    study, tuned = shaken
    ground, first, second, *others = study.location.ranked
    assert not {"ground", "j0"} & {*first.places[0].names, *second.places[0].names}
    as_good = [
        replace(one, profile=replace(one.profile, misfit=1.05 * ground.profile.misfit)) for one in (first, second)
    ]
    location = replace(study.location, ranked=(ground, *as_good, *others))
    assert shaken_by(replace(study, location=location), tuned) is None


@pytest.mark.nightly
def test_a_spring_between_a_body_and_the_ground_is_no_floor() -> None:
    study, tuned = studied(SPRING)
    assert "ground" in study.location.ranked[0].places[0].names
    assert shaken_by(study, tuned) is None


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
