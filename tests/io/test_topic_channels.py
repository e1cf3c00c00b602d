"""What is listed of a topic: arrays in arrays, and names that one damaged message changes."""

import struct
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, message_factory
from google.protobuf.descriptor_pool import DescriptorPool
from mcap_ros2._dynamic import serialize_dynamic

from chladni.io.log import open_log
from chladni.signals.arrays import Real
from chladni.signals.errors import LogError
from tests.make_logs import JOINT_STATE, START_NS, LogMaker, joint_state

STEP_NS = 10_000_000
SEPARATOR = "=" * 80
GRID = f"Row[] rows\nfloat64 x\n{SEPARATOR}\nMSG: test/Row\nfloat64[2] pair\nfloat64[] more\n"


def write_json(path: Path, messages: Sequence[Any], topic: str = "/a") -> Path:
    with LogMaker(path) as maker:
        channel = maker.json(topic)
        for index, one in enumerate(messages):
            maker.write(channel, one, START_NS + index * STEP_NS)
    return path


def grid_log(path: Path, rows: int, more: int) -> Path:
    """Row r of message k holds 1000 r + k and so on: each number tells where it stood."""
    with LogMaker(path) as maker:
        channel = maker.ros2("/a", "test/msg/Grid", GRID)
        for index in range(100):
            content = {
                "rows": [
                    {
                        "pair": [1000.0 * row + index, 1000.0 * row + 500 + index],
                        "more": [1e6 * (k + 1) + 1000 * row + index for k in range(more if row else 1)],
                    }
                    for row in range(rows)
                ],
                "x": index,
            }
            maker.write(channel, content, START_NS + index * STEP_NS)
    return path


def test_elements_of_arrays_in_arrays_are_listed_and_right(tmp_path: Path) -> None:
    with open_log(grid_log(tmp_path / "a.mcap", rows=2, more=2)) as log:
        names = [channel.name for channel in log.channels]
        assert names == [
            "/a.rows[0].pair[0]", "/a.rows[0].pair[1]", "/a.rows[1].pair[0]", "/a.rows[1].pair[1]",
            "/a.rows[0].more[0]", "/a.rows[1].more[0]", "/a.rows[1].more[1]", "/a.x",
        ]  # fmt: skip
        first = [0, 500, 1000, 1500, 1e6, 1e6 + 1000, 2e6 + 1000, 0]
        np.testing.assert_array_equal(log.read(names).values, np.add.outer(first, np.arange(100.0)))
        assert not log.info().unread


def test_what_is_listed_of_arrays_in_arrays_is_bounded_and_told(tmp_path: Path) -> None:
    with open_log(grid_log(tmp_path / "a.mcap", rows=33, more=3)) as log:
        assert [channel.name for channel in log.channels] == ["/a.x"]
        told = {one.name: one.reason for one in log.info().unread}
        assert set(told) == {"/a.rows[].pair", "/a.rows[].more"}
        assert all("this long isn't listed; single elements can be read by path" in one for one in told.values())
        np.testing.assert_array_equal(log.read(["/a.rows[32].pair[1]"]).values[0], 32_500 + np.arange(100.0))


def test_keys_with_brackets_of_their_own_are_not_indices(tmp_path: Path) -> None:
    with open_log(
        write_json(tmp_path / "a.mcap", [{"a[]": [[k, 1], [2]], "b": [{"c.[]": k}]} for k in range(9)])
    ) as log:
        names = [channel.name for channel in log.channels]
        assert names == ['/a."a[]"[0][0]', '/a."a[]"[0][1]', '/a."a[]"[1][0]', '/a.b[0]."c.[]"']
        assert log.read(names).values[:, 8].tolist() == [8, 1, 2, 8]


# --- one message that names things otherwise ---------------------------------------------------------------------


