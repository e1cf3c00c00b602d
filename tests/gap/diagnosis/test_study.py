"""What of a log is told before anything is searched: sensors that hold their samples."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.study import study_of
from tests.gap.arm import arm, measured


@pytest.mark.nightly
def test_a_sensor_that_holds_its_samples_is_noticed_and_a_clipped_one_is_not() -> None:
    log = measured(seconds=2.0)
    outputs = log.outputs.copy()
    outputs[1] = np.repeat(outputs[1, ::2], 2)[: outputs.shape[1]]
    outputs[2] = np.clip(outputs[2], -0.5 * outputs[2].std(), 0.5 * outputs[2].std())
    study = study_of(arm(), replace(log, outputs=outputs), leave_out=frozenset(), own={})
    assert study.repeating == (log.output_names[1],)


@pytest.mark.nightly
def test_a_few_long_holds_are_noticed() -> None:
    log = measured(seconds=2.0)
    outputs = log.outputs.copy()
    for start in (300, 700, 1100):
        outputs[1, start : start + 12] = outputs[1, start]
    study = study_of(arm(), replace(log, outputs=outputs), leave_out=frozenset(), own={})
    assert study.repeating == (log.output_names[1],)
