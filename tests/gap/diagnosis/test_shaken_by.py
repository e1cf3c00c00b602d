"""A floor that shakes has a motion of its own for every sample: it's told only where nothing else can be."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.shaken_by import shaken_by
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.explanation.hypothesis import Contestant
from chladni.models.effects.attached_effect import AttachedEffect, attached
from tests.gap.made_log import band_noise, measured, three_bodies

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
