"""Logs on a grid: what was written comes back, whole or block by block, and what isn't there is told."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from chladni.io.log import Log, open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import LogError, SetupError
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from tests.make_logs import (
    ACCEL_STAMPED,
    IMU,
    JOINT_STATE,
    SAMPLE_BLOCK,
    SENSOR_ACCEL_FIFO,
    START_NS,
    LogMaker,
    accel_fifo,
    header,
    imu,
    joint_state,
    protobuf_log,
    sample_block,
    vector,
    write_imu_log,
    write_scalars,
)

AXES = ["/imu.linear_acceleration.x", "/imu.linear_acceleration.y", "/imu.linear_acceleration.z"]


def noise(channels: int, samples: int, seed: int = 1) -> Real:
    return np.random.default_rng(seed).standard_normal((channels, samples))


def together(blocks: Sequence[TimeSeries]) -> TimeSeries:
    """Consecutive blocks as one series."""
    for before, after in pairwise(blocks):
        step_ns = after.start_time_ns - before.start_time_ns
        assert step_ns == pytest.approx(before.duration_s * 1e9, abs=1.5)
    valid = None
    if not all(block.all_valid() for block in blocks):
        valid = np.concatenate([np.isfinite(block.values) for block in blocks], axis=1)
    return TimeSeries(
        values=np.concatenate([block.values for block in blocks], axis=1),
        sample_rate_hz=blocks[0].sample_rate_hz,
        start_time_ns=blocks[0].start_time_ns,
        channels=blocks[0].channels,
        valid=valid,
    )


@pytest.fixture(scope="module")
def imu_log(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Log, Real]]:
    path = tmp_path_factory.mktemp("imu") / "imu.mcap"
    linear = noise(3, 2000)
    write_imu_log(path, linear)
    with open_log(path) as log:
        yield log, linear


# --- one topic ---------------------------------------------------------------------------------------------------


def test_channels_of_an_imu(imu_log: tuple[Log, Real]) -> None:
    log, _ = imu_log
    units = {channel.name: channel.unit for channel in log.channels}
    assert units == {
        **{f"/imu.orientation.{axis}": "1" for axis in "xyzw"},
        **{f"/imu.angular_velocity.{axis}": "rad/s" for axis in "xyz"},
        **{f"/imu.linear_acceleration.{axis}": "m/s^2" for axis in "xyz"},
    }


def test_samples_come_back_bit_for_bit(imu_log: tuple[Log, Real]) -> None:
    log, linear = imu_log
    series = log.read(AXES)
    np.testing.assert_array_equal(series.values, linear)
    assert (series.sample_rate_hz, series.start_time_ns, series.valid) == (200.0, START_NS, None)
    assert [channel.name for channel in series.channels] == AXES


def test_order_is_that_of_the_paths(imu_log: tuple[Log, Real]) -> None:
    log, linear = imu_log
    np.testing.assert_array_equal(log.read(AXES[::-1]).values, linear[::-1])
    # Asked for twice, it's there once: names are unique.
    assert log.read([AXES[1], AXES[1]]).values.shape == (1, 2000)


def test_hidden_fields_can_be_read_by_path(imu_log: tuple[Log, Real]) -> None:
    log, _ = imu_log
    stamps = log.read(["/imu.header.stamp", "/imu.linear_acceleration_covariance[4]"])
    # Seconds since 1970 in double precision, rounded twice: half a microsecond.
    np.testing.assert_allclose(stamps.values[0] - 1.7e9, np.arange(2000) / 200, rtol=0, atol=5e-7)
    assert not stamps.values[1].any()


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_blocks_are_what_read_gives(tmp_path: Path, compression: str) -> None:
    linear = noise(3, 1501)
    write_imu_log(tmp_path / "a.mcap", linear, compression=compression)
    with open_log(tmp_path / "a.mcap") as log:
        blocks = list(log.blocks(AXES, seconds=0.4))
        assert [block.samples for block in blocks] == [80] * 18 + [61]
        assert_close(together(blocks), log.read(AXES), rtol=0, atol=0)


def test_a_window_of_time(imu_log: tuple[Log, Real]) -> None:
    log, linear = imu_log
    series = log.read(AXES, start_s=2.5, end_s=5.0)
    np.testing.assert_array_equal(series.values, linear[:, 500:1000])
    assert series.start_time_ns == START_NS + 2_500_000_000
    np.testing.assert_array_equal(log.read(AXES, end_s=1.0).values, linear[:, :200])
    np.testing.assert_array_equal(log.read(AXES, start_s=9.9).values, linear[:, 1980:])
    blocks = list(log.blocks(AXES, seconds=1.0, start_s=2.5, end_s=5.0))
    assert_close(together(blocks), series, rtol=0, atol=0)


@pytest.mark.parametrize(
    ("window", "told"),
    [
        ({"start_s": 100.0}, "has no sample between 100.0 s and its end"),
        ({"start_s": 3.0, "end_s": 3.0}, "the window from 3.0 s to 3.0 s is empty"),
        ({"start_s": float("nan")}, "must be finite"),
    ],
)
def test_windows_without_samples(imu_log: tuple[Log, Real], window: dict[str, float], told: str) -> None:
    log, _ = imu_log
    with pytest.raises(LogError, match=told):
        log.read(AXES, **window)


def test_blocks_need_a_length(imu_log: tuple[Log, Real]) -> None:
    log, _ = imu_log
    with pytest.raises(LogError, match="seconds must be finite and positive"):
        list(log.blocks(AXES, seconds=0))


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("/imu.linear_accel.x", r"imu.mcap: '/imu.linear_accel.x': .* did you mean linear_acceleration.x"),
        ("/im.x", "no topic of the log starts this path; did you mean /imu"),
        ("/imu", "is a topic; name a channel of it"),
        ("/imu.linear_acceleration", "have no field 'linear_acceleration'"),
        ("/imu.header.frame_id", "is text, not a number"),
        ("/imu.linear_acceleration.x[0]", "is a single value, not an array"),
        ("/imu.linear_acceleration_covariance", r"is an array; name an element, .*\[0\]"),
        ("/imu.linear_acceleration_covariance[:]", "a slice gives many numbers"),
        ("/imu.linear_acceleration_covariance[0][1]", "takes an index for each array it is in; leave out the index"),
        ("/imu.linear_acceleration_covariance[a]", "names its elements; give a number"),
        ("/imu.nothing[0]", "have no field 'nothing'"),
        ("/imu{header.frame_id==3}.orientation.x", "is text: compare it"),
        ('/imu{header.frame_id<"3"}.orientation.x', "is text: compare it"),
        ('/imu{orientation.x=="3"}.orientation.x', "is a number: leave out the quotes"),
        ("/imu{linear_acceleration_covariance==3}.orientation.x", "is an array"),
        ("/imu{nothing==3}.orientation.x", "have no field 'nothing'"),
    ],
)
def test_paths_that_name_nothing(imu_log: tuple[Log, Real], path: str, told: str) -> None:
    log, _ = imu_log
    with pytest.raises(LogError, match=told):
        log.read([path])


def test_a_topic_of_one_channel_is_that_channel(tmp_path: Path) -> None:
    made = TimeSeries.from_arrays({"force": [1.0, 2.0, 3.0], "tip": [4.0, 5.0, 6.0]}, sample_rate_hz=10.0)
    write_mcap([made], tmp_path / "named.mcap")
    log = open_log(tmp_path / "named.mcap")
    assert [one.name for one in log.channels] == ["/force.value", "/tip.value"]
    setup = tmp_path / "setup.toml"
    setup.write_text('format = "chladni.setup/1"\n[[channel]]\npath = "/force.value"\nunit = "kN"\n')
    told = open_log(tmp_path / "named.mcap", setup=setup)
    for word in ("force", "/force", "/force.value"):
        assert log.read(word).values.tolist() == [[1.0, 2.0, 3.0]]
        assert told.read(word).values.tolist() == [[1000.0, 2000.0, 3000.0]]


def test_nothing_asked_for(imu_log: tuple[Log, Real]) -> None:
    with pytest.raises(LogError, match="no channel is asked for"):
        imu_log[0].read([])


# --- gaps, disorder, repeats -------------------------------------------------------------------------------------


def scattered_log(path: Path, order: Whole, values: Real) -> None:
    """Messages of a 100 Hz grid, written in the order given, as they're logged; some may be missing or repeated."""
    with LogMaker(path, chunk_size=2048) as log:
        channel = log.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for index, reached in zip(order.tolist(), np.maximum.accumulate(order).tolist(), strict=True):
            stamp_ns = START_NS + index * 10_000_000
            log.write(channel, imu(stamp_ns, (values[index], 0, 0)), START_NS + reached * 10_000_000 + 5_000_000)


