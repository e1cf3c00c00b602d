"""Damaged and lying logs: everything whole is read, nothing wrong is given, and the loss is told."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType

from chladni.io.mcap.container import McapContainer
from tests.io.mcap import log_bytes as lb

DEFINITIONS = lb.schema() + lb.channel()


def content_of(numbers: range, channel_id: int = 1, **options: int) -> bytes:
    return b"".join(lb.message(number, channel_id, **options) for number in numbers)


def indexed_chunk(content: bytes, compression: str = "") -> bytes:
    return lb.chunk(content, compression) + lb.index_of(content)


def summarised(
    *chunks: tuple[bytes, bytes], counts: dict[int, int], channel_ids: dict[int, list[int]] | None = None
) -> bytes:
    """Put a log of plain chunks together; ``channel_ids`` overrides what the summary says of a chunk."""
    data = b""
    summary = lb.schema() + b"".join(lb.channel(number, f"/topic{number}") for number in counts)
    for number, (content, index) in enumerate(chunks):
        record = lb.chunk(content)
        listed = (channel_ids or {}).get(number, sorted(counts))
        start = lb.data_start() + len(data)
        summary += lb.chunk_index(start, len(record), listed, len(index), len(content), len(content))
        data += record + index
    return lb.log(data, summary=summary + lb.statistics(counts))


@pytest.mark.parametrize(
    "settings",
    [
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
    ],
    ids=str,
)
def test_a_log_cut_anywhere_gives_its_start_and_tells_the_rest(tmp_path: Path, settings: dict[str, object]) -> None:
    content = lb.sample_log(**settings)
    whole = lb.read(lb.write(tmp_path, content))
    last = -1
    for size in range(9, len(content), 331):
        with McapContainer.open(lb.write(tmp_path, content[:size])) as log:
            found = lb.messages(log)
            # Within a chunk the batches come channel by channel, so a cut chunk has a part of each.
            assert set(found) <= set(whole)
            assert len(found) >= last
            assert log.damage
            last = len(found)
    assert len(found) == len(whole)


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_the_whole_messages_of_a_cut_chunk_are_given(tmp_path: Path, compression: str) -> None:
    numbers = range(3000)
    chunk = lb.chunk(b"".join(noisy_message(number) for number in numbers), compression)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, chunk[: len(chunk) // 2]))
    with McapContainer.open(path) as log:
        found = lb.messages(log)
        assert 1000 < len(found) < 2000
        assert found == [noisy(number) for number in range(len(found))]
        assert "the file ends within the chunk" in log.damage[0].what
        assert "checksum could not be checked" in log.damage[0].what
        assert (log.damage[0].record, log.damage[0].lost_messages) == ("Chunk", None)


def noisy(number: int) -> lb.Message:
    return 1, lb.START_NS + number, np.random.default_rng(number).bytes(60)


def noisy_message(number: int) -> bytes:
    _, time_ns, data = noisy(number)
    return lb.record(5, struct.pack("<HIQQ", 1, number, time_ns, time_ns) + data)


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_chunk_whose_end_is_zeros_gives_what_is_before_them(tmp_path: Path, compression: str) -> None:
    content = b"".join(noisy_message(number) for number in range(3000))
    chunk = lb.chunk(content, compression)
    half = len(chunk) // 2
    data = chunk[:half] + bytes(len(chunk) - half) + lb.index_of(content)
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data))) as log:
        found = lb.messages(log)
        assert 1000 < len(found) < 2000
        assert found == [noisy(number) for number in range(len(found))]
        assert "filled with zeros" in log.damage[0].what
        assert log.damage[0].lost_messages == 3000 - len(found)


def test_zeros_that_belong_to_the_messages_do_not_excuse_a_wrong_checksum(tmp_path: Path) -> None:
    content = content_of(range(5)) + lb.record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + bytes(100))
    wrong = content.replace(lb.payload(2), b"?" * 20)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, lb.chunk(content, data=wrong)))
    assert lb.read(path) == []


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_chunk_with_a_wrong_checksum_is_left_out_and_counted(tmp_path: Path, compression: str) -> None:
    contents = [content_of(range(start, start + 10)) for start in (0, 10, 20)]
    spoiled = contents[1].replace(lb.payload(15), b"!" * 20)
    data = lb.compress(spoiled, compression)
    chunk = lb.chunk(contents[1], compression, data=data) + lb.index_of(contents[1])
    log_content = lb.log(
        DEFINITIONS, indexed_chunk(contents[0], compression), chunk, indexed_chunk(contents[2], compression)
    )
    path = lb.write(tmp_path, log_content)
    with McapContainer.open(path) as log:
        assert lb.messages(log) == lb.expected([*range(10), *range(20, 30)])
        bad = next(one for one in log.damage if one.record == "Chunk")
        assert "the chunk's checksum is wrong; none of the chunk's messages are given" in bad.what
        assert bad.lost_messages == 10
        first = lb.data_start() + len(DEFINITIONS) + len(indexed_chunk(contents[0], compression))
        assert bad.offset == first
    assert len(lb.read(path, check_crc=False)) == 30


def test_a_checksum_missing_where_others_have_one_is_not_trusted(tmp_path: Path) -> None:
    one, other = content_of(range(5)), content_of(range(5, 10))
    path = lb.write(tmp_path, lb.log(DEFINITIONS, lb.chunk(one), lb.chunk(other, crc=0)))
    assert lb.read(path) == lb.expected(range(5))
    path = lb.write(tmp_path, lb.log(DEFINITIONS, lb.chunk(one, crc=0), lb.chunk(other, crc=0)))
    assert lb.read(path) == lb.expected(range(10))


def test_a_zero_filled_tail_is_told_with_its_length(tmp_path: Path) -> None:
    content = lb.log(DEFINITIONS, content_of(range(10)))
    with McapContainer.open(lb.write(tmp_path, content + bytes(5000))) as log:
        assert lb.messages(log) == lb.expected(range(10))
        zeros = next(one for one in log.damage if one.record == "zeros")
        assert zeros.what.startswith("5000 bytes are filled with zeros")
        assert zeros.offset == len(content)


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_behind_garbage_reading_goes_on_at_the_next_chunk(tmp_path: Path, compression: str) -> None:
    one, other = content_of(range(50)), content_of(range(50, 100))
    garbage = np.random.default_rng(3).bytes(3000)
    for junk in (garbage, bytes(3000), b"\x06" * 3000):
        data = indexed_chunk(one, compression) + junk + indexed_chunk(other, compression)
        with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data))) as log:
            assert lb.messages(log) == lb.expected(range(100))
            assert any("reading goes on at byte" in damage.what for damage in log.damage)


def test_records_with_unknown_opcodes_are_stepped_over_without_a_word(tmp_path: Path) -> None:
    private, future = lb.record(0x9A, b"anything" * 20), lb.record(0x22, b"")
    content = content_of(range(3)) + private + future + content_of(range(3, 6))
    for data in (content, lb.chunk(content), private + lb.chunk(content) + future):
        path = lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))
        with McapContainer.open(path) as log:
            assert lb.messages(log) == lb.expected(range(6))
            assert log.damage == ()


def test_messages_of_an_undefined_channel_are_counted_as_lost(tmp_path: Path) -> None:
    content = content_of(range(4)) + content_of(range(3), 9)
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, content, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(4))
        (damage,) = log.damage
        assert (damage.what, damage.lost_messages) == (
            "messages of the undefined channel 9 are left out",
            3,
        )


@pytest.mark.parametrize("second", [lb.channel(topic="/other"), lb.schema(data=b"float32 y")])
def test_messages_behind_a_contradicting_definition_are_left_out(tmp_path: Path, second: bytes) -> None:
    one, other = content_of(range(5)), second + content_of(range(5, 8))
    data = DEFINITIONS + lb.chunk(one) + lb.chunk(other)
    with McapContainer.open(lb.write(tmp_path, lb.log(data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert sorted(one.lost_messages or 0 for one in log.damage) == [0, 3]
        assert log.channels[1].topic == "/imu"


def test_a_schema_that_is_nowhere_defined_is_told(tmp_path: Path) -> None:
    data = lb.channel(schema_id=7) + content_of(range(3))
    with McapContainer.open(lb.write(tmp_path, lb.log(data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(3))
        assert log.channels[1].schema is None
        assert "schema 7, which the log doesn't define" in log.damage[0].what


def test_times_beyond_64_signed_bits_are_not_wrapped(tmp_path: Path) -> None:
    content = lb.message(0) + lb.message(1, time_ns=(1 << 63) + 5) + lb.message(2)
    for data in (lb.chunk(content), content, lb.chunk(lb.message(1, time_ns=1 << 63))):
        with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
            assert lb.messages(log) == [one for one in lb.expected([0, 2]) if lb.payload(0) in data]
            assert [damage.lost_messages for damage in log.damage] == [1]


def lying_indexes(content: bytes) -> dict[str, bytes]:
    size = len(lb.message(0))
    right = [(lb.START_NS + number, number * size) for number in range(10)]
    return {
        "an offset is wrong": lb.message_index(1, [*right[:5], (right[5][0], 7), *right[6:]]),
        "an offset is huge": lb.message_index(1, [*right[:9], (right[9][0], (1 << 63) + 10)]),
        "an entry is missing": lb.message_index(1, right[:4] + right[5:]),
        "an entry is there twice": lb.message_index(1, [*right, right[0]]),
        "a time is wrong": lb.message_index(1, [(1, 0), *right[1:]]),
        "the channel is wrong": lb.message_index(2, right),
        "a channel comes twice": lb.message_index(1, right[:5]) + lb.message_index(1, right[5:]),
        "it ends within an entry": lb.record(7, struct.pack("<HI", 1, 17) + bytes(17)),
        "it is empty": lb.message_index(1, []),
    }


@pytest.mark.parametrize("lie", lying_indexes(b""))
def test_a_lying_message_index_hides_nothing(tmp_path: Path, lie: str) -> None:
    content = content_of(range(10))
    data = lb.chunk(content) + lying_indexes(content)[lie]
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(10))
        assert [(damage.record, damage.lost_messages) for damage in log.damage] == [("MessageIndex", 0)]


def test_an_index_larger_than_its_chunk_could_need_is_not_kept(tmp_path: Path) -> None:
    content = content_of(range(3))
    index = lb.message_index(1, [(0, 0)] * 1000)
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, lb.chunk(content) + index, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(3))
        (damage,) = log.damage
        assert (damage.record, damage.lost_messages) == ("MessageIndex", 0)
        assert "more entries than its chunk can hold" in damage.what


def test_a_summary_that_hides_a_channel_of_a_chunk_is_found_out(tmp_path: Path) -> None:
    one, other = content_of(range(5)), content_of(range(5), 2)
    # The summary says that the second chunk has only channel 1; its message index knows better.
    content = summarised(
        (one, lb.index_of(one)), (other, lb.index_of(other)), counts={1: 5, 2: 5},
        channel_ids={0: [1], 1: [1]},
    )  # fmt: skip
    with McapContainer.open(lb.write(tmp_path, content)) as log:
        assert lb.messages(log, [2]) == lb.expected(range(5), 2)


def test_what_summary_and_indexes_both_hide_the_statistics_betray_and_it_is_read(tmp_path: Path) -> None:
    one, hidden = content_of(range(5)), content_of(range(5), 2)
    index = lb.index_of(one)
    content = summarised((one, index), (one + hidden, index), counts={1: 10, 2: 5}, channel_ids={0: [1], 1: [1]})
    with McapContainer.open(lb.write(tmp_path, content)) as log:
        assert lb.messages(log, [2]) == lb.expected(range(5), 2)
        assert "the message index contradicts the chunk before it" in log.damage[0].what
        assert sum(one.lost_messages or 0 for one in log.damage) == 0


def test_more_messages_than_the_statistics_count_are_told_too(tmp_path: Path) -> None:
    one = content_of(range(5))
    with McapContainer.open(lb.write(tmp_path, summarised((one, lb.index_of(one)), counts={1: 3}))) as log:
        assert len(lb.messages(log)) == 5
        assert "channel 1 has 2 messages more than" in log.damage[0].what
        assert log.damage[0].lost_messages == 0


@given(
    order=st.lists(st.integers(1, 6), min_size=1, max_size=60),
    sizes=st.lists(st.integers(0, 40), min_size=6, max_size=6),
    chunk_size=st.integers(1, 300),
    empty=st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_whole_log_in_chunks_of_any_size_is_sound(
    tmp_path: Path, order: list[int], sizes: list[int], chunk_size: int, empty: bool
) -> None:
    """Few messages a chunk, and indexes of channels that it doesn't hold, as some writers give them."""
    definitions = lb.schema() + b"".join(lb.channel(number, f"/t{number}") for number in range(1, 7))
    data, content, expected = b"", b"", []
    for place, number in enumerate(order):
        content += lb.message(place, number, size=sizes[number - 1])
        expected += lb.expected([place], number, sizes[number - 1])
        if len(content) >= chunk_size or place == len(order) - 1:
            spare = [lb.message_index(other, []) for other in range(10, 14)] if empty else []
            data += lb.chunk(content) + lb.index_of(content) + b"".join(spare)
            content = b""
    with McapContainer.open(lb.write(tmp_path, lb.log(definitions, data, summary=b""))) as log:
        assert sorted(lb.messages(log)) == sorted(expected)
        assert log.damage == ()


