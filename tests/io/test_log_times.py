"""Messages of any channel, stored in any order, with stamps that are no times: each sample at its own time."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.io import grid_blocks
from chladni.io.log import Log, open_log
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import LogError
from chladni.signals.testing import assert_close
from tests.io.test_log import together
from tests.make_logs import (
    ACCEL_STAMPED,
    FLOAT64,
    IMU,
    JOINT_STATE,
    RATE_HZ,
    SAMPLE_BLOCK,
    START_NS,
    LogMaker,
    header,
    imu,
    joint_state,
    sample_block,
    tone,
    two_sensors,
    vector,
    write_numbers,
)

STAMPED = ACCEL_STAMPED
PERIOD_NS = 10_000_000
COUNT = 400
LAYOUTS: Mapping[str, Mapping[str, Any]] = {
    "in small chunks": {"chunk_size": 2000},
    "in one chunk": {"chunk_size": 1 << 20},
    "without chunks": {"use_chunking": False},
}

Place = Callable[[Whole], Whole]


def require_whole(log: Log, path: str, expected: Real) -> None:
    """The series has these values at 100 Hz, whole and in blocks, without a gap; and the log is as long."""
    series = log.read([path])
    assert series.sample_rate_hz == RATE_HZ
    assert series.start_time_ns == log.start_time_ns == START_NS
    assert series.all_valid()
    np.testing.assert_array_equal(series.values[0], expected)
    assert_close(together(list(log.blocks([path], seconds=0.3))), series, rtol=0, atol=0)
    info = log.info()
    assert info.duration_s == pytest.approx(expected.size / RATE_HZ, abs=1e-9)
    (told,) = (one.to_json() for one in info.channels if one.channel.name == path)
    assert (told["rate_hz"], told["samples"], told["gaps"], told["publishers"]) == (RATE_HZ, expected.size, [], 1)
    assert not [finding for finding in info.findings if "jump" in finding or "missing" in finding]


# --- in any order, through any channel ---------------------------------------------------------------------------

STORED: Mapping[str, Place] = {
    "later half first": lambda number: np.roll(number, COUNT // 2),
    "parts of 50 in another order": lambda number: number.reshape(-1, 50)[[3, 0, 1, 6, 7, 2, 5, 4]].ravel(),
    "shuffled": lambda number: np.random.default_rng(2).permutation(number),
}


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
@pytest.mark.parametrize("place", STORED.values(), ids=STORED.keys())
def test_messages_stored_in_any_order(tmp_path: Path, place: Place, layout: Mapping[str, Any]) -> None:
    number = np.arange(COUNT)
    stored = place(number)
    write_numbers(tmp_path / "a.mcap", START_NS + stored * PERIOD_NS, tone(stored), **layout)
    with open_log(tmp_path / "a.mcap") as log:
        require_whole(log, "/s.data", tone(number))
        late = np.count_nonzero(stored < np.maximum.accumulate(stored))
        assert f"/s: {late} messages stored behind later ones, read in the order of time" in log.info().findings


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
def test_a_window_of_a_log_that_is_stored_out_of_order(tmp_path: Path, layout: Mapping[str, Any]) -> None:
    stored = np.roll(np.arange(COUNT), COUNT // 2)
    write_numbers(tmp_path / "a.mcap", START_NS + stored * PERIOD_NS, tone(stored), **layout)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/s.data"], start_s=1.5, end_s=2.5)
        np.testing.assert_array_equal(series.values[0], tone(np.arange(150, 250)))
        assert series.start_time_ns == START_NS + 150 * PERIOD_NS


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
@pytest.mark.parametrize("turn", [50, 130, 1])
def test_mcap_channels_that_take_turns_are_one_source(tmp_path: Path, turn: int, layout: Mapping[str, Any]) -> None:
    number = np.arange(COUNT)
    # Two of three by one, in turns of a single message.
    channel = number // turn % 2 if turn > 1 else (number % 3 == 0).astype(np.int64)
    write_numbers(
        tmp_path / "a.mcap", START_NS + number * PERIOD_NS, tone(number), channel=channel.tolist(), **layout
    )
    with open_log(tmp_path / "a.mcap") as log:
        assert [one.name for one in log.channels] == ["/s.data"]
        require_whole(log, "/s.data", tone(number))
        # Each of them can still be read by itself.
        alone = log.read(["/s{@channel==1}.data"])
        np.testing.assert_array_equal(alone.values[0][np.isfinite(alone.values[0])], tone(number)[channel == 0])


def test_channels_stored_one_after_the_other(tmp_path: Path) -> None:
    number = np.arange(COUNT)
    channel = number // 50 % 2
    stored = np.argsort(channel, kind="stable")
    write_numbers(tmp_path / "a.mcap", START_NS + stored * PERIOD_NS, tone(stored), channel=channel[stored].tolist())
    with open_log(tmp_path / "a.mcap") as log:
        require_whole(log, "/s.data", tone(number))


def test_own_stamps_are_put_in_the_order_of_the_log_times(tmp_path: Path) -> None:
    stored = np.roll(np.arange(COUNT), COUNT // 2)
    with LogMaker(tmp_path / "a.mcap", chunk_size=3000) as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for number, value in zip(stored.tolist(), tone(stored), strict=True):
            stamp_ns = START_NS + number * PERIOD_NS
            maker.write(channel, imu(stamp_ns, (value, 0, 0)), stamp_ns + 3_000_000 + number % 7 * 100_000)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/imu.linear_acceleration.x"])
        assert (series.start_time_ns, log.start_time_ns) == (START_NS, START_NS)
        np.testing.assert_array_equal(series.values[0], tone(np.arange(COUNT)))


def test_blocks_of_samples_stored_out_of_order(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal((2, 2000)).astype(np.float32)
    with LogMaker(tmp_path / "a.mcap", chunk_size=5000) as maker:
        channel = maker.ros2("/daq", "daq_msgs/msg/SampleBlock", SAMPLE_BLOCK)
        for block in np.roll(np.arange(20), 7).tolist():
            stamp_ns = START_NS + block * 100_000_000
            part = values[:, 100 * block : 100 * block + 100]
            maker.write(channel, sample_block(stamp_ns, 1000.0, ("a", "b"), part), stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        series = log.read(["/daq.a", "/daq.b"])
        np.testing.assert_array_equal(series.values, values)
        assert_close(together(list(log.blocks(["/daq.a", "/daq.b"], seconds=0.15))), series, rtol=0, atol=0)
        assert log.info().duration_s == pytest.approx(2.0)


def test_blocks_take_bounded_memory_however_far_out_of_order_the_log_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored = np.roll(np.arange(COUNT), COUNT // 2)
    write_numbers(tmp_path / "a.mcap", START_NS + stored * PERIOD_NS, tone(stored), chunk_size=1000)
    monkeypatch.setattr(grid_blocks, "MOST_BYTES", 1)
    filled: list[int] = []
    made = grid_blocks.BlockGrid.buffer

    def noted(grid: grid_blocks.BlockGrid, number: int) -> Any:
        filled.append(grid.first + number * grid.block_samples)
        return made(grid, number)

    monkeypatch.setattr(grid_blocks.BlockGrid, "buffer", noted)
    with open_log(tmp_path / "a.mcap") as log:
        blocks = []
        for block in log.blocks(["/s.data"], seconds=0.1):
            # Never more blocks begun than given, beyond those that may be filled at a time.
            assert len(filled) - len(blocks) <= grid_blocks.MOST_BLOCKS
            blocks.append(block)
        np.testing.assert_array_equal(together(blocks).values[0], tone(np.arange(COUNT)))
        assert sorted(filled) == list(range(0, COUNT, 10))


# --- publishers --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
@pytest.mark.parametrize("offset_s", [0.004, 0.003, 0.0])
@pytest.mark.parametrize("joins_at", [0, 150])
def test_publishers_at_once_are_channels_of_their_own(
    tmp_path: Path, offset_s: float, joins_at: int, layout: Mapping[str, Any]
) -> None:
    two_sensors(tmp_path / "a.mcap", offset_s=offset_s, joins_at=joins_at, **layout)
    names = ["/s{@channel==1}.data", "/s{@channel==2}.data"]
    with open_log(tmp_path / "a.mcap") as log:
        assert [one.name for one in log.channels] == names
        first, second = (log.read([name]) for name in names)
        number = np.arange(COUNT)
        np.testing.assert_array_equal(first.values[0], tone(number))
        np.testing.assert_array_equal(second.values[0], 3 * tone(number[joins_at:], offset_s=offset_s, tone_hz=7.0))
        assert second.start_time_ns - START_NS == joins_at * PERIOD_NS + round(offset_s * 1e9)
        told = [one.to_json() for one in log.info().channels]
        assert [(one["rate_hz"], one["publishers"], one["gaps"]) for one in told] == [(RATE_HZ, 2, [])] * 2
        assert (
            "/s: 2 publish here at once; each has channels of its own: /s{@channel==1}, /s{@channel==2}"
            in log.info().findings
        )
        with pytest.raises(LogError) as caught:
            log.read(["/s.data"])
        told_names = str(caught.value).partition("name one of them: ")[2].split(" or ")
        assert told_names == names


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
def test_channels_that_alternate_evenly_are_one_source(tmp_path: Path, layout: Mapping[str, Any]) -> None:
    """A tone above the Nyquist frequency of either would be another tone in both."""
    number = np.arange(2 * COUNT)
    values = tone(number, tone_hz=40.0)
    times = START_NS + number * PERIOD_NS
    write_numbers(tmp_path / "a.mcap", times, values, channel=(number % 2).tolist(), **layout)
    with open_log(tmp_path / "a.mcap") as log:
        require_whole(log, "/s.data", values)
        assert (
            "/s: 2 MCAP channels send in turn and are read as one; each alone: /s{@channel==1}, /s{@channel==2}"
            in log.info().findings
        )
        alone = log.read(["/s{@channel==2}.data"])
        assert alone.sample_rate_hz == RATE_HZ / 2
        np.testing.assert_array_equal(alone.values[0], values[1::2])


def test_paths_of_publishers_that_are_none(tmp_path: Path) -> None:
    two_sensors(tmp_path / "a.mcap", offset_s=0.003)
    with open_log(tmp_path / "a.mcap") as log:
        for path in (
            "/s{@channel==3}.data",
            "/s{ @channel==1 }.data",
            "/s{@sender==1}.data",
            "/s{@publisher==0}.data",
        ):
            with pytest.raises(
                LogError, match=r"is no field of a message; right behind the topic, /s\{@channel==1\} is"
            ):
                log.read([path])


def test_each_publisher_has_a_clock_of_its_own(tmp_path: Path) -> None:
    """One stamps by the log's clock, the other since it was switched on."""
    with LogMaker(tmp_path / "a.mcap") as maker:
        channels = [maker.ros2("/a", "geometry_msgs/msg/AccelStamped", STAMPED) for _ in range(2)]
        for number, value in enumerate(tone(np.arange(COUNT))):
            for owner, epoch_ns in enumerate((START_NS, 77 * 10**9)):
                accel = {"linear": vector(value * (1 + owner)), "angular": vector()}
                message = {"header": header(epoch_ns + number * PERIOD_NS), "accel": accel}
                maker.write(channels[owner], message, START_NS + number * PERIOD_NS + 1_000_000 * (1 + owner))
    with open_log(tmp_path / "a.mcap") as log:
        both = log.read(["/a{@channel==1}.accel.linear.x", "/a{@channel==2}.accel.linear.x"], sample_rate_hz=RATE_HZ)
        assert both.start_time_ns == pytest.approx(START_NS, abs=5 * 10**8)
        assert log.info().duration_s == pytest.approx(4.0, abs=0.01)


