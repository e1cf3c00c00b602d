"""The search for one cause, where it begins."""

from dataclasses import replace

import pytest

import chladni
from chladni.gap.diagnosis.search import sibling_causes, twin_causes
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.models.effects.catalogue import CATALOGUE, taking_part
from tests.gap.arm import arm, measured
from tests.gap.made_log import band_noise, chain
from tests.gap.made_log import measured as made


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_stribeck_curve_hands_on_to_the_coulomb_friction_that_it_ends_at() -> None:
    log = measured((chladni.attached("coulomb_friction", "elbow", {"force": 5.0}),), noise=0.005)
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    curve = chladni.attached("stribeck_friction", "elbow", {"coulomb": 4.5, "static": 5.5, "speed": 0.1})
    stribeck = study.contest.enter(hypothesis_of((curve,), study.location.tuned.z))
    assert stribeck is not None
    (plain,) = sibling_causes(study, [stribeck])
    assert plain.hypothesis.named[0].effect == "coulomb_friction"
    assert plain.fit.effects[0].values["force"] == pytest.approx(5.0, rel=0.02)
    without = replace(study, kinds=taking_part({"coulomb_friction"}, ()))
    assert sibling_causes(without, [stribeck]) == []


@pytest.mark.slow
def test_a_ripple_of_the_joint_that_an_input_acts_across_may_be_the_inputs() -> None:
    machine = chain([2.0, 2.5], [2.6e4, 1.7e4], [5.0, 4.0])
    cogging = chladni.attached("ripple", "j0", {"amplitude": 30.0, "period": 0.01, "phase": 0.3})
    log, _ = made(machine.with_effects((cogging,)), band_noise(3000), noise=0.005)
    study = study_of(machine, log, leave_out=frozenset(CATALOGUE) - {"ripple"}, own={})
    joint = study.contest.enter(hypothesis_of((cogging,), study.location.tuned.z), max_iterations=40)
    assert joint is not None
    twins = twin_causes(study, joint)
    assert {one.hypothesis.named[0].site for one in twins} == {"hammer"}
    best = min(twins, key=lambda one: one.chi)
    # At a joint the force resists, at an input it pushes: but for half a turn both are one and the same.
    assert best.chi == pytest.approx(joint.chi, rel=1e-3)
    assert best.fit.effects[0].values["phase"] == pytest.approx(0.3 - 3.141592653589793, abs=0.05)
