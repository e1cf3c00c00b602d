"""Messages by index against messages by walk."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.mcap.message_table import MessageTable, message_headers, table_from_index, table_from_walk
from chladni.io.mcap.record_walk import walk_records
from chladni.io.mcap.records import MessageIndex, parse_message_index
from tests.io.mcap import log_bytes as lb


def walked(content: bytes) -> MessageTable:
    buffer = np.frombuffer(content, np.uint8)
    return table_from_walk(buffer, walk_records(buffer, start=0, stop=len(content)))


def indexes(content: bytes) -> list[MessageIndex]:
    packed, found = lb.index_of(content), []
    while packed:
        length = struct.unpack_from("<Q", packed, 1)[0]
        found.append(parse_message_index(packed[9 : 9 + length]))
        packed = packed[9 + length :]
    return found


def assert_same(one: MessageTable, other: MessageTable) -> None:
    assert one.starts.tolist() == other.starts.tolist()
    assert one.headers.tolist() == other.headers.tolist()
    assert sorted(one.others.tolist()) == sorted(other.others.tolist())
    assert one.end == other.end


MESSAGES = st.lists(st.tuples(st.integers(1, 4), st.integers(0, 60), st.booleans()), min_size=1, max_size=80)


@given(chosen=MESSAGES)
def test_index_and_walk_agree(chosen: list[tuple[int, int, bool]]) -> None:
    content = b""
    for number, (channel_id, size, defined) in enumerate(chosen):
        content += (lb.schema() if defined else b"") + lb.message(number, channel_id, size=size)
    table = table_from_index(np.frombuffer(content, np.uint8), indexes(content))
    assert table is not None
    assert_same(table, walked(content))


@pytest.mark.parametrize("backwards", [False, True])
def test_an_index_by_time_may_jump_in_the_chunk(backwards: bool) -> None:
    content = b"".join(lb.message(number, 1 + number % 2) for number in range(20))
    found = indexes(content)
    if backwards:
        found = [MessageIndex(channel_id=one.channel_id, entries=one.entries[::-1]) for one in found]
    table = table_from_index(np.frombuffer(content, np.uint8), found)
    assert table is not None
    assert_same(table, walked(content))


def test_one_channel_backwards_is_sorted_by_offset() -> None:
    content = b"".join(lb.message(number) for number in range(9))
    (one,) = indexes(content)
    found = [MessageIndex(channel_id=1, entries=one.entries[::-1])]
    table = table_from_index(np.frombuffer(content, np.uint8), found)
    assert table is not None
    assert_same(table, walked(content))


@given(channels=st.integers(1, 700), repeats=st.integers(1, 3), gap=st.booleans())
def test_any_number_of_other_records_between_messages_is_sound(channels: int, repeats: int, gap: bool) -> None:
    definitions = [lb.channel(number) for number in range(channels)]
    content = b"".join(
        (definitions[number] if first or gap else b"") + lb.message(number, number)
        for first in range(repeats)
        for number in range(channels)
    )
    table = table_from_index(np.frombuffer(content, np.uint8), indexes(content))
    assert table is not None
    assert_same(table, walked(content))


def test_an_index_that_lacks_a_message_among_very_many_other_records_is_refused() -> None:
    content = b"".join(lb.message(number) + lb.schema() for number in range(400))
    (one,) = indexes(content)
    short = MessageIndex(channel_id=1, entries=np.delete(one.entries, 200))
    assert table_from_index(np.frombuffer(content, np.uint8), [short]) is None


def test_messages_that_overlap_are_refused() -> None:
    inner = lb.message(2)
    content = lb.message(1, size=0)[:9].replace(b"\x16", bytes([22 + len(inner)]), 1)
    content += lb.message(1, size=0)[9:] + inner
    entries = lb.message_index(1, [(lb.START_NS + 1, 0), (lb.START_NS + 2, 31)])
    buffer = np.frombuffer(content, np.uint8)
    assert table_from_index(buffer, [parse_message_index(entries[9:])]) is None
    assert walked(content).starts.tolist() == [0]


def test_equally_spaced_headers_are_a_view() -> None:
    content = b"".join(lb.message(number) for number in range(50))
    buffer = np.frombuffer(content, np.uint8)
    starts = np.arange(50) * len(lb.message(0))
    assert message_headers(buffer, starts).base is not None
    assert message_headers(buffer, starts)["sequence"].tolist() == list(range(50))
    assert message_headers(buffer, starts[[0, 1, 3]])["sequence"].tolist() == [0, 1, 3]
    assert len(message_headers(buffer, starts[:0])) == 0
