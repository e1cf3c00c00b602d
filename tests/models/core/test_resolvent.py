import numpy as np
import pytest

from chladni.models.core.resolvent import resolvent
from chladni.signals.errors import ModelError

S = 2j * np.pi * np.geomspace(1e-2, 1e4, 61)


def test_states_of_very_different_size_keep_their_digits():
    """A piston in m, m/s and Pa: (s I - A)^-1 in closed form."""
    stiff, back, damping = 2.3e-5, 6.5e6, 4.3
    a = np.array([[0.0, 1.0, 0.0], [0.0, -damping, stiff], [0.0, -back, 0.0]])
    below = S * (S + damping) + stiff * back
    found = resolvent(a, S)
    np.testing.assert_allclose(found[:, 1, 2], stiff / below, rtol=1e-12)
    np.testing.assert_allclose(found[:, 0, 2], stiff / below / S, rtol=1e-12)
    np.testing.assert_allclose(found[:, 2, 1], -back / below, rtol=1e-12)
    np.testing.assert_allclose(found[:, 2, 2], (S + damping) / below, rtol=1e-12)


def test_it_is_the_inverse():
    a = np.random.default_rng(4).normal(size=(6, 6))
    eye = np.einsum("pij,pjk->pik", S[:, None, None] * np.eye(6) - a, resolvent(a, S))
    np.testing.assert_allclose(eye, np.broadcast_to(np.eye(6), eye.shape), atol=1e-11)


def test_no_states_have_an_empty_one():
    assert resolvent(np.zeros((0, 0)), S).shape == (61, 0, 0)


def test_an_eigenvalue_has_none():
    with pytest.raises(ModelError, match="a pole at 0 Hz"):
        resolvent(np.zeros((1, 1)), np.zeros(1, complex))


def test_units_may_differ_by_more_than_integers_hold():
    # Balanced by 2^67; a warning would be an error here.
    a = np.array([[-1.0, 1e40], [-1e-40, -1.0]])
    s = np.array([0.5j])
    determinant = (s[0] + 1) ** 2 + 1
    expected = np.array([[s[0] + 1, 1e40], [-1e-40, s[0] + 1]]) / determinant
    np.testing.assert_allclose(resolvent(a, s)[0], expected, rtol=1e-14)
