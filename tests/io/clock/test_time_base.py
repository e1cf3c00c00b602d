"""The time base: rate, start and soundness from stamps with known flaws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.clock_verdict import round_rate
from chladni.io.clock.grid_places import MAX_GAPS
from chladni.io.clock.time_base import TimeBase, fit_batch_time_base, fit_time_base
from chladni.signals.errors import EstimateError
from tests.io.clock.stamp_makers import START_NS, grid, in_bursts, stamps

RATES_HZ = (51_200.0, 1000.123456, 610.35, 100.0, 1 / 3)
# Five sigma: one false alarm in two million, per seed and case.
SIGMAS = 5.0


def agrees(base: TimeBase, rate_hz: float) -> bool:
    return abs(base.rate_hz - rate_hz) <= max(SIGMAS * base.rate_std_hz, 1e-9 * rate_hz)


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("samples", [50, 20_000])
def test_an_ideal_clock_is_told_to_a_billionth(rate_hz: float, samples: int) -> None:
    base = fit_time_base(grid(rate_hz, samples))
    # Rounding to nanoseconds is white scatter of 1/sqrt(12) ns; over 50 samples that's 3e-9 of a millisecond.
    assert base.rate_hz == pytest.approx(rate_hz, rel=1e-9 + SIGMAS * rate_hz * 1e-9 / samples**1.5)
    assert abs(base.start_ns - START_NS) <= 1
    assert base.verdict == "regular"
    assert base.advice == "the clock is sound"
    assert base.jitter_s <= 0.5e-9, "rounding to nanoseconds is uniform within half of one"
    assert (base.gaps, base.missing, base.duplicates, base.out_of_order, base.clock.count) == ((), 0, 0, 0, 0)
    assert base.longest_stretch_s == pytest.approx(samples / rate_hz)
    assert base.uniform
    assert base.moving
    assert base.samples == samples


@pytest.mark.parametrize("step_ns", [333_333, 10_000_000])
@pytest.mark.parametrize("samples", [2, 7, 8, 255, 257, 5000])
def test_even_stamps_are_a_clock_without_error(step_ns: int, samples: int) -> None:
    when = START_NS + step_ns * np.arange(samples)
    base = fit_time_base(when)
    assert base.rate_hz == pytest.approx(1e9 / step_ns, rel=4e-16)
    assert base.verdict == ("short" if samples < 8 else "regular")
    assert (base.start_ns, base.samples, base.missing, base.gap_count) == (START_NS, samples, 0, 0)
    np.testing.assert_array_equal(base.knots_ns, when[[0, -1]])
    np.testing.assert_array_equal(base.knots_index, [0, samples - 1])
    # Residuals are the rounding of nanoseconds since the first stamp, held in doubles.
    assert base.jitter_s < 1e-9 * step_ns * samples * np.finfo(float).eps
    # A single stamp one nanosecond off is no longer even, and the fit to all of them says the same.
    if samples > 8:
        nearly = when.copy()
        nearly[samples // 2] += 1
        fitted = fit_time_base(nearly)
        assert abs(fitted.rate_hz - base.rate_hz) < 1e-8 * base.rate_hz
        assert abs(fitted.start_ns - base.start_ns) <= 1
        np.testing.assert_array_equal(fitted.knots_index, base.knots_index)


@pytest.mark.parametrize("relative_jitter", [0.01, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("law", ["normal", "uniform"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_jitter_leaves_the_rate_within_its_error(relative_jitter: float, law: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scatter = rng.normal(size=3000) if law == "normal" else rng.uniform(-1, 1, 3000)
    base = fit_time_base(stamps((np.arange(3000) + relative_jitter * scatter) / 100))
    assert agrees(base, 100.0)
    assert base.rate_std_hz < 100 * 1e-4, "a least-squares line knows sqrt(12) sigma / n^1.5, here 6e-6 at most"
    assert base.missing == 0
    assert base.gap_count == 0
    assert base.verdict == ("jittered" if relative_jitter * np.std(scatter) > 0.05 else "regular")
    # Stamps nearer to a neighbour's place count as its own, so the largest scatter reads up to a sixth low.
    assert base.jitter_s * 100 == pytest.approx(relative_jitter * np.std(scatter), rel=0.17)


def test_the_stated_rate_error_is_the_one_of_least_squares() -> None:
    # sigma_T = sigma sqrt(12 / n^3) for a line through n points with white scatter sigma.
    errors = [
        fit_time_base(stamps((np.arange(500) + 0.05 * np.random.default_rng(seed).normal(size=500)) / 97.3)).rate_hz
        / 97.3
        - 1
        for seed in range(60)
    ]
    expected = 0.05 * np.sqrt(12 / 500**3)
    # The scatter of 60 errors is known to 1/sqrt(120) = 9 %.
    assert np.std(errors) == pytest.approx(expected, rel=5 * 0.09)
    base = fit_time_base(stamps((np.arange(500) + 0.05 * np.random.default_rng(0).normal(size=500)) / 97.3))
    assert base.rate_std_hz / 97.3 == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize("ppm", [-100.0, 3.0, 50.0])
def test_a_clock_that_is_off_is_not_rounded_to_a_nice_rate(ppm: float) -> None:
    rate_hz = 100 / (1 + ppm * 1e-6)
    base = fit_time_base(grid(rate_hz, 5000))
    assert base.rate_hz == pytest.approx(rate_hz, rel=1e-9)
    assert base.rate_hz != 100.0
    assert base.verdict == "regular"


@pytest.mark.parametrize("relative_jitter", [0.0, 0.1, 0.2, 0.3])
def test_lost_messages_bias_nothing(relative_jitter: float) -> None:
    rng = np.random.default_rng(4)
    kept = rng.random(5000) > 0.05
    kept[[0, -1]] = True
    times = (np.arange(5000) + relative_jitter * rng.normal(size=5000)) / 100
    base = fit_time_base(stamps(times[kept]))
    assert agrees(base, 100.0)
    assert base.missing == np.count_nonzero(~kept)
    if relative_jitter <= 0.1:
        runs = np.count_nonzero(np.diff(kept.astype(int)) == -1)
        assert base.gap_count == runs
        assert base.gaps[0][0] == pytest.approx((np.flatnonzero(~kept)[0] - 1) / 100, abs=0.01)


@pytest.mark.parametrize("relative_jitter", [0.0, 0.1])
def test_long_gaps_of_any_length_are_listed_and_bias_nothing(relative_jitter: float) -> None:
    rng = np.random.default_rng(5)
    lost = {2000: 5.555, 4000: 1000.0007, 6000: 3.0}
    times = (np.arange(10_000) + relative_jitter * rng.normal(size=10_000)) / 100
    for place, length in lost.items():
        times[place:] += length
    base = fit_time_base(stamps(times))
    assert agrees(base, 100.0)
    expected = [(times[place - 1] - times[0], times[place] - times[0]) for place in lost]
    np.testing.assert_allclose(base.gaps, expected, atol=1e-6)
    assert base.gap_count == 3
    # Half a period of doubt for each gap, because lengths aren't whole.
    assert base.missing == pytest.approx(100 * sum(lost.values()), abs=2)
    assert "missing in 3 gaps" in base.advice or base.verdict == "jittered"


def test_only_the_longest_of_very_many_gaps_are_listed_but_all_are_counted() -> None:
    # At random: gaps as even as every fifth sample would be the ticks of a coarse clock, see test_coarse_stamps.
    steps = np.where(np.random.default_rng(17).random(10_000) < 0.2, 2.0, 1.0)
    steps[9] = 50.0
    base = fit_time_base(stamps(np.cumsum(steps) / 100))
    assert base.rate_hz == 100.0
    assert base.gap_count == np.count_nonzero(steps[1:] > 1)
    assert len(base.gaps) == MAX_GAPS
    assert max(end - start for start, end in base.gaps) == pytest.approx(0.5, abs=1e-6)
    assert list(base.gaps) == sorted(base.gaps)


def test_duplicates_are_counted() -> None:
    ideal = grid(100.0, 2000)
    # At random: one in fifty would be 102 Hz stamped by a clock that ticks every 10 ms.
    again = np.random.default_rng(18).choice(2000, 15, replace=False)
    base = fit_time_base(np.sort(np.concatenate((ideal, ideal[again]))))
    assert base.rate_hz == 100.0
    assert base.duplicates == 15
    assert base.missing == 0
    assert base.verdict == "regular"


def test_swapped_neighbours_are_counted_and_put_in_order() -> None:
    swapped = grid(100.0, 2000)
    places = np.arange(10, 1990, 37)
    swapped[places], swapped[places + 1] = swapped[places + 1].copy(), swapped[places].copy()
    base = fit_time_base(swapped)
    assert base.rate_hz == 100.0
    assert base.out_of_order == places.size
    assert base.clock.count == 0
    assert base.jitter_s < 1e-9


def test_one_message_that_comes_very_late_is_no_clock_jump() -> None:
    late = np.delete(np.insert(grid(100.0, 2000), 1501, grid(100.0, 2000)[500]), 500)
    base = fit_time_base(late)
    assert base.clock.count == 0
    assert base.out_of_order == 1
    assert base.missing == 0


@pytest.mark.parametrize("step_s", [3600.0, -3600.0, -5.0])
def test_a_clock_that_is_set_keeps_its_rate(step_s: float) -> None:
    times = np.arange(4000) / 100
    times[1500:] += step_s
    base = fit_time_base(stamps(times + 4000))
    assert base.rate_hz == 100.0
    assert base.out_of_order == 0
    assert base.longest_stretch_s == pytest.approx(25.0)
    # Backward, a sample is left out and time runs on; forward it may as well be a pause, so it's a gap as long.
    back = step_s < 0
    assert base.clock.sizes_s.tolist() == ([pytest.approx(step_s + 0.01)] if back else [])
    assert (base.gap_count, base.missing) == ((0, 0) if back else (1, 360_000))
    np.testing.assert_allclose(base.breaks_s, [[14.99, 15.01 if back else 3615.0]], atol=1e-9)


def test_a_clock_that_starts_in_1970_is_a_jump_and_no_gap_of_years() -> None:
    when = grid(100.0, 4000)
    when[:1500] -= START_NS
    base = fit_time_base(when)
    assert base.rate_hz == 100.0
    assert base.clock.count == 1
    assert base.clock.sizes_s[0] > 1.6e9
    assert (base.missing, base.gap_count, base.out_of_order) == (0, 0, 0)
    np.testing.assert_allclose(base.breaks_s, [[14.99, 15.01]], atol=1e-9)


def test_a_first_stamp_of_zero_spoils_nothing() -> None:
    when = grid(100.0, 4000)
    when[0] = 0
    base = fit_time_base(when)
    assert base.rate_hz == 100.0
    assert base.clock.count == 1


def test_stamps_over_more_than_thirty_years_are_no_clock() -> None:
    assert fit_time_base(np.arange(10) * 2**58).verdict == "irregular"
    base = fit_batch_time_base(np.arange(10) * 2**58, np.full(10, 7), nominal_rate_hz=100.0)
    assert base.verdict == "irregular"
    assert base.samples == 70


@pytest.mark.nightly
def test_a_log_full_of_steps_back_is_no_clock() -> None:
    rng = np.random.default_rng(6)
    base = fit_time_base(stamps(rng.uniform(0, 1000, 20_000)))
    assert not base.uniform
    assert base.verdict == "irregular"


@pytest.mark.parametrize("size", [2, 10, 25])
@pytest.mark.parametrize("spread_s", [0.0, 2e-5])
def test_bursts_are_counted_in_order(size: int, spread_s: float) -> None:
    base = fit_time_base(in_bursts(5000, size=size, rate_hz=100.0, spread_s=spread_s))
    assert base.verdict == "bursts"
    assert base.burst_size == size
    assert base.rate_hz == pytest.approx(100.0, rel=1e-9)
    assert base.missing == 0
    assert base.duplicates == 0
    assert "bursts of about" in base.advice


def test_bursts_with_irregular_delivery_and_a_gap() -> None:
    rng = np.random.default_rng(7)
    late = np.repeat(rng.normal(0, 0.004, 500), 10)
    times = (np.arange(5000) // 10 + 1) * 0.1 + late
    times[3000:] += 20.0
    base = fit_time_base(stamps(times))
    assert base.verdict == "bursts"
    assert agrees(base, 100.0)
    assert base.gap_count == 1
    assert base.missing == pytest.approx(2000, abs=2)
    assert base.gaps[0] == pytest.approx((times[2999] - times[0], times[3000] - times[0]), abs=1e-6)


def test_late_delivery_beyond_a_period_is_counted_in_order() -> None:
    rng = np.random.default_rng(8)
    base = fit_time_base(stamps(np.sort(np.arange(5000) / 100 + rng.uniform(0, 0.03, 5000))))
    assert base.uniform
    assert base.rate_hz == pytest.approx(100.0, rel=1e-4)


def test_events_are_not_forced_on_a_grid() -> None:
    rng = np.random.default_rng(9)
    events = np.cumsum(rng.exponential(0.01, 5000))
    base = fit_time_base(stamps(events))
    assert base.verdict == "irregular"
    assert not base.uniform
    assert base.rate_hz == pytest.approx(4999 / (events[-1] - events[0]))
    assert base.rate_std_hz == np.inf
    assert "events" in base.advice


def test_a_topic_published_on_change_is_no_grid() -> None:
    scans = np.flatnonzero(np.random.default_rng(10).random(20_000) < 0.2)
    assert fit_time_base(stamps(scans * 0.1)).verdict == "irregular"


def test_random_pairs_are_no_bursts() -> None:
    rng = np.random.default_rng(11)
    events = np.repeat(np.cumsum(rng.exponential(1.0, 500)), 3) + np.tile([0, 1e-4, 2e-4], 500)
    assert fit_time_base(stamps(events)).verdict == "irregular"


def test_wander_of_the_clock_is_measured_and_followed() -> None:
    samples = 50_000
    slow = 0.03 * np.sin(2 * np.pi * np.arange(samples) / samples)
    base = fit_time_base(stamps(np.arange(samples) / 100 + slow))
    assert base.missing == 0
    # A line through one period of a sine keeps its residual at 1.26 of the sine's peak to peak of 0.06 s.
    assert 0.05 < base.wander_s < 0.08
    assert base.jitter_s < 1e-3
    assert base.knots_ns.size > 100
    assert "wanders" in base.advice
    assert agrees(base, 100 / (1 + np.polyfit(np.arange(samples) / 100, slow, 1)[0]))


@pytest.mark.parametrize("value", [0, START_NS])
def test_stamps_that_dont_move_are_noticed(value: int) -> None:
    base = fit_time_base(np.full(500, value))
    assert base.verdict == "still"
    assert not base.moving
    assert not base.uniform
    assert base.rate_hz == 0.0
    assert "don't move" in base.advice


def test_stamps_that_move_only_now_and_then_stand_still() -> None:
    assert not fit_time_base(np.repeat(grid(1.0, 3), 1000)).moving


@pytest.mark.parametrize(
    ("seconds", "rate_hz", "uniform"),
    [([], 0.0, False), ([0.0], 0.0, False), ([0.0, 0.01], 100.0, True), ([0.0, 0.01, 0.02], 100.0, True)],
)
def test_short_logs_say_so(seconds: list[float], rate_hz: float, uniform: bool) -> None:
    base = fit_time_base(stamps(np.array(seconds)))
    assert base.verdict == "short"
    assert base.rate_hz == pytest.approx(rate_hz)
    assert base.uniform is uniform
    assert base.moving
    assert base.samples == len(seconds)
    assert not base.snapped


@pytest.mark.parametrize("samples", [2, 3, 5, 7, 8, 40])
def test_few_samples_at_any_spacing_raise_nothing(samples: int) -> None:
    rng = np.random.default_rng(samples)
    for _ in range(20):
        base = fit_time_base(stamps(np.sort(rng.choice([0.0, 1e-3, 1.0, 7.0], samples) * rng.random(samples))))
        assert np.isfinite(base.rate_hz)


@given(st.lists(st.integers(0, 2**62 - 1), max_size=60))
def test_any_stamps_give_a_verdict(numbers: list[int]) -> None:
    base = fit_time_base(np.array(numbers, dtype=np.int64))
    # A stamp that contradicts the others is left out, and told.
    assert base.samples + base.strays.size == len(numbers)
    assert base.rate_hz >= 0
    assert base.advice


@given(
    rate_hz=st.floats(0.2, 60_000.0),
    samples=st.integers(20, 3000),
    relative_jitter=st.floats(0.0, 0.2),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_rate_is_found(rate_hz: float, samples: int, relative_jitter: float, seed: int) -> None:
    scatter = relative_jitter * np.random.default_rng(seed).normal(size=samples).clip(-2, 2)
    base = fit_time_base(stamps((np.arange(samples) + scatter) / rate_hz))
    # Six sigma plus a nanosecond over the log; sigma of a small sample is itself uncertain by 1/sqrt(2 n).
    bound = 9 * base.rate_std_hz + 1e-9 * rate_hz**2 / samples + 1e-9 * rate_hz
    assert abs(base.rate_hz - rate_hz) <= bound


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (np.array([0.0, 1.0]), "whole nanoseconds"),
        (np.zeros((2, 2), dtype=np.int64), "one dimension"),
        (np.array([-5, 0, 5]), "between 0 and 2"),
        (np.array([0, 2**63], dtype=np.uint64), "between 0 and 2"),
    ],
)
def test_what_is_no_stamp_is_refused(wrong: np.ndarray, words: str) -> None:
    with pytest.raises(EstimateError, match=words):
        fit_time_base(wrong)


def test_unsigned_stamps_are_fine() -> None:
    assert fit_time_base(grid(100.0, 50).astype(np.uint64)).rate_hz == 100.0


def test_very_long_logs_are_fitted_to_every_nth_stamp() -> None:
    rng = np.random.default_rng(12)
    samples = 1_200_000
    kept = rng.random(samples) > 0.02
    kept[[0, -1]] = True
    times = (np.arange(samples) + 0.1 * rng.normal(size=samples)) / 1000
    base = fit_time_base(stamps(times[kept]))
    assert agrees(base, 1000.0)
    assert base.missing == np.count_nonzero(~kept)


def test_amplitude_error_of_jitter() -> None:
    rng = np.random.default_rng(13)
    base = fit_time_base(stamps((np.arange(20_000) + 0.1 * rng.normal(size=20_000)) / 1000))
    # A sine sampled at jittered times, taken for uniform: error RMS over amplitude RMS is 2 pi f sigma.
    frequency_hz = 30.0
    ideal = np.arange(20_000) / 1000
    sampled = np.sin(2 * np.pi * frequency_hz * (ideal + 1e-4 * rng.normal(size=20_000)))
    error = np.std(sampled - np.sin(2 * np.pi * frequency_hz * ideal)) * np.sqrt(2)
    assert base.amplitude_error(frequency_hz) == pytest.approx(error, rel=0.05)


@pytest.mark.parametrize(
    ("rate_hz", "std_hz", "rounded"),
    [
        (100.00001, 1e-5, 100.0),
        (99.993, 1e-3, None),
        (0.33333333, 1e-8, 1 / 3),
        (512.0, 0.0, 512.0),
        (512.8205128, 1e-6, 1 / 1.95e-3),
        (123.4613, 1e-3, None),
        (101.0, 5.0, None),
        (50.0, np.inf, None),
    ],
)
def test_rates_are_rounded_only_within_their_uncertainty(
    rate_hz: float, std_hz: float, rounded: float | None
) -> None:
    assert round_rate(rate_hz, std_hz) == (None if rounded is None else pytest.approx(rounded, rel=1e-15))


def batches(count: int, *, size: int, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    return stamps(np.arange(count) * size / rate_hz), np.full(count, size)


def test_batches_give_the_sample_rate() -> None:
    first, counts = batches(60, size=256, rate_hz=25_600.0)
    base = fit_batch_time_base(first, counts)
    assert base.rate_hz == pytest.approx(25_600.0, rel=1e-9)
    assert base.samples == 60 * 256
    assert base.verdict == "regular"
    assert base.gap_count == base.missing == 0


def test_batches_of_different_sizes() -> None:
    counts = np.random.default_rng(14).integers(1, 100, 300)
    base = fit_batch_time_base(stamps((np.cumsum(counts) - counts) / 1000), counts)
    assert base.rate_hz == pytest.approx(1000.0, rel=1e-9)
    assert base.missing == 0


def test_batch_jitter_is_within_the_stated_error() -> None:
    first, counts = batches(200, size=100, rate_hz=1000.0)
    late = np.random.default_rng(15).normal(0, 2e-3, 200) * 1e9
    base = fit_batch_time_base(first + late.astype(np.int64), counts, nominal_rate_hz=1000.0)
    assert base.rate_hz == 1000.0
    assert base.snapped
    assert base.jitter_s == pytest.approx(2e-3, rel=0.2)
    assert base.missing == 0


def test_lost_batches_are_a_gap() -> None:
    first, counts = batches(60, size=100, rate_hz=100.0)
    first[20:] += 7_000_000_000
    base = fit_batch_time_base(first, counts, nominal_rate_hz=100.0)
    assert base.rate_hz == 100.0
    assert base.gaps == ((19.99, 27.0),)
    assert base.missing == 700


def test_a_stated_rate_that_the_stamps_contradict_is_not_taken() -> None:
    first, counts = batches(60, size=100, rate_hz=100.003)
    base = fit_batch_time_base(first, counts, nominal_rate_hz=100.0)
    assert base.rate_hz == pytest.approx(100.003, rel=1e-9)
    assert "a rate of 100 Hz is stated" in base.advice
    assert "100.003" in base.advice


def test_records_triggered_now_and_then_keep_the_stated_rate() -> None:
    pauses = np.cumsum(np.random.default_rng(16).uniform(1, 5, 20))
    base = fit_batch_time_base(stamps(pauses), np.full(20, 100), nominal_rate_hz=100.0)
    assert base.rate_hz == 100.0
    assert base.rate_std_hz == np.inf
    assert base.uniform
    assert base.gap_count == np.count_nonzero(np.diff(pauses) > 1.01)


def test_a_single_batch_has_the_stated_rate_or_none() -> None:
    alone = fit_batch_time_base(stamps(np.zeros(1)), np.array([100]), nominal_rate_hz=200.0)
    assert alone.rate_hz == 200.0
    assert alone.uniform
    assert "stated rate" in alone.advice
    assert not fit_batch_time_base(stamps(np.zeros(1)), np.array([100])).uniform
    assert not fit_batch_time_base(stamps(np.zeros(0)), np.zeros(0, int), nominal_rate_hz=200.0).uniform


def test_batches_that_come_out_of_order_are_sorted_with_their_sizes() -> None:
    counts = np.tile([10, 30], 50)
    first = stamps((np.cumsum(counts) - counts) / 1000)
    order = np.arange(100)
    order[[40, 41]] = [41, 40]
    base = fit_batch_time_base(first[order], counts[order])
    assert base.rate_hz == pytest.approx(1000.0, rel=1e-9)
    assert base.out_of_order == 1
    assert base.missing == 0


@pytest.mark.parametrize("counts", [np.array([1, 0]), np.array([1]), np.array([1.0, 2.0])])
def test_wrong_counts_are_refused(counts: np.ndarray) -> None:
    with pytest.raises(EstimateError, match="counts"):
        fit_batch_time_base(grid(1.0, 2), counts)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, np.nan, np.inf])
def test_a_wrong_nominal_rate_is_refused(rate_hz: float) -> None:
    with pytest.raises(EstimateError, match="nominal rate"):
        fit_batch_time_base(grid(1.0, 2), np.array([1, 1]), nominal_rate_hz=rate_hz)


def test_advice_names_everything_that_was_put_right() -> None:
    when = grid(100.0, 3000)
    when[1000:] -= 60_000_000_000
    when[[50, 51]] = when[[51, 50]]
    when = np.insert(when, 2000, when[2000])
    advice = fit_time_base(np.delete(when, [400, 401])).advice
    assert advice == (
        "the clock was set (1 step); 2 samples missing in 1 gap, averages leave out what touches them; "
        "1 repeated stamp, the first message of each is kept; 1 message late, put in order"
    )


@pytest.mark.parametrize("into_the_second", [0, 13, 49])
@pytest.mark.parametrize("seconds", [20, 120, 700])
def test_stamps_of_whole_seconds_are_bursts_of_all_samples_in_them(into_the_second: int, seconds: int) -> None:
    number = np.arange(50 * seconds)
    base = fit_time_base((number + into_the_second) // 50 * 10**9 + 1_700_000_000 * 10**9)
    assert (base.verdict, base.rate_hz, base.duplicates) == ("bursts", 50.0, 0)
