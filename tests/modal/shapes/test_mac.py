"""MAC: closed forms, invariance, channels that two sets share, and two other programs as witnesses."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.shapes.mac import auto_mac, cross_mac, mac, parallel_sign, shape_mac, shared_channels
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.mode_set import ModeSet
from tests import strategies as ours
from tests.modal.mode_makers import mode_set

X, MINUS_X, Y = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
EPSILON = float(np.finfo(float).eps)


def place(name: str, point: str | None = None, direction: tuple[float, float, float] | None = None) -> Channel:
    return Channel(name=name, unit="m/s^2", point=point, direction=direction)


def test_sines_on_a_string_are_orthogonal() -> None:
    points = np.arange(1, 8) / 8
    shapes = np.sin(np.pi * np.outer(np.arange(1, 8), points))
    np.testing.assert_allclose(shape_mac(shapes, shapes), np.eye(7), atol=20 * EPSILON)


def test_two_vectors_at_a_known_angle() -> None:
    angle = 0.3
    shapes = np.array([[1.0, 0.0], [np.cos(angle), np.sin(angle)]])
    np.testing.assert_allclose(shape_mac(shapes[:1], shapes[1:]), [[np.cos(angle) ** 2]], rtol=4 * EPSILON)


def test_one_mode_gives_a_matrix_too() -> None:
    assert shape_mac([1.0, 2.0], [1.0, 2.0]).shape == (1, 1)
    assert shape_mac([1.0, 2.0], [[1.0, 2.0], [0.0, 1.0], [1.0, 0.0]]).shape == (1, 3)
    assert shape_mac(np.zeros((0, 3)), [[1.0, 2.0, 3.0]]).shape == (0, 1)


@given(st.data())
def test_a_complex_factor_changes_nothing(data: st.DataObject) -> None:
    modes = data.draw(ours.mode_sets(min_modes=1))
    factor = 10.0 ** data.draw(st.floats(-150, 150)) * np.exp(1j * data.draw(st.floats(0, 7)))
    reference = shape_mac(modes.shapes, modes.shapes)
    tolerance = 8 * len(modes.channels) * EPSILON
    np.testing.assert_allclose(shape_mac(factor * modes.shapes, modes.shapes), reference, atol=tolerance)
    np.testing.assert_allclose(np.diag(auto_mac(modes)), 1.0, atol=tolerance)
    np.testing.assert_allclose(auto_mac(modes), auto_mac(modes).T, atol=tolerance)
    assert np.all((auto_mac(modes) >= 0) & (auto_mac(modes) <= 1))


def test_other_programs_agree() -> None:
    # Importing it tells NumPy for good to be silent about 0/0, which would hide ours in every later test.
    with warnings.catch_warnings(), np.errstate():
        warnings.simplefilter("ignore")  # their imports warn about their own dependencies
        from pyoma2.functions.gen import MAC as MAC_PYOMA
        from sdypy.EMA.tools import MAC as MAC_SDYPY

        rng = np.random.default_rng(1)
        a, b = (rng.normal(size=(4, 6)) + 1j * rng.normal(size=(4, 6)) for _ in range(2))
        np.testing.assert_allclose(shape_mac(a, b), MAC_PYOMA(a.T, b.T), rtol=1e-13)
        np.testing.assert_allclose(shape_mac(a, b), MAC_SDYPY(a.T, b.T), rtol=1e-13)


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ([1.0, 2.0], [1.0, 2.0, 3.0], "2 and 3 channels"),
        ([[1.0, 2.0], [0.0, 0.0]], [1.0, 2.0], "shape 1 of a is zero"),
        ([1.0, 2.0], [1.0, float("nan")], "b holds NaN"),
        (np.zeros((2, 0)), np.zeros((2, 0)), "at least one channel"),
        (np.zeros((2, 2, 2)), np.zeros((2, 2)), r"\[mode, channel\]"),
    ],
)
def test_what_cant_be_compared_is_refused(a: object, b: object, words: str) -> None:
    with pytest.raises(EstimateError, match=words):
        shape_mac(a, b)  # type: ignore[arg-type]  # some of them are no numbers on purpose


def test_names_go_before_places_and_a_turned_sensor_changes_its_sign() -> None:
    a = (place("a1", "wrist", X), place("a2", "wrist", X), place("a3", "elbow", X), place("a4", "base", X))
    b = (
        place("b3", "elbow", MINUS_X),
        place("a2", "wrist", X),
        place("b1", "wrist", MINUS_X),
        place("a4", "base", Y),
    )
    found = [(pair.row_a, pair.row_b, pair.sign) for pair in shared_channels(a, b)]
    assert found == [(0, 2, -1.0), (1, 1, 1.0), (2, 0, -1.0)], "a4 was turned to another axis"


def test_sets_are_compared_over_shared_channels() -> None:
    a = mode_set(np.array([[1.0, 0.5, 0.2], [0.1, 1.0, -0.4]]), names=("p", "q", "r"))
    b = mode_set(np.array([[-0.4, 9.0, 1.0]]), names=("r", "z", "q"))
    np.testing.assert_allclose(cross_mac(a, b), shape_mac(a.shapes[:, 1:], [1.0, -0.4]), rtol=4 * EPSILON)
    assert cross_mac(a, b).shape == (2, 1)


def test_opposite_sensors_give_the_same_shape() -> None:
    modes = mode_set(np.array([[1.0, 0.5]]), names=("p", "q"))
    here = replace(modes, channels=(place("p", "one", X), place("q", "two", X)))
    there = replace(
        here, shapes=np.array([[-1.0 + 0j, 0.5]]), channels=(place("s", "one", MINUS_X), here.channels[1])
    )
    np.testing.assert_allclose(cross_mac(here, there), [[1.0]], rtol=4 * EPSILON)


def test_no_shared_channel_names_both_sides() -> None:
    a = mode_set(np.array([[1.0, 0.5]]), names=("p", "q"))
    b = mode_set(np.array([[1.0]]), names=("z",))
    with pytest.raises(EstimateError, match="one has p, q, the other z; channels are shared by name, or by point"):
        cross_mac(a, b)


def test_parallel_directions() -> None:
    assert parallel_sign(X, X) == 1.0
    assert parallel_sign(X, MINUS_X) == -1.0
    assert parallel_sign(X, Y) is None
    assert parallel_sign(X, None) is None


def sets(shapes):
    hertz = np.arange(1.0, len(shapes) + 1)
    return ModeSet.from_arrays(hertz, shapes, rows="modes")


def test_an_array_against_a_set_is_read_the_way_that_fits():
    shapes = np.random.default_rng(2).standard_normal((2, 5))
    modes = sets(shapes)
    for other in (shapes, shapes.T, modes):
        np.testing.assert_allclose(mac(modes, other), shape_mac(shapes, shapes), rtol=1e-12)
    np.testing.assert_array_equal(mac(modes, shapes).a_hz, [1.0, 2.0])
    assert np.isnan(mac(modes, shapes).b_hz).all()


def test_shapes_by_columns_against_rows_of_a_square_set_are_refused_until_told():
    """Of dof x mode against rows of the same shapes a guess gave 0.19 where the answer is identity."""
    shapes = np.linalg.qr(np.random.default_rng(3).standard_normal((4, 4)))[0]
    modes = sets(shapes)
    with pytest.raises(EstimateError, match=r"fit as .mode, channel. and as .channel, mode.; say rows='modes'"):
        mac(modes, shapes.T)
    np.testing.assert_allclose(mac(modes, shapes.T, rows="channels"), np.eye(4), atol=1e-12)
    with pytest.raises(EstimateError, match=r"shapes \(3, 8\) and \(3, 8\) fit as"):
        mac(np.ones((3, 8)), np.ones((3, 8)))
    assert mac(np.eye(3), rows="modes")[0, 0] == 1.0


def test_shapes_over_other_channels_are_refused():
    with pytest.raises(EstimateError, match="no channels in common"):
        mac(np.ones((2, 5)), np.ones((4, 3)))


def test_a_mac_is_a_plain_matrix_to_numpy():
    found = mac(np.eye(3), rows="modes")
    assert found.shape == (3, 3)
    assert ((found > 0.5) == np.eye(3, dtype=bool)).all()
    np.testing.assert_array_equal(1 - found, 1 - np.eye(3))
    assert np.trace(found) == 3.0
