"""MPC, mean phase and mean phase deviation: closed forms, invariance, and another program as witness."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.shapes.complexity import deviation_from_noise, mean_phase, phase_collinearity
from chladni.signals.errors import EstimateError
from tests import strategies as ours

EPSILON = float(np.finfo(float).eps)


@given(st.data())
def test_a_real_shape_in_any_phase_is_collinear(data: st.DataObject) -> None:
    phase = data.draw(st.floats(-1.5, 1.5))
    real = np.array(data.draw(st.lists(st.floats(-1, 1, allow_subnormal=False), min_size=2, max_size=9).filter(any)))
    shape = real * np.exp(1j * phase)
    np.testing.assert_allclose(phase_collinearity(shape), [1.0], atol=20 * EPSILON)
    found = mean_phase(shape)
    # The singular vectors are good to an epsilon, so an angle is as well.
    np.testing.assert_allclose(found.deviation_deg, [0.0], atol=1e-13 * 180)
    np.testing.assert_allclose(found.phase_deg, [np.degrees(phase)], atol=1e-12 * 180)


def test_a_circle_has_no_direction() -> None:
    circle = np.exp(2j * np.pi * np.arange(8) / 8)
    np.testing.assert_allclose(phase_collinearity(circle), [0.0], atol=20 * EPSILON)
    many = np.exp(2j * np.pi * np.arange(3600) / 3600)
    # The mean of an angle that is spread evenly over 0 to 90 degrees.
    np.testing.assert_allclose(mean_phase(many).deviation_deg, [45.0], atol=0.02)


def test_an_ellipse_in_closed_form() -> None:
    phases = 2 * np.pi * np.arange(7200) / 7200
    flattening = 0.2
    ellipse = np.cos(phases) + 1j * flattening * np.sin(phases)
    expected = ((1 - flattening**2) / (1 + flattening**2)) ** 2
    turned = ellipse * np.exp(1j * np.radians(30))
    np.testing.assert_allclose(phase_collinearity(turned), [expected], rtol=1e-12)
    np.testing.assert_allclose(mean_phase(turned).phase_deg, [30.0], rtol=1e-12)


def test_an_upright_shape_points_up_not_down() -> None:
    found = mean_phase([[1j, -2j], [-3j, 1j]])
    np.testing.assert_allclose(found.phase_deg, [90.0, 90.0], rtol=1e-12)


@given(ours.mode_sets(min_modes=1), st.floats(-100, 100), st.floats(0.1, 6))
def test_a_complex_factor_changes_only_the_mean_phase(modes, exponent, phase) -> None:  # type: ignore[no-untyped-def]
    factor = 10.0**exponent * np.exp(1j * phase)
    tolerance = 100 * EPSILON
    collinearity = phase_collinearity(modes.shapes)
    np.testing.assert_allclose(phase_collinearity(factor * modes.shapes), collinearity, atol=tolerance)
    if len(modes.channels) == 1:
        assert np.all(np.isnan(collinearity))
        return
    assert np.all((collinearity >= 0) & (collinearity <= 1))
    deviation = mean_phase(modes.shapes).deviation_deg
    assert np.all((deviation >= 0) & (deviation <= 90))
    assert np.all(np.abs(mean_phase(modes.shapes).phase_deg) <= 90)


def test_another_program_agrees() -> None:
    # Importing it tells NumPy for good to be silent about 0/0, which would hide ours in every later test.
    with warnings.catch_warnings(), np.errstate():
        warnings.simplefilter("ignore")  # its imports warn about their own dependencies
        from pyoma2.functions.gen import MPC, MPD
    rng = np.random.default_rng(2)
    shapes = rng.normal(size=(5, 6)) + 0.4j * rng.normal(size=(5, 6))
    # It takes moments about the mean; a shape beside its opposite has the mean zero.
    mirrored = np.hstack([shapes, -shapes])
    np.testing.assert_allclose(phase_collinearity(shapes), [MPC(row) for row in mirrored], rtol=1e-12)
    np.testing.assert_allclose(mean_phase(shapes).deviation_deg, [np.degrees(MPD(row)) for row in shapes], rtol=1e-9)


def test_noise_on_a_real_shape_deviates_as_predicted() -> None:
    rng = np.random.default_rng(3)
    real = np.array([1.0, -0.8, 0.6, 0.5, -0.9])
    std, runs = 0.02, 4000
    noisy = real + std * (rng.normal(size=(runs, 5)) + 1j * rng.normal(size=(runs, 5)))
    predicted = deviation_from_noise(real, np.full(5, std * (1 + 1j)))[0]
    # The best line takes one of the five degrees of freedom across it: the mean square falls by 1/5 at most.
    mean = mean_phase(noisy).deviation_deg.mean()
    assert np.sqrt(4 / 5) * predicted * 0.97 < mean < predicted * 1.03
    turned = deviation_from_noise(1j * real, np.full(5, std * (1 + 0j)))[0]
    assert turned == pytest.approx(predicted, rel=1e-9), "across a shape along j are the errors of its real part"
    np.testing.assert_array_equal(deviation_from_noise(real, np.full(5, np.nan * (1 + 1j))), 0.0)


@pytest.mark.parametrize("wrong", [[0.0, 0.0], [1.0, float("nan")]])
def test_what_has_no_phase_is_refused(wrong: list[float]) -> None:
    with pytest.raises(EstimateError, match="zero at all channels, or holds NaN"):
        mean_phase(wrong)


def test_shapes_without_channels_are_refused() -> None:
    with pytest.raises(EstimateError, match="at least one channel"):
        phase_collinearity(np.zeros((2, 0)))


def test_a_single_channel_has_no_phase_to_compare() -> None:
    shapes = np.array([[1.0], [0.3 + 0.4j]])
    assert np.all(np.isnan(phase_collinearity(shapes)))
    found = mean_phase(shapes)
    assert np.all(np.isnan(found.phase_deg))
    assert np.all(np.isnan(found.deviation_deg))