def patched(content: bytes, offset: int, new: bytes) -> bytes:
    return content[:offset] + new + content[offset + len(new) :]


@pytest.mark.parametrize(
    ("field", "at", "size"),
    [("opcode", 0, 1), ("length", 1, 8), ("start time", 9, 8), ("uncompressed size", 25, 8), ("data size", 41, 8)],
)
def test_a_damaged_chunk_header_is_replaced_by_the_summary(tmp_path: Path, field: str, at: int, size: int) -> None:
    contents = [content_of(range(start, start + 10)) for start in (0, 10, 20)]
    sound = summarised(*((one, lb.index_of(one)) for one in contents), counts={1: 30})
    second = lb.data_start() + len(indexed_chunk(contents[0]))
    content = patched(sound, second + at, b"\x05".ljust(size, b"\x77"))
    with McapContainer.open(lb.write(tmp_path, content)) as log:
        assert lb.messages(log) == lb.expected(range(30))
        assert [(one.record, one.lost_messages) for one in log.damage] == [("Chunk", 0)]


def test_without_a_summary_a_damaged_chunk_header_costs_that_chunk_only(tmp_path: Path) -> None:
    chunks = [indexed_chunk(content_of(range(start, start + 10))) for start in (0, 10, 20)]
    data = chunks[0] + patched(chunks[1], 1, struct.pack("<Q", 1 << 60)) + chunks[2]
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data))) as log:
        assert lb.messages(log) == lb.expected([*range(10), *range(20, 30)])
        assert "the chunk's header is damaged" in log.damage[0].what


