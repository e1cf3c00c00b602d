"""Placing stamped samples on their grid."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.time_base import TimeBase, fit_batch_time_base, fit_time_base
from chladni.io.clock.uniform import Placer, message_index, place
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from tests.io.clock.stamp_makers import START_NS, grid, in_bursts, stamps

CHANNELS = (Channel(name="number"), Channel(name="twice"))
Case = tuple[Whole, Whole]


def ideal() -> Case:
    return grid(100.0, 2000), np.arange(2000)


def lost() -> Case:
    kept = np.random.default_rng(1).random(2000) > 0.05
    kept[[0, -1]] = True
    return grid(100.0, 2000)[kept], np.flatnonzero(kept)


def scattered_and_lost() -> Case:
    rng = np.random.default_rng(2)
    kept = rng.random(2000) > 0.05
    kept[[0, -1]] = True
    scatter = 0.08 * rng.normal(size=2000).clip(-3, 3)
    return stamps((np.arange(2000) + scatter) / 100)[kept], np.flatnonzero(kept)


def badly_scattered() -> Case:
    # No sample overtakes another, but a tenth of them are nearer to a neighbour's grid point.
    scatter = np.random.default_rng(3).uniform(-0.49, 0.49, 2000) * 1.2
    number = np.arange(2000)
    return np.sort(stamps((number + scatter) / 100)), number


def bursts() -> Case:
    return in_bursts(2000, size=10, rate_hz=100.0, spread_s=1e-5), np.arange(2000)


def bursts_with_a_gap() -> Case:
    number = np.arange(2000)
    number[1000:] += 500
    return stamps((number // 10 + 1) * 0.1), number


def paused() -> Case:
    number = np.arange(2000)
    number[700:] += 555
    number[1200:] += 10_000
    return stamps(number / 100), number


def swapped() -> Case:
    number = np.arange(2000)
    places = np.arange(10, 1990, 37)
    number[places], number[places + 1] = number[places + 1].copy(), number[places].copy()
    return grid(100.0, 2000)[number], number


def set_back() -> Case:
    times = np.arange(2000) / 100
    times[800:] -= 3600
    times[1500:] -= 60
    # One missing sample marks each step, because how long it took is unknown.
    number = np.arange(2000)
    number[800:] += 1
    number[1500:] += 1
    return stamps(times), number


def restarted() -> Case:
    # Simulated time that starts anew with each episode, of 8 to 60 samples.
    lengths = np.random.default_rng(6).integers(8, 61, 60)
    episode = np.repeat(np.arange(60), lengths)
    first = (np.cumsum(lengths) - lengths)[episode]
    number = np.arange(episode.size)
    return stamps((number - first) / 100 + 0.25), number + episode


def restarted_and_scattered() -> Case:
    when, number = restarted()
    scatter = 0.08e7 * np.random.default_rng(7).normal(size=when.size).clip(-3, 3)
    return when + np.rint(scatter).astype(np.int64), number


def restarted_and_late() -> Case:
    when, number = restarted()
    places = np.flatnonzero(np.diff(number, prepend=0) > 1)[1::4] + 4
    for values in (when, number):
        values[places], values[places + 1] = values[places + 1].copy(), values[places].copy()
    return when, number


def ticking() -> Case:
    number = np.arange(3000)
    return stamps(np.floor(number / 1.04) / 100), number


def ticking_and_restarted() -> Case:
    number = np.arange(3000)
    episode = number // 300
    return stamps(np.floor((number % 300) / 1.66) / 1000 + 0.25), number + episode


def from_1970() -> Case:
    when, number = grid(100.0, 2000), np.arange(2000)
    when[:300] -= START_NS
    number[300:] += 1
    return when, number


def wandering() -> Case:
    number = np.arange(20_000)
    return stamps(number / 100 + 0.03 * np.sin(2 * np.pi * number / 20_000)), number


CASES: list[Callable[[], Case]] = [
    ideal,
    lost,
    scattered_and_lost,
    badly_scattered,
    bursts,
    bursts_with_a_gap,
    paused,
    swapped,
    set_back,
    restarted,
    restarted_and_scattered,
    restarted_and_late,
    ticking,
    ticking_and_restarted,
    from_1970,
    wandering,
]


def rows(number: Whole) -> Real:
    """Each sample's value is its true place, so that a sample in a wrong place shows."""
    return np.stack((number, 2.0 * number))


def in_blocks(base: TimeBase, when: Whole, values: Real, seed: int) -> tuple[list[TimeSeries], int]:
    rng = np.random.default_rng(seed)
    placer = Placer(base, CHANNELS)
    blocks = []
    place = 0
    while place < when.size:
        part = slice(place, place + int(rng.integers(1, 300)))
        blocks.append(placer.push(when[part], values[:, part]))
        place = part.stop
    blocks.append(placer.finish())
    return [block for block in blocks if block is not None], placer.left_out


