"""The end of a log is used as far as it is sound."""

import struct
from pathlib import Path

import pytest

from chladni.io.mcap.container import McapContainer
from tests.io.mcap import log_bytes as lb

DEFINITIONS = lb.schema() + lb.channel()
CONTENT = b"".join(lb.message(number) for number in range(5))
CHUNK = lb.chunk(CONTENT) + lb.index_of(CONTENT)
OFFSET = lb.data_start() + len(DEFINITIONS)
INDEX = lb.chunk_index(OFFSET, len(lb.chunk(CONTENT)), [1], len(lb.index_of(CONTENT)), len(CONTENT), len(CONTENT))


def opened(folder: Path, summary: bytes, **options: int) -> tuple[list[lb.Message], list[str]]:
    path = lb.write(folder, lb.log(DEFINITIONS, CHUNK, summary=summary, **options))
    with McapContainer.open(path) as log:
        return lb.messages(log), [one.what for one in log.damage]


@pytest.mark.parametrize("crc", [None, 0])
def test_a_sound_summary_is_used_without_reading_the_data(tmp_path: Path, crc: int | None) -> None:
    content = lb.log(DEFINITIONS, CHUNK, summary=DEFINITIONS + INDEX + lb.statistics({1: 5}), summary_crc=crc)
    # With the data spoiled, only the summary can tell.
    with McapContainer.open(lb.write(tmp_path, content.replace(CHUNK, bytes(len(CHUNK))))) as log:
        assert log.message_counts() == {1: 5}
        assert log.time_range_ns == (lb.START_NS, lb.START_NS + 1000)
        assert log.damage == ()
        assert lb.messages(log) == []
        assert sum(one.lost_messages or 0 for one in log.damage) == 5


@pytest.mark.parametrize(
    ("summary", "what"),
    [
        (DEFINITIONS + lb.record(5, b"x")[:-1], "the summary holds a record that can't be one"),
        (DEFINITIONS + b"\x05", "the summary ends within a record"),
        (DEFINITIONS + bytes(20), "the summary holds a record that can't be one"),
        (DEFINITIONS + INDEX + INDEX, "the chunk indexes in the summary overlap"),
        (
            DEFINITIONS + lb.chunk_index(1 << 40, 500, [1], 0, 100, 100),
            "the chunk indexes in the summary point behind the data",
        ),
        (DEFINITIONS + lb.channel(topic="/other"), "the summary defines a channel twice, differently"),
        (DEFINITIONS + lb.record(0x0B, b"short"), "a field of 8 bytes runs over the record's end"),
        (lb.record(4, struct.pack("<HHI", 1, 1, 2) + b"\xff\xfe" + bytes(8)), "a text is not UTF-8"),
        (DEFINITIONS + lb.record(3, bytes(14)), "schema id 0 is reserved for 'no schema'"),
    ],
)
def test_an_unsound_summary_is_told_and_the_log_read_from_its_start(
    tmp_path: Path, summary: bytes, what: str
) -> None:
    found, damage = opened(tmp_path, summary)
    assert found == lb.expected(range(5))
    assert damage == [f"{what}; the log is read from its start instead"]


def test_a_wrong_checksum_makes_the_summary_unsound(tmp_path: Path) -> None:
    found, damage = opened(tmp_path, DEFINITIONS + INDEX, summary_crc=12345)
    assert found == lb.expected(range(5))
    assert damage == ["the summary's checksum is wrong; the log is read from its start instead"]


@pytest.mark.parametrize("start", [3, 1 << 60])
def test_a_summary_outside_the_log_is_not_looked_for(tmp_path: Path, start: int) -> None:
    content = bytearray(lb.log(DEFINITIONS, CHUNK, summary=b""))
    content[-28:-20] = struct.pack("<Q", start)
    with McapContainer.open(lb.write(tmp_path, bytes(content))) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert f"the summary starts at byte {start}, outside the log" in log.damage[0].what


@pytest.mark.parametrize(
    "summary",
    [
        DEFINITIONS,  # nothing says that these are all channels
        lb.channel() + INDEX,  # the schema is missing
        lb.schema() + INDEX,  # the channel is missing
        DEFINITIONS + INDEX + lb.statistics({1: 5}, channels=2),  # one of two channels is missing
        DEFINITIONS + lb.statistics({1: 3, 2: 2}),
    ],
)
def test_a_summary_that_may_lack_channels_is_completed_from_the_data(tmp_path: Path, summary: bytes) -> None:
    path = lb.write(tmp_path, lb.log(DEFINITIONS, CHUNK, summary=summary))
    with McapContainer.open(path) as log:
        assert list(log.channels) == [1]
        assert log.channels[1].schema is not None
        assert log.message_counts() == {1: 5}
        assert lb.messages(log) == lb.expected(range(5))


def test_a_channel_that_the_summary_conceals_is_told(tmp_path: Path) -> None:
    hidden = lb.channel(2, "/hidden") + lb.message(7, 2)
    content = lb.chunk(CONTENT + hidden)
    index = lb.chunk_index(OFFSET, len(content), [1], 0, len(CONTENT + hidden), len(CONTENT + hidden))
    path = lb.write(tmp_path, lb.log(DEFINITIONS, content, summary=DEFINITIONS + index))
    with McapContainer.open(path) as log:
        assert lb.messages(log, [1]) == lb.expected(range(5))
        assert [one.what for one in log.damage] == ["a channel is defined here that the summary doesn't know"]


def test_a_log_without_data_end_is_read_up_to_the_summary(tmp_path: Path) -> None:
    content = lb.log(DEFINITIONS, CHUNK, summary=b"")
    end = content.index(lb.record(15, bytes(4)))
    with McapContainer.open(lb.write(tmp_path, content[:end] + content[end + 13 :])) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert log.damage == ()


@pytest.mark.parametrize("what", ["far", "near", "size"])
def test_a_summary_without_checksum_that_lies_about_chunks_is_overruled_by_them(tmp_path: Path, what: str) -> None:
    offset = {"far": 1 << 20, "near": 20, "size": 0}[what]
    wrong = lb.chunk_index(
        OFFSET + min(offset, 20), len(lb.chunk(CONTENT)) - (9 if what == "size" else 20), [1], 0,
        len(CONTENT), len(CONTENT) + 1,
    )  # fmt: skip
    found, damage = opened(tmp_path, DEFINITIONS + wrong, summary_crc=0)
    assert found == lb.expected(range(5))
    assert damage
