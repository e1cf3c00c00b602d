import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import force
from tests.models.effects.small_models import one_body, with_loop


def test_nothing_passes_under_the_threshold_and_the_rest_is_shifted() -> None:
    effect = attached("dead_zone", "motor", {"width": 2.0})
    samples, wanted = np.array([-7.0, -2.0, -1.0, 0.0, 1.9, 2.5]), np.array([-5.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    ((_, action),) = effect.attach(one_body()).input_maps
    np.testing.assert_allclose(action(samples, 100.0), wanted)
    (law,) = effect.attach(with_loop(one_body())).laws
    for sample, left in zip(samples, wanted, strict=True):
        assert sample + force(law, d=sample) == pytest.approx(left, abs=1e-15)
