"""A log that grows gives the samples of the finished file, whatever pieces it comes in, whatever its clock does."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.live.door import open_live
from chladni.io.live.followed_log import FollowedFile
from chladni.io.log import open_log
from chladni.signals.errors import LogError
from tests.io.live.growing import IMU_CHANNELS, START_NS, Bits, joined, read_live, write_imus
from tests.make_logs import IMU, LogMaker, imu

STAMPS = START_NS + np.arange(3000) * 2_000_000
CHANNELS = list(IMU_CHANNELS)


def finished(path: Path, channels: list[str] | None = None) -> np.ndarray:
    with open_log(path) as log:
        return log.read(CHANNELS if channels is None else channels).values


def live_of(path: Path, lengths: tuple[int, ...] = (5000, 1, 333), **options):
    return read_live(Bits(path.read_bytes(), lengths), channels=CHANNELS, **options)


@pytest.mark.parametrize("lengths", [(1 << 20,), (997,), (1, 2, 70_000)])
def test_pieces_of_any_size_give_the_samples_of_the_finished_file(tmp_path: Path, lengths: tuple[int, ...]) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS)
    blocks, told = live_of(path, lengths)
    np.testing.assert_array_equal(joined(blocks), finished(path))
    assert blocks[0].sample_rate_hz == 500.0
    assert not told


def test_lost_messages_leave_their_places_free_and_are_told(tmp_path: Path) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS, keep=lambda _, number: not 2000 <= number < 2125)
    blocks, told = live_of(path)
    np.testing.assert_array_equal(joined(blocks), finished(path))
    (gap,) = told
    assert (gap.kind, gap.samples) == ("gap", 125)
    assert gap.time_ns == STAMPS[2125]


def test_scattered_stamps_move_no_sample(tmp_path: Path) -> None:
    scatter = np.random.default_rng(3).normal(0.0, 150_000, STAMPS.size).astype(np.int64)
    path = write_imus(tmp_path / "a.mcap", STAMPS + scatter, log_ns=STAMPS + 1_000_000)
    blocks, told = live_of(path)
    np.testing.assert_array_equal(joined(blocks), finished(path))
    assert not told


def test_a_clock_that_was_set_is_told_and_time_runs_on(tmp_path: Path) -> None:
    stamps = STAMPS.copy()
    stamps[1800:] -= 3_600_000_000_000
    path = write_imus(tmp_path / "a.mcap", stamps, log_ns=STAMPS)
    blocks, told = live_of(path)
    np.testing.assert_array_equal(joined(blocks), finished(path))
    (step,) = told
    assert step.kind == "clock"
    assert "set back by 3600 s" in step.text


def test_messages_out_of_order_find_their_places(tmp_path: Path) -> None:
    order = np.arange(STAMPS.size)
    order[1500:1504] = [1502, 1500, 1503, 1501]
    path = write_imus(tmp_path / "a.mcap", STAMPS[order], log_ns=STAMPS)
    blocks, _ = live_of(path)
    np.testing.assert_array_equal(joined(blocks), finished(path))


def test_a_topic_that_falls_silent_is_told_and_the_other_goes_on(tmp_path: Path) -> None:
    path = write_imus(
        tmp_path / "a.mcap",
        STAMPS,
        topics=("/imu", "/arm"),
        keep=lambda topic, number: topic != "/arm" or number < 1500,
    )
    names = [*CHANNELS, "/arm.linear_acceleration.x"]
    blocks, told = read_live(Bits(path.read_bytes(), (4000,)), channels=names)
    values = joined(blocks)
    np.testing.assert_array_equal(values, finished(path, names))
    assert np.isnan(values[3, 1500:]).all()
    assert [one.kind for one in told] == ["silent"]


# A name that another topic's begins is a topic of its own.
@pytest.mark.parametrize("topic", ["/arm", "/imu2"])
def test_a_topic_that_appears_late_is_told_and_comes_apart(tmp_path: Path, topic: str) -> None:
    path = write_imus(
        tmp_path / "a.mcap",
        STAMPS,
        topics=("/imu", topic),
        keep=lambda one, number: one != topic or number > 2000,
    )
    names = [*CHANNELS, f"{topic}.linear_acceleration.x"]
    blocks, told = read_live(Bits(path.read_bytes(), (4000,)), channels=names)
    late = [one for one in blocks if len(one.channels) == 1]
    np.testing.assert_array_equal(joined(late), finished(path, names[3:]))
    assert [one.text for one in told] == [
        f"no message of {names[3]} has come; waiting for it",
        f"{topic} appeared; it is averaged apart from the others",
    ]


def test_a_log_that_is_cut_gives_all_whole_messages_and_says_so(tmp_path: Path) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS)
    content = path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    blocks, told = read_live(Bits(content[: len(content) // 2]), channels=CHANNELS)
    # Whole messages of the torn chunk wait for its checksum, which never comes.
    values = joined(blocks)
    np.testing.assert_array_equal(values, finished(tmp_path / "cut.mcap")[:, : values.shape[1]])
    assert values.shape[1] > 1200
    assert "without a footer" in told[-1].text


def test_a_damaged_chunk_is_told_and_reading_goes_on(tmp_path: Path) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    (tmp_path / "bad.mcap").write_bytes(content)
    blocks, told = read_live(Bits(bytes(content)), channels=CHANNELS)
    np.testing.assert_array_equal(joined(blocks), finished(tmp_path / "bad.mcap"))
    assert {"source", "gap"} <= {one.kind for one in told}


def test_what_is_no_log_is_refused() -> None:
    with pytest.raises(LogError, match="not an MCAP log: starts with 6e 6f"):
        read_live(Bits(b"no log at all"))


def test_a_file_is_followed_while_it_grows(tmp_path: Path) -> None:
    content = write_imus(tmp_path / "a.mcap", STAMPS).read_bytes()
    path = tmp_path / "growing.mcap"
    path.write_bytes(b"")
    source = FollowedFile(path, patience_s=5.0)
    with path.open("ab", buffering=0) as file:
        for first in range(0, len(content), 30_000):
            assert not source.receive(0.0).ended
            file.write(content[first : first + 30_000])
    blocks, told = read_live(source, channels=CHANNELS)
    source.close()
    assert joined(blocks).shape[1] > 0
    assert not told


def test_a_file_that_becomes_shorter_ends_with_a_word(tmp_path: Path) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    source = FollowedFile(path, patience_s=5.0)
    assert not source.receive(0.0).ended
    path.write_bytes(content[:1000])
    found = source.receive(0.0)
    source.close()
    assert found.ended
    assert "became shorter" in found.told[0]


def test_messages_that_are_sent_again_are_told_and_not_taken_in_silence(tmp_path: Path) -> None:
    stamps = np.concatenate((STAMPS[:2000], STAMPS[1900:2900]))
    path = write_imus(tmp_path / "a.mcap", stamps, log_ns=START_NS + np.arange(stamps.size) * 2_000_000)
    blocks, told = live_of(path)
    np.testing.assert_array_equal(joined(blocks), finished(path))
    assert "clock" in {one.kind for one in told}


def test_fields_that_nobody_measures_stop_no_average(tmp_path: Path) -> None:
    """A message type has fields of which a sensor fills some, and NaN stands in the others."""
    path = tmp_path / "a.mcap"
    with LogMaker(path) as maker:
        channel = maker.ros2("/imu", "sensor_msgs/msg/Imu", IMU)
        for number, stamp_ns in enumerate(STAMPS.tolist()):
            maker.write(channel, imu(stamp_ns, (number % 7, np.nan, 1.0), (0.0, 0.0, number % 3)), stamp_ns)
    blocks, told = read_live(Bits(path.read_bytes()))
    names = [one.name for one in blocks[0].channels]
    assert "/imu.linear_acceleration.x" in names
    assert "/imu.linear_acceleration.y" not in names
    assert ["/imu.linear_acceleration.y" in one.text for one in told] == [True]


def test_a_channel_of_which_no_topic_is_there_is_told(tmp_path: Path) -> None:
    path = write_imus(tmp_path / "a.mcap", STAMPS)
    _, told = read_live(Bits(path.read_bytes()), channels=[*CHANNELS, "/imu2.linear_acceleration.x"])
    why = "no topic starts /imu2.linear_acceleration.x; did you mean /imu?; waiting for it"
    assert [one.text for one in told] == [why]


@pytest.mark.parametrize(
    ("length", "why"),
    [
        (0, "ended within its first 8 bytes; it holds no message"),
        (500, "without a footer"),
        (None, "no topic starts /nowhere.x; there are: /imu"),
    ],
)
def test_a_source_that_gave_nothing_says_why(tmp_path: Path, length: int | None, why: str) -> None:
    content = write_imus(tmp_path / "a.mcap", STAMPS).read_bytes()[:length]
    with pytest.raises(LogError, match=f"^bits: it ended without samples: .*{why}"):
        read_live(Bits(content), channels=["/nowhere.x"] if length is None else None)


def test_what_is_no_source_is_refused() -> None:
    with pytest.raises(LogError, match=r"http://127\.0\.0\.1: no source; give an MCAP log"):
        open_live("http://127.0.0.1")
