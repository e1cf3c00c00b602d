"""Friction at a joint that mostly sticks is found by the force that the joint passes on."""

import pytest

import chladni
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.hypotheses import polished, sticking_hypotheses
from tests.gap.made_log import band_noise, chain, measured, three_bodies


def unlike_the_model():
    """`three_bodies` with a mass, two stiffnesses and a damper a few per cent off."""
    return chain([2.1, 2.5, 3.0], [4.9e5, 6.2e5, 4e5], [40.0, 70.0, 50.0], at=2)


@pytest.mark.nightly
@pytest.mark.parametrize("force", [30.0, 100.0, 400.0])
def test_sliding_force_is_found_however_much_of_it_sticks(force: float) -> None:
    values = {"force": force, "presliding": 2e-8}
    rubbing = unlike_the_model().with_effects(
        (chladni.attached("coulomb_friction", "j1", values, variant="bristle"),)
    )
    log, _ = measured(rubbing, band_noise(6000), noise=0.005)
    study = study_of(three_bodies(), log, leave_out=frozenset(), own={})
    (sticking,) = sticking_hypotheses(study.location, study.kinds)
    entered = study.contest.enter(sticking)
    assert entered is not None
    finer = polished(entered.hypothesis, entered.fit)
    assert finer is not None
    found = study.contest.enter(finer)
    assert found is not None
    assert found.fit.effects[0].site == "j1"
    assert found.fit.effects[0].values["force"] == pytest.approx(force, rel=0.02)
    # What bristles do before they slip stays: the law creeps there.
    assert found.gap < 0.05