def test_a_wrong_opcode_does_not_hide_a_chunk(tmp_path: Path) -> None:
    chunks = [indexed_chunk(content_of(range(start, start + 10))) for start in (0, 10)]
    for opcode in (5, 9, 12, 0x86):
        data = chunks[0] + patched(chunks[1], 0, bytes([opcode]))
        with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
            assert lb.messages(log) == lb.expected(range(20))
            assert [one.lost_messages for one in log.damage] == [0]


def test_message_indexes_betray_a_chunk_that_is_gone(tmp_path: Path) -> None:
    content = content_of(range(10))
    data = lb.chunk(content) + lb.record(0x99, b"was a chunk") + lb.index_of(content)
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(10))
        assert log.damage[0].what == "a message index without a chunk before it"
        assert log.damage[0].lost_messages == 10


def test_messages_outside_the_chunks_of_a_chunked_log_need_a_checksum(tmp_path: Path) -> None:
    data = lb.chunk(content_of(range(5))) + content_of(range(5, 8))
    path = lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))
    with McapContainer.open(path) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert [one.lost_messages for one in log.damage] == [3]
    assert lb.read(path, check_crc=False) == lb.expected(range(8))


def test_records_inside_a_chunk_that_make_no_sense_end_it(tmp_path: Path) -> None:
    content = content_of(range(10))
    broken = content + struct.pack("<BQ", 5, 1 << 60) + bytes(50)
    for data, lost in ((lb.chunk(broken), None), (lb.chunk(broken) + lb.index_of(content), 0)):
        with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
            assert lb.messages(log) == lb.expected(range(10))
            damage = next(one for one in log.damage if one.record == "Chunk")
            assert "stop making sense 510 bytes into its content" in damage.what
            assert damage.lost_messages == lost