def test_frames_tell_publishers_of_one_mcap_channel_apart(tmp_path: Path) -> None:
    number = np.arange(COUNT)
    frames = ("left", 'the "right" one')
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for one, value in zip(number.tolist(), tone(number), strict=True):
            for place, frame in enumerate(frames):
                stamp_ns = START_NS + one * PERIOD_NS + place * 1_000_000
                message = imu(stamp_ns, (value * (1 + place), 0, 0))
                message["header"]["frame_id"] = frame
                maker.write(channel, message, stamp_ns + 500_000)
    with open_log(tmp_path / "a.mcap") as log:
        listed = [one for one in log.channels if one.name.endswith("linear_acceleration.x")]
        names = [
            '/imu{header.frame_id=="left"}.linear_acceleration.x',
            '/imu{header.frame_id=="the \\"right\\" one"}.linear_acceleration.x',
        ]
        assert [(one.name, one.unit) for one in listed] == [(name, "m/s^2") for name in names]
        for place, name in enumerate(names):
            series = log.read([name])
            np.testing.assert_array_equal(series.values[0], (1 + place) * tone(number))
            assert (series.sample_rate_hz, series.start_time_ns) == (RATE_HZ, START_NS + place * 1_000_000)
        assert {one.publishers for one in log.info().channels} == {2}
        with pytest.raises(LogError, match="2 publish on /imu at once"):
            log.read(["/imu.linear_acceleration.x"])


