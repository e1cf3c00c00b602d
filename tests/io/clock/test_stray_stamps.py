"""A single wrong stamp moves no other sample: it's told, and its own sample is in its place or left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.clock.stray_stamps import find_strays
from chladni.io.clock.time_base import fit_batch_time_base, fit_time_base
from chladni.io.clock.uniform import Placer, message_index, place
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from tests.io.clock.stamp_makers import START_NS

STEP_NS = 10_000_000
CHANNELS = [Channel(name="number")]


def jittered(samples: int, jitter: float, seed: int) -> Whole:
    scatter = np.random.default_rng(seed).uniform(-jitter, jitter, samples)
    return START_NS + np.rint((np.arange(samples) + scatter) * STEP_NS).astype(np.int64)


def where_it_claims(kind: str, true: Whole, place: int, share: float) -> int:
    """Another time for one sample."""
    span = int(true[-1] - true[0])
    if kind == "inside":
        return int(true[0]) + round(share * span)
    if kind == "near":
        return int(true[place]) + round(6 * (share - 0.5) * STEP_NS)
    if kind == "a neighbour's":
        return int(true[max(0, place - 1)] if share < 0.5 else true[min(true.size - 1, place + 1)])
    if kind == "another's":
        return int(true[round(share * (true.size - 1))])
    return int(true[0] - (1 + share * span) if kind == "before" else true[-1] + 1 + share * span)


KINDS = ["inside", "near", "a neighbour's", "another's", "before", "after"]
one_wrong = given(
    samples=st.integers(12, 200) | st.integers(1200, 3000),
    jitter=st.sampled_from([0.0, 0.01, 0.05, 0.1]),
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(KINDS),
    at=st.floats(0, 1),
    share=st.floats(0, 1),
)


def spoiled(samples: int, jitter: float, seed: int, kind: str, at: float, share: float) -> tuple[Whole, int]:
    # The first and the last sample are by themselves: before them and after them any time may be one.
    wrong = 1 + round(at * (samples - 3))
    stamps = jittered(samples, jitter, seed)
    stamps[wrong] = where_it_claims(kind, stamps, wrong, share)
    return stamps, wrong


def require_places(values: Real, first: int, wrong: int, samples: int, told: int) -> None:
    """Every number at its own place but the wrong one, which is there or missing, and told where it's missing."""
    number = first + np.arange(values.size)
    there = np.isfinite(values)
    np.testing.assert_array_equal(values[there], number[there])
    assert sorted({*range(samples)} - {*values[there].astype(int).tolist()}) in ([], [wrong])
    assert np.count_nonzero(there) + told >= samples


@one_wrong
def test_one_wrong_stamp_moves_no_other_sample(
    samples: int, jitter: float, seed: int, kind: str, at: float, share: float
) -> None:
    stamps, wrong = spoiled(samples, jitter, seed, kind, at, share)
    base = fit_time_base(stamps)
    series = place(stamps, np.arange(samples, dtype=float)[None], base, CHANNELS)
    first = round((series.start_time_ns - START_NS) / STEP_NS)
    require_places(series.values[0], first, wrong, samples, base.strays.size + base.duplicates)
    index = message_index(stamps, base)
    assert set(np.flatnonzero(index == NOWHERE)) >= set(base.strays.tolist())
    np.testing.assert_array_equal(np.delete(index - index[0], wrong), np.delete(np.arange(samples), wrong))


@one_wrong
def test_blocks_of_a_log_with_a_wrong_stamp_are_those_of_the_whole(
    samples: int, jitter: float, seed: int, kind: str, at: float, share: float
) -> None:
    stamps, _ = spoiled(samples, jitter, seed, kind, at, share)
    base, numbers = fit_time_base(stamps), np.arange(samples, dtype=float)[None]
    placer = Placer(base, CHANNELS)
    parts = [slice(first, first + 50) for first in range(0, samples, 50)]
    blocks = [*(placer.push(stamps[part], numbers[:, part]) for part in parts), placer.finish()]
    in_blocks = np.concatenate([block.values[0] for block in blocks if block is not None])
    np.testing.assert_array_equal(in_blocks, place(stamps, numbers, base, CHANNELS).values[0])


@pytest.mark.parametrize("jitter", [0.0, 0.05])
@pytest.mark.parametrize(("late", "by"), [([30], 1), ([30], 5), ([30, 31], 4), ([10, 40, 41, 42], 3), ([99], 0)])
def test_late_messages_are_put_in_order(late: list[int], by: int, jitter: float) -> None:
    stamps = jittered(100, jitter, seed=1)
    came = np.arange(100.0)
    came[late] += by + 0.5
    order = np.argsort(came, kind="stable")
    assert not find_strays(stamps[order]).size
    series = place(stamps[order], order[None].astype(float), fit_time_base(stamps[order]), CHANNELS)
    np.testing.assert_array_equal(series.values[0], np.arange(100))