def joints_log(
    path: Path, odd: Collection[int], names: Sequence[str] = ("axis", "arm"), wrong: Sequence[str] = ("axiq", "arm")
) -> Real:
    """Messages in `odd` have the wrong names."""
    values = np.random.default_rng(1).normal(size=(2, 300))
    with LogMaker(path) as maker:
        channel = maker.ros2("/js", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(300):
            stamp_ns = START_NS + index * STEP_NS
            said = list(wrong if index in odd else names)
            maker.write(channel, joint_state(stamp_ns, said, values[:, index]), stamp_ns)
    return values


@pytest.mark.parametrize("odd", [0, 1, 40, 63, 64, 150, 299])
def test_a_name_that_one_message_changes_costs_only_its_element(tmp_path: Path, odd: int) -> None:
    values = joints_log(tmp_path / "a.mcap", [odd])
    with open_log(tmp_path / "a.mcap") as log:
        names = ["/js.position[0]", "/js.position[1]"]
        assert [channel.name for channel in log.channels] == names
        read = log.read(names).values
        np.testing.assert_array_equal(read[1], values[1])
        assert np.isnan(read[0, odd])
        np.testing.assert_array_equal(np.delete(read[0], odd), np.delete(values[0], odd))
        (lost,) = log.damage
        assert lost.lost_messages == 1
        assert lost.what == "/js: element 0 of name is called 'axiq', in the first messages 'axis'; read it by name"
        assert [one.what for one in log.info().damage] == [lost.what]


def test_a_name_that_one_message_changes_is_read_by_name(tmp_path: Path) -> None:
    values = joints_log(tmp_path / "a.mcap", [100])
    with open_log(tmp_path / "a.mcap") as log:
        read = log.read(["/js.position[axis]"]).values[0]
        np.testing.assert_array_equal(np.delete(read, 100), np.delete(values[0], 100))
        assert np.isnan(read[100])


def test_names_that_change_places_are_read_by_name(tmp_path: Path) -> None:
    """By number two joints would be mixed."""
    odd = range(0, 300, 3)
    values = joints_log(tmp_path / "a.mcap", odd, wrong=("arm", "axis"))
    with open_log(tmp_path / "a.mcap") as log:
        names = ["/js.position[arm]", "/js.position[axis]"]
        assert [channel.name for channel in log.channels] == names
        values[:, odd] = values[::-1, odd]
        np.testing.assert_array_equal(log.read(names).values, values[::-1])
        with pytest.raises(LogError, match=r"'/js.position\[0\]': element 0 is called arm and axis in different"):
            log.read(["/js.position[0]"])


def test_names_that_change_places_once_are_told_and_read_by_name(tmp_path: Path) -> None:
    values = joints_log(tmp_path / "a.mcap", [40], wrong=("arm", "axis"))
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ["/js.position[0]", "/js.position[1]"]
        assert np.flatnonzero(np.isnan(log.read().values[0])).tolist() == [40]
        assert "is called 'arm', in the first messages 'axis'; read it by name" in log.damage[0].what
        values[:, 40] = values[::-1, 40]
        np.testing.assert_array_equal(log.read(["/js.position[axis]", "/js.position[arm]"]).values, values)


def test_lists_that_all_differ_are_read_by_name(tmp_path: Path) -> None:
    """Names in random order: hardly any two of the first messages have the same list."""
    joints = [f"j{number}" for number in range(7)]
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/js", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(100):
            order = np.random.default_rng(index % 60).permutation(7)
            stamp_ns = START_NS + index * STEP_NS
            said, values = [joints[place] for place in order], order + index / 128
            maker.write(channel, joint_state(stamp_ns, said, values), stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        names = [f"/js.position[{joint}]" for joint in joints]
        assert {channel.name for channel in log.channels} == set(names)
        np.testing.assert_array_equal(log.read(names).values, np.add.outer(np.arange(7), np.arange(100) / 128))


def test_names_of_elements_parse_back(tmp_path: Path) -> None:
    joints_log(tmp_path / "a.mcap", range(0, 300, 2), names=("7", "a]b"), wrong=("a]b", "7"))
    with open_log(tmp_path / "a.mcap") as log:
        names = [channel.name for channel in log.channels]
        assert names == ['/js.position["a]b"]', '/js.position["7"]']
        assert log.read(names).values.shape == (2, 300)


@pytest.mark.parametrize("odd", [0, 30, 200])
def test_a_frame_that_one_message_names_makes_no_second_publisher(tmp_path: Path, odd: int) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.ros2("/js", "sensor_msgs/msg/JointState", JOINT_STATE)
        for index in range(300):
            stamp_ns = START_NS + index * STEP_NS
            content = joint_state(stamp_ns, ["a"], np.array([float(index)]))
            content["header"]["frame_id"] = "bass" if index == odd else "base"
            maker.write(channel, content, stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ["/js.position[0]"]
        np.testing.assert_array_equal(log.read(["/js.position[0]"]).values[0], np.arange(300.0))


def test_elements_told_apart_by_text_are_told_beside_other_channels(tmp_path: Path) -> None:
    motors = [{"name": "left", "current": 1.5}, {"name": "right", "current": 2.5}]
    messages = [{"voltage": 48.0 + k, "motors": motors[:: (-1) ** k]} for k in range(9)]
    with open_log(write_json(tmp_path / "a.mcap", messages)) as log:
        assert [channel.name for channel in log.channels] == ["/a.voltage"]
        (one,) = log.info().unread
        assert (one.name, "by path or filter" in one.reason) == ("/a.motors[].current", True)
        assert log.read(['/a.motors[:]{name=="left"}.current']).values.tolist() == [[1.5] * 9]


def test_entries_of_a_map_keep_their_places(tmp_path: Path) -> None:
    """Protobuf gives the entries of a map in any order; by their keys they have one."""
    file = descriptor_pb2.FileDescriptorProto(name="m.proto", package="demo", syntax="proto3")
    field = descriptor_pb2.FieldDescriptorProto
    message = file.message_type.add(name="M")
    entry = message.nested_type.add(name="GainsEntry")
    entry.options.map_entry = True
    entry.field.add(name="key", number=1, type=field.TYPE_INT32, label=field.LABEL_OPTIONAL)
    entry.field.add(name="value", number=2, type=field.TYPE_DOUBLE, label=field.LABEL_OPTIONAL)
    message.field.add(
        name="gains", number=1, type=field.TYPE_MESSAGE, label=field.LABEL_REPEATED, type_name=".demo.M.GainsEntry"
    )
    pool = DescriptorPool()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.M"))
    data = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    keys = [7, -3, 10**6, 0, 12]
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.raw("/a", encoding="protobuf", schema=("demo.M", "protobuf", data))
        for index in range(40):
            one = kind()
            for key in np.random.default_rng(index).permutation(keys).tolist():
                one.gains[key] = key + index / 64
            maker.write(channel, one.SerializeToString(), START_NS + index * STEP_NS)
    with open_log(tmp_path / "a.mcap") as log:
        values = log.read([f"/a.gains[{place}].value" for place in range(5)]).values
        np.testing.assert_array_equal(values, np.add.outer(sorted(keys), np.arange(40) / 64))


def test_damage_is_counted_once_however_many_streams_a_topic_has(tmp_path: Path) -> None:
    """Joints that are read by name are streams of their own; a message that none of them can read is one message."""
    encode = serialize_dynamic("sensor_msgs/msg/JointState", JOINT_STATE)["sensor_msgs/msg/JointState"]
    with LogMaker(tmp_path / "a.mcap") as maker:
        schema = ("sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
        channel = maker.raw("/js", encoding="cdr", schema=schema)
        for index in range(100):
            stamp_ns = START_NS + index * STEP_NS
            content = joint_state(stamp_ns, ["a", "b"] if index % 2 else ["b", "a"], [1.0, 2.0])
            if index == 50:
                content["header"]["stamp"]["sec"] = -5
            maker.write(channel, encode(content)[: 8 if index == 70 else None], stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        assert [channel.name for channel in log.channels] == ["/js.position[b]", "/js.position[a]"]
        log.info()
        assert [one.lost_messages for one in log.damage] == [1, 1]


def test_a_signalling_nan_is_missing_without_a_warning(tmp_path: Path) -> None:
    signalling = 0x7FA00000
    with LogMaker(tmp_path / "a.mcap") as maker:
        channel = maker.raw("/a", encoding="cdr", schema=("test/F", "ros2msg", b"float32 x\nfloat64 y\nfloat32 t\n"))
        for index in range(100):
            x = signalling if index in (3, 70) else 0x3F800000
            content = struct.pack("<BBBBIxxxxdI", 0, 1, 0, 0, x, index, x)
            maker.write(channel, content, START_NS + index * STEP_NS)
    with open_log(tmp_path / "a.mcap") as log:
        log.info()
        assert np.flatnonzero(np.isnan(log.read(["/a.x", "/a.y"]).values[0])).tolist() == [3, 70]


def test_lists_of_numbers_are_told_with_their_names_and_how_many_they_are(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with LogMaker(path) as maker:
        joints = maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE)
        bare = maker.ros2("/bare", "test/msg/Grid", GRID)
        for index in range(20):
            stamp_ns = START_NS + index * STEP_NS
            maker.write(joints, joint_state(stamp_ns, ["a", "b"], [1.0, 2.0], effort=[3.0]), stamp_ns)
            maker.write(bare, {"rows": [{"pair": [0.0, 1.0], "more": [index]}], "x": 0.0}, stamp_ns)
    with open_log(path) as log:
        first, second = log.number_lists
    assert (first.topic, first.place, first.label, first.names) == ("/joints", "", "/joints", (("a", "b"),))
    assert (first.elements, first.named_in_message) == ({"position": 2, "effort": 1}, True)
    assert (first.path("position", 1), first.path("position", "b")) == ("/joints.position[1]", "/joints.position[b]")
    assert (second.place, second.names, second.elements) == ("rows[0]", (), {"pair": 2, "more": 1})
    assert (second.label, second.path("pair", 1)) == ("/bare", "/bare.rows[0].pair[1]")


def test_events_are_read_as_they_were_stamped(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    stamps_ns = START_NS + np.array([0, 9, 3, 3, 40]) * STEP_NS
    with LogMaker(path) as maker:
        channel = maker.ros2("/joints", "sensor_msgs/msg/JointState", JOINT_STATE)
        for value, stamp_ns in enumerate(stamps_ns.tolist()):
            maker.write(channel, joint_state(stamp_ns, ["a", "b"], [value, -value]), stamp_ns)
    with open_log(path) as log:
        (found,) = log.stamped(["/joints.position[1]", "/joints.position[0]"])
        (part,) = log.stamped(["/joints.position[0]"], start_s=0.02, end_s=0.1)
    # Of two with one stamp the later one counts.
    np.testing.assert_array_equal(found.times_ns, START_NS + np.array([0, 3, 9, 40]) * STEP_NS)
    rows = {channel.name: values.tolist() for channel, values in zip(found.channels, found.values, strict=True)}
    assert rows["/joints.position[0]"] == [0.0, 3.0, 1.0, 4.0]
    assert rows["/joints.position[1]"] == [0.0, -3.0, -1.0, -4.0]
    assert part.values.tolist() == [[3.0, 1.0]]
