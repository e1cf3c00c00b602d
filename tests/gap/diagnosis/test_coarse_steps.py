"""A sensor whose steps are larger than its signal: what rounding takes is no tone, no force and no other cause."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.diagnosis.study import study_of
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.made_log import RATE_HZ, band_noise, chain, measured

WORDS = {"quantization", "tonal_disturbance", "gain_error"}
#: Step over RMS of the second sensor.
COARSE = 4.0


def machine():
    return chain([2.0, 2.5], [2.6e4, 1.7e4], [5.0, 4.0])


def rounded(cut):
    """Blows that cross some steps, over a swing that stays below half of one."""
    time = np.arange(8000)
    swing = 9.0 * np.sin(2.0 * np.pi * 11.0 * time / RATE_HZ)
    log, _ = measured(machine(), band_noise(8000, rms=150.0) * (time % 2000 < 100) + swing, noise=0.005)
    outputs = log.outputs.copy()
    step = COARSE * float(np.std(outputs[1]))
    outputs[1] = step * cut(outputs[1] / step)
    return replace(log, outputs=outputs), step, float(np.std(outputs[1] - log.outputs[1]))


@pytest.mark.nightly
@pytest.mark.slow
def test_only_the_steps_are_named() -> None:
    log, step, _ = rounded(np.round)
    found = diagnose(machine(), [log], leave_out=frozenset(CATALOGUE) - WORDS)
    assert [(one.effect, one.site) for one in found.causes] == [("quantization", log.output_names[1])]
    assert found.causes[0].parameters["step"].value == pytest.approx(step)


@pytest.mark.nightly
def test_the_floor_holds_what_rounding_takes() -> None:
    log, step, taken = rounded(np.floor)
    study = study_of(machine(), log, leave_out=frozenset(), own={})
    assert study.coarse == {log.output_names[1]}
    # More than of a signal that crosses many steps.
    assert taken > 1.15 * step / np.sqrt(12.0)
    assert study.contest.noise.rms[1] == pytest.approx(taken, rel=0.1)
