"""Clocks that were set back or ahead, told from messages that come late, whatever the length of the stretches."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.stamp_order import MAX_CANDIDATES, ClockSteps, arrival_order, find_clock_steps, untangle
from chladni.io.clock.time_base import fit_batch_time_base, fit_time_base
from chladni.io.clock.uniform import message_index, place
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from tests.io.clock.stamp_makers import START_NS, grid, in_bursts, stamps

RATES_HZ = (1.0, 10.0, 250.0, 2000.0)


def restarted(lengths: Whole, rate_hz: float) -> tuple[Whole, Whole]:
    """Stamps that start anew with each stretch, and the first message of each but the first."""
    first = np.cumsum(lengths) - lengths
    number = np.arange(lengths.sum()) - np.repeat(first, lengths)
    return stamps((number + 1) / rate_hz), first[1:]


def random_lengths(seed: int, count: int, low: int, high: int) -> Whole:
    return np.random.default_rng(seed).integers(low, high + 1, count)


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize(("count", "low", "high"), [(60, 12, 12), (60, 8, 60), (200, 4, 9), (5, 3000, 9000)])
def test_every_restart_is_a_step_at_any_length_of_stretch(rate_hz: float, count: int, low: int, high: int) -> None:
    lengths = random_lengths(1, count, low, high)
    when, set_at = restarted(lengths, rate_hz)
    base = fit_time_base(when)
    np.testing.assert_array_equal(base.clock.message, set_at)
    np.testing.assert_allclose(base.clock.sizes_s, (1 - lengths[:-1]) / rate_hz, atol=1e-8)
    assert base.rate_hz == pytest.approx(rate_hz, rel=1e-6)
    assert (base.gap_count, base.missing, base.out_of_order, base.duplicates) == (0, 0, 0, 0)
    assert base.jitter_s < 1e-6
    assert base.longest_stretch_s == pytest.approx(lengths.max() / rate_hz)
    # One sample is left out at each step: breaks are two periods from the last sample to the first.
    np.testing.assert_allclose(np.diff(base.breaks_s)[:, 0], 2 / rate_hz, rtol=1e-4)
    ends = (np.cumsum(lengths)[:-1] + np.arange(count - 1)) / rate_hz
    np.testing.assert_allclose(base.breaks_s[:, 1], ends + 1 / rate_hz, rtol=1e-4)


@pytest.mark.parametrize("jitter", [0.02, 0.1])
def test_scatter_hides_no_step_and_makes_none(jitter: float) -> None:
    when, set_at = restarted(random_lengths(2, 80, 10, 200), 100.0)
    scatter = jitter * 1e7 * np.random.default_rng(3).normal(size=when.size).clip(-3, 3)
    base = fit_time_base(when + np.rint(scatter).astype(np.int64))
    np.testing.assert_array_equal(base.clock.message, set_at)
    assert base.rate_hz == pytest.approx(100.0, rel=1e-3)
    assert base.missing == 0


@pytest.mark.parametrize("back_s", [3600.0, 1.0, 0.05, 0.02])
@pytest.mark.parametrize("length", [12, 12_000])
def test_a_clock_that_is_set_back_by_any_time_is_set_and_not_late(back_s: float, length: int) -> None:
    times = np.arange(3 * length) / 100
    times[length:] -= back_s
    times[2 * length :] -= back_s
    base = fit_time_base(stamps(times + 10_000))
    np.testing.assert_array_equal(base.clock.message, [length, 2 * length])
    np.testing.assert_allclose(base.clock.sizes_s, 0.01 - back_s, atol=1e-8)
    number = np.arange(3 * length)
    np.testing.assert_array_equal(message_index(stamps(times + 10_000), base), number + number // length)


def test_no_sample_is_sorted_into_the_past_and_none_stands_where_the_clock_was_set() -> None:
    lengths = random_lengths(4, 50, 8, 60)
    when, set_at = restarted(lengths, 100.0)
    number = np.arange(when.size)
    series = place(when, number[None].astype(float), fit_time_base(when), [Channel(name="number")])
    there = np.isfinite(series.values[0])
    np.testing.assert_array_equal(series.values[0, there], number)
    np.testing.assert_array_equal(np.flatnonzero(~there), set_at + np.arange(set_at.size))


def held_up(seed: int) -> tuple[Whole, int]:
    """Ten places where one to three messages come behind up to six later ones."""
    rng = np.random.default_rng(seed)
    order = np.arange(4000)
    for place_ in rng.choice(np.arange(5, 195), 10, replace=False) * 20:
        length, late = int(rng.integers(3, 8)), int(rng.integers(1, 3))
        order[place_ : place_ + length] = np.roll(order[place_ : place_ + length], -late)
    return order, 10


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_late_messages_are_no_steps(seed: int) -> None:
    order, groups = held_up(seed)
    base = fit_time_base(grid(100.0, 4000)[order])
    assert base.clock.count == 0
    assert base.out_of_order == groups
    assert (base.rate_hz, base.missing, base.duplicates) == (100.0, 0, 0)
    np.testing.assert_array_equal(message_index(grid(100.0, 4000)[order], base), order)


def test_a_few_late_messages_among_many_lost_are_no_steps() -> None:
    """They fill no hole where all is holes, but no clock is set back for one message."""
    order = np.array([0, 1, 2, 4, 7, 8, 12, 13, 16, 18, 19, 20, 14, 21, 11, 15, 22, 23, 25, 27, 29, 33, 36, 37, 39])
    assert find_clock_steps(grid(100.0, 40)[order]).count == 0


def test_many_messages_that_fill_the_hole_they_left_are_late() -> None:
    # A buffer of twenty that is sent behind three later messages, as a second thread may.
    order = np.arange(600)
    order[250:273] = np.roll(order[250:273], 3)
    base = fit_time_base(grid(100.0, 600)[order])
    assert (base.clock.count, base.out_of_order, base.missing) == (0, 1, 0)


def test_a_clock_that_is_set_back_and_ahead_again_is_not_late() -> None:
    # Twenty samples with stamps that others had before, then on from where the clock was.
    times = np.arange(600) / 100
    times[250:270] -= 1.0
    base = fit_time_base(stamps(times))
    np.testing.assert_array_equal(base.clock.message, [250])
    # What came ahead again may as well be a pause: a gap.
    assert base.gap_count == 1


@given(
    lengths=st.lists(st.integers(8, 80), min_size=2, max_size=20),
    rate_hz=st.floats(0.5, 5000.0),
    back=st.floats(2.1, 500.0),
    jitter=st.floats(0.0, 0.1),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_history_of_steps_back_is_told(
    lengths: list[int], rate_hz: float, back: float, jitter: float, seed: int
) -> None:
    stretch = np.repeat(np.arange(len(lengths)), lengths)
    number = np.arange(stretch.size)
    scatter = np.random.default_rng(seed).uniform(-jitter, jitter, stretch.size)
    when = stamps((number + scatter - back * stretch) / rate_hz + 20_000 / rate_hz)
    base = fit_time_base(when)
    np.testing.assert_array_equal(base.clock.message, np.flatnonzero(np.diff(stretch)) + 1)
    np.testing.assert_array_equal(message_index(when, base), number + stretch)


def test_bursts_of_a_clock_that_is_set_back_stay_in_order() -> None:
    when = np.concatenate([in_bursts(1000, size=10, rate_hz=100.0, spread_s=1e-5)] * 4)
    base = fit_time_base(when)
    assert (base.verdict, base.clock.count) == ("bursts", 3)
    assert base.rate_hz == pytest.approx(100.0, rel=1e-6)
    np.testing.assert_array_equal(message_index(when, base), np.arange(4000) + np.arange(4000) // 1000)


def test_batches_of_a_clock_that_is_set_back_leave_out_one_sample() -> None:
    counts = np.tile([10, 30, 20], 30)
    before = np.cumsum(counts) - counts
    first = before - np.where(np.arange(90) >= 40, before[40], 0)
    base = fit_batch_time_base(stamps(first / 1000 + 5), counts)
    np.testing.assert_array_equal(base.clock.message, [40])
    assert (base.rate_hz, base.missing, base.gap_count) == (1000.0, 0, 0)
    index = message_index(stamps(first / 1000 + 5), base, counts=counts)
    np.testing.assert_array_equal(index, before + (np.arange(90) >= 40))
    assert base.longest_stretch_s == pytest.approx(counts[40:].sum() / 1000)


# --- another clock as a witness -----------------------------------------------------------------------------------


def logged(times_s: Real, seed: int = 5) -> Whole:
    delay = 0.002 + np.abs(np.random.default_rng(seed).normal(0, 0.0005, times_s.size))
    return stamps(np.maximum.accumulate(times_s + delay + 3.0))


@pytest.mark.parametrize("ahead_s", [0.3, 3600.0])
@pytest.mark.parametrize("length", [12, 2000])
def test_a_clock_that_is_set_ahead_is_told_from_a_pause_by_the_log(ahead_s: float, length: int) -> None:
    times = np.arange(3 * length) / 100
    set_ahead = times + ahead_s * (np.arange(times.size) // length)
    base = fit_time_base(stamps(set_ahead), logged_ns=logged(times))
    np.testing.assert_array_equal(base.clock.message, [length, 2 * length])
    assert (base.gap_count, base.rate_hz) == (0, 100.0)
    paused = fit_time_base(stamps(set_ahead), logged_ns=logged(set_ahead))
    assert (paused.clock.count, paused.gap_count) == (0, 2)


def test_a_log_that_catches_up_after_it_lost_messages_set_no_clock() -> None:
    # Two seconds are logged late, the end of the queue is lost, and the log is on time again.
    times = np.arange(3000) / 100
    delay = np.full(3000, 0.002)
    delay[1000:1200] = np.linspace(2.0, 1.5, 200)
    kept = np.delete(np.arange(3000), np.r_[1200:1340])
    base = fit_time_base(stamps(times[kept]), logged_ns=stamps((times + delay)[kept] + 3))
    assert (base.clock.count, base.gap_count, base.missing) == (0, 1, 140)


def test_a_log_that_was_set_back_itself_is_no_witness() -> None:
    times = np.arange(2000) / 100
    times[1000:] += 5.0
    log_s = np.arange(2000) / 100
    log_s[1500:] -= 2.0
    base = fit_time_base(stamps(times), logged_ns=stamps(log_s + 100))
    assert (base.clock.count, base.gap_count) == (0, 1)


def test_simulated_time_may_run_faster_than_the_log() -> None:
    times = np.arange(2000) / 100
    times[1000:] += 5.0
    base = fit_time_base(stamps(times), logged_ns=logged(times / 10))
    assert (base.clock.count, base.gap_count) == (0, 1)


# --- leaps without a witness ------------------------------------------------------------------------------------


def test_leaps_beyond_all_that_was_recorded_are_breaks_and_gaps() -> None:
    times = np.arange(60) / 10
    times += 3600.0 * (np.arange(60) // 12)
    base = fit_time_base(stamps(times))
    assert (base.clock.count, base.gap_count, len(base.breaks_s)) == (0, 4, 4)
    assert base.longest_stretch_s == pytest.approx(1.2)


def test_a_pause_shorter_than_what_was_recorded_is_a_gap() -> None:
    times = np.arange(20_000) / 100
    times[10_000:] += 90.0
    base = fit_time_base(stamps(times))
    assert (base.gap_count, len(base.breaks_s)) == (1, 0)


# --- the pieces -------------------------------------------------------------------------------------------------


def test_steps_are_undone_from_any_message_on() -> None:
    steps = ClockSteps(
        message=np.array([3, 5]),
        before_ns=np.array([2, 1]),
        after_ns=np.array([0, 0]),
        shift_ns=np.array([10, 100]),
    )
    np.testing.assert_array_equal(steps.run_on(np.zeros(7, np.int64)), [0, 0, 0, 10, 10, 100, 100])
    np.testing.assert_array_equal(steps.run_on(np.zeros(3, np.int64), first=2), [0, 10, 10])
    np.testing.assert_array_equal(steps.run_on(np.zeros(2, np.int64), first=9), [100, 100])
    np.testing.assert_array_equal(steps.eras(7), [0, 0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(steps.sizes_s, [-2e-9, -1e-9])


def test_known_steps_are_taken_as_they_are() -> None:
    when, set_at = restarted(np.full(6, 100), 100.0)
    own = fit_time_base(when).clock
    longer = own.moved(np.cumsum(np.full(5, 70_000_000)))
    base = fit_time_base(when, clock=longer)
    np.testing.assert_array_equal(base.clock.shift_ns, longer.shift_ns)
    assert (base.gap_count, base.missing, base.rate_hz) == (0, 0, 100.0)
    # Seven samples more are left out at each.
    np.testing.assert_allclose(np.diff(base.breaks_s)[:, 0], 0.09, atol=1e-6)
    np.testing.assert_array_equal(np.diff(message_index(when, base))[set_at - 1], 9)


def test_places_of_arrival_stay_within_their_stretch() -> None:
    when, _ = restarted(np.array([20, 30]), 100.0)
    assert arrival_order(when) is None
    when[[5, 6]] = when[[6, 5]]
    order = arrival_order(when)
    assert order is not None
    np.testing.assert_array_equal(order[:10], [0, 1, 2, 3, 4, 6, 5, 7, 8, 9])
    assert untangle(when).out_of_order == 1


def test_garbage_has_no_steps() -> None:
    rng = np.random.default_rng(6)
    huge = np.sort(rng.integers(0, 2**62, 300))[rng.permutation(300)]
    assert np.abs(untangle(huge).clock.run_on(huge).astype(float)).max() < 2**63
    # Every other message goes back in a way that needs a look: no clock does.
    tangle = np.tile([5, 4, 3, 9, 2], MAX_CANDIDATES) * 1_000_000 + START_NS
    assert find_clock_steps(tangle).count == 0
