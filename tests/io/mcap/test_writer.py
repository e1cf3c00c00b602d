"""The log writer against independent readers: mcap with its ROS 2 decoder, rosbags, rerun."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

START_NS = 1_700_000_000_123_456_789


def series_of(names: list[str], values: np.ndarray, **fields: object) -> TimeSeries:
    channels = tuple(Channel(name=name, unit="m/s^2") for name in names)
    rate = fields.pop("sample_rate_hz", 100.0)
    return TimeSeries(values=values, sample_rate_hz=rate, start_time_ns=START_NS, channels=channels, **fields)


def noise(rows: int, samples: int = 250, dtype: type = np.float64) -> np.ndarray:
    return np.random.default_rng(7).standard_normal((rows, samples)).astype(dtype)


def decoded(path: Path) -> list[tuple[str, str, int, object]]:
    """Give ``(topic, schema, log time, message)`` of all messages, checksums verified."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        return [
            (channel.topic, schema.name, record.log_time, message)
            for schema, channel, record, message in reader.iter_decoded_messages()
        ]


def stamp_ns(message: object) -> int:
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def reach(message: object, path: str) -> float:
    for part in path.replace("[", ".").replace("]", "").split("."):
        message = message[int(part)] if part.isdigit() else getattr(message, part)
    return message


MESSAGES = {
    "sensor_msgs/msg/Imu": ["linear_acceleration.x", "linear_acceleration.z", "angular_velocity.y"],
    "geometry_msgs/msg/AccelStamped": ["accel.linear.z"],
    "geometry_msgs/msg/TwistStamped": ["twist.angular.z", "twist.linear.x"],
    "geometry_msgs/msg/WrenchStamped": ["wrench.force.z", "wrench.torque.x"],
    "geometry_msgs/msg/Vector3Stamped": ["vector.y"],
    "sensor_msgs/msg/JointState": ["position[0]", "position[2]", "effort[1]"],
    "chladni_msgs/msg/ScalarStamped": ["value"],
    "chladni_msgs/msg/RigA": ["pressure", "tank.level[2]", "tank.level[0]", "probe[1].t"],
}


@pytest.mark.parametrize("schema", MESSAGES)
def test_each_message_type_holds_the_samples_bit_for_bit(tmp_path: Path, schema: str) -> None:
    fields = MESSAGES[schema]
    series = series_of([f"/rig/a.{field}" for field in fields], noise(len(fields)))
    write_mcap(series, tmp_path / "a.mcap")
    messages = decoded(tmp_path / "a.mcap")
    assert {(topic, name) for topic, name, _, _ in messages} == {("/rig/a", schema)}
    for row, field in enumerate(fields):
        np.testing.assert_array_equal([reach(message, field) for *_, message in messages], series.values[row])
    np.testing.assert_array_equal([stamp_ns(message) for *_, message in messages], series.times_ns())
    np.testing.assert_array_equal([log_ns for _, _, log_ns, _ in messages], series.times_ns())


def test_fields_that_were_not_measured_are_not_numbers(tmp_path: Path) -> None:
    write_mcap(series_of(["/imu.linear_acceleration.z"], noise(1, 3)), tmp_path / "a.mcap")
    imu = decoded(tmp_path / "a.mcap")[0][3]
    assert np.isnan([imu.linear_acceleration.x, imu.angular_velocity.z]).all()
    covariances = (imu.orientation_covariance[0], imu.angular_velocity_covariance[0])
    assert covariances == (-1.0, -1.0)
    assert imu.linear_acceleration_covariance[0] == 0.0
    assert (imu.orientation.x, imu.orientation.w) == (0.0, 1.0)


def test_joints_by_name(tmp_path: Path) -> None:
    series = series_of(["/arm.position[elbow]", "/arm.velocity[wrist]"], noise(2, 4))
    write_mcap(series, tmp_path / "a.mcap")
    message = decoded(tmp_path / "a.mcap")[1][3]
    assert list(message.name) == ["elbow", "wrist"]
    assert (message.position[0], message.velocity[1]) == (series.values[0, 1], series.values[1, 1])
    assert list(message.effort) == []


def test_channels_under_the_names_of_joints_are_listed_so_with_their_units(tmp_path: Path) -> None:
    names = ["/arm.position[elbow]", "/arm.position[wrist]"]
    channels = tuple(Channel(name=name, unit="rad") for name in names)
    write_mcap(TimeSeries(values=noise(2, 40), sample_rate_hz=100.0, channels=channels), tmp_path / "a.mcap")
    with open_log(tmp_path / "a.mcap") as log:
        assert [(one.name, one.unit) for one in log.channels] == [(name, "rad") for name in names]
        assert log.read(names).samples == 40