def test_gaps_are_marked_and_never_bridged(tmp_path: Path) -> None:
    values = noise(1, 1000)[0]
    keep = np.delete(np.arange(1000), np.r_[300:350, 700])
    scattered_log(tmp_path / "a.mcap", keep, values)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read([AXES[0]])
        expected = np.full(1000, np.nan)
        expected[keep] = values[keep]
        np.testing.assert_array_equal(series.values[0], expected)
        assert series.valid is not None
        np.testing.assert_array_equal(series.valid[0], np.isfinite(expected))
        assert_close(together(list(log.blocks([AXES[0]], seconds=0.13))), series, rtol=0, atol=0)
        (info,) = (one for one in log.info().channels if one.channel.name == AXES[0])
        np.testing.assert_allclose(info.gaps, [(2.99, 3.5), (6.99, 7.01)], atol=1e-9)


def test_late_messages_are_put_in_order(tmp_path: Path) -> None:
    values = noise(1, 600)[0]
    order = np.arange(600)
    order[100:104] = [103, 101, 102, 100]
    order[250:270] = np.roll(order[250:270], 3)
    scattered_log(tmp_path / "a.mcap", order, values)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read([AXES[0]])
        np.testing.assert_array_equal(series.values[0], values)
        assert_close(together(list(log.blocks([AXES[0]], seconds=0.2))), series, rtol=0, atol=0)
        assert any("came after later ones" in finding for finding in log.info().findings)


def doubled_log(path: Path, values: np.ndarray, doubled: Sequence[int], second: float | None) -> None:
    """Write 100 Hz, some messages twice; the second time with another value, if one is given."""
    with LogMaker(path, chunk_size=2048) as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for index, value in enumerate(values.tolist()):
            stamp_ns = START_NS + index * 10_000_000
            for sample in (value, value if second is None else second)[: 2 if index in doubled else 1]:
                maker.write(channel, imu(stamp_ns, (sample, 0, 0)), stamp_ns)


@pytest.mark.parametrize("doubled", [(50, 150, 250, 350), (3, 4, 99)])
def test_a_message_that_was_sent_twice_is_one_sample(tmp_path: Path, doubled: Sequence[int]) -> None:
    values = noise(1, 400)[0]
    doubled_log(tmp_path / "a.mcap", values, doubled, None)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read([AXES[0]])
        assert series.sample_rate_hz == 100.0
        np.testing.assert_array_equal(series.values[0], values)
        assert_close(together(list(log.blocks([AXES[0]], seconds=0.07))), series, rtol=0, atol=0)
        info = log.info()
        assert info.channels[-3].time_base.duplicates == len(doubled)
        assert any(f"{len(doubled)} samples left out" in finding for finding in info.findings)


def test_of_stamps_that_repeat_unevenly_the_first_sample_stays_and_the_others_are_told(tmp_path: Path) -> None:
    values = noise(1, 400)[0]
    doubled_log(tmp_path / "a.mcap", values, (3, 4, 99), 99.0)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read([AXES[0]])
        np.testing.assert_array_equal(series.values[0], values)
        assert_close(together(list(log.blocks([AXES[0]], seconds=0.07))), series, rtol=0, atol=0)
        assert any("3 samples left out" in finding for finding in log.info().findings)