@pytest.mark.parametrize("case", CASES)
def test_every_sample_is_in_its_place_and_what_is_missing_is_marked(case: Callable[[], Case]) -> None:
    when, number = case()
    base = fit_time_base(when)
    series = place(when, rows(number), base, CHANNELS)
    expected = np.full((2, number.max() + 1), np.nan)
    expected[:, number] = rows(number)
    np.testing.assert_array_equal(series.values, expected)
    if np.isnan(expected).any():
        assert series.valid is not None
        np.testing.assert_array_equal(series.valid, ~np.isnan(expected))
    else:
        assert series.valid is None
    assert series.sample_rate_hz == base.rate_hz
    assert series.start_time_ns == base.start_ns
    assert np.count_nonzero(np.isnan(series.values[0])) == base.missing + base.clock.count


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", [1, 2])
def test_blocks_are_the_whole(case: Callable[[], Case], seed: int) -> None:
    when, number = case()
    base = fit_time_base(when)
    whole = place(when, rows(number), base, CHANNELS)
    blocks, left_out = in_blocks(base, when, rows(number), seed)
    np.testing.assert_array_equal(np.concatenate([block.values for block in blocks], axis=1), whole.values)
    assert left_out == 0
    position = 0
    for block in blocks:
        expected_ns = whole.start_time_ns + round(position / base.rate_hz * 1e9)
        assert abs(block.start_time_ns - expected_ns) <= 1
        position += block.samples


@pytest.mark.parametrize("case", CASES)
def test_message_index_is_the_place(case: Callable[[], Case]) -> None:
    when, number = case()
    np.testing.assert_array_equal(message_index(when, fit_time_base(when)), number)


def test_of_repeated_samples_the_first_stays() -> None:
    # Unevenly: every tenth would be the ticks of a clock coarser than the sampling.
    again = np.isin(np.arange(1000), [3, 4, 5, 90, 400, 401, 402, 403, 700, 990])
    when = np.repeat(grid(100.0, 1000), np.where(again, 2, 1))
    number = (when - START_NS) // 10_000_000
    values = np.stack((number, np.arange(when.size)))
    base = fit_time_base(when)
    placer = Placer(base, CHANNELS)
    series = placer.push(when, values, last=True)
    assert series is not None
    assert placer.left_out == 10
    np.testing.assert_array_equal(series.values[0], np.arange(1000))
    assert series.values[1, 3] == 3, "the repeat at arrival 4 is left out"
    assert series.valid is None


def test_grid_times_are_within_half_a_period_of_the_stamps() -> None:
    when, number = paused()
    base = fit_time_base(when)
    series = place(when, rows(number), base, CHANNELS)
    there = series.times_ns()[~np.isnan(series.values[0])]
    assert np.abs(there - when).max() <= 0.5e9 / base.rate_hz


def test_a_sine_sampled_with_jitter_errs_as_stated() -> None:
    rng = np.random.default_rng(4)
    times = (np.arange(20_000) + 0.1 * rng.normal(size=20_000)) / 1000
    when = stamps(times)
    base = fit_time_base(when)
    series = place(when, np.sin(2 * np.pi * 20 * times)[None], base, CHANNELS[:1])
    uniform = np.sin(2 * np.pi * 20 * (series.times_s() + (series.start_time_ns - START_NS) * 1e-9))
    error = np.std(series.values[0] - uniform) * np.sqrt(2)
    assert error == pytest.approx(base.amplitude_error(20.0), rel=0.05)


def test_batches_are_placed_sample_by_sample() -> None:
    counts = np.random.default_rng(5).integers(1, 60, 200)
    first = np.cumsum(counts) - counts
    number = np.arange(counts.sum())
    first[100:] += 777
    number[first[100] - 777 :] += 777
    base = fit_batch_time_base(stamps(first / 1000), counts)
    series = place(stamps(first / 1000), rows(number), base, CHANNELS, counts=counts)
    there = ~np.isnan(series.values[0])
    np.testing.assert_array_equal(series.values[0, there], np.flatnonzero(there))
    assert np.count_nonzero(~there) == 777
    np.testing.assert_array_equal(message_index(stamps(first / 1000), base, counts=counts), first)


def test_swapped_batches_are_put_in_order() -> None:
    counts = np.tile([10, 30], 50)
    first = np.cumsum(counts) - counts
    order = np.arange(100)
    order[[40, 41]] = [41, 40]
    number = np.concatenate([np.arange(first[one], first[one] + counts[one]) for one in order])
    when = stamps(first / 1000)[order]
    base = fit_batch_time_base(when, counts[order])
    series = place(when, rows(number), base, CHANNELS, counts=counts[order])
    np.testing.assert_array_equal(series.values[0], np.arange(2000))
    np.testing.assert_array_equal(message_index(when, base, counts=counts[order]), first[order])


