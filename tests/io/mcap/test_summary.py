"""The end of a log is used as far as it is sound."""

import struct
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

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


BOTH = CONTENT + lb.channel(2, "/hidden") + b"".join(lb.message(number, 2) for number in range(5))


def hiding_log(index: bytes, told: bytes) -> bytes:
    """Build a log with a chunk that holds messages of channel 2, too, of which the summary says nothing."""
    chunk = lb.chunk(BOTH)
    listed = lb.chunk_index(OFFSET, len(chunk), [1], len(index), len(BOTH), len(BOTH))
    return lb.log(DEFINITIONS, chunk + index, summary=DEFINITIONS + listed + told)


@pytest.mark.parametrize(
    ("index", "told"),
    [
        (lb.index_of(BOTH), b""),  # the size of the indexes doesn't fit one channel
        (lb.index_of(BOTH), lb.statistics({1: 5})),
        (b"", b""),
        (b"", lb.statistics({1: 5})),
        (b"", lb.statistics({}, channels=0)),
        (lb.index_of(CONTENT), lb.statistics({1: 5}, channels=2)),
    ],
)
def test_a_channel_that_the_summary_conceals_is_read(tmp_path: Path, index: bytes, told: bytes) -> None:
    with McapContainer.open(lb.write(tmp_path, hiding_log(index, told))) as log:
        assert list(log.channels) == [1, 2]
        assert lb.messages(log, [2]) == lb.expected(range(5), 2)
        assert sum(one.lost_messages or 0 for one in log.damage) == 0


def test_messages_of_a_channel_that_no_number_betrays_are_counted(tmp_path: Path) -> None:
    content = hiding_log(lb.index_of(CONTENT), lb.statistics({1: 5}))
    with McapContainer.open(lb.write(tmp_path, content)) as log:
        assert lb.messages(log, [1]) == lb.expected(range(5))
        told = {one.what: one.lost_messages for one in log.damage}
    assert told == {
        "the message index contradicts the chunk before it, which is read record by record": 0,
        "a channel is defined here that the summary doesn't know": 0,
        "messages of channel 2, which the summary doesn't list, are left out; "
        "'mcap recover' writes a whole summary": 5,
    }


@pytest.mark.parametrize("told", [lb.statistics({}), lb.statistics({1: 5}), lb.statistics({1: 500})])
@pytest.mark.parametrize("chunked", [False, True])
@pytest.mark.parametrize("definitions", [b"", DEFINITIONS])
def test_a_summary_that_lists_no_chunk_hides_none(
    tmp_path: Path, told: bytes, chunked: bool, definitions: bytes
) -> None:
    data = lb.chunk(DEFINITIONS + CONTENT) + lb.index_of(DEFINITIONS + CONTENT) if chunked else DEFINITIONS + CONTENT
    with McapContainer.open(lb.write(tmp_path, lb.log(data, summary=definitions + told))) as log:
        assert list(log.channels) == [1]
        assert lb.messages(log) == lb.expected(range(5))


@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_summary_that_omits_whatever_it_likes_hides_nothing(tmp_path: Path, data: st.DataObject) -> None:
    """Every part of a summary may be missing: what can be read stays the same, or the loss is counted."""
    chunks = data.draw(st.lists(st.sets(st.integers(1, 5), min_size=1), min_size=1, max_size=5), label="channels")
    body, indexes, known, counts = lb.header()[:0], b"", set[int](), dict[int, int]()
    for channels in chunks:
        fresh = b"".join(lb.channel(one, f"/t{one}") for one in sorted(channels - known))
        content = (b"" if known else lb.schema()) + fresh + b"".join(lb.message(one, one) for one in sorted(channels))
        known |= channels
        counts |= {one: counts.get(one, 0) + 1 for one in channels}
        behind = lb.index_of(content) if data.draw(st.booleans(), label="message index") else b""
        told = sorted(channels) if behind else []
        chunk = lb.chunk(content)
        if data.draw(st.booleans(), label="chunk index"):
            offset = lb.data_start() + len(body)
            indexes += lb.chunk_index(offset, len(chunk), told, len(behind), len(content), len(content))
        body += chunk + behind
    listed = data.draw(st.sets(st.sampled_from(sorted(known))), label="listed channels")
    summary = lb.schema() + b"".join(lb.channel(one, f"/t{one}") for one in sorted(listed)) + indexes
    summary += data.draw(
        st.sampled_from(
            [b"", lb.statistics(counts), lb.statistics({}), lb.statistics({one: counts[one] for one in listed})]
        ),
        label="statistics",
    )
    with McapContainer.open(lb.write(tmp_path, lb.log(body, summary=summary))) as log:
        found = lb.messages(log)
        lost = sum(one.lost_messages or 0 for one in log.damage)
        assert len(found) + lost == sum(counts.values())


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
