"""Places of labels beside each other, against SciPy's isotonic regression."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import isotonic_regression

from chladni.viewers.figures.peak_labels import _not_falling, apart


@given(st.lists(st.floats(-1e3, 1e3), max_size=12))
def test_pools_are_those_of_scipy(values):
    given_values = np.array(values, dtype=np.float64)
    # SciPy wants one value at least.
    wanted = isotonic_regression(given_values).x if values else given_values
    np.testing.assert_allclose(_not_falling(given_values), wanted, rtol=1e-12, atol=1e-9)


def test_labels_stay_inside():
    moved = apart(np.array([0.97, 0.98, 0.99]), 0.1)
    np.testing.assert_allclose(np.diff(moved), 0.1)
    assert moved.max() <= 1.0