def test_publishers_that_only_their_stamps_tell_apart(tmp_path: Path) -> None:
    two_sensors(tmp_path / "a.mcap", offset_s=0.003)
    number = np.arange(COUNT)
    expected = (tone(number), 3 * tone(number, offset_s=0.003, tone_hz=7.0))
    times = START_NS + np.concatenate([number * PERIOD_NS, number * PERIOD_NS + 3_000_000])
    order = np.argsort(times)
    write_numbers(tmp_path / "one.mcap", times[order], np.concatenate(expected)[order], chunk_size=1500)
    with open_log(tmp_path / "one.mcap") as log:
        with pytest.raises(LogError, match=r"2 publish on /s at once; their samples are no single signal") as caught:
            log.read(["/s.data"])
        names = str(caught.value).partition("read one alone: ")[2].split(" or ")
        assert names == ["/s{@publisher==1}.data", "/s{@publisher==2}.data"]
        for name, values, offset_ns in zip(names, expected, (0, 3_000_000), strict=True):
            series = log.read([name])
            np.testing.assert_array_equal(series.values[0], values)
            assert (series.sample_rate_hz, series.start_time_ns) == (RATE_HZ, START_NS + offset_ns)
            assert_close(together(list(log.blocks([name], seconds=0.25))), series, rtol=0, atol=0)
        with pytest.raises(LogError, match=r"/s\{@publisher==3\}.data has no sample"):
            log.read(["/s{@publisher==3}.data"])
        (told,) = log.info().to_json()["channels"]
        assert told["publishers"] == 2
        assert any("2 publish on /s at once" in finding for finding in log.info().findings)


