"""Logs whose clocks were set, or tick coarsely: one time for all topics of a clock, however it's read."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from chladni.io import mcap_log
from chladni.io.clock.shared_clocks import Stamped, clocks_of
from chladni.io.clock.time_base import fit_time_base
from chladni.io.convert import convert
from chladni.io.log import Log, open_log
from chladni.io.repeats import digests_of, repeats_of
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import LogError, SetupError
from chladni.signals.testing import assert_close
from tests.io.clock.stamp_makers import stamps
from tests.io.test_log import together
from tests.make_logs import START_NS, LogMaker, header, write_scalars, write_stored

SAMPLE = """std_msgs/Header header
float64 x
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@dataclass(frozen=True, kw_only=True)
class Topic:
    """Samples of a topic: when they were taken, what their clock said, and which of them were logged."""

    true_s: Real
    told_s: Real
    values: Real


def write(path: Path, topics: Mapping[str, Topic], *, chunk_size: int = 4096, start_s: float = 10.0) -> None:
    """Write all topics in the order in which they were logged, by a clock that runs on."""
    rows = []
    with LogMaker(path, chunk_size=chunk_size) as maker:
        for name, topic in topics.items():
            channel = maker.ros2(name, "test_msgs/msg/Sample", SAMPLE)
            logged = START_NS + np.rint((topic.true_s + 0.002) * 1e9).astype(np.int64)
            told = np.rint((topic.told_s + start_s) * 1e9).astype(np.int64)
            rows += [
                (*row, channel) for row in zip(logged.tolist(), told.tolist(), topic.values.tolist(), strict=True)
            ]
        for logged_ns, told_ns, value, channel in sorted(rows, key=lambda row: row[0]):
            maker.write(channel, {"header": header(told_ns), "x": value}, logged_ns)


def episodes(rate_hz: float, lengths_s: Sequence[float], *, lost: Sequence[int] = (), phase: float = 0.0) -> Topic:
    """Simulated time that starts anew with each episode; a second passes between them. Values are the true times."""
    begun_s = np.cumsum([0.0, *(np.array(lengths_s[:-1]) + 1.0)])
    parts = [np.arange(round(length * rate_hz)) / rate_hz + phase for length in lengths_s]
    told = np.concatenate(parts)
    true = np.concatenate([begun + part for begun, part in zip(begun_s, parts, strict=True)])
    kept = np.delete(np.arange(told.size), lost)
    return Topic(true_s=true[kept], told_s=told[kept], values=true[kept])


LENGTHS_S = [0.4, 0.23, 0.31, 0.6, 0.12, 0.5]
ENDS = (np.cumsum(np.rint(np.array(LENGTHS_S) * 100)) - 1).astype(int)


def names(*topics: str) -> list[str]:
    return [f"{topic}.x" for topic in topics]


def info_of(log: Log, name: str) -> dict[str, object]:
    return next(one for one in log.info().to_json()["channels"] if one["name"] == name)


# --- one topic ---------------------------------------------------------------------------------------------------


def test_every_restart_is_told_and_nothing_is_averaged_across(tmp_path: Path) -> None:
    topic = episodes(100.0, LENGTHS_S)
    write(tmp_path / "a.mcap", {"/a": topic})
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(names("/a"))
        there = np.isfinite(series.values[0])
        np.testing.assert_array_equal(series.values[0, there], topic.values)
        np.testing.assert_array_equal(np.flatnonzero(~there), ENDS[:-1] + 1 + np.arange(5))
        found = info_of(log, "/a.x")
        np.testing.assert_allclose(found["breaks"], (ENDS[:-1] + 2 + np.arange(5)) / 100, atol=1e-6)
        assert found["longest_stretch_s"] == pytest.approx(0.6)
        assert (found["gaps"], found["duplicates"], found["rate_hz"]) == ([], 0, 100.0)
        # What was recorded, not what lies between.
        assert log.info().duration_s == pytest.approx(sum(LENGTHS_S))
        told = "\n".join(log.info().findings)
        assert "the clock was set 5 times (-0.39 s, -0.22 s, -0.3 s, ...)" in told
        assert "the longest stretch is 0.6 s" in told


