from math import pi

import numpy as np

from chladni.models.effects.attached_effect import attached
from tests.models.effects.small_models import one_body, with_loop

FREQUENCY_HZ = np.linspace(0.1, 20.0, 30)


def test_one_channel_is_late_and_offsets_add_up() -> None:
    late = attached("time_offset", "speed", {"offset": 0.03}).attach(one_body())
    late = attached("time_offset", "speed", {"offset": -0.01}).attach(late)
    assert late.output_offsets_s == (0.0, 0.03 - 0.01, 0.0)
    ratio = late.frequency_response(FREQUENCY_HZ) / one_body().frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(ratio[1, 0], np.exp(-2j * pi * FREQUENCY_HZ * 0.02), rtol=1e-11)
    np.testing.assert_allclose(ratio[[0, 2], 0], 1.0, rtol=1e-14)


def test_a_clock_of_the_log_is_none_of_the_controllers_business() -> None:
    late = with_loop(attached("time_offset", "place", {"offset": 0.03}).attach(one_body(), in_loop=True))
    assert late.output_offsets_s == (0.0, 0.0, 0.03)
    ratio = late.frequency_response(FREQUENCY_HZ) / with_loop(one_body()).frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(ratio[:2], 1.0, rtol=1e-14)
