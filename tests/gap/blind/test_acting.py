"""A hidden law must do what its word means."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.blind.acting import loops_open
from chladni.gap.blind.case_draw import Order, draw_case
from chladni.gap.blind.performance import perform


@pytest.fixture(scope="module")
def case():
    return draw_case(Order(kind="effect", words=("hysteresis",)), np.random.default_rng(4))


@pytest.mark.parametrize(("share", "opens"), [(0.5, True), (1.5, True), (2.5, False), (20.0, False)])
def test_a_loop_opens_where_half_of_its_yield_is_moved(case, share, opens):
    (loop,) = case.effects
    way = perform(case.bench, case.numbers, case.drive, watched=True)[f"{loop.site}.d"]
    # So weak that it doesn't hold the joint back.
    weak = replace(loop, numbers={**loop.numbers, "force": 1e-9, "yield": share * 0.5 * np.ptp(way)})
    assert loops_open(case.bench, case.numbers, case.drive, (weak,)) == opens


def test_what_is_no_loop_needn_t_open(case):
    assert loops_open(case.bench, case.numbers, case.drive, ())