def test_a_late_message_beside_lost_ones_is_put_in_order() -> None:
    """One was lost where it came, but it fits where its stamp says."""
    order = np.array([0, 1, 2, 4, 3, 6, 7, 8, 9, 10, 11, 12, 13])
    assert not find_strays(jittered(20, 0.0, seed=0)[order]).size
    order = np.array([0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 4, 12, 13, 14])
    assert not find_strays(jittered(20, 0.0, seed=0)[order]).size


def test_a_stamp_amid_a_pause_is_no_late_message() -> None:
    stamps = np.delete(jittered(400, 0.02, seed=2), np.arange(150, 250))
    stamps[60] = START_NS + 200 * STEP_NS
    assert find_strays(stamps).tolist() == [60]


@pytest.mark.parametrize("wrong", [[0], [199], [50, 51], [0, 77, 130], [20, 40, 60, 80, 81, 199]])
@pytest.mark.parametrize("seed", range(10))
def test_a_few_wrong_stamps_are_found(wrong: list[int], seed: int) -> None:
    stamps = jittered(200, 0.05, seed)
    # Amid others, where no wrong one has left a place.
    stamps[wrong] = stamps[100] + 1_234_567 * np.arange(1, len(wrong) + 1)
    assert find_strays(stamps).tolist() == wrong


@pytest.mark.parametrize("claims", [-3.4, 20.3, 55.7, 100.2])
def test_a_wrong_stamp_of_a_batch_moves_no_other(claims: float) -> None:
    sizes = np.random.default_rng(3).integers(5, 40, 60)
    before = np.cumsum(sizes) - sizes
    stamps = START_NS + before * STEP_NS
    stamps[30] = START_NS + round(claims / 60 * int(sizes.sum()) * STEP_NS)
    base = fit_batch_time_base(stamps, sizes)
    assert base.strays.tolist() == [30]
    assert base.samples == sizes.sum() - sizes[30]
    series = place(stamps, np.arange(sizes.sum(), dtype=float)[None], base, CHANNELS, counts=sizes)
    numbers = np.arange(float(sizes.sum()))
    numbers[before[30] : before[31]] = np.nan
    np.testing.assert_array_equal(series.values[0], numbers)


@pytest.mark.parametrize("wrong", [40, 140])
def test_a_wrong_stamp_beside_a_clock_that_was_set(wrong: int) -> None:
    """The step is counted in all messages, the samples in those that have a place."""
    stamps = jittered(200, 0.01, seed=4)
    stamps[100:] -= 3600 * 10**9
    stamps[wrong] = stamps[wrong + 25] + 1_000_000
    base = fit_time_base(stamps)
    assert base.clock.message.tolist() == [100]
    assert base.strays.tolist() == [wrong]
    index = message_index(stamps, base)
    expected = np.arange(200) + (np.arange(200) >= 100)
    expected[wrong] = NOWHERE
    np.testing.assert_array_equal(index, expected)


@pytest.mark.parametrize("shares", [(20.0, 20.0), (19.9, 20.0), (20.0, 20.2)])
def test_two_on_one_point_go_by_their_order(shares: tuple[float, float]) -> None:
    """Samples 19 and 20 have stamps near one point; that of the other is free before or behind it."""
    for moved in (19, 21):
        stamps = jittered(3000, 0.0, seed=0)
        stamps[[19, 20] if moved == 19 else [20, 21]] = START_NS + np.rint(np.array(shares) * STEP_NS).astype(int)
        base = fit_time_base(stamps)
        assert base.smoothing == 1
        values = place(stamps, np.arange(3000.0)[None], base, CHANNELS).values[0]
        there = np.isfinite(values)
        np.testing.assert_array_equal(values[there], np.flatnonzero(there))
        # Of one and the same stamp it isn't known which message is the other's repeat.
        assert there.all() == (shares[0] != shares[1])
        assert (base.gap_count, base.missing) == ((0, 0) if there.all() else (1, 1))


@given(st.lists(st.integers(0, 2**61), max_size=40))
def test_any_stamps_have_strays_or_none(stamps: list[int]) -> None:
    some = np.array(stamps, dtype=np.int64)
    strays = find_strays(some)
    assert np.all(np.diff(strays) > 0)
    assert strays.size == 0 or (strays[0] >= 0 and strays[-1] < some.size)
    assert fit_time_base(some).samples in (some.size, some.size - strays.size)


def test_events_have_no_strays_left_out() -> None:
    """Where nothing keeps a rate, no stamp contradicts another."""
    rng = np.random.default_rng(5)
    stamps = START_NS + np.cumsum(rng.exponential(STEP_NS, 500)).astype(np.int64)
    stamps[200] = stamps[300] + 1
    base = fit_time_base(stamps)
    assert not base.uniform
    assert not base.strays.size
    assert base.samples == 500


def test_strays_are_told() -> None:
    stamps = jittered(64, 0.0, seed=0)
    stamps[20] = START_NS + 780_000
    base = fit_time_base(stamps)
    assert base.verdict == "regular"
    assert "1 stamp contradicts the count of samples around, left out" in base.advice
    assert base.gaps == ((pytest.approx(0.19), pytest.approx(0.21)),)
