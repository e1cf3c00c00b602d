"""What is asked for after an answer: what tells it from others that come near, or what the log lacks for any."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from chladni.gap.diagnosis.advice import measure_next
from chladni.gap.diagnosis.belief import Belief
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.records.diagnosis import Verdict
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.made_log import band_noise, measured, three_bodies

ONLY_GAINS = frozenset(CATALOGUE) - {"gain_error"}
HARDENING = attached("hardening_stiffness", "j1", {"cubic": 1.2e9})


def gain(site: str) -> AttachedEffect:
    return attached("gain_error", site, {"gain": 1.3})


def log_of(*effects: AttachedEffect, noise: float = 0.02, outputs: list[int] | None = None) -> Measurement:
    log, _ = measured(three_bodies().with_effects(effects), band_noise(1536), noise=noise, outputs=outputs)
    return log


def answered(study: Study, entered: list[Contestant], verdict: Verdict = "effect") -> Causes:
    """The causes with the first of contestants as the answer."""
    tuned = study.contest.enter(Hypothesis(start_z=study.location.tuned.z))
    assert tuned is not None
    return believing(study, tuned, entered, verdict)


def believing(study: Study, tuned: Contestant, ranked: Sequence[Contestant], verdict: Verdict = "effect") -> Causes:
    return Causes(
        verdict=verdict,
        tuned=tuned,
        best=ranked[0] if ranked else tuned,
        belief=Belief(study.location, [tuned, *ranked]),
        shaken=None,
        noise=study.contest.noise,
        distorted=(),
    )


def entered(study: Study, *effects: tuple[AttachedEffect, ...]) -> list[Contestant]:
    hypotheses = [hypothesis_of(one, study.location.tuned.z) for one in effects]
    found = [study.contest.enter(one) for one in hypotheses]
    return [one for one in found if one is not None]


def studied(log: Measurement) -> Study:
    return study_of(three_bodies(), log, leave_out=frozenset(), own={})


@pytest.fixture(scope="module")
def hardening() -> Study:
    """Of a joint that hardens, seen by all three sensors."""
    return studied(log_of(HARDENING))


@pytest.fixture(scope="module")
def hardening_of_one() -> Study:
    """The same seen by one."""
    return studied(log_of(HARDENING, outputs=[2]))


@pytest.mark.nightly
def test_a_diagnosis_asks_for_what_tells_its_candidates_apart() -> None:
    # Both scale the only channel.
    found = diagnose(three_bodies(), [log_of(gain("hammer"), outputs=[2])], leave_out=ONLY_GAINS)
    assert found.verdict == "effect"
    said = found.next_measurement or ""
    assert any(
        f"a gain error at {a} and a gain error at {b}" in said for a, b in (("hammer", "a2"), ("a2", "hammer"))
    )
    assert said.startswith("Add ")


@pytest.mark.nightly
def test_two_causes_are_compared_with_those_without_one() -> None:
    study = studied(log_of(gain("a0"), HARDENING))
    both, single, alone = entered(study, (gain("a0"), HARDENING), (gain("a0"),), (HARDENING,))
    causes = answered(study, [both, single, alone])
    # As near as they may be, whatever this log says of them: what is compared is what is tested.
    less = causes.best.log_evidence - 1.0
    near = [replace(each, log_evidence=less) for each in causes.ranked if each is not causes.best]
    near.sort(key=lambda each: len(each.hypothesis.named))
    said = measure_next(study, believing(study, causes.tuned, [causes.best, *near]), seed=0) or ""
    assert "gain error at a0 with hardening stiffness at j1" in said
    assert "gain error at a0 alone then differ" in said
    # None of them comes near: nothing is left to be told apart.
    far = [replace(each, log_evidence=causes.best.log_evidence - 20.0) for each in near]
    assert measure_next(study, believing(study, causes.tuned, [causes.best, *far]), seed=0) is None


@pytest.mark.nightly
def test_nothing_missing_in_loud_noise_says_what_may_be_hidden() -> None:
    loud, quiet = studied(log_of(noise=1.0)), studied(log_of())
    said = measure_next(loud, answered(loud, [], "none"), seed=0) or ""
    assert said.startswith("Noise is 7")
    assert "average 16 records or periods of the same input" in said
    assert said.endswith("may act unseen: this log can't rule it out.")
    assert measure_next(quiet, answered(quiet, [], "none"), seed=0) is None


@pytest.mark.nightly
def test_an_effect_in_loud_noise_asks_for_a_higher_level() -> None:
    study = studied(log_of(attached("gain_error", "a0", {"gain": 3.0}), noise=1.0))
    # So large that nothing else comes near.
    said = measure_next(study, answered(study, entered(study, (gain("a0"),))), seed=0) or ""
    assert "raise the level 4 times" in said
    assert "unseen" not in said


@pytest.mark.nightly
def test_an_only_sensor_is_asked_for_another_one(hardening: Study, hardening_of_one: Study) -> None:
    study = hardening_of_one
    causes = answered(study, entered(study, (HARDENING,)))
    tuned = replace(causes.tuned, log_evidence=causes.best.log_evidence - 100.0)
    lone = believing(study, tuned, [causes.best])
    said = measure_next(study, lone, seed=0) or ""
    assert said.startswith("One sensor can't tell where a force acts: add ")
    assert measure_next(study, believing(study, tuned, [], "none"), seed=0) is None
    causes = answered(hardening, entered(hardening, (HARDENING,)))
    assert measure_next(hardening, causes, seed=0) is None


def test_what_an_only_sensor_leaves_unknown_asks_for_another_one(hardening: Study, hardening_of_one: Study) -> None:
    said = measure_next(hardening_of_one, answered(hardening_of_one, [], "unknown"), seed=0) or ""
    assert said.startswith("One sensor can't tell where a force acts: add ")
    assert measure_next(hardening, answered(hardening, [], "unknown"), seed=0) is None
