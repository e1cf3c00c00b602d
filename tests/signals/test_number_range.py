import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import (
    LARGEST,
    SMALLEST,
    largest_magnitudes,
    out_of_range,
    require_in_range,
    rms,
)

NOISE = np.random.default_rng(5).standard_normal((3, 200))
CHANNELS = tuple(Channel(name=name, unit="N") for name in "abc")


def test_numbers_in_range_can_be_squared_twice_and_so_can_their_last_bits():
    tiny = np.finfo(np.float64).tiny
    assert (SMALLEST * np.finfo(np.float64).eps) ** 4 > tiny
    assert np.isfinite((LARGEST * 2.0**40) ** 4)


@given(exponent=st.integers(-1000, 1000))
def test_the_rms_scales_with_any_power_of_two_to_the_last_bit(exponent):
    np.testing.assert_array_equal(rms(np.ldexp(NOISE, exponent)), np.ldexp(rms(NOISE), exponent))


def test_the_rms_is_the_plain_one_where_squares_are_numbers():
    np.testing.assert_allclose(rms(NOISE), np.sqrt(np.mean(NOISE**2, axis=1)), rtol=4e-16)


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-200, 1e200, 1.7e308, 0.0])
def test_the_rms_of_a_constant_is_its_size(size):
    assert rms(np.full((1, 7), -size)) == pytest.approx(size, rel=1e-15)


def test_the_rms_of_nothing_and_of_single_precision():
    np.testing.assert_array_equal(rms(np.zeros((2, 4))), [0.0, 0.0])
    assert rms(np.full((1, 4), 3e38, dtype=np.float32))[0] == np.float32(3e38)


def test_magnitudes_are_looked_for_within_runs_only():
    values = np.array([[1.0, -7.0, 2.0, np.nan], [0.0, 0.0, 3.0, 4.0]])
    np.testing.assert_array_equal(largest_magnitudes(values, [(0, 1), (2, 3)]), [2.0, 3.0])
    np.testing.assert_array_equal(largest_magnitudes(values[:, :2]), [7.0, 0.0])
    assert np.isnan(largest_magnitudes(values)[0])


@pytest.mark.parametrize("largest", [0.0, SMALLEST, 1e-45, 1.0, 3.4e38, LARGEST])
def test_zeros_and_all_that_single_precision_holds_are_in_range(largest):
    assert out_of_range(largest) is None


@pytest.mark.parametrize("largest", [5e-324, 1e-100, 1e100, np.inf])
def test_a_channel_out_of_range_is_named_with_its_largest_value_and_the_others_counted(largest):
    with pytest.raises(EstimateError, match=rf"channel 'b' holds .*{largest:.3g}".replace("+", r"\+")) as told:
        require_in_range(CHANNELS, np.array([1.0, largest, largest]))
    assert "leave the channel out" in str(told.value)
    assert str(told.value).endswith("(and 1 more channel like it)")
