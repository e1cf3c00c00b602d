"""What the inputs drive is told from where windows began."""

import numpy as np
import pytest

from chladni.gap.diagnosis.advice import driven_parts
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import band_noise, chain, measured

#: One body on a guide, and one that hangs on it by a spring: two states that stay, and a mode.
FREE = chain([20.0, 2.0], [0.0, 5e4], [60.0, 20.0])
WINDOWS = ((0, 400), (400, 1000), (1000, 1500))


def test_starts_leave_nothing_and_scale_stays() -> None:
    log, _ = measured(FREE, band_noise(1500), initial=np.array([0.3, -0.2, 1.5, 0.7]), noise=0.0, offset=4.0)
    own, made = driven_parts(FreeRun(FREE, log, windows=WINDOWS))
    np.testing.assert_allclose(own, made, atol=1e-6 * np.std(log.outputs))
    # Of a sensor with another gain likewise.
    assert np.std(made) > 0.0


def test_what_only_started_in_motion_was_driven_by_nothing() -> None:
    log, _ = measured(FREE, np.zeros((1, 1500)), initial=np.array([0.3, -0.2, 1.5, 0.7]), noise=0.0)
    own, made = driven_parts(FreeRun(FREE, log, windows=WINDOWS))
    assert np.std(log.outputs) > 0.0
    np.testing.assert_allclose(own, 0.0, atol=1e-6 * np.std(log.outputs))
    assert not made.any()


@pytest.mark.parametrize("windows", [None, WINDOWS])
def test_laws_of_the_model_take_no_part(windows: tuple[tuple[int, int], ...] | None) -> None:
    log, _ = measured(FREE, band_noise(1500))
    rubbing = FREE.with_effects((attached("coulomb_friction", "j0", {"force": 30.0}),))
    for plain, other in zip(
        driven_parts(FreeRun(FREE, log, windows=windows)),
        driven_parts(FreeRun(rubbing, log, windows=windows)),
        strict=True,
    ):
        np.testing.assert_array_equal(plain, other)