def test_joints_tell_publishers_apart_by_their_names(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channels = [maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE) for _ in range(3)]
        for number, value in enumerate(tone(np.arange(COUNT))):
            stamp_ns = START_NS + number * PERIOD_NS
            for owner, joints in enumerate((["shoulder", "elbow"], ["finger"])):
                positions = [value * (1 + owner)] * len(joints)
                maker.write(channels[owner], joint_state(stamp_ns + owner, joints, positions), stamp_ns + owner)
    with open_log(tmp_path / "a.mcap") as log:
        assert [one.name for one in log.channels] == [
            f"/joints.position[{joint}]" for joint in ("shoulder", "elbow", "finger")
        ]
        np.testing.assert_array_equal(log.read(["/joints.position[finger]"]).values[0], 2 * tone(np.arange(COUNT)))


def test_a_joint_that_two_publish_is_refused_and_others_are_read(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channels = [maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE) for _ in range(2)]
        for number in range(COUNT):
            stamp_ns = START_NS + number * PERIOD_NS
            for owner, joints in enumerate((["shoulder", "elbow"], ["elbow", "finger"])):
                maker.write(channels[owner], joint_state(stamp_ns + owner, joints, [owner, owner]), stamp_ns + owner)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read(["/joints.position[finger]"]).samples == COUNT
        with pytest.raises(LogError, match=r"name one of them: /joints\{@channel==1\}.position\[elbow\] or "):
            log.read(["/joints.position[elbow]"])


