import numpy as np

from chladni.models.schemes.derivative_filter import filtered_derivatives, lag_names


def test_powers_become_powers_of_a_lagged_derivative() -> None:
    a, b, c = np.array([[-1.0]]), np.array([[2.0, 0.0]]), np.array([[3.0], [0.0]])
    d = np.zeros((3, 2, 2))
    d[0] = [[0.5, 0.0], [0.0, 1.0]]
    d[1, 0, 1], d[2, 0, 1], d[2, 1, 0] = 4.0, 5.0, 6.0
    time_s, s = 0.05, 1.3 + 2.1j
    found = filtered_derivatives(a, b, c, d, filter_time_s=time_s)
    assert (found.sources, found.orders) == ((0, 1, 1), (2, 1, 2))
    response = found.c @ np.linalg.solve(s * np.eye(5) - found.a, found.b) + found.d
    lagged = s / (time_s * s + 1)
    expected = c @ np.linalg.solve(s * np.eye(1) - a, b) + d[0] + lagged * d[1] + lagged**2 * d[2]
    np.testing.assert_allclose(response[:2, :2], expected, rtol=1e-12)
    # The ideal rest enters as the derivative would, and its ports see the columns themselves.
    np.testing.assert_allclose(response[:2, 2:], [[0, 4.0, 5.0], [6.0, 0, 0]])
    np.testing.assert_allclose(response[2:, :2], [[1, 0], [0, 1], [0, 1]])
    assert lag_names(found.sources, found.orders, ["u", "w"]) == ["u.lag1", "u.lag2", "w.lag1", "w.lag2"]


def test_a_proper_system_stays_as_it_is() -> None:
    a, b, c = -np.eye(2), np.ones((2, 1)), np.ones((1, 2))
    found = filtered_derivatives(a, b, c, np.full((1, 1, 1), 7.0), filter_time_s=1e-3)
    assert found.sources == ()
    np.testing.assert_array_equal(found.a, a)
    np.testing.assert_array_equal(found.d, [[7.0]])
