"""The grid of a time base tells the time of its stamps, whatever the intervals; else there is no grid."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chladni.io.clock.clock_fit import HELD_UP, JITTERS, grid_agrees
from chladni.io.clock.time_base import TimeBase, fit_batch_time_base, fit_time_base
from chladni.io.clock.uniform import message_index
from chladni.signals.arrays import Real
from tests.io.clock.stamp_makers import START_NS, grid, stamps

ONE_EACH = np.ones(1, dtype=np.int64)
KINDS = ("scattered", "log-normal", "alternating", "bimodal", "events", "dropped", "two rates", "late")


def periods(kind: str, rng: np.random.Generator, samples: int, spread: float) -> Real:
    """Times of one kind in periods; `spread` 0 to 1 from nearly even to wild."""
    number = np.arange(samples)
    if kind == "log-normal":
        return np.cumsum(rng.lognormal(0, spread, samples))
    if kind == "alternating":
        return np.cumsum(np.where(number % 2, 1.0, 1 + 1.2 * spread))
    if kind == "bimodal":
        return np.cumsum(rng.choice([1.0, 1 + 1.2 * spread], samples))
    if kind == "events":
        return np.cumsum(rng.exponential(1, samples))
    if kind == "dropped":
        kept = rng.random(samples) > 0.3 * spread
        return number[kept] + rng.uniform(-0.1, 0.1, np.count_nonzero(kept))
    if kind == "two rates":
        return np.cumsum(np.where(number < samples * rng.uniform(0.05, 0.5), 1.0, 1 + spread))
    return np.sort(number + rng.uniform(0, spread if kind == "scattered" else 4 * spread, samples))


def allowed_ns(base: TimeBase) -> float:
    return 1e9 * (base.burst_size / base.rate_hz + JITTERS * base.jitter_s + base.wander_s)


@given(
    kind=st.sampled_from(KINDS),
    samples=st.integers(20, 3000),
    spread=st.floats(0.0, 1.0),
    rate_hz=st.floats(0.5, 20_000.0),
    seed=st.integers(0, 2**32 - 1),
)
@example(kind="two rates", samples=115, spread=0.3125, rate_hz=1.0, seed=126)
def test_a_grid_tells_the_time_of_its_stamps(
    kind: str, samples: int, spread: float, rate_hz: float, seed: int
) -> None:
    when = stamps(periods(kind, np.random.default_rng(seed), samples, spread) / rate_hz)
    base = fit_time_base(when)
    if not base.uniform:
        assert base.verdict in {"irregular", "short"}
        return
    index = message_index(when, base)
    period_ns = 1e9 / base.rate_hz
    off_ns = when - base.start_ns - index * period_ns
    # No sample is far from its own stamp.
    assert np.count_nonzero(np.abs(off_ns) > allowed_ns(base)) <= HELD_UP * when.size
    # Rate times span is the number of samples; one sample apart from what jitter does to the span, whose two ends
    # each have their own.
    assert abs(off_ns[-1] - off_ns[0]) <= allowed_ns(base) + 1e9 * JITTERS * base.jitter_s
    # Every step of the grid is a sample or counted as missing; a hundredth may meet another one on its point.
    counted = base.samples - 1 + base.missing - base.duplicates
    assert abs(index[-1] - index[0] - counted) <= 1 + 0.01 * base.samples


@pytest.mark.parametrize("fast", [0.05, 0.2, 0.4])
@pytest.mark.parametrize("samples", [200, 4000])
def test_a_source_that_changes_its_rate_is_no_clock(fast: float, samples: int) -> None:
    # As a control loop does whose cycle grew from 10 to 17 ms, ragged by a millisecond.
    rng = np.random.default_rng(1)
    steps = np.where(np.arange(samples) < fast * samples, 10, 17) + rng.integers(0, 2, samples)
    base = fit_time_base(stamps(np.cumsum(steps) / 1000))
    if base.uniform:
        # A few samples at the start may count as a scatter that is stated.
        assert samples * fast <= 10
        assert base.rate_hz * steps[1:].sum() / 1000 == pytest.approx(samples - 1, abs=JITTERS)
        return
    assert base.verdict == "irregular"
    assert base.rate_hz == pytest.approx(1000 / steps[1:].mean())
    assert "no single rate fits the stamps" in base.advice
    assert "resample" in base.advice


def test_intervals_that_alternate_are_a_clock_of_their_mean() -> None:
    base = fit_time_base(stamps(np.cumsum(np.tile([10, 22], 1000)) / 1000))
    assert base.verdict == "jittered"
    assert base.rate_hz == pytest.approx(1000 / 16, rel=1e-6)
    # Every other stamp is 3 ms early, the rest 3 ms late.
    assert base.jitter_s == pytest.approx(3e-3, rel=0.01)
    assert (base.missing, base.gap_count) == (0, 0)


def test_two_messages_for_a_point_of_the_grid_are_repeats() -> None:
    # A second source, or a relay, that sends a quarter of the messages once more, a tenth of a millisecond later.
    rng = np.random.default_rng(2)
    once = grid(10.0, 1200) + rng.integers(0, 100_000, 1200)
    when = np.sort(np.concatenate((once, once[rng.random(1200) < 0.25] + 100_000)))
    base = fit_time_base(when)
    assert base.rate_hz == pytest.approx(10.0, rel=1e-5)
    assert base.verdict == "regular"
    assert base.duplicates == when.size - 1200
    assert base.missing == 0
    index = message_index(when, base)
    np.testing.assert_array_equal(np.unique(index), np.arange(1200))
    assert np.abs(when - START_NS - index * 100_000_000).max() < 300_000


def test_a_rate_is_not_rounded_where_a_long_gap_would_show_it() -> None:
    # 65 ppm of error are within two sigma of 600 scattered stamps, but a week later they are half a minute.
    times = np.arange(600) + 0.2 * np.random.default_rng(299).normal(size=600)
    times[300:] += 6e7
    when = stamps(times / 100)
    base = fit_time_base(when)
    assert base.verdict == "jittered"
    assert not base.snapped
    off_ns = when - base.start_ns - message_index(when, base) * (1e9 / base.rate_hz)
    assert np.abs(off_ns).max() <= allowed_ns(base)


def test_each_rule_refuses_what_it_is_for() -> None:
    when = grid(100.0, 2000)
    base = fit_time_base(when)
    assert grid_agrees(base, when, ONE_EACH)
    in_order = replace(base, resumed=np.zeros(1, dtype=np.int64), resumed_shift=np.zeros(1, dtype=np.int64))
    assert grid_agrees(in_order, when, ONE_EACH)
    # A sample is off: up to half a percent may be held up, not more.
    held_up = when.copy()
    held_up[1000:1010] += 30_000_000
    assert grid_agrees(in_order, np.sort(held_up), ONE_EACH)
    held_up[1010:1020] += 30_000_000
    assert not grid_agrees(in_order, np.sort(held_up), ONE_EACH)
    # The span is off: 0.11 % of 2000 samples are 2.2 periods.
    assert grid_agrees(replace(in_order, rate_hz=100.04), when, ONE_EACH)
    assert not grid_agrees(replace(in_order, rate_hz=100.11, jitter_s=0.1), when, ONE_EACH)
    # Wander excuses both, but not a rate that is locally off by more than a twentieth.
    assert grid_agrees(replace(in_order, rate_hz=104.0, wander_s=10.0), when, ONE_EACH)
    assert not grid_agrees(replace(in_order, rate_hz=106.0, wander_s=10.0), when, ONE_EACH)


def test_batches_are_checked_at_their_first_sample() -> None:
    counts = np.tile([10, 30], 50)
    first = stamps((np.cumsum(counts) - counts) / 1000)
    base = fit_batch_time_base(first, counts)
    assert grid_agrees(base, first, counts)
    assert not grid_agrees(base, first, counts[::-1])


def test_long_logs_are_checked_to_their_last_message() -> None:
    when = grid(1000.0, 120_001)
    base = fit_time_base(when)
    late = replace(base, resumed=np.zeros(1, dtype=np.int64), resumed_shift=np.zeros(1, dtype=np.int64))
    assert grid_agrees(late, when, ONE_EACH)
    assert not grid_agrees(replace(late, rate_hz=1000.05), when, ONE_EACH)


@pytest.mark.parametrize("bar", [1, 7])
def test_a_loop_that_is_late_now_and_then_keeps_its_stamps(shared_data: Path, bar: int) -> None:
    when = np.rint(np.loadtxt(shared_data / f"pneumatic_seal_{bar}bar.csv")[:, 0] * 1e6).astype(np.int64)
    base = fit_time_base(when)
    assert base.verdict == "jittered"
    index = message_index(when, base)
    off_s = (when - base.start_ns) * 1e-9 - index / base.rate_hz
    assert np.abs(off_s).max() < 1.1 / base.rate_hz
    assert base.rate_hz * (when[-1] - when[0]) * 1e-9 == pytest.approx(index[-1] - index[0], abs=1)


def test_a_loop_that_grows_from_10_to_17_ms_is_refused(shared_data: Path) -> None:
    when = np.rint(np.loadtxt(shared_data / "pneumatic_seal_4bar.csv")[:, 0] * 1e6).astype(np.int64)
    base = fit_time_base(when)
    assert base.verdict == "irregular"
    assert base.rate_hz == pytest.approx(4182 / 66.848)
    assert "from 10 to 18 ms" in base.advice
