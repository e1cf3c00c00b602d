"""Which pole stands for a mode, and the least error bar a record allows."""

from math import pi

import numpy as np
import pytest

from chladni.modal.poles.certain_poles import certain_pole, least_std, pole_std
from chladni.modal.poles.pole_table import PoleTable


def table(frequency_hz, damping, frequency_std_hz, damping_std, *, with_std=True):
    omega = 2 * pi * np.array(frequency_hz)
    zeta = np.array(damping)
    orders = np.arange(2, 2 + 2 * omega.size, 2)
    return PoleTable(
        orders=orders,
        order=orders,
        pole=-zeta * omega + 1j * omega * np.sqrt(1 - zeta**2),
        vector=np.ones((omega.size, 1), complex),
        frequency_std_hz=np.array(frequency_std_hz) if with_std else None,
        damping_std=np.array(damping_std) if with_std else None,
    )


def test_the_surest_pole_that_the_others_bear_out_is_taken():
    # The lowest order looks surest, but is five of its sigmas off: it merges two modes.
    poles = table([10.5, 10.0, 10.01, 10.0], [0.01] * 4, [0.1, 0.2, 0.3, 0.4], [0.001, 0.002, 0.003, 0.004])
    assert certain_pole(poles, np.arange(4)) == 1
    assert certain_pole(poles, np.arange(4), least_order=5) == 2
    # No pole of so high an order: the cluster as it is.
    assert certain_pole(poles, np.arange(4), least_order=50) == 1


def test_damping_must_agree_too():
    poles = table([10.0] * 3, [0.02, 0.01, 0.01], [0.1, 0.2, 0.3], [0.001, 0.002, 0.003])
    assert certain_pole(poles, np.arange(3)) == 1


def test_where_none_agrees_the_nearest_in_sigmas_is_taken():
    poles = table([10.0, 11.0], [0.01, 0.01], [0.1, 0.2], [0.001, 0.001])
    assert certain_pole(poles, np.arange(2)) == 1


def test_a_table_without_error_bars_knows_nothing():
    assert np.isinf(pole_std(table([1.0], [0.01], [0.1], [0.1], with_std=False), np.arange(1))).all()


def test_the_least_error_bar_is_the_published_one():
    # Au's law for the first three modes of the building: 0.93, 1.03, 1.10 mHz in 90 min.
    std_hz, damping_std = least_std(np.array([1.882, 2.4217, 2.687]), np.array([0.0157, 0.0150, 0.0153]), 5400.0)
    np.testing.assert_allclose(std_hz * 1e3, [0.93, 1.03, 1.10], atol=0.006)
    assert damping_std[0] == pytest.approx(std_hz[0] / 1.882)
