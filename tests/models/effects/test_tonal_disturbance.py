import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import force
from tests.models.effects.small_models import one_body

VALUES = {"frequency": 17.0, "amplitude": 3.0, "phase": 0.2}
TIMES_S = np.arange(50) / 200.0
TONE = 3.0 * np.sin(2 * np.pi * 17.0 * TIMES_S + 0.2)


def test_at_a_body_it_is_a_force_that_follows_time_alone() -> None:
    compiled = attached("tonal_disturbance", "mass", VALUES).attach(one_body())
    (law,) = compiled.laws
    assert compiled.ports[law.port].kind == "body"
    found = [force(law, d=5.0, s=-2.0, t=t) for t in TIMES_S]
    np.testing.assert_allclose(found, TONE, atol=1e-13)


def test_at_an_output_it_is_added_to_the_samples() -> None:
    ((row, action),) = attached("tonal_disturbance", "acc", VALUES).attach(one_body()).output_maps
    assert row == 0
    np.testing.assert_allclose(action(np.ones(50), 200.0), 1 + TONE, rtol=1e-13)


def test_a_controller_hears_the_hum() -> None:
    compiled = attached("tonal_disturbance", "place", VALUES).attach(one_body(), in_loop=True)
    assert not compiled.output_maps
    assert force(compiled.laws[0], t=0.1) == pytest.approx(3.0 * np.sin(3.4 * np.pi + 0.2), rel=1e-12)
