import numpy as np
import pytest

from chladni.models.schemes.descriptor import MAX_POWER, Descriptor, reduced
from chladni.signals.errors import ModelError


def descriptor(e: np.ndarray, r_r: np.ndarray, r_w: np.ndarray) -> Descriptor:
    """Without states of its own: E r' = Rr r + sum_k Rw[k] w^(k)."""
    count, inputs = r_r.shape[0], r_w.shape[2]
    return Descriptor(
        x_x=np.zeros((0, 0)),
        x_r=np.zeros((0, count)),
        x_w=np.zeros((r_w.shape[0], 0, inputs)),
        e=e,
        r_x=np.zeros((count, 0)),
        r_r=r_r,
        r_w=r_w,
        preferred=np.ones(count, dtype=bool),
    )


def response(given: Descriptor, s: complex) -> np.ndarray:
    result = reduced(given)
    states = np.linalg.solve(s * np.eye(result.a.shape[0]) - result.a, result.b)
    return result.c @ states + sum(part * s**power for power, part in enumerate(result.d))


def test_a_chain_of_derivatives_is_a_polynomial() -> None:
    # r1 = w, r2 = r1', r3 = r2': E r' = r - [w, 0, 0].
    e, r_w = np.eye(3, k=-1), np.zeros((1, 3, 1))
    r_w[0, 0, 0] = -1.0
    result = reduced(descriptor(e, np.eye(3), r_w))
    assert result.a.shape == (0, 0)
    s = 0.3 + 0.7j
    np.testing.assert_allclose(response(descriptor(e, np.eye(3), r_w), s)[:, 0], [1, s, s**2])


def test_too_many_derivatives_are_refused() -> None:
    count = MAX_POWER + 3
    r_w = np.zeros((1, count, 1))
    r_w[0, 0, 0] = -1.0
    with pytest.raises(ModelError, match="differentiated more than 10 times"):
        reduced(descriptor(np.eye(count, k=-1), np.eye(count), r_w))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("rank", [1, 2, 3])
def test_any_pencil_gives_its_transfer_function(rank: int, scale: float) -> None:
    rng = np.random.default_rng(rank)
    # E of any rank, each unknown in a unit of its own.
    units = scale ** np.arange(4)
    e = rng.normal(size=(4, rank)) @ rng.normal(size=(rank, 4)) * units
    r_r, r_w = rng.normal(size=(4, 4)) * units, rng.normal(size=(2, 4, 2))
    s = 0.8 - 0.6j
    expected = np.linalg.solve((s * e - r_r) / units, r_w[0] + s * r_w[1]) / units[:, None]
    found = response(descriptor(e, r_r, r_w), s)
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_equations_that_repeat_each_other_are_refused() -> None:
    with pytest.raises(ModelError, match="do not determine every signal"):
        reduced(descriptor(np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 4.0]]), np.zeros((1, 2, 1))))
