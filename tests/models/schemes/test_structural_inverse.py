import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.schemes.structural_inverse import structural_inverse, total
from chladni.signals.errors import ModelError


def test_cancelling_sums_are_exactly_zero() -> None:
    row, column = np.array([[1.0, 1.0]]), np.array([[0.1], [0.2]])
    assert (row @ column - 0.3)[0, 0] != 0
    assert total((row, column), np.array([[-0.3]]))[0, 0] == 0
    assert total((row, column), np.array([[-0.2]]))[0, 0] == pytest.approx(0.1)


@given(st.integers(2, 8), st.integers(0, 2**32 - 1))
def test_inverse_of_a_permuted_triangle_keeps_its_zeros(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Small diagonals make the elimination exchange rows, which is where rounding fills zeros.
    lower = np.tril(rng.uniform(1, 5, (count, count)), -1) + np.diag(rng.uniform(0.1, 0.2, count))
    row, column = rng.permutation(count), rng.permutation(count)
    found = structural_inverse(lower[np.ix_(row, column)])
    expected = np.zeros_like(lower)
    expected[np.ix_(np.arange(count), np.arange(count))] = np.linalg.inv(lower)
    back = found[np.ix_(np.argsort(column), np.argsort(row))]
    assert np.all(back[np.triu_indices(count, 1)] == 0)
    np.testing.assert_allclose(back, np.tril(expected), rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_a_matrix_without_a_full_diagonal_is_refused() -> None:
    with pytest.raises(ModelError, match="do not determine every signal"):
        structural_inverse(np.array([[1.0, 2.0], [0.0, 0.0]]))
