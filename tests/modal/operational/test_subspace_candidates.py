"""One mode that models of several orders told twice is one mode."""

import numpy as np
import pytest

from chladni.modal.operational.subspace_candidates import ResponseRules, _repeated
from chladni.modal.poles.pole_table import PoleTable

UP, ACROSS = np.array([1.0, 0.0], complex), np.array([0.0, 1.0], complex)


def pole(frequency_hz, damping):
    return 2 * np.pi * frequency_hz * (-damping + 1j * np.sqrt(1 - damping**2))


def two_clusters(orders, frequencies_hz, vectors, *, damping=0.01):
    """Two clusters, each with its pole in the orders given for it."""
    order = np.concatenate(orders)
    first, second = np.arange(len(orders[0])), np.arange(len(orders[1])) + len(orders[0])
    which = np.repeat([0, 1], [first.size, second.size])
    rising = np.argsort(order, kind="stable")
    table = PoleTable(
        orders=np.unique(order),
        order=order[rising],
        pole=np.array([pole(f, damping) for f in frequencies_hz])[which][rising],
        vector=np.array(vectors)[which][rising],
    )
    clusters = [np.flatnonzero(np.isin(rising, rows)) for rows in (first, second)]
    return table, np.array([cluster[0] for cluster in clusters]), clusters


@pytest.mark.parametrize(
    ("orders", "vectors", "repeated"),
    [
        (([10, 20, 30], [10, 20]), (UP, UP), [False, True]),
        (([10, 20, 30], [10, 20]), (UP, ACROSS), [False, False]),
        (([10, 20, 30], [40, 50]), (UP, ACROSS), [False, True]),
        (([10, 20], [30, 40, 50]), (UP, ACROSS), [True, False]),
    ],
    ids=["one shape", "two shapes in one model", "two shapes in no model", "the fewer orders go"],
)
def test_twins_are_one_mode_when_no_model_tells_them_apart(orders, vectors, repeated):
    found = _repeated(*two_clusters(orders, (10.0, 10.05), vectors), ResponseRules())
    assert found.tolist() == repeated


def test_what_is_further_apart_than_half_a_half_power_width_is_two_modes():
    found = _repeated(*two_clusters(([10, 20, 30], [40, 50]), (10.0, 10.2), (UP, UP)), ResponseRules())
    assert found.tolist() == [False, False]
