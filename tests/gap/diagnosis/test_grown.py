"""A second effect grows from little beside a first one, whatever its place explains alone."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.grown import Grown
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.made_log import band_noise, chain, measured, three_bodies

#: What takes part: the whole catalogue would only make it slower.
WORDS = {"backlash", "hardening_stiffness", "gain_error"}
GAPS = {"j1": 1.2e-4, "j2": 4e-5}


def seen_twice(model):
    """With two sensors, which locate no pair of forces."""
    return replace(model, outputs=model.outputs[1:])


@pytest.mark.nightly
def test_the_second_play_grows_beside_the_first() -> None:
    plays = tuple(chladni.attached("backlash", site, {"gap": gap}) for site, gap in GAPS.items())
    machine = seen_twice(chain([2.1, 2.5, 3.0], [4.9e5, 6.1e5, 4e5], [40.0, 66.0, 50.0], at=2)).with_effects(plays)
    log, _ = measured(machine, band_noise(8000), noise=0.005)
    study = study_of(seen_twice(three_bodies()), log, leave_out=frozenset(CATALOGUE) - WORDS, own={})
    alone = chladni.attached("backlash", "j1", {"gap": 1e-4})
    lead = study.contest.enter(hypothesis_of((alone,), study.location.ranked[0].profile.z))
    assert lead is not None
    found = weighed(Grown(study).beside(lead))[0]
    assert {one.site: one.values["gap"] for one in found.fit.effects} == pytest.approx(GAPS, rel=0.05)
    assert np.max(found.held) < 0.05 * np.max(lead.held)
    # Beside an effect at its own site none is tried: it would mend that one's law.
    assert all(len({each.site for each in one.fit.effects}) == 2 for one in Grown(study).beside(lead))


@pytest.mark.slow
def test_a_word_without_its_place_is_no_second() -> None:
    axis = chain([2.0, 3.0], [0.0, 4e5], [30.0, 60.0])
    rubbing = axis.with_effects((chladni.attached("coulomb_friction", "j0", {"force": 20.0}),))
    log, _ = measured(rubbing, band_noise(4000), noise=0.005)
    leave_out = frozenset(CATALOGUE) - {"coulomb_friction", "softening_stiffness", "gain_error"}
    study = study_of(axis, log, leave_out=leave_out, own={})
    wrong_gain = chladni.attached("gain_error", "hammer", {"gain": 1.05})
    lead = study.contest.enter(hypothesis_of((wrong_gain,), study.location.tuned.z))
    assert lead is not None
    # The joint to the ground has no spring that could soften.
    grown = {one.effect for both in Grown(study).beside(lead) for one in both.fit.effects if one.site == "j0"}
    assert grown == {"coulomb_friction"}


def test_a_spring_that_looked_soft_alone_grows_hard_beside_another() -> None:
    springs = (
        chladni.attached("softening_stiffness", "j0", {"cubic": -8e9}),
        chladni.attached("hardening_stiffness", "j1", {"cubic": 3e8}),
    )
    machine = chain([7.5, 8.3], [7.2e5, 2.8e5], [45.0, 22.0])
    log, _ = measured(machine.with_effects(springs), band_noise(4000, rms=200.0), noise=0.005)
    leave_out = frozenset(CATALOGUE) - {"hardening_stiffness", "softening_stiffness"}
    study = study_of(machine, log, leave_out=leave_out, own={})
    lead = study.contest.enter(hypothesis_of(springs[:1], study.location.tuned.z))
    assert lead is not None
    found = weighed(Grown(study).beside(lead))[0]
    assert {one.site: one.values["cubic"] for one in found.fit.effects} == pytest.approx(
        {"j0": -8e9, "j1": 3e8}, rel=0.1
    )
    assert np.max(found.held) < 0.8 * np.max(lead.held)
