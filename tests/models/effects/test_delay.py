from math import pi

import numpy as np
import pytest

from chladni.models.core.compiled_model import DelayLine
from chladni.models.effects.attached_effect import attached
from tests.models.effects.small_models import DAMPING, MASS, STIFFNESS, one_body, with_loop

FREQUENCY_HZ = np.linspace(0.1, 20.0, 60)
S = 2j * pi * FREQUENCY_HZ


def test_outside_of_loops_it_delays_the_inputs_samples() -> None:
    plant = one_body()
    late = attached("delay", "motor", {"delay": 0.013}).attach(plant)
    assert late.input_delays_s == (0.013,)
    assert not late.delays
    ratio = late.frequency_response(FREQUENCY_HZ) / plant.frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(ratio, np.broadcast_to(np.exp(-S * 0.013), ratio.shape), rtol=1e-11)


def test_two_delays_add_up() -> None:
    once = attached("delay", "motor", {"delay": 0.013}).attach(one_body())
    assert attached("delay", "motor", {"delay": 0.007}).attach(once).input_delays_s == (0.02,)


def test_in_a_loop_it_is_a_delay_line_and_gives_the_loops_closed_form() -> None:
    late = attached("delay", "motor", {"delay": 0.004}).attach(with_loop(one_body(), gain=300.0))
    assert late.delays == (DelayLine(port=4, delay_s=0.004),)
    assert late.input_delays_s == (0.0,)
    open_loop = 300.0 * np.exp(-0.004 * S) / (MASS * S**2 + DAMPING * S + STIFFNESS)
    np.testing.assert_allclose(late.frequency_response(FREQUENCY_HZ)[2, 0], open_loop / (1 + open_loop), rtol=1e-10)


def test_behind_a_lag_it_still_delays_the_samples() -> None:
    # Both are linear and don't change with time: their order makes no difference.
    lagged = attached("lag", "motor", {"time_constant": 0.02}).attach(one_body())
    late = attached("delay", "motor", {"delay": 0.013}).attach(lagged)
    assert late.input_delays_s == (0.013,)
    wanted = np.exp(-S * 0.013) / (0.02 * S + 1) / (MASS * S**2 + DAMPING * S + STIFFNESS)
    np.testing.assert_allclose(late.frequency_response(FREQUENCY_HZ)[2, 0], wanted, rtol=1e-10)


def test_in_a_loop_delay_and_lag_act_one_after_the_other() -> None:
    plant = with_loop(one_body(), gain=300.0)
    late = attached("delay", "motor", {"delay": 0.004}).attach(plant)
    both = attached("lag", "motor", {"time_constant": 0.003}).attach(late)
    twice = attached("delay", "motor", {"delay": 0.002}).attach(both)
    open_loop = 300.0 * np.exp(-0.006 * S) / (0.003 * S + 1) / (MASS * S**2 + DAMPING * S + STIFFNESS)
    np.testing.assert_allclose(twice.frequency_response(FREQUENCY_HZ)[2, 0], open_loop / (1 + open_loop), rtol=1e-10)


def test_no_delay_leaves_the_model_as_it_is() -> None:
    plant = with_loop(one_body())
    assert attached("delay", "motor", {"delay": 0.0}).attach(plant) is plant


def test_at_a_reference_it_delays_the_references_samples() -> None:
    late = attached("delay", "reference", {"delay": 0.1}).attach(with_loop(one_body()))
    assert late.input_delays_s == (0.1,)
    assert not late.delays


@pytest.mark.parametrize("delay_s", [0.001, 0.3])
def test_at_an_input_beside_another_one_it_delays_only_its_own(delay_s: float) -> None:
    from tests.models.structures.made_models import tree

    late = attached("delay", "actuator", {"delay": delay_s}).attach(tree().compile())
    assert late.input_delays_s == (0.0, delay_s, 0.0)