def test_not_a_number_counts_as_missing(tmp_path: Path) -> None:
    linear = noise(3, 300)
    linear[1, 7] = np.nan
    linear[2, 9] = np.inf
    write_imu_log(tmp_path / "a.mcap", linear)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(AXES)
        assert series.valid is not None
        np.testing.assert_array_equal(np.argwhere(~series.valid), [[1, 7], [2, 9]])
        assert np.isnan(series.values[2, 9])
        told = log.info().findings
        assert f"{AXES[1]}: 1 of 300 samples not a number; they count as missing" in told
        assert any(finding.startswith(f"{AXES[2]}: is no number in 1 sample at ") for finding in told)


def test_stamps_that_leap_for_days_take_no_memory(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for index in range(200):
            stamp_ns = START_NS + index * 1_000_000 + (8 * 10**14 if index >= 100 else 0)
            maker.write(channel, imu(stamp_ns, (1, 0, 0)), stamp_ns)
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError, match="lie 800000 s after the others"):
        log.read([AXES[0]])


# --- stamps ------------------------------------------------------------------------------------------------------


def constant_header(path: Path, *, publish_lag_ns: int | None = None) -> None:
    with LogMaker(path) as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for index in range(300):
            logged = START_NS + index * 5_000_000
            publish = None if publish_lag_ns is None else logged - publish_lag_ns
            maker.write(channel, imu(START_NS, (index, 0, 0)), logged, publish_time_ns=publish)


def test_a_header_stamp_that_stands_still_is_noticed(tmp_path: Path) -> None:
    constant_header(tmp_path / "a.mcap")
    with open_log(tmp_path / "a.mcap") as log:
        info = log.info().channels[0]
        assert info.stamp == "log"
        assert info.stamp_reason == (
            "header.stamp stands still (64 of the first 64 messages have the same); "
            "publish time is the same as log time"
        )
        assert log.read([AXES[0]]).sample_rate_hz == 200.0


def test_publish_time_comes_before_log_time(tmp_path: Path) -> None:
    constant_header(tmp_path / "a.mcap", publish_lag_ns=1_500_000)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.info().channels[0].stamp == "publish"
        assert log.read([AXES[0]]).start_time_ns == START_NS - 1_500_000


def test_stamps_can_be_forced(tmp_path: Path) -> None:
    write_imu_log(tmp_path / "a.mcap", noise(3, 300), late_ns=3_000_000)
    for stamp, start_ns in (("header", START_NS), ("log", START_NS + 3_000_000), ("publish", START_NS + 3_000_000)):
        with open_log(tmp_path / "a.mcap", stamp=stamp) as log:  # type: ignore[arg-type]
            assert log.read(AXES).start_time_ns == start_ns
            assert log.info().channels[0].stamp_reason.endswith("as asked for")
            np.testing.assert_array_equal(
                log.read(AXES, start_s=1, end_s=1.1).values, log.read(AXES).values[:, 200:220]
            )


def test_forcing_a_stamp_that_is_not_there(tmp_path: Path) -> None:
    write_scalars(tmp_path / "a.mcap", {"/a": (range(0, 10**9, 10**7), range(100))})
    with (
        open_log(tmp_path / "a.mcap", stamp="header") as log,
        pytest.raises(LogError, match="/a: stamp 'header' is asked for, but messages have no stamp"),
    ):
        _ = log.channels


def test_stamps_since_startup_are_brought_to_the_logs_clock(tmp_path: Path) -> None:
    """Two topics on one clock that began at zero: the shift is the same, so they stay in step to the nanosecond."""
    with LogMaker(tmp_path / "a.mcap") as maker:
        channels = [maker.ros2(topic, "sensor_msgs/msg/Imu", IMU) for topic in ("/a", "/b")]
        for index in range(200):
            own = 40_000_000_000 + index * 10_000_000
            for delay_ns, channel in zip((2_000_000, 7_000_000), channels, strict=True):
                maker.write(channel, imu(own, (index, 0, 0)), START_NS + own + delay_ns)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/a.linear_acceleration.x", "/b.linear_acceleration.x"])
        np.testing.assert_array_equal(series.values, [np.arange(200)] * 2)
        # The least delay is what can't be told from the clocks' difference.
        assert series.start_time_ns == START_NS + 40_002_000_000
        assert "isn't the log's" in log.info().channels[0].stamp_reason


def test_a_log_whose_stamps_all_say_another_day_keeps_them(tmp_path: Path) -> None:
    write_imu_log(tmp_path / "a.mcap", noise(3, 200), late_ns=5 * 86_400 * 10**9)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read(AXES).start_time_ns == START_NS
        assert log.read(AXES, start_s=0.5, end_s=0.6).samples == 20


@pytest.mark.parametrize(
    ("unit", "stamp"),
    [
        ("s since 1970", lambda index: 1.7e9 + index * 0.01),
        ("ms since 1970", lambda index: 1_700_000_000_000 + index * 10),
        ("us since 1970", lambda index: 1_700_000_000_000_000 + index * 10_000),
        ("ns since 1970", lambda index: START_NS + index * 10_000_000),
        ("us since startup", lambda index: 5_000_000 + index * 10_000),
        ("s since startup", lambda index: 5.0 + index * 0.01),
    ],
)
def test_bare_numbers_as_stamps(tmp_path: Path, unit: str, stamp: object) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.json(
            "/a", {"type": "object", "properties": {"timestamp": {"type": "number"}, "v": {"type": "number"}}}
        )
        for index in range(200):
            content = {"timestamp": stamp(index), "v": index}  # type: ignore[operator]
            maker.write(channel, content, START_NS + index * 10_000_000 + (index % 3) * 1_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/a.v"])
        info = log.info().channels[0]
    assert (info.stamp, series.samples, unit) == ("header", 200, unit)
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-6)
    assert abs(series.start_time_ns - START_NS) < 1000


