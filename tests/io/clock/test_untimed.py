"""Stamps that are no time are told from clocks that were set, wherever they stand."""

import numpy as np
import pytest

from chladni.io.clock.stray_stamps import untimed
from chladni.signals.arrays import Mask, Whole
from tests.make_logs import START_NS

COUNT = 500
STEP_NS = 10_000_000
EVEN = np.arange(COUNT) * STEP_NS
LOGGED = START_NS + 2_000_000 + EVEN
YEAR_NS = 31_557_600 * 10**9

WHERE = {
    "first": [0],
    "amid": [200],
    "last": [COUNT - 1],
    "some in a row": [30, 31, 32, 33],
    "often": range(0, COUNT, 4),
}
WHAT = {
    "zero": 0,
    "soon after 1970": 12_345_678_901,
    "2100": 4_102_444_800 * 10**9,
    "a year before": START_NS - YEAR_NS,
    "an hour late": START_NS + 3600 * 10**9,
}


def mask(places: object) -> Mask:
    told = np.zeros(COUNT, np.bool_)
    told[list(places)] = True  # type: ignore[call-overload]
    return told


@pytest.mark.parametrize("what", WHAT.values(), ids=WHAT.keys())
@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
def test_own_stamps_that_are_no_time(where: object, what: int) -> None:
    wrong = mask(where)
    np.testing.assert_array_equal(untimed(np.where(wrong, what, START_NS + EVEN), LOGGED), wrong)


@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
def test_log_times_that_are_no_time(where: object) -> None:
    """Nothing else tells the time then, and only what's many days away can't be one."""
    wrong = mask(where)
    np.testing.assert_array_equal(untimed(np.where(wrong, 0, LOGGED), None), wrong)
    assert untimed(np.where(wrong, LOGGED + 3600 * 10**9, LOGGED), None) is None


def test_a_log_time_that_is_none_does_not_make_the_log_long() -> None:
    wrong, logged = mask([7]), LOGGED.copy()
    logged[100] = 0
    np.testing.assert_array_equal(untimed(np.where(wrong, 0, START_NS + EVEN), logged), wrong)


def simulated() -> Whole:
    """Time from 0, whose first stamp is one."""
    return EVEN


def episodes() -> Whole:
    return EVEN % (12 * STEP_NS)


def set_after_a_while() -> Whole:
    """From when the machine was switched on, until the network told the time."""
    return np.where(np.arange(COUNT) < 40, EVEN, START_NS + EVEN)


def late() -> Whole:
    """One message that was held up for 3 s, longer than the slack of a sound log by nothing."""
    stamps = START_NS + EVEN
    stamps[300] -= 3 * 10**9
    return stamps


def sampled_fast() -> Whole:
    """A simulation of hours that takes seconds."""
    return EVEN * 5000


CLOCKS = [simulated, episodes, set_after_a_while, late, sampled_fast]


@pytest.mark.parametrize("clock", CLOCKS)
def test_clocks_that_are_right_or_were_set_keep_all_their_stamps(clock: object) -> None:
    assert callable(clock)
    assert untimed(clock(), LOGGED) is None


def test_a_pause_is_a_time_that_the_log_confirms() -> None:
    # One message, and the others an hour later.
    stamps = START_NS + EVEN + 3600 * 10**9
    stamps[0] = START_NS
    assert untimed(stamps, stamps + 1000) is None


@pytest.mark.parametrize("stamps", [[], [0], [0, 0, 0]])
def test_nothing_can_be_said_of_a_few(stamps: list[int]) -> None:
    few = np.array(stamps, np.int64)
    assert untimed(few, LOGGED[: few.size]) is None


def test_of_two_the_one_that_the_log_confirms_is_a_time() -> None:
    np.testing.assert_array_equal(untimed(np.array([0, START_NS]), LOGGED[:2]), [True, False])
