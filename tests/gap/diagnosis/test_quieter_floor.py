"""What was taken for noise is doubted where a law promises to explain it, and only there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.quieter_floor import quieter_study
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.contest import Contest
from chladni.gap.explanation.hypotheses import hypothesis_of
from tests.gap.arm import all_but, arm, measured, with_outputs

RUB = chladni.attached("coulomb_friction", "elbow", {"force": 8.0})
NOISE = 0.01


def quieter(effects, colour: float, leave_out: frozenset[str] = frozenset()):
    """What is told behind friction, of an arm with two sensors, whose wrist's floor holds all but friction."""
    log = with_outputs(measured(effects, seconds=3.0, noise=NOISE, off={}, colour=colour), ("acc_arm", "acc_wrist"))
    study = study_of(seen_at(("acc_arm", "acc_wrist")), log, leave_out=leave_out, own={})
    found = study.contest.enter(hypothesis_of((RUB,), study.location.tuned.z))
    left = np.std(log.outputs - found.fit.outputs, axis=1)
    noise = study.contest.noise.raised(left)
    high = replace(
        study,
        contest=Contest(
            study.contest.run, replace(noise, upper_bound=np.array([False, True])), study.contest.training
        ),
    )
    found = high.contest.enter(hypothesis_of((RUB,), study.location.tuned.z))
    return log, quieter_study(high, SimpleNamespace(best=found, instead=None, shaken=None))


def seen_at(names):
    return replace(arm(), outputs=tuple(one for one in arm().outputs if one.name in names))


@pytest.mark.slow
def test_a_law_that_was_taken_for_noise_is_worth_another_round() -> None:
    drag = chladni.attached("quadratic_damping", "shoulder", {"coefficient": 500.0})
    log, found = quieter((RUB, drag), colour=0.0, leave_out=all_but("quadratic_damping"))
    assert found is not None
    assert found.contest.noise.rms[1] == pytest.approx(NOISE * np.std(log.outputs[1]), rel=0.25)


@pytest.mark.slow
def test_coloured_noise_is_worth_none_however_quiet_its_band_is() -> None:
    _, found = quieter((RUB,), colour=0.9)
    assert found is None