def test_a_counter_called_timestamp_is_no_clock(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.json("/a")
        for index in range(100):
            maker.write(channel, {"timestamp": index, "v": index}, START_NS + index * 10_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        info = log.info().channels[0]
    assert info.stamp == "log"
    assert info.stamp_reason == (
        "timestamp is no clock: its numbers don't run with the log's time in s, ms, us or ns; "
        "publish time is the same as log time"
    )


# --- several topics ----------------------------------------------------------------------------------------------


def two_rates(path: Path) -> tuple[Real, Real]:
    fast, slow = noise(1, 1000)[0], noise(1, 250, seed=2)[0]
    columns = {
        "/fast": (START_NS + np.arange(1000) * 5_000_000, fast),
        "/slow": (START_NS + np.arange(250) * 20_000_000, slow),
    }
    write_scalars(path, columns)  # type: ignore[arg-type]
    return fast, slow


def test_topics_with_the_same_stamps_are_one_series(tmp_path: Path) -> None:
    values = noise(2, 500)
    times = START_NS + np.arange(500) * 10_000_000
    write_scalars(tmp_path / "a.mcap", {"/a": (times, values[0]), "/b": (times, values[1])}, chunk_size=2000)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read()
        np.testing.assert_array_equal(series.values, values)
        assert_close(together(list(log.blocks(seconds=0.31))), series, rtol=0, atol=0)


def test_a_topic_that_starts_later_is_missing_before(tmp_path: Path) -> None:
    times = START_NS + np.arange(500) * 10_000_000
    write_scalars(tmp_path / "a.mcap", {"/a": (times, np.arange(500)), "/b": (times[200:450], np.arange(250))})
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/b.data", "/a.data"])
        expected = np.full(500, np.nan)
        expected[200:450] = np.arange(250)
        np.testing.assert_array_equal(series.values, [expected, np.arange(500)])
        assert_close(together(list(log.blocks(["/b.data", "/a.data"], seconds=0.5))), series, rtol=0, atol=0)


def test_different_rates_are_told(tmp_path: Path) -> None:
    fast, slow = two_rates(tmp_path / "a.mcap")
    with open_log(tmp_path / "a.mcap") as log:
        told = "2 different sampling grids: /fast.data at 200 Hz; /slow.data at 50 Hz; .* sample_rate_hz="
        with pytest.raises(LogError, match=told):
            log.read()
        with pytest.raises(LogError, match=told):
            list(log.blocks(seconds=1))
        groups = log.read_groups()
        np.testing.assert_array_equal(groups[0].values, [fast])
        np.testing.assert_array_equal(groups[1].values, [slow])
        assert [grid.names for grid in log.grids()] == [("/fast.data",), ("/slow.data",)]
        assert [(grid.sample_rate_hz, grid.samples, grid.duration_s) for grid in log.grids()] == [
            (200.0, 1000, 5.0),
            (50.0, 250, 5.0),
        ]


def test_different_rates_on_one_grid(tmp_path: Path) -> None:
    """A sine well inside both bands comes out the same from both topics, whatever their rates and offsets."""
    times = {"/fast": np.arange(2000) * 5_000_000, "/slow": np.arange(500) * 20_000_000 + 7_000_000}
    columns = {topic: (START_NS + at, np.sin(2 * np.pi * 3.0 * at * 1e-9)) for topic, at in times.items()}
    write_scalars(tmp_path / "a.mcap", columns)  # type: ignore[arg-type]
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/slow.data", "/fast.data"], sample_rate_hz=40.0)
        assert [channel.name for channel in series.channels] == ["/slow.data", "/fast.data"]
        assert [channel.name for channel in log.read(sample_rate_hz=40.0).channels] == ["/fast.data", "/slow.data"]
    assert series.sample_rate_hz == 40.0
    at_s = (series.times_ns() - START_NS) * 1e-9
    expected = np.sin(2 * np.pi * 3.0 * at_s)
    good = slice(40, -40)
    np.testing.assert_allclose(series.values[:, good], [expected[good]] * 2, atol=1e-3)


def test_the_same_rate_half_a_sample_apart_is_another_grid(tmp_path: Path) -> None:
    times = START_NS + np.arange(300) * 10_000_000
    write_scalars(tmp_path / "a.mcap", {"/a": (times, range(300)), "/b": (times + 5_000_000, range(300))})
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError, match="2 different sampling grids") as caught:
        log.read()
    # The rates are the same: what differs is told.
    assert "/a.data at 100 Hz; /b.data at 100 Hz, 5 ms after those of the first;" in str(caught.value)


@pytest.mark.parametrize(
    ("period_ns", "told"),
    [(10_000_050, "/b.data at 99.9995 Hz;"), (9_999_997, "/b.data at 100.00003 Hz, beginning 0 s after the first")],
)
def test_grids_that_drift_apart_are_told_by_their_rates(tmp_path: Path, period_ns: int, told: str) -> None:
    samples = np.arange(60_000)
    times = {"/a": START_NS + samples * 10_000_000, "/b": START_NS + samples * period_ns}
    write_scalars(tmp_path / "a.mcap", {name: (at, samples) for name, at in times.items()})
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError, match="2 different sampling grids") as caught:
        log.read()
    assert told in str(caught.value)


def test_recordings_hours_apart_are_no_single_grid(tmp_path: Path) -> None:
    times = START_NS + np.arange(300) * 10_000_000
    later = times + 10**15
    write_scalars(tmp_path / "a.mcap", {"/a": (times, range(300)), "/b": (later, range(300))})
    with open_log(tmp_path / "a.mcap") as log:
        assert [series.samples for series in log.read_groups()] == [300, 300]


