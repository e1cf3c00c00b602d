"""Wrong units are doubted before anything else is believed."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.comparison.scale_doubt import scale_doubt
from chladni.gap.diagnosis.diagnose import diagnose
from tests.gap.arm import arm, measured

RNG = np.random.default_rng(0)
SIGNALS = RNG.standard_normal((2, 400))


def test_what_agrees_within_a_factor_is_not_doubted() -> None:
    assert scale_doubt(SIGNALS, SIGNALS * [[0.1], [10.0]], ["a", "b"]) is None


def test_the_output_that_differs_most_is_named_with_its_factor() -> None:
    found = scale_doubt(SIGNALS, SIGNALS * [[50.0], [0.001]], ["a", "b"])
    assert found is not None
    assert found.startswith("At b the model as it is gives 0.001 times what was measured")


def test_another_signal_tells_nothing() -> None:
    assert scale_doubt(SIGNALS, 1e3 * SIGNALS[::-1], ["a", "b"]) is None


def test_what_stands_still_is_told_elsewhere() -> None:
    assert scale_doubt(SIGNALS * 0.0, SIGNALS, ["a", "b"]) is None
    assert scale_doubt(SIGNALS, SIGNALS * 0.0, ["a", "b"]) is None


@pytest.mark.slow
def test_a_log_in_millimetres_is_told_in_the_advice() -> None:
    log = measured()
    found = diagnose(arm(), [replace(log, outputs=1e3 * log.outputs)])
    assert found.advice is not None
    assert found.advice.startswith("At acc_")
    assert "times what was measured: check its channel and unit" in found.advice