def test_the_checksum_over_all_data_is_checked(tmp_path: Path) -> None:
    for options in ({"use_chunking": False}, {"enable_crcs": False}):
        content = lb.sample_log(enable_data_crcs=True, compression=CompressionType.NONE, **options)
        at = content.index(lb.payload(77, 40))
        for position, told in ((None, False), (at, True), (20, True)):
            changed = content if position is None else patched(content, position, b"\xee")
            with McapContainer.open(lb.write(tmp_path, changed)) as log:
                assert len(lb.messages(log)) == 203
                assert any(one.record == "DataEnd" for one in log.damage) is told
            assert len(lb.read(lb.write(tmp_path, changed), check_crc=False)) == 203


def test_reading_one_channel_checks_all_data_only_where_nothing_is_left_out(tmp_path: Path) -> None:
    with McapContainer.open(lb.write(tmp_path, lb.sample_log(enable_data_crcs=True))) as log:
        assert len(lb.messages(log, [3])) == 3
        assert log.damage == ()


@pytest.mark.parametrize("opcode", [0, 2, 5, 0x0F])
def test_a_wrong_header_does_not_stop_the_reading(tmp_path: Path, opcode: int) -> None:
    content = lb.log(DEFINITIONS, content_of(range(5)), summary=b"")
    with McapContainer.open(lb.write(tmp_path, patched(content, 8, bytes([opcode])))) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert [one.record for one in log.damage] == ["Header"]
        assert (log.profile, log.library) == ("", "")


