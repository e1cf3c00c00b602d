"""A hidden law must do what its word means."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.blind.acting import all_act
from chladni.gap.blind.case_draw import Order, draw_case
from chladni.gap.blind.performance import perform
from chladni.gap.blind.plan import Hidden

#: So weak that it moves nothing.
RIPPLE = {
    "amplitude": 1e-9, "phase": 0.3, "second": 0.0, "second_phase": 0.0, "third": 0.0, "third_phase": 0.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def case():
    # Its log is among the shortest.
    return draw_case(Order(kind="effect", words=("hysteresis",)), np.random.default_rng(7))


@pytest.mark.parametrize(("share", "opens"), [(0.5, True), (1.5, True), (2.5, False), (20.0, False)])
def test_a_loop_opens_where_half_of_its_yield_is_moved(case, share, opens):
    (loop,) = case.effects
    way = perform(case.bench, case.numbers, case.drive, watched=True)[f"{loop.site}.d"]
    # So weak that it doesn't hold the joint back.
    weak = replace(loop, numbers={**loop.numbers, "force": 1e-9, "yield": share * 0.5 * np.ptp(way)})
    assert all_act(case.bench, case.numbers, case.drive, (weak,)) == opens


@pytest.mark.parametrize("place", ["joint", "input"])
@pytest.mark.parametrize(("periods", "repeats"), [(1.9, False), (2.1, True)])
def test_a_ripple_repeats_from_two_periods_on(case, place, periods, repeats):
    plan = case.bench.plan
    site, signal = (plan.joints[0].name, "d") if place == "joint" else (plan.inputs[0].name, "x")
    way = np.ptp(perform(case.bench, case.numbers, case.drive, watched=True)[f"{site}.{signal}"])
    ripple = Hidden(effect="ripple", site=site, law="ripple", numbers={**RIPPLE, "period": way / periods})
    assert all_act(case.bench, case.numbers, case.drive, (ripple,)) == repeats


def test_what_is_no_loop_needn_t_open(case):
    assert all_act(case.bench, case.numbers, case.drive, ())