@pytest.mark.parametrize(("dtype", "schema"), [(np.float32, "SampleBlock"), (np.float64, "SampleBlock64")])
def test_batches_hold_the_samples_bit_for_bit(tmp_path: Path, dtype: type, schema: str) -> None:
    series = series_of(["/daq.ch1", "force (hammer)"], noise(2, 250, dtype))
    write_mcap(series, tmp_path / "a.mcap", layout="batches")
    messages = decoded(tmp_path / "a.mcap")
    assert [name for _, name, _, _ in messages] == [f"daq_msgs/msg/{schema}"] * 3
    blocks = [message for *_, message in messages]
    assert [len(block.samples) for block in blocks] == [200, 200, 100]
    assert list(blocks[0].channel_names) == ["ch1", "force (hammer)"]
    assert blocks[0].sample_rate == 100.0
    np.testing.assert_array_equal(
        np.concatenate([np.reshape(block.samples, (2, -1)) for block in blocks], axis=1), series.values
    )
    np.testing.assert_array_equal([stamp_ns(block) for block in blocks], series.times_ns()[::100])


def test_invalid_samples_have_no_message(tmp_path: Path) -> None:
    valid = np.ones((2, 10), dtype=bool)
    valid[:, 3:5] = False
    valid[1, 7] = False
    series = series_of(["/a.vector.x", "/a.vector.y"], noise(2, 10), valid=valid)
    write_mcap(series, tmp_path / "a.mcap")
    messages = decoded(tmp_path / "a.mcap")
    np.testing.assert_array_equal([ns for _, _, ns, _ in messages], np.delete(series.times_ns(), [3, 4]))
    assert np.isnan(messages[5][3].vector.y)
    assert messages[5][3].vector.x == series.values[0, 7]


def test_gaps_in_batches_are_nan_and_empty_blocks_have_no_message(tmp_path: Path) -> None:
    valid = np.ones((1, 14), dtype=bool)
    valid[:, 2:9] = False
    series = series_of(["/daq.a"], noise(1, 14), valid=valid, sample_rate_hz=4.0)
    write_mcap(series, tmp_path / "a.mcap", layout="batches")
    messages = decoded(tmp_path / "a.mcap")
    assert [ns for _, _, ns, _ in messages] == [int(series.times_ns()[first]) for first in (0, 8, 12)]
    found = np.concatenate([message.samples for *_, message in messages])
    expected = np.where(valid, series.values, np.nan)[0]
    np.testing.assert_array_equal(found, np.delete(expected, [4, 5, 6, 7]))


def test_topics_of_several_series_are_interleaved_in_time(tmp_path: Path) -> None:
    slow = series_of(["/slow.value"], noise(1, 5), sample_rate_hz=10.0)
    fast = series_of(["/fast.accel.linear.x", "/other.value"], noise(2, 50), sample_rate_hz=100.0)
    written = write_mcap([slow, fast], tmp_path / "a.mcap")
    stamps = [ns for _, _, ns, _ in decoded(tmp_path / "a.mcap")]
    assert stamps == sorted(stamps)
    assert len(stamps) == written.messages == 105


def test_channel_metadata_and_records(tmp_path: Path) -> None:
    channel = Channel(
        name="/a.accel.linear.z",
        unit="m/s^2",
        point="wrist",
        direction=(0.0, 0.6, 0.8),
        role="reference",
        overload=500.0,
    )
    series = TimeSeries(values=noise(1, 5), sample_rate_hz=1e3 / 3, channels=(channel,))
    write_mcap(series, tmp_path / "a.mcap", metadata={"truth": {"mode_1_hz": "7.25"}})
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file)
        (record,) = reader.get_summary().channels.values()
        (metadata,) = reader.iter_metadata()
        assert reader.get_header().profile == "ros2"
    assert record.metadata == {
        "chladni.format": "chladni.log/1",
        "chladni.sample_rate_hz": repr(1e3 / 3),
        "chladni.fields": json.dumps(["accel.linear.z"]),
        "chladni.unit.accel.linear.z": "m/s^2",
        "chladni.point.accel.linear.z": "wrist",
        "chladni.direction.accel.linear.z": "[0.0, 0.6, 0.8]",
        "chladni.role.accel.linear.z": "reference",
        "chladni.overload.accel.linear.z": "500.0",
    }
    assert (metadata.name, metadata.metadata) == ("truth", {"mode_1_hz": "7.25"})


