"""Trials: what an effect's own file says of how it is looked for."""

import numpy as np
import pytest

from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.law_trials import trials_of
from chladni.models.effects.trial import logarithms
from tests.models.effects.known_motions import RATE_HZ, SAMPLES, along_joint
from tests.models.effects.own_effect import CUBIC_DAMPING

TIME_S = np.arange(SAMPLES) / RATE_HZ
WAY = 1e-3 * (np.sin(2 * np.pi * 7.0 * TIME_S) + 0.4 * np.sin(2 * np.pi * 23.0 * TIME_S))
AT_JOINTS = [kind for kind in CATALOGUE.values() if "joint" in kind.sites]


@pytest.mark.parametrize(("stiffness", "there"), [(4e4, True), (0.0, False)])
def test_a_joint_without_a_spring_has_none_that_could_soften_or_change(stiffness, there):
    motion = along_joint(WAY, stiffness=stiffness)
    words = {kind.name for kind in AT_JOINTS if [*trials_of(kind, motion)]}
    assert words.isdisjoint({"softening_stiffness", "backlash", "varying_stiffness"}) != there
    assert {"coulomb_friction", "hardening_stiffness"} <= words


def test_an_effect_without_trials_goes_along_its_law_over_the_usual_range_of_its_number():
    motion = along_joint(WAY)
    (trial,) = trials_of(CUBIC_DAMPING, motion)
    assert len(trial.grid) == 16
    shape = logarithms((40.0,))[0]
    force = trial.build(shape)
    # No amplitude is free: the number that enters the law is the one that is searched.
    assert not len(force.basis)
    assert force.fixed == pytest.approx(motion.spectrum(40.0 * motion.velocity**3))
    assert trial.values(shape, np.zeros(0)) == pytest.approx({"coefficient": 40.0})


def test_what_is_seen_in_samples_or_follows_nothing_is_tried_along_no_motion():
    motion = along_joint(WAY)
    read = [kind for kind in CATALOGUE.values() if kind.clues.in_samples or kind.clues.of_force]
    assert [kind.name for kind in read] == ["quantization", "base_vibration"]
    assert not any([*trials_of(kind, motion)] for kind in read)
