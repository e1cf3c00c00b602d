"""One topic that can't be read costs only itself, and is told with its reason; so is what holds no number."""

import struct
from pathlib import Path

import numpy as np
import pytest

from chladni.io.log import open_log
from chladni.io.log_info import unread_sentences
from chladni.io.loss import Unread
from chladni.signals.errors import LogError
from tests.io.decoding.encoded import CdrWriter
from tests.make_logs import FLOAT64, IMU, START_NS, LogMaker, imu

COUNT = 200
X = np.sin(0.3 * np.arange(COUNT))
DOUBLES = [struct.pack("<4Bd", 0, 1, 0, 0, x) for x in X]
TEXT = ("p/msg/T", "ros2msg", b"string data\n")


def write_log(
    path: Path, *others: tuple[str, str, tuple[str, str, bytes] | None, list[bytes]], **options: object
) -> Path:
    """A sound topic /good at 100 Hz, and others beside it: topic, message encoding, schema, messages."""
    with LogMaker(path, **options) as maker:
        topics = [(maker.ros2("/good", "std_msgs/msg/Float64", FLOAT64), [{"data": x} for x in X])]
        topics += [(maker.raw(topic, encoding=how, schema=schema), rows) for topic, how, schema, rows in others]
        for index in range(COUNT):
            for channel, rows in topics:
                maker.write(channel, rows[index], START_NS + index * 10_000_000)
    return path


def wide(x: float) -> bytes:
    return CdrWriter().number("I", 3).number("H", *b"abc").number("d", x).message()