def test_what_isnt_finite_is_marked() -> None:
    values = np.ones((1, 50))
    values[0, [3, 7]] = np.nan, np.inf
    series = place(grid(100.0, 50), values, fit_time_base(grid(100.0, 50)), CHANNELS[:1])
    assert series.valid is not None
    np.testing.assert_array_equal(np.flatnonzero(~series.valid[0]), [3, 7])


@pytest.mark.parametrize(
    ("given_type", "kept"), [(np.float32, np.float32), (np.float64, np.float64), (int, np.float64)]
)
def test_floating_types_are_kept_and_whole_numbers_become_double(given_type: type, kept: type) -> None:
    series = place(grid(1.0, 20), np.ones((1, 20), dtype=given_type), fit_time_base(grid(1.0, 20)), CHANNELS[:1])
    assert series.values.dtype == kept


def test_a_part_of_the_log_starts_at_its_own_place() -> None:
    when = grid(100.0, 2000)
    base = fit_time_base(when)
    part = place(when[500:700], rows(np.arange(500, 700)), base, CHANNELS)
    assert part.start_time_ns == START_NS + 5_000_000_000
    np.testing.assert_array_equal(part.values[0], np.arange(500, 700))


def test_a_message_that_is_later_than_the_stream_waits_is_left_out_and_counted() -> None:
    when = grid(100.0, 2000)
    late = np.delete(np.insert(when, 1501, when[500]), 500)
    base = fit_time_base(late)
    values = rows((late - START_NS) // 10_000_000)
    blocks, left_out = in_blocks(base, late, values, 6)
    joined = np.concatenate([block.values for block in blocks], axis=1)
    assert left_out == 1
    assert np.flatnonzero(np.isnan(joined[0])).tolist() == [500]
    np.testing.assert_array_equal(place(late, values, base, CHANNELS).values[0], np.arange(2000))


@pytest.mark.parametrize(
    ("base", "words"),
    [
        (fit_time_base(np.full(100, START_NS)), "stamps don't move"),
        (fit_time_base(stamps(np.cumsum(np.random.default_rng(7).exponential(1, 1000)))), "come at events"),
        (fit_time_base(stamps(np.zeros(0))), "at least two stamps"),
    ],
)
def test_without_a_grid_nothing_is_placed(base: TimeBase, words: str) -> None:
    with pytest.raises(EstimateError, match=words):
        place(grid(1.0, 5), np.zeros((1, 5)), base, CHANNELS[:1])
    with pytest.raises(EstimateError, match=words):
        message_index(grid(1.0, 5), base)


def test_shapes_must_agree() -> None:
    base = fit_time_base(grid(1.0, 20))
    with pytest.raises(EstimateError, match=r"shape \(1, 20\), but 2 channels and 20 samples in 20 messages"):
        place(grid(1.0, 20), np.zeros((1, 20)), base, CHANNELS)
    with pytest.raises(EstimateError, match="40 samples in 20 messages"):
        place(grid(1.0, 20), np.zeros((2, 20)), base, CHANNELS, counts=np.full(20, 2))
    with pytest.raises(EstimateError, match="no samples"):
        place(grid(1.0, 0), np.zeros((2, 0)), base, CHANNELS)


def test_a_gap_of_days_is_not_filled() -> None:
    when = grid(1000.0, 2000)
    when[1000:] += 8 * 86_400 * 1_000_000_000
    with pytest.raises(EstimateError, match="stamps that leap"):
        place(when, rows(np.arange(2000)), fit_time_base(when), CHANNELS)


@given(
    rate_hz=st.floats(0.5, 50_000.0),
    kept=st.lists(st.booleans(), min_size=30, max_size=400),
    relative_jitter=st.floats(0.0, 0.1),
    seed=st.integers(0, 2**32 - 1),
)
def test_with_small_jitter_nothing_is_misplaced(
    rate_hz: float, kept: list[bool], relative_jitter: float, seed: int
) -> None:
    # At least two thirds are there: of a topic that skips more, the grid can't be known.
    there = np.array(kept) | (np.arange(len(kept)) % 3 > 0)
    there[[0, 1, -1]] = True
    number = np.flatnonzero(there)
    scatter = np.random.default_rng(seed).uniform(-relative_jitter, relative_jitter, number.size)
    when = stamps((number + scatter) / rate_hz)
    base = fit_time_base(when)
    np.testing.assert_array_equal(message_index(when, base), number)
