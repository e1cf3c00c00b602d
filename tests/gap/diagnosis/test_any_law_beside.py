"""Any law of what moves at a place, held beside an answer that leaves something."""

from dataclasses import replace

import pytest

import chladni
from chladni.gap.diagnosis.any_law_beside import any_law
from chladni.gap.diagnosis.naming import causes_named
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.diagnosis.verdict import Causes, causes_found
from chladni.gap.records.diagnosis import AnyLaw
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.arm import arm, measured


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
