"""Laws whose runs have several ends are found over short windows, which then grow to the whole record."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.study import recovered_states, study_of
from chladni.gap.explanation.contest import Contest
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.shooting import Shooting
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import band_noise, chain, measured

TEETH = {"amplitude": 12.0, "period": 1e-3, "phase": 0.7}


def machine():
    """Modes at 21 and 41 Hz; how the first body is displaced is seen, which tells where its teeth are."""
    seen = (
        StructureOutput(name="x0", measures="displacement", at="b0"),
        StructureOutput(name="a1", measures="acceleration", at="b1"),
    )
    return replace(chain([2.0, 1.5], [5e4, 6e4], [12.0, 9.0]), outputs=seen)


@pytest.fixture(scope="module")
def made():
    toothed = machine().with_effects((attached("ripple", "j0", TEETH),))
    log, floor = measured(toothed, band_noise(6000, rms=60.0), noise=5e-3)
    study = study_of(machine(), log, leave_out=frozenset(), own={})
    contest = Contest(study.contest.run, study.contest.problem.with_noise(floor), study.contest.training)
    return contest, Shooting(contest, recovered_states(study.location.problem, study.location.best))


def near(share: float):
    """Teeth that are a few per cent off: over the whole way that is more than a period."""
    off = {"amplitude": 0.9 * TEETH["amplitude"], "period": share * TEETH["period"], "phase": 0.6}
    return hypothesis_of((attached("ripple", "j0", off),), np.zeros(6))


@pytest.mark.nightly
def test_teeth_whose_run_is_lost_from_a_near_start_are_found_over_windows(made) -> None:
    contest, shooting = made
    lost = contest.enter(near(1.03))
    assert lost is None or lost.chi > 100.0
    shot = shooting.shot(near(1.03))
    assert shot.misfit < 1.5
    assert dict(shot.fit.effects[0].values) == pytest.approx(TEETH, rel=0.02)


@pytest.mark.nightly
@pytest.mark.slow
def test_windows_grow_as_long_as_the_run_follows(made) -> None:
    _, shooting = made
    grown = shooting.grown(shooting.shot(near(1.03)))
    assert grown.level >= 2
    assert grown.misfit < 2.0
    # Teeth of twice the period don't follow over an oscillation even.
    assert shooting.shot(near(2.0)).misfit > 10.0


@pytest.mark.nightly
@pytest.mark.slow
def test_a_run_of_one_end_only_is_entered_where_windows_led() -> None:
    softly = attached("ripple", "j0", {**TEETH, "amplitude": 3.0})
    log, floor = measured(machine().with_effects((softly,)), band_noise(4000, rms=60.0), noise=5e-3)
    study = study_of(machine(), log, leave_out=frozenset(), own={})
    contest = Contest(study.contest.run, study.contest.problem.with_noise(floor), study.contest.training)
    shooting = Shooting(contest, recovered_states(study.location.problem, study.location.best))
    found = shooting.entered(shooting.shot(near(1.03)))
    assert found.chi < 1.3
    assert found.fit.effects[0].values["amplitude"] == pytest.approx(3.0, rel=0.05)


@pytest.mark.slow
def test_what_no_machine_could_have_is_not_shot(made) -> None:
    _, shooting = made
    # The first of the outputs is a place, but no joint.
    nowhere = hypothesis_of((attached("backlash", "x0", {"gap": 1e-3}),), np.zeros(6))
    assert shooting.shot(nowhere) is None