def test_publishers_with_schemas_of_their_own_are_both_listed(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        one = maker.ros2("/a", "geometry_msgs/msg/AccelStamped", STAMPED)
        other = maker.ros2("/a", "std_msgs/msg/Float64", FLOAT64)
        for number, value in enumerate(tone(np.arange(COUNT))):
            stamp_ns = START_NS + number * PERIOD_NS
            accel = {"linear": vector(value), "angular": vector()}
            maker.write(one, {"header": header(stamp_ns), "accel": accel}, stamp_ns)
            maker.write(other, {"data": 2 * value}, stamp_ns + 1_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        assert "/a{@channel==2}.data" in [channel.name for channel in log.channels]
        np.testing.assert_array_equal(log.read(["/a{@channel==2}.data"]).values[0], 2 * tone(np.arange(COUNT)))
        # Only one of them has the field.
        np.testing.assert_array_equal(log.read(["/a.accel.linear.x"]).values[0], tone(np.arange(COUNT)))


# --- stamps that are no times ------------------------------------------------------------------------------------

NO_TIMES = {"zero": 0, "soon after 1970": 98_765_432_100, "2200": 7_258_118_400 * 10**9, "negative": -(10**9)}
WHERE = {"first": [0], "amid": [200], "last": [COUNT - 1], "three in a row": [70, 71, 72]}
OWN_TIME = "int64 timestamp\nfloat64 x\n"


@pytest.mark.parametrize("stamp_ns", NO_TIMES.values(), ids=NO_TIMES.keys())
@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
def test_own_stamps_that_are_no_times_are_left_out_and_told(tmp_path: Path, where: list[int], stamp_ns: int) -> None:
    with LogMaker(tmp_path / "a.mcap", chunk_size=2000) as maker:
        channel = maker.ros2("/s", "test/msg/OwnTime", OWN_TIME)
        for number, value in enumerate(tone(np.arange(COUNT))):
            own_ns = stamp_ns if number in where else START_NS + number * PERIOD_NS
            maker.write(channel, {"timestamp": own_ns, "x": value}, START_NS + number * PERIOD_NS + 3_000_000)
    require_left_out(tmp_path / "a.mcap", "/s.x", where, kind="header")


@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
@pytest.mark.parametrize("kind", ["publish", "log"])
def test_times_of_the_log_itself_that_are_no_times(tmp_path: Path, kind: str, where: list[int]) -> None:
    with LogMaker(tmp_path / "a.mcap", chunk_size=2000) as maker:
        channel = maker.ros2("/s", "std_msgs/msg/Float64", FLOAT64)
        for number, value in enumerate(tone(np.arange(COUNT))):
            right_ns = START_NS + number * PERIOD_NS
            said_ns = 0 if number in where else right_ns
            logged_ns = said_ns if kind == "log" else right_ns + 2_000_000
            maker.write(channel, {"data": value}, logged_ns, publish_time_ns=said_ns)
    require_left_out(tmp_path / "a.mcap", "/s.data", where, kind=kind)


@pytest.mark.parametrize("stamp", [float("nan"), float("inf"), -1.0, 0.0])
@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
def test_numbers_that_are_no_times(tmp_path: Path, where: list[int], stamp: float) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/s", "test/msg/Timed", "float64 t\nfloat64 x\n")
        for number, value in enumerate(tone(np.arange(COUNT))):
            own_s = stamp if number in where else START_NS * 1e-9 + number / RATE_HZ
            maker.write(channel, {"t": own_s, "x": value}, START_NS + number * PERIOD_NS + 3_000_000)
    require_left_out(tmp_path / "a.mcap", "/s.x", where, kind="header", exact=False)


def require_left_out(path: Path, name: str, where: list[int], *, kind: str, exact: bool = True) -> None:
    """Samples at these places are missing, all others are where they belong, and the log is as long as it is."""
    right = np.delete(np.arange(COUNT), where)
    slack_ns = 0 if exact else 1000
    with open_log(path) as log:
        assert log.start_time_ns == pytest.approx(START_NS + right[0] * PERIOD_NS, abs=slack_ns)
        series = log.read([name])
        assert series.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-9 if exact else 1e-6)
        assert series.start_time_ns == pytest.approx(START_NS + right[0] * PERIOD_NS, abs=slack_ns)
        np.testing.assert_array_equal(np.flatnonzero(np.isfinite(series.values[0])) + right[0], right)
        np.testing.assert_array_equal(series.values[0][right - right[0]], tone(right))
        assert_close(together(list(log.blocks([name], seconds=0.3))), series, rtol=0, atol=0)
        part = log.read([name], start_s=1.0, end_s=3.0)
        assert abs(part.samples - 200) <= len(where)
        info = log.info()
        (told,) = (one.to_json() for one in info.channels if one.channel.name == name)
        assert (told["stamp"], told["samples"], told["untimed"]) == (kind, right.size, len(where))
        assert info.duration_s == pytest.approx((right[-1] - right[0] + 1) / RATE_HZ, abs=2e-6)
        assert len(told["gaps"]) == (where[0] > 0 and where[-1] < COUNT - 1)
        (loss,) = info.damage
        assert (loss.lost_messages, "is no time" in loss.what) == (len(where), True)


@pytest.mark.parametrize("epoch_ns", [0, 5 * 10**9], ids=["from 0", "from 5 s"])
def test_simulated_time_that_begins_at_zero_is_a_time(tmp_path: Path, epoch_ns: int) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/s", "test/msg/OwnTime", "builtin_interfaces/Time stamp\nfloat64 x\n" + TIME)
        for number, value in enumerate(tone(np.arange(COUNT))):
            own_ns = epoch_ns + number * PERIOD_NS
            stamp = {"sec": own_ns // 10**9, "nanosec": own_ns % 10**9}
            maker.write(channel, {"stamp": stamp, "x": value}, own_ns)
    with open_log(tmp_path / "a.mcap") as log:
        np.testing.assert_array_equal(log.read(["/s.x"]).values[0], tone(np.arange(COUNT)))
        assert log.start_time_ns == epoch_ns
        (told,) = log.info().to_json()["channels"]
        assert (told["stamp"], told["samples"], told["untimed"], log.damage) == ("header", COUNT, 0, ())


TIME = "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"


def test_stamps_that_mostly_are_no_times_give_way_to_the_log(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for number, value in enumerate(tone(np.arange(COUNT))):
            logged_ns = START_NS + number * PERIOD_NS
            maker.write(channel, imu(logged_ns if number % 3 == 0 else 0, (value, 0, 0)), logged_ns)
    with open_log(tmp_path / "a.mcap") as log:
        np.testing.assert_array_equal(log.read(["/imu.linear_acceleration.x"]).values[0], tone(np.arange(COUNT)))
        told = log.info().to_json()["channels"][0]
        assert told["stamp"] == "log"
        assert told["stamp_reason"].startswith("header.stamp is no time in 42 of the first 64 messages")