def test_a_header_with_an_absurd_length_leaves_the_chunks(tmp_path: Path) -> None:
    content = lb.log(DEFINITIONS + lb.chunk(DEFINITIONS + content_of(range(5))))
    with McapContainer.open(lb.write(tmp_path, patched(content, 9, b"\xff" * 8))) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert log.damage[0].what.startswith("the log doesn't start with a Header; reading goes on")


@pytest.mark.parametrize(
    ("junk", "record"), [(lb.record(2, bytes(20)), "Footer"), (lb.record(15, bytes(4)), "DataEnd")]
)
def test_an_end_that_comes_too_early_is_not_believed(tmp_path: Path, junk: bytes, record: str) -> None:
    data = lb.chunk(content_of(range(5))) + junk + lb.chunk(content_of(range(5, 9)))
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(9))
        assert [one.record for one in log.damage] == [record]


def test_a_log_whose_summary_is_cut_off_has_lost_nothing(tmp_path: Path) -> None:
    content = lb.log(DEFINITIONS, content_of(range(5)), summary=DEFINITIONS)
    with McapContainer.open(lb.write(tmp_path, content[:-20])) as log:
        assert lb.messages(log) == lb.expected(range(5))
        assert [(one.record, one.lost_messages) for one in log.damage] == [("Summary", 0)]


def test_bytes_behind_the_end_are_told(tmp_path: Path) -> None:
    content = lb.sample_log()
    with McapContainer.open(lb.write(tmp_path, content + b"more")) as log:
        assert len(lb.messages(log)) == 203
        assert log.damage


def test_a_listed_chunk_that_is_not_there_is_told(tmp_path: Path) -> None:
    content = lb.sample_log(compression=CompressionType.NONE, index_types=IndexType.CHUNK)
    start = content.index(struct.pack("<B", 6), lb.data_start())
    assert content[start] == 6
    with McapContainer.open(lb.write(tmp_path, patched(content, start, bytes(60)))) as log:
        found = lb.messages(log)
        assert 0 < len(found) < 203
        assert sum(one.lost_messages or 0 for one in log.damage) == 203 - len(found)


def test_a_chunk_that_is_spoiled_and_cut_gives_nothing(tmp_path: Path) -> None:
    content = b"".join(noisy_message(number) for number in range(3000))
    chunk = bytearray(lb.chunk(content, "zstd"))
    chunk[60:80] = b"\xff" * 20
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, bytes(chunk[:100_000])))) as log:
        assert lb.messages(log) == []
        assert "the file ends within the chunk" in log.damage[0].what
        assert "none of the chunk's messages are given" in log.damage[0].what


def test_a_chunk_that_reaches_over_the_data_is_not_read(tmp_path: Path) -> None:
    content = content_of(range(10))
    header = bytearray(lb.chunk(content))
    header[1:9] = struct.pack("<Q", len(header) - 9 + 10_000)
    header[41:49] = struct.pack("<Q", len(content) + 10_000)
    data = bytes(header) + lb.chunk(content_of(range(10, 20)))
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(10, 20))
        assert "bytes doesn't fit here; reading goes on at byte" in log.damage[0].what


def test_a_record_that_reaches_into_a_listed_chunk_is_not_believed(tmp_path: Path) -> None:
    one = content_of(range(10))
    sound = summarised((one, lb.index_of(one)), counts={1: 10})
    content = patched(sound, 9, struct.pack("<Q", 200))
    with McapContainer.open(lb.write(tmp_path, content)) as log:
        assert lb.messages(log) == lb.expected(range(10))
        assert [(one.record, one.lost_messages) for one in log.damage] == [("Header", None)]


def test_a_message_too_short_to_be_one_is_stepped_over(tmp_path: Path) -> None:
    data = content_of(range(5)) + lb.record(5, b"short") + content_of(range(5, 8))
    with McapContainer.open(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))) as log:
        assert lb.messages(log) == lb.expected(range(8))
        (damage,) = log.damage
        assert (damage.what, damage.lost_messages) == ("a message too short to hold its own fields", 1)


def test_a_schema_that_comes_after_its_channel_is_still_used(tmp_path: Path) -> None:
    data = lb.channel() + lb.schema() + content_of(range(3))
    with McapContainer.open(lb.write(tmp_path, lb.log(data, summary=b""))) as log:
        assert log.channels[1].schema is not None
        assert lb.messages(log) == lb.expected(range(3))
        assert log.damage == ()
