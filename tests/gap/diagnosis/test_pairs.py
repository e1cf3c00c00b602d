"""How much a second effect must bring: where no force at one place explains a gap, no more than a first one."""

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis import search
from chladni.gap.diagnosis.pairs import second_causes
from chladni.gap.diagnosis.price import added_nats
from chladni.gap.diagnosis.search import single_causes
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import AttachedEffect
from tests.gap.arm import arm, measured

SPRING = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
LATE = chladni.attached("time_offset", "acc_column", {"offset": 3e-4})
WHEEL = chladni.attached("extra_mode", "wrist", {"mass": 0.2, "frequency": 60.0, "damping_ratio": 0.05})


def nats(*effects: AttachedEffect) -> float:
    log = measured(effects, seconds=6.0, seed=4)
    return added_nats(locate(arm(), log, estimate_noise(log), Tunables.of(arm())))


@pytest.mark.slow
def test_two_causes_that_no_single_place_explains_need_less() -> None:
    assert nats(SPRING, LATE) < 20.0


@pytest.mark.slow
@pytest.mark.parametrize("effects", [(), (SPRING,), (LATE,)])
def test_details_of_one_law_mustn_t_name_a_second(effects: tuple[AttachedEffect, ...]) -> None:
    assert nats(*effects) == 100.0


@pytest.mark.slow
def test_the_second_is_found_behind_the_first() -> None:
    study = study_of(arm(), measured((SPRING, LATE), seconds=6.0, seed=4), leave_out=frozenset(), own={})
    first = single_causes(study, lambda _: None).ranked[0]
    found = weighed(second_causes(study, first))[0]
    assert {one.effect for one in found.hypothesis.effects} == {"hardening_stiffness", "time_offset"}
    assert np.all(found.held < 1.3)


@pytest.mark.slow
def test_a_second_effect_is_kept_though_the_first_turns_out_to_be_nothing(monkeypatch) -> None:
    study = study_of(arm(), measured((SPRING, LATE), seconds=6.0, seed=4), leave_out=frozenset(), own={})
    first = study.contest.enter(hypothesis_of((WHEEL,), study.location.tuned.z))
    # As an oscillator that imitates something else is, once that isn't all of the gap any more.
    monkeypatch.setattr(
        search, "is_degenerate", lambda _, found: WHEEL.effect in words(found) and len(words(found)) > 1
    )
    found = weighed(second_causes(study, first))[0]
    assert words(found) == {"hardening_stiffness", "time_offset"}


def words(found) -> set[str]:
    return {one.effect for one in found.hypothesis.effects}