BAD = {
    "wstring": ("cdr", ("p/msg/W", "ros2msg", b"wstring w\nfloat64 x\n"), [wide(x) for x in X], "wstring"),
    "parameter list": ("cdr", ("S", "ros2msg", b"float64 x"), [b"\0\3" + one[2:] for one in DOUBLES], "@mutable"),
    "unknown encoding": ("flatbuffer", ("S", "flatbuffer", b"\0\1"), DOUBLES, "encoding 'flatbuffer'"),
    "no schema": ("cdr", None, DOUBLES, "encoding 'cdr' with schema encoding ''"),
    "empty schema": ("cdr", ("p/msg/S", "ros2msg", b""), DOUBLES, "a message has 12, its definition makes 5"),
    "empty IDL": ("cdr", ("p/msg/S", "ros2idl", b""), DOUBLES, "doesn't define a struct"),
    "broken schema": ("cdr", ("p/msg/S", "ros2msg", b"float64 x\n}} what\n"), DOUBLES, "expected 'type name'"),
    "a type that's missing": ("cdr", ("p/msg/S", "ros2msg", b"Other x\n"), DOUBLES, "doesn't define"),
    "a union": ("cdr", ("S", "omgidl", b"union S switch (long) { case 1: double x; };"), DOUBLES, "unions"),
    "another definition": ("cdr", ("p/msg/S", "ros2msg", b"float32 x\n"), DOUBLES, "from the same build"),
    "empty descriptors": ("protobuf", ("t.A", "protobuf", b""), [b""] * COUNT, "descriptor set"),
    "no descriptors": ("protobuf", ("t.A", "protobuf", b"\xff\xff"), [b""] * COUNT, "FileDescriptorSet"),
    "not JSON": ("json", None, DOUBLES, "is JSON"),
    "nothing named": ("json", None, [b"0.5"] * COUNT, "names its values"),
    "ROS 1 of another type": ("ros1", ("p/S", "ros1msg", b"float32 x"), [one[4:] for one in DOUBLES], "has 8"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
@pytest.mark.parametrize("first", [False, True], ids=["after", "before"])
def test_a_topic_that_cannot_be_decoded_costs_only_itself(tmp_path: Path, what: str, first: bool) -> None:
    encoding, schema, messages, told = BAD[what]
    topic = "/a/bad" if first else "/zz"
    with open_log(write_log(tmp_path / "a.mcap", (topic, encoding, schema, messages))) as log:
        info = log.info()
        assert [(one.channel.name, one.samples, one.time_base.rate_hz) for one in info.channels] == [
            ("/good.data", COUNT, pytest.approx(100.0))
        ]
        np.testing.assert_array_equal(log.read().values, [X])
        (unread,) = info.unread
        assert (unread.name, unread.messages, unread.complete) == (topic, COUNT, False)
        assert unread.reason.startswith("can't be decoded: ")
        assert told in unread.reason
        assert f"{topic} (200 messages): {unread.reason}" in info.findings
        assert info.to_json()["unread"] == [{"name": topic, "reason": unread.reason, "messages": COUNT}]
        assert info.damage == ()
        with pytest.raises(LogError, match="can't be decoded"):
            log.read([f"{topic}.x"])


def test_topics_that_share_a_reason_share_a_sentence() -> None:
    same = [Unread(topic=f"/{name}", reason="holds no number", messages=3) for name in "abcd"]
    other = Unread(topic="/e", field="x", reason="is too long")
    assert unread_sentences([*same[:2], other, *same[2:]]) == (
        "/a, /b, /c and 1 more (12 messages): holds no number",
        "/e.x: is too long",
    )


def test_fields_before_a_wide_string_are_read_and_those_behind_it_are_told(tmp_path: Path) -> None:
    messages = [CdrWriter().number("d", x).number("I", 2).number("H", 1, 2).number("d", 1.0).message() for x in X]
    schema = ("p/msg/W", "ros2msg", b"float64 x\nwstring w\nfloat64 y\n")
    with open_log(write_log(tmp_path / "a.mcap", ("/label", "cdr", schema, messages))) as log:
        assert [channel.name for channel in log.channels] == ["/good.data", "/label.x"]
        np.testing.assert_array_equal(log.read(["/label.x"]).values, [X])
        (unread,) = log.unread
        assert (unread.name, unread.messages) == ("/label.y", None)
        with pytest.raises(LogError, match=r"'/label\.y' can't be decoded: numbers behind a wstring"):
            log.read(["/label.y"])


def test_one_channel_of_a_topic_that_cannot_be_decoded_costs_only_itself(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        imus = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        others = maker.raw("/imu", encoding="cdr", schema=("p/msg/S", "ros2msg", b"float32 x\n"))
        for index in range(COUNT):
            stamp_ns = START_NS + index * 10_000_000
            maker.write(imus, imu(stamp_ns, (X[index], 0, 0)), stamp_ns)
            maker.write(others, DOUBLES[index], stamp_ns)
    with open_log(tmp_path / "a.mcap") as log:
        np.testing.assert_array_equal(log.read(["/imu.linear_acceleration.x"]).values, [X])
        assert [one.topic for one in log.unread] == ["/imu"]


# --- no numbers --------------------------------------------------------------------------------------------------


def hello(count: int = COUNT) -> list[bytes]:
    return [CdrWriter().text("hello").message()] * count


@pytest.mark.parametrize("period_ns", [10_000_000, 250_000_000])
def test_a_log_of_text_alone_is_told_as_such(tmp_path: Path, period_ns: int) -> None:
    with LogMaker(tmp_path / "a.mcap") as maker:
        chatter = maker.raw("/chatter", encoding="cdr", schema=TEXT)
        rare = maker.raw("/rare", encoding="json")
        for index, content in enumerate(hello()):
            maker.write(chatter, content, START_NS + index * period_ns)
        maker.write(rare, b'{"on": true, "text": "a"}', START_NS + period_ns)
    with open_log(tmp_path / "a.mcap") as log:
        info = log.info()
        assert info.channels == ()
        # As for samples, the last message stands for a period, too.
        assert info.duration_s == pytest.approx(COUNT * period_ns / 1e9)
        assert log.start_time_ns == info.start_time_ns == START_NS
        assert info.findings == ("/chatter, /rare (201 messages): holds no number",)
        assert [(one.name, one.messages) for one in info.unread] == [("/chatter", COUNT), ("/rare", 1)]
        with pytest.raises(LogError, match=r"no channel that could be read \(/chatter, /rare .*: holds no number\)"):
            log.read()


def test_text_beside_signals_is_listed_and_is_no_trouble(tmp_path: Path) -> None:
    with open_log(write_log(tmp_path / "a.mcap", ("/chatter", "cdr", TEXT, hello()))) as log:
        info = log.info()
    assert [(one.name, one.reason, one.complete) for one in info.unread] == [("/chatter", "holds no number", True)]
    assert not [one for one in info.findings if "/chatter" in one]


def test_numbers_that_are_no_signals_are_not_called_text(tmp_path: Path) -> None:
    schema = ("p/msg/C", "ros2msg", b"uint32 seq\nbool on\nuint8 status\n")
    messages = [CdrWriter().number("I", index).number("?", True).number("B", 1).message() for index in range(COUNT)]
    with open_log(write_log(tmp_path / "a.mcap", ("/counter", "cdr", schema, messages))) as log:
        (unread,) = log.unread
        assert unread.reason == "none of its numbers is listed as a signal; single ones can be read by path"
        np.testing.assert_array_equal(log.read(["/counter.seq"]).values, [np.arange(COUNT)])


def test_a_long_array_is_told_as_left_out(tmp_path: Path) -> None:
    schema = ("p/msg/C", "ros2msg", b"float64 x\nfloat32[100] curve\n")
    messages = [CdrWriter().number("d", x).number("f", *[0.5] * 100).message() for x in X]
    with open_log(write_log(tmp_path / "a.mcap", ("/scan", "cdr", schema, messages))) as log:
        (unread,) = log.unread
        assert unread.name == "/scan.curve"
        assert unread.reason == "an array this long isn't listed; single elements can be read by path"


def test_a_log_that_does_not_count_its_messages_is_not_made_to(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.mcap", ("/chatter", "cdr", TEXT, hello()), use_statistics=False)
    with open_log(path) as log:
        assert [(one.name, one.messages) for one in log.unread] == [("/chatter", None)]


def test_a_log_of_text_that_counts_nothing_still_has_a_duration(tmp_path: Path) -> None:
    with LogMaker(tmp_path / "a.mcap", use_statistics=False) as maker:
        chatter = maker.raw("/chatter", encoding="cdr", schema=TEXT)
        for index, content in enumerate(hello()):
            maker.write(chatter, content, START_NS + index * 10_000_000)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.info().duration_s == pytest.approx(1.99)
        assert log.info().findings == ("/chatter: holds no number",)


# --- what is odd, and read all the same ---------------------------------------------------------------------------


def test_what_is_odd_about_messages_is_told_with_their_number(tmp_path: Path) -> None:
    schema = ("S", "jsonschema", b'{"type": "object", "properties": {"x": {"type": "integer"}}}')
    messages = [f'{{"x": {x!r}}}'.encode() for x in X.tolist()]
    micro = [CdrWriter(origin=4).number("d", x).message() for x in X]
    path = write_log(
        tmp_path / "a.mcap",
        ("/j", "json", schema, messages),
        ("/m", "cdr", ("S", "omgidl", b"struct S { double x; };"), micro),
        chunk_size=500,
    )
    with open_log(path) as log:
        assert log.notes == ()
        np.testing.assert_array_equal(log.read(["/j.x", "/m.x"]).values, [X, X])
        told = [
            "/j: the schema calls x an integer, which its values aren't; they are read as they are",
            "/m: numbers are aligned from the encapsulation header on, as the lengths of the messages show",
        ]
        assert sorted(log.notes) == [f"{one} (200 messages)" for one in told]
        # Read again, they aren't odd twice.
        assert set(log.notes) <= set(log.info().findings)
        assert sorted(log.notes) == [f"{one} (200 messages)" for one in told]
        assert log.info().damage == ()


@pytest.mark.parametrize(
    ("case", "channels"),
    [
        ("cdr_aligned_from_its_header/rti", {"/s.x": X, "/s.y": -X}),
        ("json_schema_says_integer/floats", {"/j.x": X}),
        ("one_topic_spoils_the_log/wstring_topic", {"/good.x": X}),
        ("one_topic_spoils_the_log/xcdr2_topic", {"/good.x": X, "/x2.x": X}),
        ("protobuf_optional_absent/every_fourth_absent", {"/p.x": np.where(np.arange(COUNT) % 4, 5 + X, np.nan)}),
        ("log_without_numbers/strings", {}),
    ],
)
def test_messages_as_others_write_them(shared_data: Path, case: str, channels: dict[str, np.ndarray]) -> None:
    path = shared_data / "cases" / f"{case}.mcap"
    if not path.exists():
        pytest.skip("the cases aren't there")
    with open_log(path) as log:
        assert [channel.name for channel in log.channels] == list(channels)
        assert log.info().duration_s == pytest.approx(2.0)
        for name, values in channels.items():
            np.testing.assert_array_equal(log.read([name]).values[0], values)
