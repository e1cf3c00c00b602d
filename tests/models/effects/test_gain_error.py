from dataclasses import replace

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.gain_error import gain_doubt
from chladni.models.structures.structure_input import StructureInput
from tests.models.effects.small_models import one_body, with_loop
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.1, 20.0, 30)


@pytest.mark.parametrize("gain", [1.3, -1.0, 0.0])
@pytest.mark.parametrize("site", ["motor", "speed"])
def test_the_response_is_multiplied(site: str, gain: float) -> None:
    before = one_body().frequency_response(FREQUENCY_HZ)
    after = attached("gain_error", site, {"gain": gain}).attach(one_body()).frequency_response(FREQUENCY_HZ)
    factor = np.ones((3, 1, 1)) * gain if site == "motor" else np.array([1.0, gain, 1.0])[:, None, None]
    np.testing.assert_allclose(after, before * factor, rtol=1e-12)


def test_in_a_loop_it_changes_the_loops_gain() -> None:
    by_motor = attached("gain_error", "motor", {"gain": 0.5}).attach(with_loop(one_body(), gain=300.0))
    by_sensor = with_loop(attached("gain_error", "place", {"gain": 0.5}).attach(one_body()), gain=300.0)
    wanted = with_loop(one_body(), gain=150.0).frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(by_motor.frequency_response(FREQUENCY_HZ), wanted, rtol=1e-11)
    # The reference isn't measured by the sensor: from it, the loop has half the way back.
    np.testing.assert_allclose(by_sensor.frequency_response(FREQUENCY_HZ)[:2], 2 * wanted[:2], rtol=1e-11)


def test_a_prescribed_motion_is_multiplied_with_its_derivatives() -> None:
    model = tree()
    table = StructureInput(name="table", at="base", kind="displacement")
    driven = replace(model, inputs=(*model.inputs, table)).compile()
    louder = attached("gain_error", "table", {"gain": 1.2}).attach(driven)
    before = driven.frequency_response(FREQUENCY_HZ)
    after = louder.frequency_response(FREQUENCY_HZ)[:, 3]
    # The stretch of a joint is a small difference of large motions.
    np.testing.assert_allclose(after, 1.2 * before[:, 3], rtol=1e-11, atol=1e-14 * np.abs(before).max())


def test_behind_clipping_it_acts_on_samples() -> None:
    clipped = attached("clipping", "acc", {"limit": 2.0}).attach(one_body())
    louder = attached("gain_error", "acc", {"gain": 3.0}).attach(clipped)
    samples = np.array([1.0, 5.0, -9.0])
    for _, action in louder.output_maps:
        samples = action(samples, 100.0)
    np.testing.assert_allclose(samples, [3.0, 6.0, -6.0])


@pytest.mark.parametrize("gain", [1.0, 0.5, -0.9, 9.0, 11.0, 0.0, 29.0])
def test_a_sensitivity_may_be_off(gain: float) -> None:
    assert gain_doubt("tip", gain) is None


@pytest.mark.parametrize(
    ("gain", "words"),
    [(9.80665, "between g and m/s^2"), (1 / 9.8, "between g and m/s^2"), (-1.01, "a reversed sign"),
     (np.pi / 180, "between degrees and rad"), (-1e-3, "mm for m"),
     (7.1e-4, "rather that of a wrong unit"), (40.0, "rather that of a wrong unit")],
)  # fmt: skip
def test_a_gain_that_only_a_unit_has_is_doubted(gain: float, words: str) -> None:
    found = gain_doubt("tip", gain)
    assert found is not None
    assert words in found
    assert "at tip" in found
