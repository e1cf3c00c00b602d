"""The order in which messages came, whatever the order in which a log stores them."""

from collections.abc import Callable

import numpy as np
import pytest

from chladni.io.arrival import Arrivals, arrival_order, stored_late
from chladni.signals.arrays import Real, Whole

PERIOD_NS = 10_000_000
COUNT = 400

Order = Callable[[np.random.Generator], Whole]


def in_parts(rng: np.random.Generator) -> Whole:
    """Chunks of 50 messages in any order."""
    return np.arange(COUNT).reshape(-1, 50)[rng.permutation(COUNT // 50)].ravel()


ORDERS: dict[str, Order] = {
    "later half first": lambda _: np.roll(np.arange(COUNT), COUNT // 2),
    "parts in any order": in_parts,
    "shuffled": lambda rng: rng.permutation(COUNT),
    "backwards": lambda _: np.arange(COUNT)[::-1],
}


def logged(
    times_ns: Whole,
    *,
    sequence: Whole | None = None,
    channel: Whole | None = None,
) -> Arrivals:
    """Arrivals in the order of the file."""
    return Arrivals(
        log_ns=times_ns,
        sequence=np.zeros(times_ns.size, np.uint32) if sequence is None else sequence.astype(np.uint32),
        channel=None if channel is None else channel.astype(np.uint16),
        position=None if channel is None else np.arange(times_ns.size),
    )


@pytest.mark.parametrize("counted", [True, False], ids=["with a counter", "without one"])
@pytest.mark.parametrize("jitter", [0.0, 0.1], ids=["exact", "scattered"])
@pytest.mark.parametrize("stored", ORDERS.values(), ids=ORDERS.keys())
def test_stored_in_any_order_messages_are_put_into_that_of_time(stored: Order, jitter: float, counted: bool) -> None:
    rng = np.random.default_rng(3)
    scatter = rng.uniform(-jitter, jitter, COUNT)
    times = np.rint((np.arange(COUNT) + scatter) * PERIOD_NS).astype(np.int64)
    place = stored(rng)
    arrivals = logged(times[place], sequence=place + 7 if counted else None)
    order = arrival_order(arrivals.log_ns, arrivals)
    assert order is not None
    np.testing.assert_array_equal(place[order], np.arange(COUNT))
    assert stored_late(order, arrivals) > 0


def test_a_message_lost_where_parts_meet_does_not_hide_their_order() -> None:
    times = np.delete(np.arange(COUNT), COUNT // 2)
    arrivals = logged(np.roll(times, 180) * PERIOD_NS)
    order = arrival_order(arrivals.log_ns, arrivals)
    assert order is not None
    np.testing.assert_array_equal(arrivals.log_ns[order], times * PERIOD_NS)


def test_the_counter_tells_between_messages_of_one_log_time() -> None:
    coarse = np.arange(COUNT) // 3 * 3 * PERIOD_NS
    place = np.random.default_rng(1).permutation(COUNT)
    arrivals = logged(coarse[place], sequence=place)
    order = arrival_order(arrivals.log_ns, arrivals)
    assert order is not None
    np.testing.assert_array_equal(place[order], np.arange(COUNT))


def episodes(rng: np.random.Generator) -> Whole:
    """Simulated time that begins again after 12 messages."""
    return np.tile(np.arange(12), 30)


def set_back(rng: np.random.Generator) -> Whole:
    """A clock that is set back into what it told before, at any length of stretch."""
    starts = np.cumsum(rng.uniform(-60, 20, 12))
    return np.concatenate(
        [start + 2000 + np.arange(length) for start, length in zip(starts, rng.integers(10, 200, 12), strict=True)]
    )


def before_all_else(rng: np.random.Generator) -> Whole:
    """A clock that is set to a time before the log began."""
    return np.concatenate([5000 + np.arange(200), np.arange(200)])


@pytest.mark.parametrize("counted", [True, False], ids=["with a counter", "without one"])
@pytest.mark.parametrize("resolution", [1, PERIOD_NS // 3, 2 * PERIOD_NS], ids=["exact", "coarse", "coarser"])
@pytest.mark.parametrize("clock", [episodes, set_back, before_all_else])
def test_a_clock_that_is_set_back_moves_no_message(
    clock: Callable[[np.random.Generator], Real], resolution: int, counted: bool
) -> None:
    times = np.rint(clock(np.random.default_rng(8)) * PERIOD_NS).astype(np.int64) // resolution * resolution
    arrivals = logged(times, sequence=np.arange(times.size) if counted else None)
    assert np.any(np.diff(times) < 0)
    assert arrival_order(times, arrivals) is None


def test_a_counter_that_begins_again_with_the_clock_moves_no_message() -> None:
    times = episodes(np.random.default_rng(0))
    arrivals = logged(times * PERIOD_NS, sequence=times)
    assert arrival_order(arrivals.log_ns, arrivals) is None


def test_a_recorders_clock_that_is_set_back_does_not_touch_sound_stamps() -> None:
    stamps = np.arange(COUNT) * PERIOD_NS
    # By its log times alone the later half would be stored first.
    assert arrival_order(stamps, logged(np.roll(stamps, COUNT // 2))) is None


def test_messages_of_several_mcap_channels_are_merged() -> None:
    times = np.arange(COUNT) * PERIOD_NS
    turns = np.arange(COUNT) // 50 % 2
    by_channel = np.argsort(turns, kind="stable")
    # A writer that stores one channel after the other: each by itself rises.
    arrivals = logged(times[by_channel], channel=turns[by_channel])
    order = arrival_order(arrivals.log_ns, arrivals)
    assert order is not None
    np.testing.assert_array_equal(arrivals.log_ns[order], times)
    # A chunk is read channel after channel; the position in the file then tells the order, and nothing is late.
    in_file = Arrivals(
        log_ns=times[by_channel],
        sequence=np.zeros(COUNT, np.uint32),
        channel=turns[by_channel].astype(np.uint16),
        position=by_channel,
    )
    order = arrival_order(in_file.log_ns, in_file)
    assert order is not None
    np.testing.assert_array_equal(in_file.log_ns[order], times)
    assert stored_late(order, in_file) == 0


def test_a_clock_set_back_while_channels_take_turns_keeps_the_order_of_the_file() -> None:
    times = np.tile(np.arange(12), 20)
    turns = np.arange(times.size) // 5 % 2
    by_channel = np.argsort(turns, kind="stable")
    arrivals = Arrivals(
        log_ns=times[by_channel] * PERIOD_NS,
        sequence=np.zeros(times.size, np.uint32),
        channel=turns[by_channel].astype(np.uint16),
        position=by_channel,
    )
    order = arrival_order(arrivals.log_ns, arrivals)
    assert order is not None
    np.testing.assert_array_equal(arrivals.log_ns[order], times * PERIOD_NS)
