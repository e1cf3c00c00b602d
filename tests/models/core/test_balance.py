import numpy as np

from chladni.models.core.balance import balance


def test_scales_are_powers_of_two_and_undo_exactly():
    rng = np.random.default_rng(3)
    sizes = 10.0 ** rng.uniform(-9, 9, 5)
    matrix = rng.standard_normal((5, 5)) * sizes[:, None] / sizes
    balanced, scale = balance(matrix)
    np.testing.assert_array_equal(np.log2(scale) % 1, 0)
    np.testing.assert_array_equal(balanced * scale[:, None] / scale, matrix)
    # What is left differs by the random entries and by less than two for each scale, not by the units.
    rows = np.abs(balanced).sum(axis=1)
    assert rows.max() / rows.min() < 100


def test_units_that_no_integer_holds_do_not_warn():
    huge = 2.0**70
    balanced, _ = balance(np.array([[1.0, huge], [1.0 / huge, 1.0]]))
    assert np.abs(balanced).max() < 4
