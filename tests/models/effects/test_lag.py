from dataclasses import replace
from math import pi

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure_input import StructureInput
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import DAMPING, MASS, STIFFNESS, one_body, with_loop
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.1, 20.0, 60)
S = 2j * pi * FREQUENCY_HZ
PLANT = 1 / (MASS * S**2 + DAMPING * S + STIFFNESS)
WAYS = [
    ("first_order", {"time_constant": 0.02}, 1 / (0.02 * S + 1)),
    ("second_order", {"time_constant": 0.01, "damping_ratio": 0.6}, 1 / (1e-4 * S**2 + 2 * 0.6 * 0.01 * S + 1)),
]


@pytest.mark.parametrize(("variant", "values", "way"), WAYS)
def test_outside_of_loops_the_response_passes_the_filter(variant: str, values: dict[str, float], way) -> None:
    lagged = attached("lag", "motor", values, variant=variant).attach(one_body())
    response = lagged.frequency_response(FREQUENCY_HZ)[:, 0]
    np.testing.assert_allclose(response, np.stack([S**2, S, S**0]) * PLANT * way, rtol=1e-10)
    assert lagged.is_linear()


@pytest.mark.parametrize(("variant", "values", "way"), WAYS)
def test_in_a_loop_it_takes_part_in_the_loop(variant: str, values: dict[str, float], way) -> None:
    lagged = attached("lag", "motor", values, variant=variant).attach(with_loop(one_body(), gain=300.0))
    open_loop = 300.0 * way * PLANT
    np.testing.assert_allclose(lagged.frequency_response(FREQUENCY_HZ)[2, 0], open_loop / (1 + open_loop), rtol=1e-10)


def test_two_lags_act_one_after_the_other() -> None:
    once = attached("lag", "motor", {"time_constant": 0.02}).attach(one_body())
    twice = attached("lag", "motor", {"time_constant": 0.005}).attach(once)
    np.testing.assert_allclose(
        twice.frequency_response(FREQUENCY_HZ)[2, 0], PLANT / (0.02 * S + 1) / (0.005 * S + 1), rtol=1e-10
    )


@pytest.mark.parametrize(("variant", "values", "way"), WAYS)
def test_a_prescribed_motion_lags_with_its_derivatives(variant: str, values: dict[str, float], way) -> None:
    model = tree()
    table = StructureInput(name="table", at="base", kind="displacement")
    driven = replace(model, inputs=(*model.inputs, table)).compile()
    lagged = attached("lag", "table", values, variant=variant).attach(driven)
    before, after = driven.frequency_response(FREQUENCY_HZ), lagged.frequency_response(FREQUENCY_HZ)
    # The stretch of a joint is a small difference of large motions.
    np.testing.assert_allclose(after[:, 3], before[:, 3] * way, rtol=1e-9, atol=1e-13 * np.abs(before).max())
    np.testing.assert_allclose(after[:, :3], before[:, :3], rtol=1e-12)


def test_behind_a_lagging_motion_no_map_of_samples_is_possible() -> None:
    model = tree()
    table = StructureInput(name="table", at="base", kind="displacement")
    driven = replace(model, inputs=(*model.inputs, table)).compile()
    lagged = attached("lag", "table", {"time_constant": 0.02}).attach(driven)
    with pytest.raises(ModelError, match=r"input 'table' prescribes a motion"):
        attached("saturation", "table", {"limit": 1e-3}).attach(lagged)
    assert attached("saturation", "table", {"limit": 1e-3}).attach(driven).input_maps


@pytest.mark.parametrize("variant", ["first_order", "second_order"])
def test_no_time_constant_leaves_the_model_as_it_is(variant: str) -> None:
    plant = one_body()
    assert attached("lag", "motor", {"time_constant": 0.0}, variant=variant).attach(plant) is plant