def test_the_log_s_own_clock_may_be_set_back(tmp_path: Path) -> None:
    number = np.arange(720)
    with LogMaker(tmp_path / "a.mcap", chunk_size=512) as maker:
        channel = maker.ros2("/a", "std_msgs/msg/Float64", "float64 data\n")
        for one in number.tolist():
            maker.write(channel, {"data": float(one)}, (one % 12 + 1) * 100_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read()
        there = np.isfinite(series.values[0])
        np.testing.assert_array_equal(series.values[0, there], number)
        np.testing.assert_array_equal(np.flatnonzero(there), number + number // 12)
        found = info_of(log, "/a.data")
        assert (len(found["breaks"]), found["longest_stretch_s"]) == (59, pytest.approx(1.2))
        assert log.info().duration_s == pytest.approx(72.0)
        assert json.loads(json.dumps(log.info().to_json(), allow_nan=False))


def test_a_restart_is_no_spike_and_no_dropout_of_the_sensor(tmp_path: Path) -> None:
    topic = episodes(100.0, [3.0] * 5)
    slow = Topic(true_s=topic.true_s, told_s=topic.told_s, values=np.sin(2 * np.pi * 0.7 * topic.true_s))
    noisy = slow.values + 1e-3 * np.random.default_rng(1).standard_normal(slow.values.size)
    write(tmp_path / "a.mcap", {"/a": Topic(true_s=slow.true_s, told_s=slow.told_s, values=noisy)})
    with open_log(tmp_path / "a.mcap") as log:
        assert not any("spike" in finding or "clip" in finding for finding in log.info().findings)


@pytest.mark.parametrize(("start_s", "end_s"), [(0.3, 0.9), (1.0, None), (None, 0.55), (0.66, 0.71), (0.0, 5.0)])
def test_a_window_is_one_of_the_time_that_runs_on(tmp_path: Path, start_s: float | None, end_s: float | None) -> None:
    write(tmp_path / "a.mcap", {"/a": episodes(100.0, LENGTHS_S), "/b": episodes(100.0, LENGTHS_S)})
    with open_log(tmp_path / "a.mcap") as log:
        whole = log.read(names("/a", "/b"))
        part = log.read(names("/a", "/b"), start_s=start_s, end_s=end_s)
        # A missing sample at an end isn't there at all.
        expected = whole.window(start_s=start_s, end_s=end_s)
        inside = np.flatnonzero(np.isfinite(expected.values[0]))
        np.testing.assert_array_equal(part.values, expected.values[:, inside[0] : inside[-1] + 1])
        assert part.start_time_ns == pytest.approx(expected.times_ns()[inside[0]], abs=2)
        blocks = list(log.blocks(names("/a", "/b"), seconds=0.17, start_s=start_s, end_s=end_s))
        assert_close(together(blocks), part, rtol=0, atol=0)


def test_a_window_of_a_large_log_is_found_by_log_time_unless_a_clock_was_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_log, "READ_WHOLE_BYTES", 0)
    sound = episodes(100.0, [100.0])
    set_back = episodes(100.0, [20.0] * 5)
    for name, topic in (("sound", sound), ("set", set_back)):
        write(tmp_path / f"{name}.mcap", {"/a": topic})
    with open_log(tmp_path / "sound.mcap") as log:
        part = log.read(names("/a"), start_s=70, end_s=71)
        np.testing.assert_array_equal(part.values[0], sound.values[7000:7100])
        assert log._clocks is not None
        assert not log._clocks._seen, "nothing but the window was read"
    with open_log(tmp_path / "set.mcap") as log:
        part = log.read(names("/a"), start_s=70.0, end_s=71)
        np.testing.assert_array_equal(part.values[0], log.read(names("/a")).window(start_s=70, end_s=71).values[0])


# --- several topics ---------------------------------------------------------------------------------------------


def test_topics_of_one_clock_stay_together_whatever_each_of_them_lost(tmp_path: Path) -> None:
    # The second lacks the last sample of an episode and the first one of another.
    whole = episodes(100.0, LENGTHS_S)
    part = episodes(100.0, LENGTHS_S, lost=[int(ENDS[0]), int(ENDS[2]) + 1, 70])
    write(tmp_path / "a.mcap", {"/a": whole, "/b": part})
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(names("/a", "/b"))
        both = np.isfinite(series.values).all(axis=0)
        assert np.count_nonzero(both) == part.values.size
        np.testing.assert_array_equal(series.values[0, both], series.values[1, both])
        assert_close(together(list(log.blocks(names("/a", "/b"), seconds=0.3))), series, rtol=0, atol=0)
        assert len(info_of(log, "/a.x")["breaks"]) == len(info_of(log, "/b.x")["breaks"]) == 5
        # Where each stretch begins is the same time for both, but for the sample that one has lost.
        np.testing.assert_allclose(info_of(log, "/a.x")["breaks"], info_of(log, "/b.x")["breaks"], atol=0.0101)


@pytest.mark.parametrize("rate_hz", [50.0, 25.0, 40.0])
def test_topics_of_different_rates_keep_their_phases(tmp_path: Path, rate_hz: float) -> None:
    topics = {}
    for name, rate in (("/fast", 200.0), ("/slow", rate_hz)):
        topic = episodes(rate, [5.0, 3.0, 4.1, 6.0])
        topics[name] = Topic(
            true_s=topic.true_s, told_s=topic.told_s, values=np.sin(2 * np.pi * 2.0 * topic.true_s + 0.4)
        )
    write(tmp_path / "a.mcap", topics)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(names("/fast", "/slow"), sample_rate_hz=200.0)
        both = np.isfinite(series.values).all(axis=0)
        assert np.count_nonzero(both) > 0.5 * 18.1 * 200
        np.testing.assert_allclose(series.values[0, both], series.values[1, both], atol=2e-3)
    written = convert(tmp_path / "a.mcap", tmp_path / "b.csv", resample_hz=200.0)
    assert written.channels == tuple(names("/fast", "/slow"))


def test_topics_whose_clocks_were_set_at_different_times_are_not_brought_together(tmp_path: Path) -> None:
    set_back = episodes(100.0, LENGTHS_S)
    sound = Topic(true_s=set_back.true_s, told_s=set_back.true_s, values=set_back.values)
    write(tmp_path / "a.mcap", {"/a": set_back, "/b": sound})
    told = "the clock of /a was set 5 times and that of /b 0 times"
    with open_log(tmp_path / "a.mcap") as log:
        with pytest.raises(LogError, match=told):
            log.read(names("/a", "/b"))
        with pytest.raises(LogError, match=told):
            log.read(names("/a", "/b"), sample_rate_hz=100.0)
        with pytest.raises(LogError, match=told):
            next(iter(log.blocks(names("/a", "/b"), seconds=1.0)))
        assert [one.channels[0].name for one in log.read_groups(names("/a", "/b"))] == names("/a", "/b")
        # What the message tells to do.
        assert log.read(names("/a", "/b"), end_s=0.39).samples == 39
        assert log.read(names("/a")).channels[0].name == "/a.x"
    with pytest.raises(LogError, match=told):
        convert(tmp_path / "a.mcap", tmp_path / "b.csv", resample_hz=100.0)
    with open_log(tmp_path / "a.mcap", stamp="log") as log:
        series = log.read(names("/a", "/b"))
        there = np.isfinite(series.values[0])
        np.testing.assert_array_equal(series.values[0, there], series.values[1, there])


def test_a_sensor_that_is_set_ahead_is_told_by_the_log(tmp_path: Path) -> None:
    true_s = np.arange(4000) / 100
    ahead = Topic(true_s=true_s, told_s=true_s + 60.0 * (true_s >= 15), values=true_s)
    paused_s = true_s + 60.0 * (true_s >= 15)
    write(tmp_path / "ahead.mcap", {"/a": ahead})
    write(tmp_path / "paused.mcap", {"/a": Topic(true_s=paused_s, told_s=paused_s, values=true_s)})
    with open_log(tmp_path / "ahead.mcap") as log:
        assert info_of(log, "/a.x")["breaks"] == [pytest.approx(15.01)]
        assert info_of(log, "/a.x")["gaps"] == []
        assert log.info().duration_s == pytest.approx(40.0)
    with open_log(tmp_path / "paused.mcap") as log:
        assert len(info_of(log, "/a.x")["gaps"]) == 1


# --- clocks that tick coarsely, and rates that are stated --------------------------------------------------------


def test_samples_that_share_a_stamp_are_all_there(tmp_path: Path) -> None:
    number = np.arange(4032)
    when = START_NS + np.floor(number / 1.344).astype(np.int64) * 1_000_000
    write_scalars(tmp_path / "a.mcap", {"/a": (when, number.astype(float))}, chunk_size=2048)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read()
        assert series.sample_rate_hz == pytest.approx(1344.0, rel=1e-4)
        np.testing.assert_array_equal(series.values[0], number)
        assert_close(together(list(log.blocks(["/a.data"], seconds=0.5))), series, rtol=0, atol=0)
        found = info_of(log, "/a.data")
        assert (found["duplicates"], found["gaps"]) == (0, [])
        assert found["rate_std_hz"] == pytest.approx(0.007, rel=0.5)
        assert "ticks of 1 ms" in "\n".join(log.info().findings)


def test_a_slow_signal_repeats_values_but_not_samples(tmp_path: Path) -> None:
    # Most of those that share a stamp are alike, some aren't: all are samples of 104 Hz.
    number = np.arange(6240)
    when = START_NS + np.floor(number / 1.04).astype(np.int64) * 10_000_000
    write_scalars(tmp_path / "a.mcap", {"/a": (when, np.floor(number / 7))})
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read().sample_rate_hz == 104.0
        assert log.read().samples == 6240


def test_a_stated_rate_is_for_what_the_stamps_leave_open(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    lost = np.flatnonzero(rng.random(5000) > 0.02)
    coarse = START_NS + lost // 10 * 10_000_000
    events = np.sort(START_NS + rng.integers(0, 5 * 10**9, 300))
    sound = START_NS + np.arange(1000) * 5_000_000
    columns = {"/coarse": (coarse, lost * 1.0), "/events": (events, events * 1.0), "/sound": (sound, sound * 1.0)}
    write_scalars(tmp_path / "a.mcap", columns)
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError, match="--rate HZ"):
        log.read(["/coarse.data"])
    with open_log(tmp_path / "a.mcap", sample_rate_hz=1000.0) as log:
        assert log.read(["/coarse.data"]).sample_rate_hz == 1000.0
        assert info_of(log, "/coarse.data")["rate_hz"] == 1000.0
        assert log.read(["/sound.data"]).sample_rate_hz == 200.0
        # Events come far more rarely; only who names them means them.
        assert info_of(log, "/events.data")["longest_stretch_s"] is None
        assert log.read(["/events.data"]).sample_rate_hz == 1000.0


@pytest.mark.parametrize("rate_hz", [0.0, -5.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate_hz: float) -> None:
    write(tmp_path / "a.mcap", {"/a": episodes(100.0, [1.0])})
    with pytest.raises(SetupError, match="must be finite and positive"):
        open_log(tmp_path / "a.mcap", sample_rate_hz=rate_hz)


# --- the pieces --------------------------------------------------------------------------------------------------


def stamped(name: str, when: Whole) -> Stamped:
    return Stamped(key=(name,), stamps_ns=when, base=fit_time_base(when))


def test_clocks_are_told_apart_by_how_often_and_when_they_were_set() -> None:
    def restarts(rate_hz: float, lengths_s: Sequence[float]) -> Whole:
        return stamps(np.concatenate([np.arange(round(one * rate_hz)) / rate_hz for one in lengths_s]))

    found = clocks_of(
        [
            stamped("sound", stamps(np.arange(500) / 100)),
            stamped("fast", restarts(1000.0, [1.0, 2.0, 0.5])),
            stamped("slow", restarts(50.0, [1.0, 2.0, 0.5])),
            stamped("more", restarts(1000.0, [1.0, 2.0, 0.5, 1.0])),
            stamped("others", restarts(1000.0, [3.0, 0.4, 2.0])),
        ]
    )
    numbers = {key[0]: clock.number for key, clock in found.items()}
    assert numbers == {"fast": 0, "slow": 0, "more": 1, "others": 2}
    fast, slow = found["fast",].steps, found["slow",].steps
    np.testing.assert_array_equal(fast.shift_ns, slow.shift_ns)
    # Whole periods of both, and at least two of the slower one from its last sample to the next one.
    turns = fast.shift_ns / 20e6
    np.testing.assert_allclose(turns, np.rint(turns), atol=0.01)
    assert np.all(fast.shift_ns >= np.cumsum([0.98e9 + 40e6, 1.98e9 + 40e6]) - 1)


def test_equal_samples_have_equal_digests() -> None:
    rng = np.random.default_rng(3)
    for kind in (np.float32, np.float64):
        values = rng.standard_normal((3, 500)).astype(kind)
        values[:, 100] = values[:, 7]
        values[1, 200] = np.nan
        values[:, 300] = values[:, 200]
        digests = digests_of(values)
        assert digests[100] == digests[7]
        assert digests[300] == digests[200]
        assert np.unique(digests).size == 498
        # Channels that swap their values are another sample.
        assert digests_of(values[::-1].copy())[5] != digests[5]


def test_a_message_repeats_the_one_with_its_stamp_and_samples() -> None:
    when = np.array([0, 10, 10, 20, 20, 30, 10])
    digests = np.array([1, 2, 2, 3, 4, 5, 2], dtype=np.uint64)
    repeats = repeats_of(when, digests)
    assert repeats is not None
    assert repeats.differ, "two samples were stamped 20"
    np.testing.assert_array_equal(repeats.twin, [0, 1, 1, 3, 4, 5, 1])
    assert repeats_of(np.arange(4), np.zeros(4, np.uint64)) is None


def test_series_of_a_broken_log_survive_conversion(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", {"/a": episodes(100.0, LENGTHS_S)})
    convert(tmp_path / "a.mcap", tmp_path / "b.mcap")
    with open_log(tmp_path / "a.mcap") as one, open_log(tmp_path / "b.mcap") as other:
        before, after = one.read(), other.read()
        np.testing.assert_allclose(after.values, before.values)
        assert after.sample_rate_hz == before.sample_rate_hz


def test_a_window_of_a_large_log_whose_own_clock_was_set_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_log, "READ_WHOLE_BYTES", 0)
    number = np.arange(8000)
    write_stored(tmp_path / "a.mcap", START_NS + number % 2000 * 10_000_000, number.astype(float), chunk_size=4096)
    with open_log(tmp_path / "a.mcap") as log:
        # Chunks say that log times go back; three samples are left out before the fourth stretch.
        part = log.read(["/s.data"], start_s=65.0, end_s=66.0)
        np.testing.assert_array_equal(part.values[0], np.arange(6500, 6600) - 3)