def test_rosbags_reads_every_type_bit_for_bit(tmp_path: Path) -> None:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    names = [f"/t{number}.{field}" for number, fields in enumerate(MESSAGES.values()) for field in fields]
    series = series_of(names, noise(len(names), 20))
    write_mcap(series, tmp_path / "a.mcap")
    found: dict[str, list[float]] = {name: [] for name in names}
    with AnyReader([tmp_path / "a.mcap"], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            for name in names:
                if name.startswith(f"{connection.topic}."):
                    found[name].append(reach(message, name.removeprefix(f"{connection.topic}.")))
    np.testing.assert_array_equal([found[name] for name in names], series.values)


def rerun_columns(path: Path, topic: str) -> dict[str, np.ndarray]:
    """Give what rerun's reader makes of the messages of one topic, by column."""
    from rerun.chunk import McapReader

    batches = [chunk.to_record_batch() for chunk in McapReader(path).stream() if chunk.entity_path == topic]
    (messages,) = (batch for batch in batches if "message_log_time" in batch.schema.names)
    return {name: messages.column(name) for name in messages.schema.names}


def test_rerun_reads_imu_bit_for_bit(tmp_path: Path) -> None:
    series = series_of(["/imu.linear_acceleration.x", "/imu.angular_velocity.z"], noise(2, 50))
    write_mcap(series, tmp_path / "a.mcap")
    columns = rerun_columns(tmp_path / "a.mcap", "/imu")
    rows = np.array(columns["Scalars:scalars"].to_pylist(), dtype=float).T
    # Rerun gives the three angular rates, then the three accelerations.
    np.testing.assert_array_equal(rows[[3, 2]], series.values)
    assert np.isnan(rows[[0, 1, 4, 5]]).all()
    np.testing.assert_array_equal(columns["ros2_timestamp"].cast("int64").to_numpy(), series.times_ns())


def test_rerun_reads_batches_bit_for_bit(tmp_path: Path) -> None:
    series = series_of(["/daq.a", "/daq.b"], noise(2, 50))
    write_mcap(series, tmp_path / "a.mcap", layout="batches")
    (((block,),),) = (rerun_columns(tmp_path / "a.mcap", "/daq")["daq_msgs.msg.SampleBlock64:message"].to_pylist(),)
    np.testing.assert_array_equal(np.reshape(block["samples"], (2, 50)), series.values)


@pytest.mark.parametrize(
    ("names", "match"),
    [
        (["/a.b", "/a.b.c"], "'b' can't be a number and hold others"),
        (["/a.position[0]", "/a.position[elbow]"], "index all of them by number or all by name"),
        (["/a.x[99999]"], "above 4095"),
        (["a b", "a:b"], "both be written to"),
        (["/a.header.x"], "'header' is taken"),
    ],
)
def test_names_that_no_message_can_hold_are_refused(tmp_path: Path, names: list[str], match: str) -> None:
    with pytest.raises(SetupError, match=match):
        write_mcap(series_of(names, noise(len(names), 3)), tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []


def test_the_same_topic_in_two_series_is_refused(tmp_path: Path) -> None:
    first, second = series_of(["/a.vector.x"], noise(1, 3)), series_of(["/a.vector.y"], noise(1, 3))
    with pytest.raises(SetupError, match="/a occurs in two series"):
        write_mcap([first, second], tmp_path / "a.mcap")


def test_times_that_ros_cannot_stamp_are_refused(tmp_path: Path) -> None:
    series = TimeSeries(
        values=noise(1, 3), sample_rate_hz=1.0, start_time_ns=2**31 * 10**9, channels=(Channel(name="/a.value"),)
    )
    with pytest.raises(SetupError, match="set another start time"):
        write_mcap(series, tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("options", "match"), [({"layout": "rows"}, "messages, batches"), ({"block_s": 0.0}, "block_s 0.0")]
)
def test_impossible_options_are_refused(tmp_path: Path, options: dict[str, object], match: str) -> None:
    with pytest.raises(SetupError, match=match):
        write_mcap(series_of(["/a.value"], noise(1, 3)), tmp_path / "a.mcap", **options)


def test_nothing_to_write_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="no channel"):
        write_mcap([], tmp_path / "a.mcap")


def test_an_existing_log_is_kept_unless_told(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"precious")
    with pytest.raises(LogError, match="exists already"):
        write_mcap(series_of(["/a.value"], noise(1, 3)), tmp_path / "a.mcap", overwrite=False)
    assert (tmp_path / "a.mcap").read_bytes() == b"precious"


@given(data=st.data())
def test_any_gaps_survive(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    samples = data.draw(st.integers(1, 40))
    valid = np.array(
        data.draw(st.lists(st.lists(st.booleans(), min_size=samples, max_size=samples), min_size=2, max_size=2))
    )
    series = series_of(
        ["/daq.a", "/daq.b"],
        noise(2, samples),
        valid=valid,
        sample_rate_hz=data.draw(st.sampled_from([3.0, 7.5, 1e4])),
    )
    path = tmp_path_factory.mktemp("gaps") / "a.mcap"
    found = np.full(series.values.shape, np.nan)
    write_mcap(series, path, layout="batches", block_s=data.draw(st.sampled_from([0.3, 1.0, 60.0])))
    index = {int(ns): sample for sample, ns in enumerate(series.times_ns())}
    for _, _, ns, block in decoded(path):
        columns = np.reshape(block.samples, (2, -1))
        found[:, index[ns] : index[ns] + columns.shape[1]] = columns
    np.testing.assert_array_equal(found, np.where(valid, series.values, np.nan))
