from math import pi, sqrt

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.small_models import one_body


def test_three_decibels_and_45_degrees_at_the_corner() -> None:
    at = np.array([2.0])
    before = one_body().frequency_response(at)[0, 0, 0]
    coupled = attached("ac_coupling", "acc", {"corner": 2.0}).attach(one_body())
    assert coupled.frequency_response(at)[0, 0, 0] / before == pytest.approx((1 + 1j) / 2, rel=1e-12)
    assert abs((1 + 1j) / 2) == pytest.approx(1 / sqrt(2))


def test_the_response_is_that_of_a_first_order_high_pass() -> None:
    frequency_hz = np.linspace(0.0, 30.0, 50)
    s = 2j * pi * frequency_hz
    before = one_body().frequency_response(frequency_hz)
    after = attached("ac_coupling", "place", {"corner": 0.7}).attach(one_body()).frequency_response(frequency_hz)
    np.testing.assert_allclose(after[2, 0], before[2, 0] * s / (s + 2 * pi * 0.7), rtol=1e-10, atol=1e-18)


def test_a_corner_at_zero_leaves_the_model_as_it_is() -> None:
    plant = one_body()
    assert attached("ac_coupling", "acc", {"corner": 0.0}).attach(plant) is plant


def test_two_stages_multiply() -> None:
    frequency_hz = np.linspace(0.0, 30.0, 50)
    s, first, second = 2j * pi * frequency_hz, 2 * pi * 0.4, 2 * pi * 0.9
    # Corners of 0.4 and 0.9 Hz are one of 0.6 Hz, their geometric mean, damped by their arithmetic over it.
    coupled = attached(
        "ac_coupling", "place", {"corner": 0.6, "damping_ratio": 0.65 / 0.6}, variant="second_order"
    ).attach(one_body())
    before = one_body().frequency_response(frequency_hz)[2, 0]
    expected = before * s / (s + first) * s / (s + second)
    np.testing.assert_allclose(coupled.frequency_response(frequency_hz)[2, 0], expected, rtol=1e-10, atol=1e-18)
