"""A model that no log can be held against is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.diagnose import diagnose
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.signals.errors import EstimateError
from tests.gap.comparison.test_doubts import EDGE, loop
from tests.gap.made_log import band_noise, chain, measured

NONE = frozenset(CATALOGUE)


def test_a_known_law_that_its_input_drives_out_of_all_bounds_is_told() -> None:
    one = chain([2.0], [5e5], [40.0])
    log, _ = measured(one, band_noise(300))
    hard = one.with_effects((attached("hardening_stiffness", "j0", {"cubic": 1e12}),))
    told = "model 'chain' diverges on log 'made' within its tolerances; check the model's stability and the units"
    with pytest.raises(EstimateError, match=told):
        diagnose(hard, [replace(log, inputs=1e57 * log.inputs)], leave_out=NONE)


@pytest.mark.parametrize("ki", [1e14, 1e19])
def test_a_loop_that_runs_away_between_two_samples_is_told(ki: float) -> None:
    log, _ = measured(loop(0.5 * EDGE), 0.01 * np.sin(np.arange(1000) / 50)[None], rate_hz=500.0)
    growth = float(np.linalg.eigvals(loop(ki).compile().a).real.max())
    with pytest.raises(EstimateError, match="model 'axis' runs away: an error grows e-fold in ") as error:
        diagnose(loop(ki), [log], leave_out=NONE)
    assert f"{1 / growth:.2g} s" in str(error.value)
