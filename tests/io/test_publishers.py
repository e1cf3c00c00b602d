"""One source or several on a topic: by labels, and by stamps alone."""

import numpy as np
import pytest

from chladni.io.publishers import at_once, count_by_stamps, evenly_in_turn, told_apart
from chladni.signals.arrays import Whole

SECONDS = 40.0


def ticks(rate_hz: float, offset_s: float = 0.0, *, jitter: float = 0.0, lost: float = 0.0) -> Whole:
    """Stamps of one publisher: a scatter in periods, and a share of messages that are lost."""
    rng = np.random.default_rng(round(1000 * rate_hz + 1e6 * offset_s))
    number = np.arange(int(SECONDS * rate_hz))
    times = offset_s + (number + jitter * rng.standard_normal(number.size)) / rate_hz
    return np.rint((10 + times[rng.random(number.size) >= lost]) * 1e9).astype(np.int64)


def together(*publishers: Whole) -> tuple[Whole, Whole]:
    """Messages of all in the order of their stamps, and whose each is."""
    times = np.concatenate(publishers)
    owner = np.repeat(np.arange(len(publishers)), [one.size for one in publishers])
    order = np.argsort(times, kind="stable")
    return times[order], owner[order]


# --- labels ------------------------------------------------------------------------------------------------------

AT_ONCE = {
    "same rate": (ticks(100), ticks(100, 0.003)),
    "half way between": (ticks(100), ticks(100, 0.005)),
    "at the same times": (ticks(100), ticks(100)),
    "other rates": (ticks(100), ticks(73, 0.001)),
    "scattered": (ticks(100, jitter=0.1), ticks(40, jitter=0.1)),
    "with losses": (ticks(100, lost=0.1), ticks(100, 0.004, lost=0.1)),
    "one joins later": (ticks(100), ticks(50, 0.001)[1000:]),
    "one sends now and then": (ticks(100), ticks(0.5, 0.002)),
    "a single message": (ticks(100), ticks(100, 0.001)[700:701]),
    "three": (ticks(100), ticks(100, 0.003), ticks(25, 0.001)),
}


@pytest.mark.parametrize("publishers", AT_ONCE.values(), ids=AT_ONCE.keys())
def test_publishers_at_once(publishers: tuple[Whole, ...]) -> None:
    assert at_once(*together(*publishers))


@pytest.mark.parametrize("name", AT_ONCE)
def test_only_half_way_between_they_may_be_one_source(name: str) -> None:
    assert evenly_in_turn(*together(*AT_ONCE[name])) == (name == "half way between")


@pytest.mark.parametrize("lost", [0.0, 0.03])
@pytest.mark.parametrize("jitter", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("channels", [2, 3])
def test_one_source_through_channels_in_turn(channels: int, jitter: float, lost: float) -> None:
    number = np.arange(4000)
    keep = np.random.default_rng(9).random(number.size) >= lost
    times = np.rint((number + jitter * np.random.default_rng(1).standard_normal(number.size)) * 5e6).astype(np.int64)
    assert evenly_in_turn(times[keep], (number % channels)[keep])


@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize("turn", [1, 3, 50, 1700])
def test_one_source_that_takes_turns(turn: int, jitter: float) -> None:
    times = ticks(100, jitter=jitter)
    # Turns of one message by each in turn would look like two sources; one to two are enough.
    owner = np.arange(times.size) // turn % 2 if turn > 1 else (np.arange(times.size) % 3 == 0).astype(np.int64)
    assert not at_once(times, owner)


def test_one_source_whose_messages_go_anywhere() -> None:
    times = ticks(100)
    assert not at_once(times, np.random.default_rng(4).integers(0, 3, times.size))


def test_a_source_that_is_followed_by_another() -> None:
    times = ticks(100)
    assert not at_once(times, (np.arange(times.size) > 1500).astype(np.int64))
    assert not at_once(times, np.zeros(times.size, np.int64))


# --- stamps alone ------------------------------------------------------------------------------------------------

BY_STAMPS = {
    "same rate, 2 ms apart": (ticks(100), ticks(100, 0.002)),
    "same rate, 3 ms apart": (ticks(100), ticks(100, 0.003)),
    "scattered": (ticks(100, jitter=0.01), ticks(100, 0.003, jitter=0.01)),
    "with losses": (ticks(100, jitter=0.005, lost=0.03), ticks(100, 0.003, jitter=0.005, lost=0.03)),
    "half the rate": (ticks(100), ticks(50, 0.0032)),
    "other rates": (ticks(100), ticks(73, 0.0004)),
    "a tenth of the rate": (ticks(100), ticks(10, 0.0033)),
}


@pytest.mark.parametrize("publishers", BY_STAMPS.values(), ids=BY_STAMPS.keys())
def test_publishers_that_only_their_stamps_tell_apart(publishers: tuple[Whole, ...]) -> None:
    times, owner = together(*publishers)
    assert count_by_stamps(times, in_bursts=False) == len(publishers)
    apart = told_apart(times)
    assert [one.tolist() for one in apart] == [np.flatnonzero(owner == label).tolist() for label in (0, 1)]


def test_publishers_whose_stamps_cross_are_not_told_apart() -> None:
    """Clocks that slide past each other: whose the next message is can't be known where they meet."""
    times, _ = together(ticks(100, 0.003, jitter=0.01), ticks(100.2, jitter=0.01))
    assert count_by_stamps(times, in_bursts=False) == 2
    assert told_apart(times) == []


def test_publishers_that_pause_are_not_told_apart() -> None:
    times, _ = together(ticks(100), ticks(100, 0.003))
    assert told_apart(times[(times < 20 * 10**9) | (times > 23 * 10**9)]) == []


def bursts(size: int) -> Whole:
    number = np.arange(4000)
    return number // size * size * 10_000_000 + number % size * 100_000


def coarse(rate_hz: float, resolution_ns: int) -> Whole:
    """Stamps of a clock that is coarser than the sampling."""
    return ticks(rate_hz) // resolution_ns * resolution_ns


def delayed() -> Whole:
    """Messages that wait in a queue for a random time, and none overtakes another."""
    return np.maximum.accumulate(ticks(100) + np.random.default_rng(6).exponential(2e6, 4000).astype(np.int64))


SINGLE = {
    "even": ticks(100),
    "scattered by 5 %": ticks(100, jitter=0.05),
    "scattered by 30 %": ticks(100, jitter=0.3),
    "a tenth lost": ticks(100, jitter=0.01, lost=0.1),
    "half lost": ticks(100, jitter=0.01, lost=0.5),
    "104 Hz in 10 ms": coarse(104, 10_000_000),
    "400 Hz in 1 ms": coarse(400, 1_000_000),
    "1344 Hz in 1 ms": coarse(1344, 1_000_000),
    "1660 Hz in 1 ms": coarse(1660, 1_000_000),
    "bursts of 2": bursts(2),
    "bursts of 4": bursts(4),
    "delayed": delayed(),
    "events": np.cumsum(np.random.default_rng(2).exponential(1e7, 4000)).astype(np.int64),
    "another rate later": np.concatenate([ticks(100), ticks(50) + 50 * 10**9]),
    "few": ticks(100)[:6],
    "none": ticks(100)[:0],
}


@pytest.mark.parametrize("in_bursts", [False, True])
@pytest.mark.parametrize("name", SINGLE)
def test_one_source_is_never_taken_for_several(name: str, in_bursts: bool) -> None:
    if in_bursts or not name.startswith("bursts"):
        assert count_by_stamps(SINGLE[name], in_bursts=in_bursts) == 1
