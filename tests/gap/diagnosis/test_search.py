"""The search for one cause, where it begins."""

import pytest

import chladni
from chladni.gap.diagnosis.search import sibling_causes
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.hypotheses import hypothesis_of
from tests.gap.arm import arm, measured


def test_a_stribeck_curve_that_falls_slowly_isnt_lost_to_coulombs() -> None:
    # It falls over four times the speed that is usual there: from a curve that falls at once the search ends at
    # Coulomb's friction, with static and sliding force alike.
    curve = {"coulomb": 3.0, "static": 9.0, "speed": 1.0}
    log = measured((chladni.attached("stribeck_friction", "elbow", curve),), noise=0.005)
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    plain = hypothesis_of((chladni.attached("coulomb_friction", "elbow", {"force": 5.0}),), study.location.tuned.z)
    coulomb = study.contest.enter(plain)
    assert coulomb is not None
    found = sibling_causes(study, [coulomb])
    best = min(found, key=lambda one: one.chi)
    assert best.chi < coulomb.chi - 0.03
    assert best.fit.effects[0].values["speed"] == pytest.approx(1.0, rel=0.2)
