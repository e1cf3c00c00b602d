"""Forces at the sites that a verdict names are those that acted there, each beside the others."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.evidence import any_law, evidence
from chladni.gap.diagnosis.naming import causes_named
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.diagnosis.verdict import Causes, causes_found
from chladni.gap.records.diagnosis import AnyLaw, Cause
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests import made_diagnosis as made
from tests.gap.arm import RATE_HZ, arm, measured, with_outputs

FRICTION = chladni.attached("coulomb_friction", "elbow", {"force": 20.0})
SPRING = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
GAIN = chladni.attached("gain_error", "acc_column", {"gain": 1.3})


def studied(*effects: AttachedEffect, off: dict[str, float], outputs: Sequence[str] = ()) -> Study:
    log = measured(effects, seconds=4.0, off=off)
    return study_of(arm(), with_outputs(log, outputs) if outputs else log, leave_out=frozenset(), own={})


def believing(study: Study, *, freed: Sequence[str] = (), z: Real | None = None) -> SimpleNamespace:
    """What the contest would say: that parameters are nominal but for `z`, of which those of `freed` are wrong."""
    z = np.zeros(len(study.contest.run.tunables.names)) if z is None else z
    best = SimpleNamespace(fit=SimpleNamespace(z=z), hypothesis=SimpleNamespace(freed=tuple(freed)))
    return SimpleNamespace(best=best, tuned=None)


def named(*effects: AttachedEffect) -> list[Cause]:
    return [made.friction(effect=one.effect, site=one.site) for one in effects]


def true_force(study: Study, site: str, *effects: AttachedEffect) -> Real:
    channel = Channel(name="shaker", unit="N", role="reference")
    driven = TimeSeries(values=study.measurement.inputs, sample_rate_hz=RATE_HZ, channels=(channel,))
    return chladni.simulate(arm().with_effects(effects), driven).motion(site).force


def missed(found: Real, true: Real) -> float:
    """RMS of the difference over that of the truth, between the record's ends, which ring."""
    inside = slice(300, -300)
    difference = (found - found.mean() - true + true.mean())[inside]
    return float(np.sqrt(np.mean(difference**2) / np.var(true[inside])))


@pytest.fixture(scope="module")
def both() -> Study:
    return studied(FRICTION, SPRING, off={})


@pytest.mark.nightly
def test_of_two_forces_each_is_the_one_that_acts_at_its_site(both: Study) -> None:
    elbow, hand = evidence(both, believing(both), named(FRICTION, SPRING))
    assert (elbow.site.name, hand.site.name) == ("elbow", "hand")
    for one in (elbow, hand):
        assert missed(one.force, true_force(both, one.site.name, FRICTION, SPRING)) < 0.35
    # As if it acted alone, the first would have to do the other's work.
    (alone,) = evidence(both, believing(both), named(FRICTION))
    assert missed(alone.force, true_force(both, "elbow", FRICTION, SPRING)) > 2.0


@pytest.mark.nightly
def test_two_forces_that_two_sensors_cannot_tell_apart_are_not_tried(both: Study) -> None:
    few = studied(FRICTION, SPRING, off={}, outputs=["acc_column", "acc_wrist"])
    assert [one.site.name for one in evidence(few, believing(few), named(SPRING, FRICTION))] == ["hand"]


@pytest.mark.nightly
def test_beside_an_error_of_a_sensor_there_is_the_force_alone(both: Study) -> None:
    (only,) = evidence(both, believing(both), named(FRICTION, GAIN))
    assert only.site.name == "elbow"
    # One that explains little is shown by no force that is lacking.
    assert evidence(both, believing(both), named(GAIN, FRICTION)) == ()


def test_where_nothing_is_named_it_is_the_best_place(both: Study) -> None:
    (best,) = evidence(both, believing(both), ())
    assert best.site.name == "hand"
    assert evidence(both, believing(both), named(chladni.attached("delay", "knee", {"delay": 1e-3}))) == ()


@pytest.mark.nightly
def test_a_wrong_stiffness_shows_as_the_spring_that_its_joint_lacks() -> None:
    study = studied(off={"elbow.stiffness": 1.5})
    names = study.contest.run.tunables.names
    z = np.zeros(len(names))
    z[names.index("elbow.stiffness")] = 5.0
    wrong = [made.friction(effect="parameter", site="elbow.stiffness")]
    (elbow,) = evidence(study, believing(study, freed=["elbow.stiffness"], z=z), wrong)
    assert elbow.site.name == "elbow"
    inside = slice(300, -300)
    displacement, force = elbow.displacement[inside], elbow.force[inside]
    # Half of its nominal 200 kN/m is missing.
    assert displacement @ force / (displacement @ displacement) == pytest.approx(1.0e5, rel=0.05)


def judged(effect: AttachedEffect, *, words: set[str], seconds: float = 5.0) -> tuple[Study, Causes]:
    """What is said where these words take part alone."""
    log = measured((effect,), seed=7, seconds=seconds)
    study = study_of(arm(), log, leave_out=frozenset(CATALOGUE) - words, own={})
    return causes_found(study, lambda _: None)


def beside(effect: AttachedEffect, *, words: set[str], seconds: float = 5.0) -> tuple[str, AnyLaw | None]:
    """Verdict, and what any law explains."""
    study, causes = judged(effect, words=words, seconds=seconds)
    return causes.verdict, any_law(study, causes, causes_named(study, causes))


@pytest.mark.nightly
@pytest.mark.slow
def test_a_law_that_took_no_part_is_seen_to_follow_the_motion() -> None:
    spring = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
    verdict, law = beside(spring, words={"gain_error", "delay"}, seconds=3.0)
    assert verdict == "unknown"
    assert law is not None
    assert law.site == "hand" or "hand" in law.group
    assert law.force > 0.99
    # Above half the rate a law acts too, and a force that is recovered from samples doesn't.
    assert law.law > 0.96 * law.force
    assert law.named is None


@pytest.mark.nightly
@pytest.mark.slow
def test_what_remembers_is_seen_not_to_follow_it() -> None:
    loop = chladni.attached("hysteresis", "hand", {"force": 8.0, "yield": 3e-4, "shape": 1.0})
    verdict, law = beside(loop, words={"gain_error", "delay"})
    assert verdict == "unknown"
    assert law is not None
    assert law.force > 0.9
    assert law.law < 0.9 * law.force


@pytest.mark.nightly
@pytest.mark.slow
def test_beside_a_name_it_is_asked_only_where_that_leaves_more_than_noise() -> None:
    spring = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
    study, causes = judged(spring, words={"hardening_stiffness", "gain_error"})
    said = causes_named(study, causes)
    assert causes.verdict == "effect"
    assert any_law(study, causes, said) is None
    more = replace(causes, best=replace(causes.best, held=1.0 + 0.1 * (causes.tuned.held - 1.0)))
    law = any_law(study, more, said)
    assert law is not None
    assert law.site == "hand"
    assert law.named == pytest.approx(0.9)
    assert law.law > 0.96
