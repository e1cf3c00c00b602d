"""Stamps that tick more slowly than the sampling: samples are counted in order, and the rate is right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.coarse_stamps import count_ticks, phase_period, stamp_quantum
from chladni.io.clock.stamp_order import typical_period, untangle
from chladni.io.clock.time_base import TimeBase, fit_time_base
from chladni.io.clock.uniform import message_index
from chladni.signals.arrays import Real, Whole
from tests.io.clock.stamp_makers import START_NS, grid, in_bursts, stamps


def ticked(times_s: Real, tick_s: float) -> Whole:
    """What a clock tells that ticks, in whole nanoseconds."""
    tick_ns = round(tick_s * 1e9)
    return START_NS + np.floor(times_s * 1e9 / tick_ns + 1e-6).astype(np.int64) * tick_ns


def sampled(rate_hz: float, tick_s: float, samples: int, phase: float = 0.3) -> Whole:
    return ticked((np.arange(samples) + phase) / rate_hz, tick_s)


def agrees(base: TimeBase, rate_hz: float) -> bool:
    return abs(base.rate_hz - rate_hz) <= 5 * base.rate_std_hz + 1e-9 * rate_hz


@pytest.mark.parametrize(
    ("rate_hz", "tick_s", "samples"),
    [
        (104.0, 0.01, 6240),
        (1344.0, 0.001, 4032),
        (1660.0, 0.001, 4980),
        (96.0, 0.01, 6000),
        (833.0, 0.001, 5000),
        (6667.0, 0.001, 20_000),
        (1043.0, 0.01, 5000),
        (1666.0, 1 / 64, 8000),
        (26.0, 0.05, 800),
        (1.7, 1.0, 500),
    ],
)
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.77])
def test_samples_are_counted_in_order_at_their_rate(
    rate_hz: float, tick_s: float, samples: int, phase: float
) -> None:
    when = sampled(rate_hz, tick_s, samples, phase)
    base = fit_time_base(when)
    assert base.verdict == "coarse"
    assert agrees(base, rate_hz)
    # One tick over the whole log is all that can be wrong.
    assert base.rate_hz == pytest.approx(rate_hz, rel=tick_s * rate_hz / samples)
    assert base.quantum_s == pytest.approx(tick_s)
    assert (base.gap_count, base.missing, base.duplicates) == (0, 0, 0)
    np.testing.assert_array_equal(message_index(when, base), np.arange(samples))
    # Uniform within a tick.
    assert base.jitter_s == pytest.approx(tick_s / np.sqrt(12), rel=0.15)
    assert f"ticks of {tick_s * 1e3:.4g} ms" in base.advice
    assert f"their rate is {base.rate_hz:.9g} Hz, give or take" in base.advice


@pytest.mark.parametrize("shape", ["floor", "round", "microseconds", "doubles"])
def test_ticks_are_known_to_the_rounding_of_their_unit(shape: str) -> None:
    times = (np.arange(4000) + 0.4) / 1300
    tick_s = 1 / 1024
    told = (np.rint if shape == "round" else np.floor)(times / tick_s) * tick_s
    if shape == "microseconds":
        when = START_NS + np.rint(told * 1e6).astype(np.int64) * 1000
    elif shape == "doubles":
        when = ((told + START_NS * 1e-9) * 1e9).astype(np.int64)
    else:
        when = stamps(told)
    base = fit_time_base(when)
    assert base.verdict == "coarse"
    assert agrees(base, 1300.0)


@pytest.mark.parametrize("jitter", [0.05, 0.15])
@pytest.mark.parametrize(("rate_hz", "tick_s"), [(104.0, 0.01), (1344.0, 0.001), (96.0, 0.01)])
def test_jitter_of_the_sampling_changes_nothing(rate_hz: float, tick_s: float, jitter: float) -> None:
    rng = np.random.default_rng(1)
    times = np.sort(np.arange(1, 5001) + jitter * rng.normal(size=5000).clip(-3, 3)) / rate_hz
    base = fit_time_base(ticked(times, tick_s))
    assert base.verdict == "coarse"
    assert agrees(base, rate_hz)
    assert base.missing == 0


def test_gaps_longer_than_a_tick_explains_are_gaps() -> None:
    number = np.delete(np.arange(6000), np.r_[1000:1200, 4000:4005])
    when = ticked(number / 1660, 0.001)
    base = fit_time_base(when)
    assert (base.gap_count, base.missing) == (2, 205)
    assert base.rate_hz == pytest.approx(1660.0, rel=1e-4)
    np.testing.assert_array_equal(message_index(when, base), number)
    assert base.longest_stretch_s == pytest.approx(2800 / 1660, rel=1e-3)


@pytest.mark.parametrize(("rate_hz", "tick_s"), [(104.0, 0.01), (1344.0, 0.001), (833.0, 0.001)])
def test_single_samples_that_are_lost_are_found_although_a_tick_hides_them(rate_hz: float, tick_s: float) -> None:
    rng = np.random.default_rng(2)
    number = np.delete(np.arange(6000), rng.choice(np.arange(100, 5900), 8, replace=False))
    when = ticked((number + 0.2) / rate_hz, tick_s)
    base = fit_time_base(when)
    assert base.rate_hz == pytest.approx(rate_hz, rel=2e-4)
    off = message_index(when, base) - number
    # Where exactly one is lost shows only after some ticks; the count beside that is right.
    assert np.ptp(off) <= 2
    assert np.count_nonzero(off != np.median(off)) < 0.03 * number.size


def test_ticks_that_skip_unevenly_are_lost_samples_of_a_clock_that_ticks_as_it_samples() -> None:
    kept = np.random.default_rng(3).random(6000) > 0.04
    kept[[0, -1]] = True
    base = fit_time_base(grid(100.0, 6000)[kept])
    assert (base.verdict, base.rate_hz, base.missing) == ("regular", 100.0, np.count_nonzero(~kept))


def test_ticks_that_skip_evenly_are_slower_sampling() -> None:
    # 96 Hz in ticks of 10 ms: every 24th interval is 20 ms.
    base = fit_time_base(sampled(96.0, 0.01, 1000))
    assert (base.verdict, base.gap_count) == ("coarse", 0)
    assert agrees(base, 96.0)
    assert "unless samples were lost as evenly and it is 100 Hz: then state it" in base.advice
    # What is told to do settles it.
    stated = fit_time_base(sampled(96.0, 0.01, 1000), nominal_rate_hz=100.0)
    assert (stated.rate_hz, stated.verdict, stated.missing) == (100.0, "regular", 41)
    # Four even skips may well be chance; then the samples are told to be missing.
    short = fit_time_base(sampled(96.0, 0.01, 100))
    assert (short.verdict, short.rate_hz, short.missing) == ("regular", 100.0, 4)
    assert "4 samples missing in 4 gaps" in short.advice
    assert "unless none was lost or repeated, and the rate is 9" in short.advice


def test_where_many_are_lost_and_phases_tell_nothing_the_rate_is_asked_for() -> None:
    kept = np.random.default_rng(4).random(5000) > 0.02
    when = ticked(np.flatnonzero(kept) / 1000, 0.01)
    base = fit_time_base(when)
    assert not base.uniform
    assert "ticks of 10 ms" in base.advice
    assert "--rate HZ" in base.advice
    stated = fit_time_base(when, nominal_rate_hz=1000.0)
    assert (stated.rate_hz, stated.uniform) == (1000.0, True)
    # Each sample lies within two ticks of its stamp, wherever the lost ones are.
    index = message_index(when, stated)
    assert np.abs(index / 1000 - (when - START_NS) * 1e-9).max() < 0.02


@pytest.mark.parametrize("rate_hz", [1344.0, 1660.0])
def test_phases_tell_the_rate_although_a_twentieth_is_lost(rate_hz: float) -> None:
    number = np.flatnonzero(np.random.default_rng(5).random(6000) > 0.05)
    when = ticked(number / rate_hz, 0.001)
    tangled = untangle(when)
    told = phase_period(tangled, 1e6, typical_period(tangled))
    assert told is not None
    assert 1e9 / told[0] == pytest.approx(rate_hz, rel=5 * told[1] / told[0])
    base = fit_time_base(when)
    assert base.rate_hz == pytest.approx(rate_hz, rel=1e-4)
    off = message_index(when, base) - number
    assert np.ptp(off) <= 3
    assert np.mean(off == np.median(off)) > 0.5


def test_phases_say_nothing_of_random_stamps_and_near_whole_ticks() -> None:
    rng = np.random.default_rng(6)
    events = untangle(ticked(np.cumsum(rng.exponential(1 / 1344, 6000)), 0.001))
    assert phase_period(events, 1e6, typical_period(events)) is None
    near = untangle(sampled(1005.0, 0.001, 5000))
    assert phase_period(near, 1e6, typical_period(near)) is None


@pytest.mark.parametrize("rate_hz", [99.0, 101.0, 104.0])
def test_a_stated_rate_settles_what_few_samples_leave_open(rate_hz: float) -> None:
    base = fit_time_base(sampled(rate_hz, 0.01, 150), nominal_rate_hz=rate_hz)
    assert (base.rate_hz, base.missing, base.duplicates) == (rate_hz, 0, 0)
    np.testing.assert_array_equal(message_index(sampled(rate_hz, 0.01, 150), base), np.arange(150))


def test_a_stated_rate_that_ticks_contradict_is_not_taken() -> None:
    base = fit_time_base(sampled(1344.0, 0.001, 6000), nominal_rate_hz=1300.0)
    assert base.rate_hz == pytest.approx(1344.0, rel=1e-5)
    assert "a rate of 1300 Hz is stated, but the stamps advance at 134" in base.advice


def test_stamps_that_stand_still_are_samples_at_a_stated_rate() -> None:
    base = fit_time_base(np.full(500, START_NS), nominal_rate_hz=50.0)
    assert (base.verdict, base.rate_hz, base.uniform, base.moving) == ("stated", 50.0, True, True)
    np.testing.assert_array_equal(message_index(np.full(500, START_NS), base), np.arange(500))


def test_events_are_samples_at_a_stated_rate_only() -> None:
    when = stamps(np.cumsum(np.random.default_rng(7).exponential(0.01, 2000)))
    assert not fit_time_base(when).uniform
    base = fit_time_base(when, nominal_rate_hz=100.0)
    assert (base.verdict, base.rate_hz) == ("stated", 100.0)
    index = message_index(when, base)
    assert np.all(np.diff(index) >= 1)
    assert "counted at 100 Hz, as stated" in base.advice


def test_ticks_of_a_clock_that_is_set_back() -> None:
    number = np.arange(4000)
    when = ticked(0.1 + (number % 500) / 104, 0.01)
    base = fit_time_base(when)
    assert (base.verdict, base.clock.count, base.missing) == ("coarse", 7, 0)
    assert base.rate_hz == pytest.approx(104.0, rel=1e-5)
    np.testing.assert_array_equal(message_index(when, base), number + number // 500)


def test_as_many_messages_for_every_stamp_are_bursts() -> None:
    base = fit_time_base(in_bursts(3000, size=10, rate_hz=1000.0))
    assert (base.verdict, base.rate_hz, base.missing) == ("bursts", 1000.0, 0)
    # Also when the first and the last stamp have fewer, as a cut has them.
    part = in_bursts(3000, size=10, rate_hz=1000.0)[7:-4]
    base = fit_time_base(part)
    assert (base.verdict, base.missing) == ("bursts", 0)
    assert base.rate_hz == pytest.approx(1000.0, rel=1e-3)
    np.testing.assert_array_equal(message_index(part, base), np.arange(part.size))


# --- the pieces -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tick_ns", [61_035, 1_000_000, 15_625_000])
def test_the_quantum_is_the_largest_common_step(tick_ns: int) -> None:
    ticks = np.random.default_rng(8).integers(0, 4, 2000)
    assert stamp_quantum(ticks * tick_ns, 2.0 * tick_ns) == pytest.approx(tick_ns, rel=1e-9)
    # Steps of two and three ticks have ticks of one, too.
    assert stamp_quantum((2 + ticks % 2) * tick_ns, 2.5 * tick_ns) == pytest.approx(tick_ns, rel=1e-9)


def test_scattered_intervals_have_no_quantum() -> None:
    scattered = np.rint(1e7 + 2e5 * np.random.default_rng(9).normal(size=500)).astype(np.int64)
    assert stamp_quantum(scattered, 1e7) == 0.0
    assert stamp_quantum(np.zeros(10, np.int64), 1.0) == 0.0
    # Finer than an eighth of a period: each stamp tells its place by itself.
    assert stamp_quantum(np.array([10, 11, 10, 9]) * 1_000_000, 1e7) == 0.0


@given(
    per_tick=st.floats(0.35, 7.0),
    tick_s=st.sampled_from([0.001, 0.01, 1 / 64, 0.1]),
    samples=st.integers(400, 6000),
    phase=st.floats(0.0, 1.0),
)
def test_any_rate_beside_any_tick_is_found(per_tick: float, tick_s: float, samples: int, phase: float) -> None:
    rate_hz = per_tick / tick_s
    base = fit_time_base(sampled(rate_hz, tick_s, samples, phase))
    if base.verdict in {"coarse", "bursts"} or not (base.gap_count or base.duplicates):
        assert base.rate_hz == pytest.approx(rate_hz, rel=1.5 * max(per_tick, 1) / samples)
        return
    # Ticks so near to the sampling look like a few samples lost or doubled, and that is told.
    assert samples * abs(per_tick - round(per_tick)) < 40 or per_tick < 0.6
    assert base.gap_count + base.duplicates <= 40


def test_what_ticks_dont_explain_is_no_count_of_them() -> None:
    rng = np.random.default_rng(10)
    events = untangle(ticked(np.cumsum(rng.exponential(0.01, 3000)), 0.01))
    ticks = count_ticks(events, 1e7, 1e7)
    assert ticks is None or not ticks.proven


@pytest.mark.parametrize("per_tick", [50, 50.3, 37.7])
def test_stamps_in_whole_seconds_of_a_fast_sensor(per_tick: float) -> None:
    when = ticked((np.arange(3000) + 7) / per_tick, 1.0)
    base = fit_time_base(when)
    assert base.uniform
    # A tick holds fifty samples, and sixty ticks tell the rate to a part of one.
    assert base.rate_hz == pytest.approx(per_tick, rel=1e-3)
    assert (base.missing, base.duplicates) == (0, 0)
    np.testing.assert_array_equal(message_index(when, base), np.arange(3000))
