"""Choosing some of the modes keeps all that belongs to them together."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from tests.viewers.synthetic_modes import arm_study, modes_of

MODES = modes_of(arm_study())


def test_some_modes_keep_their_numbers_together():
    rows = np.array([1, 3])
    chosen = MODES.select(rows)
    for name in ("frequency_hz", "damping_ratio", "frequency_std_hz", "damping_std", "shapes", "shape_std"):
        np.testing.assert_array_equal(getattr(chosen, name), getattr(MODES, name)[rows])
    np.testing.assert_array_equal(chosen.participation, MODES.participation[rows])
    np.testing.assert_array_equal(chosen.scale.modal_mass, MODES.scale.modal_mass[rows])
    np.testing.assert_array_equal(chosen.spread.orders, MODES.spread.orders[rows])
    assert chosen.fit is MODES.fit
    assert chosen.channels == MODES.channels


def test_poles_get_the_numbers_that_their_modes_have_now():
    before, after = MODES.stabilisation.mode, MODES.select(np.array([1, 3])).stabilisation.mode
    np.testing.assert_array_equal(after[before == 1], 0)
    np.testing.assert_array_equal(after[before == 3], 1)
    assert set(after[~np.isin(before, [1, 3])].tolist()) == {-1}


def test_modes_without_the_rest_are_chosen_too():
    bare = replace(MODES, participation=None, scale=None, spread=None, stabilisation=None, fit=None)
    chosen = bare.select(np.array([0]))
    assert chosen.scale is None
    assert chosen.stabilisation is None


def test_a_fit_of_other_functions_is_refused():
    with pytest.raises(EstimateError, match=r"fit\.function_error has shape"):
        replace(MODES, references=(), participation=None)