def test_two_channels_of_one_topic_are_merged_in_time(tmp_path: Path) -> None:
    values = noise(1, 400)[0]
    with LogMaker(tmp_path / "a.mcap", chunk_size=3000) as maker:
        channels = [maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU) for _ in range(2)]
        for index in range(400):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(channels[index % 3 == 0], imu(stamp_ns, (values[index], 0, 0)), stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read([AXES[0]])
        np.testing.assert_array_equal(series.values[0], values)
        assert_close(together(list(log.blocks([AXES[0]], seconds=0.5))), series, rtol=0, atol=0)


def test_a_second_schema_without_the_field_is_told(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        imus = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        others = maker.ros2("/imu", "geometry_msgs/msg/AccelStamped", ACCEL_STAMPED)
        for index in range(100):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(imus, imu(stamp_ns, (index, 0, 0)), stamp_ns)
            if index < 7:
                accel = {"linear": vector(), "angular": vector()}
                maker.write(others, {"header": header(stamp_ns), "accel": accel}, stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read([AXES[0]]).samples == 100
        (loss,) = log.damage
        assert (loss.lost_messages, loss.offset, loss.record) == (7, None, "Message")
        assert "a second schema on the topic has no field linear_acceleration.x" in loss.what
        # Read again, it isn't lost again.
        log.read([AXES[0]])
        assert log.damage == (loss,)


def test_events_are_refused_with_a_reason(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    events = START_NS + np.cumsum(rng.exponential(0.05, 300) * 1e9).astype(np.int64)
    times = START_NS + np.arange(1500) * 10_000_000
    write_scalars(tmp_path / "a.mcap", {"/events": (events, range(300)), "/a": (times, range(1500))})
    with open_log(tmp_path / "a.mcap") as log:
        with pytest.raises(LogError, match=r"/events isn't sampled uniformly \(by log time\)"):
            log.read(["/events.data"])
        # Unasked for it's left out, and told by info.
        assert [channel.name for channel in log.read().channels] == ["/a.data"]
        info = log.info()
        assert [one.channel.name for one in info.channels] == ["/events.data", "/a.data"]
        assert any(finding.startswith("/events: ") for finding in info.findings)


def test_when_nothing_is_uniform_each_topic_says_why(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    columns = {"/one": (np.array([START_NS]), range(1))}
    for name in ("/e1", "/e2", "/e3"):
        columns[name] = (START_NS + np.cumsum(rng.exponential(0.05, 300) * 1e9).astype(np.int64), range(300))
    write_scalars(tmp_path / "a.mcap", columns)
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError) as caught:
        log.read()
    told = str(caught.value).removeprefix("a.mcap: no channel has uniform samples in the log: ")
    assert told.startswith("/one: no rate without at least two stamps, so record longer; /e1: ")
    assert told.endswith("; and 1 more")


def test_channels_on_several_grids_are_refused_with_the_remedy_of_either_surface(tmp_path: Path) -> None:
    fast, slow = START_NS + np.arange(1000) * 10**7, START_NS + np.arange(300) * 33 * 10**6
    write_scalars(tmp_path / "a.mcap", {"/a": (fast, range(1000)), "/b": (slow, range(300))})
    with open_log(tmp_path / "a.mcap") as log, pytest.raises(LogError, match="different sampling grids") as caught:
        log.read()
    for remedy in ("in Python sample_rate_hz=100", "chladni convert a.mcap OUT.mcap --resample 100,"):
        assert remedy in str(caught.value)


# --- names, filters, batch messages ------------------------------------------------------------------------------


def test_joints_by_index_and_by_name(tmp_path: Path) -> None:
    position = noise(2, 200)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(200):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(channel, joint_state(stamp_ns, ["shoulder", "elbow"], position[:, index]), stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ["/joints.position[0]", "/joints.position[1]"]
        series = log.read(["/joints.position[elbow]", "/joints.position[0]"])
        np.testing.assert_array_equal(series.values, position[::-1])
        assert [channel.name for channel in series.channels] == ["/joints.position[elbow]", "/joints.position[0]"]
        assert {channel.units_possible for channel in series.channels} == {("m", "rad")}
    stated = tmp_path / "setup.toml"
    stated.write_text('format = "chladni.setup/1"\nchannel = [{ path = "/joints.position[0]", unit = "mm" }]\n')
    with open_log(tmp_path / "a.mcap", setup=stated) as log:
        told = [(channel.unit, channel.units_possible) for channel in log.channels]
        assert told == [("m", ()), ("1", ("m", "rad"))]


def test_joints_of_two_publishers_on_one_topic(tmp_path: Path) -> None:
    """Messages take turns with different joints: by index two joints would be mixed."""
    arm, hand = noise(2, 300), noise(1, 300, seed=3)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(300):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(channel, joint_state(stamp_ns, ["shoulder", "elbow"], arm[:, index]), stamp_ns)
            maker.write(channel, joint_state(stamp_ns + 4_000_000, ["finger"], hand[:, index]), stamp_ns + 4_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        names = [f"/joints.position[{joint}]" for joint in ("shoulder", "elbow", "finger")]
        assert [channel.name for channel in log.channels] == names
        np.testing.assert_array_equal(log.read(names[:2]).values, arm)
        np.testing.assert_array_equal(log.read(names[2:]).values, hand)
        assert log.read(names[2:]).start_time_ns == START_NS + 4_000_000
        with pytest.raises(LogError, match="element 0 is called finger and shoulder in different messages"):
            log.read(["/joints.position[0]"])


LABELLED = (
    "string name\nfloat64 value\nbool on\nPart[] parts\n"
    + "=" * 80
    + "\nMSG: test/Part\nstring id\nint32 kind\nfloat32 x\n"
)


def labelled_log(path: Path, *, twice: bool = False) -> None:
    with LogMaker(path) as maker:
        channel = maker.ros2("/log", "test/msg/Labelled", LABELLED)
        for index in range(300):
            parts = [{"id": "tip", "kind": 1, "x": index}, {"id": "base", "kind": 2, "x": -index}]
            if twice:
                parts.append(parts[0])
            content = {
                "name": "ab"[index % 2],
                "value": index,
                "on": index % 3 == 0,
                "parts": parts[:: (-1) ** index],
            }
            maker.write(channel, content, START_NS + index * 10_000_000)


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ('/log{name=="a"}.value', np.arange(0, 300, 2)),
        ('/log{name!="a"}.value', np.arange(1, 300, 2)),
        ("/log{on==true}.value", np.arange(0, 300, 3)),
        ("/log{value<100}.value", np.arange(100)),
        ('/log{value>=100}{name=="b"}.value', np.arange(101, 300, 2)),
        ('/log.parts[:]{id=="tip"}.x', np.arange(300)),
        ("/log.parts[:]{kind==2}.x", -np.arange(300)),
        ('/log.parts[:]{kind>0}{id=="base"}.x', -np.arange(300)),
        ("/log.parts[0].x", np.arange(300) * (-1.0) ** np.arange(300)),
        ("/log.on", (np.arange(300) % 3 == 0).astype(float)),
    ],
)
def test_filters(tmp_path: Path, path: str, expected: Real) -> None:
    labelled_log(tmp_path / "a.mcap")
    with open_log(tmp_path / "a.mcap") as log:
        np.testing.assert_array_equal(log.read([path]).values[0], expected)
        # Elements that are told by text aren't listed by number; truth values are no signals.
        assert [channel.name for channel in log.channels] == ["/log.value"]


def test_filters_that_fit_several_elements_or_none(tmp_path: Path) -> None:
    labelled_log(tmp_path / "a.mcap", twice=True)
    with open_log(tmp_path / "a.mcap") as log:
        with pytest.raises(LogError, match=r"several elements of one message pass parts\[\].id == 'tip'"):
            log.read(['/log.parts[:]{id=="tip"}.x'])
        with pytest.raises(LogError, match="has no sample in the log"):
            log.read(['/log.parts[:]{id=="nobody"}.x'])
        with pytest.raises(LogError, match="a filter follows"):
            log.read(['/log.parts[0]{id=="tip"}.x'])


def test_blocks_of_samples(tmp_path: Path) -> None:
    samples = noise(2, 5000).astype(np.float32)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/daq", "daq_msgs/msg/SampleBlock", SAMPLE_BLOCK)
        for first in range(0, 5000, 512):
            stamp_ns = START_NS + round(first / 1000 * 1e9)
            block = samples[:, first : first + 512]
            maker.write(channel, sample_block(stamp_ns, 1000.0, ["top floor", "b"], block), stamp_ns + 600_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ['/daq."top floor"', "/daq.b"]
        series = log.read()
        np.testing.assert_array_equal(series.values, samples)
        assert (series.sample_rate_hz, series.start_time_ns, series.values.dtype) == (1000.0, START_NS, np.float32)
        np.testing.assert_array_equal(log.read(["/daq[1]"]).values, samples[1:])
        np.testing.assert_array_equal(log.read(["/daq.b"], start_s=0.6, end_s=1.3).values, samples[1:, 600:1300])
        assert_close(together(list(log.blocks(seconds=0.3))), series, rtol=0, atol=0)
        # However it's written, it's the channel that lists have.
        assert log.name("/daq[0]") == log.read(["/daq[0]"]).channels[0].name == '/daq."top floor"'
        with pytest.raises(LogError, match="holds blocks of samples; no column 'c'"):
            log.read(["/daq.c"])


def test_blocks_that_contradict_the_others_are_lost_and_told(tmp_path: Path) -> None:
    samples = noise(2, 1000).astype(np.float32)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/daq", "daq_msgs/msg/SampleBlock", SAMPLE_BLOCK)
        for first in range(0, 1000, 100):
            stamp_ns = START_NS + first * 1_000_000
            content = sample_block(stamp_ns, 1000.0, ["a", "b"], samples[:, first : first + 100])
            if first == 300:
                content["channel_names"] = ["a", "c"]
            if first == 500:
                content["samples"] = content["samples"][:-1]
            if first == 700:
                content["sample_rate"] = -1.0
            maker.write(channel, content, stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read()
        expected = samples.copy()
        for first in (300, 500, 700):
            expected[:, first : first + 100] = np.nan
        np.testing.assert_array_equal(series.values, expected)
        (loss,) = log.damage
        assert loss.lost_messages == 3
        assert "contradict" in loss.what


def test_columns_of_the_same_name_are_refused(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/daq", "daq_msgs/msg/SampleBlock", SAMPLE_BLOCK)
        maker.write(channel, sample_block(START_NS, 1000.0, ["a", "a"], noise(2, 10)), START_NS)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.channels == ()
        with pytest.raises(LogError, match="the column name 'a' occurs 2 times"):
            log.read(["/daq.a"])
        with pytest.raises(LogError, match=r"the log has no channel that could be read .*/daq"):
            log.read()
        assert any("can't be decoded" in finding for finding in log.info().findings)


def test_fifo_of_a_flight_controller(tmp_path: Path) -> None:
    """Numbers of samples that change from message to message, stamped at the newest one in microseconds."""
    rng = np.random.default_rng(8)
    raw = rng.integers(-30000, 30000, (3, 4000)).astype(np.int16)
    scale = np.float32(0.00239)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/fmu/sensor_accel_fifo", "px4_msgs/msg/SensorAccelFifo", SENSOR_ACCEL_FIFO)
        first = 0
        while first < 4000:
            count = min(int(rng.integers(8, 11)), 4000 - first)
            newest_us = 7_000_000 + (first + count - 1) * 125
            content = accel_fifo(newest_us, raw[:, first : first + count], dt_us=125.0, scale=scale)
            maker.write(channel, content, START_NS + newest_us * 1000 + 300_000)
            first += count
    with open_log(tmp_path / "a.mcap") as log:
        assert [(one.name.rpartition(".")[2], one.unit) for one in log.channels] == [
            ("x", "m/s^2"),
            ("y", "m/s^2"),
            ("z", "m/s^2"),
        ]
        series = log.read()
        np.testing.assert_allclose(series.values, raw * float(scale), rtol=1e-12)
        assert series.sample_rate_hz == pytest.approx(8000.0, rel=1e-6)
        # Once shifted by the least delay, the first sample has its own time again.
        assert abs(series.start_time_ns - (START_NS + 7_000_000_000 + 300_000)) < 1000
        assert_close(together(list(log.blocks(seconds=0.05))), series, rtol=0, atol=0)


# --- encodings, setup, the rest ----------------------------------------------------------------------------------


def test_protobuf(tmp_path: Path) -> None:
    values = noise(1, 300)[0]
    protobuf_log(tmp_path / "a.mcap", values)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ["/sensor.value"]
        series = log.read()
        np.testing.assert_array_equal(series.values[0], values)
        assert series.start_time_ns == START_NS


def test_json_fields_with_odd_names_or_that_messages_lack(tmp_path: Path) -> None:
    x = noise(3, 200)
    names = ["we ird", "a.b", "y", "never there"]
    schema = {"type": "object", "properties": {name: {"type": "number"} for name in names}}
    for given in (schema, None):
        with LogMaker(tmp_path / "a.mcap") as maker:
            channel = maker.json("/j", given)
            for index in range(200):
                row = dict(zip(names[:3], x[:, index].tolist(), strict=True))
                if index % 10 == 3:
                    row["we ird"] = None
                maker.write(channel, row, START_NS + index * 10_000_000)
        with open_log(tmp_path / "a.mcap") as log:
            channels = [one.name for one in log.channels][:3]
            assert channels == ['/j."we ird"', '/j."a.b"', "/j.y"]
            series = log.read(channels)
            assert np.array_equal(series.values[1:], x[1:])
            assert np.flatnonzero(np.isnan(series.values[0])).tolist() == list(range(3, 200, 10))
            assert log.info().damage == ()
            with pytest.raises(LogError, match='did you mean "we ird"'):
                log.read(["/j.weird"])


def test_json_without_schema_and_an_unknown_encoding(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        known = maker.json("/a")
        unknown = maker.raw("/b", encoding="flatbuffer")
        for index in range(100):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(known, {"deep": {"x": index / 8}, "name": "s"}, stamp_ns)
            maker.write(unknown, b"????", stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        np.testing.assert_array_equal(log.read().values, [np.arange(100) / 8])
        with pytest.raises(LogError, match=r"messages of /b can't be decoded: .*flatbuffer"):
            log.read(["/b.x"])


def setup_file(tmp_path: Path, text: str) -> Path:
    (tmp_path / "setup.toml").write_text(f'format = "chladni.setup/1"\n{text}')
    return tmp_path / "setup.toml"


def test_setup_refines_channels(tmp_path: Path) -> None:
    linear = noise(3, 200)
    write_imu_log(tmp_path / "a.mcap", linear)
    setup = setup_file(
        tmp_path,
        '[[point]]\nname = "wrist"\nposition = [1, 2, 3]\n'
        '[[channel]]\npath = "/imu.linear_acceleration.x"\nunit = "V"\nsensitivity = "100 mV/g"\nrange = "50 g"\n'
        'point = "wrist"\ndirection = "-z"\nrole = "reference"\n'
        '[[channel]]\npath = "/imu.linear_acceleration.y"\nunit = "g"\n',
    )
    with open_log(tmp_path / "a.mcap", setup=setup) as log:
        x, y, z = log.read(AXES).channels
        assert (x.unit, x.point, x.direction, x.role) == ("m/s^2", "wrist", (-0.0, -0.0, -1.0), "reference")
        assert x.overload == pytest.approx(50 * 9.80665)
        assert (y.unit, z.unit, y.point) == ("m/s^2", "m/s^2", None)
        np.testing.assert_allclose(log.read(AXES).values, linear * np.array([[98.0665], [9.80665], [1]]), rtol=1e-14)
        assert log.geometry.position("wrist") == (1.0, 2.0, 3.0)
        assert x in log.channels


def test_setup_by_joint_name_is_the_listed_channel(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(20):
            maker.write(channel, joint_state(START_NS + index * 10**7, ["a", "b"], (0, 0)), START_NS + index * 10**7)
    setup = setup_file(tmp_path, '[[channel]]\npath = "/joints.position[b]"\nunit = "mm"\n')
    with open_log(tmp_path / "a.mcap", setup=setup) as log:
        assert [channel.unit for channel in log.channels] == ["1", "m"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '[[channel]]\npath = "/imu.linear_acc.x"\n',
            r"setup.toml:2: \[\[channel\]\] path: a.mcap has no channel '/imu.linear_acc.x'; did you mean",
        ),
        (
            '[[channel]]\npath = "/imu.linear_acceleration.x"\nrange = "50 N"\n',
            r"setup.toml:2: /imu.linear_acceleration.x range: it is in N, the channel in m/s\^2",
        ),
        ('[[batch]]\ntopic = "/im"\nsamples = ["x"]\nrate = 1\n', r"the log has no topic '/im'; did you mean /imu"),
        (
            '[[batch]]\ntopic = "/imu"\nsamples = ["header.stamps"]\nrate = 1\n',
            "messages have no field 'header.stamps'; did you mean header.stamp",
        ),
    ],
)
def test_a_setup_that_does_not_fit_the_log(tmp_path: Path, text: str, told: str) -> None:
    write_imu_log(tmp_path / "a.mcap", noise(3, 20))
    with pytest.raises(SetupError, match=told):
        open_log(tmp_path / "a.mcap", setup=setup_file(tmp_path, text))


RAW_BLOCK = "uint64 t\nfloat32 period\nint16[] data\nint16[] y\nfloat32 gain\n"


def test_batch_messages_by_setup_file(tmp_path: Path) -> None:
    raw = np.random.default_rng(5).integers(-100, 100, (2, 600)).astype(np.int16)
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/raw", "test/msg/Raw", RAW_BLOCK)
        for first in range(0, 600, 60):
            newest_ns = START_NS + (first + 59) * 1_000_000
            block = raw[:, first : first + 60]
            content = {"t": newest_ns, "period": 1.0, "data": block.T.reshape(-1).tolist(), "y": [], "gain": 0.5}
            maker.write(channel, content, newest_ns)
    text = (
        '[[batch]]\ntopic = "/raw"\nsamples = "data"\nlayout = "sample"\nnames = ["a", "b"]\ndt = "period"\n'
        'dt_unit = "ms"\nstamp = "last"\nscale = "gain"\nunit = "g"\n'
    )
    with open_log(tmp_path / "a.mcap", setup=setup_file(tmp_path, text), stamp="log") as log:
        series = log.read(["/raw.a", "/raw.b"])
        np.testing.assert_allclose(series.values, raw * 0.5 * 9.80665, rtol=1e-12)
        assert (series.sample_rate_hz, series.start_time_ns) == (1000.0, START_NS)
        assert [channel.unit for channel in series.channels] == ["m/s^2", "m/s^2"]
        assert_close(together(list(log.blocks(seconds=0.1))), series, rtol=0, atol=0)


def test_units_in_comments_and_metadata(tmp_path: Path) -> None:
    definition = "float64 x # along the beam [mm]\nfloat64 y # N\nfloat64 z # to the left\nfloat64 w # [furlong]\n"
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2(
            "/a",
            "test/msg/A",
            definition,
            {"chladni.unit.z": "g", "chladni.role.z": "reference", "chladni.overload.z": "2"},
        )
        for index in range(20):
            maker.write(channel, {"x": 1.0, "y": 1.0, "z": 1.0, "w": 1.0}, START_NS + index * 10**7)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read()
    assert [channel.unit for channel in series.channels] == ["m", "N", "m/s^2", "1"]
    np.testing.assert_allclose(series.values[:, 0], [1e-3, 1.0, 9.80665, 1.0])
    assert [channel.role for channel in series.channels] == ["response", "reference", "reference", "response"]
    assert series.channels[2].overload == pytest.approx(2 * 9.80665)


@pytest.mark.parametrize(
    ("key", "text", "attribute", "expected"),
    [
        ("chladni.direction.z", "[0, 0, -2]", "direction", (0.0, 0.0, -1.0)),
        ("chladni.direction.z", "[0, 0, 0]", "direction", None),
        ("chladni.direction.z", '["x"]', "direction", None),
        ("chladni.direction.z", "{", "direction", None),
        ("chladni.direction.z", "[" * 100_000, "direction", None),
        ("chladni.overload.z", "fifty", "overload", None),
        ("chladni.overload.z", "inf", "overload", None),
        ("chladni.point.z", "tip", "point", "tip"),
        ("unit", "g", "unit", "m/s^2"),
        ("unit", "Gs", "unit", "m/s^2"),
        ("unit", "RPM", "unit", "rad/s"),
        ("unit", "EU", "unit", "1"),
        ("unit", "C", "unit", "1"),
        ("chladni.unit.z", "C", "unit", "C"),
        ("chladni.unit.z", "bananas", "unit", "1"),
    ],
)
def test_metadata_is_believed_only_where_it_makes_sense(
    tmp_path: Path, key: str, text: str, attribute: str, expected: object
) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2(
            "/a", "test/msg/A", "float64 z\nfloat64 padding\n", {key: text, "chladni.fields": '["z"]'}
        )
        for index in range(20):
            maker.write(channel, {"z": 1.0, "padding": 0.0}, START_NS + index * 10**7)
    with open_log(tmp_path / "a.mcap") as log:
        (found,) = log.channels
    assert getattr(found, attribute) == expected


def test_long_arrays_are_not_listed(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/scan", "test/msg/Scan", "float32[] ranges\nuint8[] picture\nfloat64[3] xyz\n")
        for index in range(20):
            content = {"ranges": [float(index)] * 100, "picture": [1, 2], "xyz": [1.0, 2.0, 3.0]}
            maker.write(channel, content, START_NS + index * 10**7)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == [f"/scan.xyz[{index}]" for index in range(3)]
        np.testing.assert_array_equal(log.read(["/scan.ranges[99]"]).values, [np.arange(20)])
        assert any("/scan.ranges: an array this long isn't listed" in finding for finding in log.info().findings)


def test_a_silent_topic_and_an_empty_log(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
    with open_log(tmp_path / "a.mcap") as log:
        with pytest.raises(LogError, match="/imu has no sample in the log"):
            log.read([AXES[0]])
        with pytest.raises(LogError, match="no channel has uniform samples in the log: /imu: no sample"):
            log.read()
        content = log.info().to_json()
        assert (content["duration_s"], content["channels"][0]["samples"], content["channels"][0]["rate_hz"]) == (
            0.0,
            0,
            None,
        )
        assert "/imu: no usable messages" in content["findings"]


def test_what_a_truncated_log_still_holds_is_read(tmp_path: Path) -> None:
    linear = noise(3, 1000)
    write_imu_log(tmp_path / "a.mcap", linear, chunk_size=20_000)
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[: len(whole) // 2])
    with open_log(tmp_path / "b.mcap") as log:
        series = log.read(AXES)
        assert 300 < series.samples < 700
        np.testing.assert_array_equal(series.values, linear[:, : series.samples])
        assert log.damage
        info = log.info().to_json()
        assert info["damage"][0]["where"]["offset"] > 0
        assert info["findings"][0].startswith("damage in ")


def test_opening_reads_no_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_imu_log(tmp_path / "a.mcap", noise(3, 100))
    log = open_log(tmp_path / "a.mcap")

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a message was read")

    monkeypatch.setattr("chladni.io.mcap.container.McapContainer.batches", refuse)
    assert log.path.name == "a.mcap"
    with pytest.raises(AssertionError, match="a message was read"):
        _ = log.channels
