"""Whole logs against the mcap package, bit for bit."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType

from chladni.io.mcap import log_pass
from chladni.io.mcap.container import McapContainer
from chladni.signals.errors import LogError
from tests.io.mcap import log_bytes as lb

NO_SUMMARY = {
    "index_types": IndexType.NONE,
    "use_statistics": False,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_summary_offsets": False,
}
SETTINGS = [
    {},
    {"use_summary_offsets": False},
    {"repeat_channels": False},
    {"repeat_schemas": False},
    {"use_statistics": False},
    {"index_types": IndexType.CHUNK},
    {"index_types": IndexType.MESSAGE},
    {"index_types": IndexType.NONE},
    {"index_types": IndexType.NONE, "use_statistics": False},
    {"enable_crcs": False},
    {"enable_data_crcs": True},
    {"use_chunking": False},
    {"use_chunking": False, "enable_data_crcs": True},
    {"use_chunking": False, **NO_SUMMARY},
    NO_SUMMARY,
]


def in_channel_order(found: list[lb.Message]) -> list[lb.Message]:
    """Sort by channel alone: within one, the order of the file has to be right."""
    return sorted(found, key=lambda message: message[0])


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_every_message_is_what_the_mcap_package_reads(
    tmp_path: Path, compression: CompressionType, settings: dict[str, object]
) -> None:
    path = lb.write(tmp_path, lb.sample_log(compression=compression, **settings))
    with McapContainer.open(path) as log:
        assert in_channel_order(lb.messages(log)) == in_channel_order(lb.by_oracle(path))
        assert log.damage == ()
        assert {number: one.topic for number, one in log.channels.items()} == {
            1: "/imu",
            2: "/text",
            3: "/rare",
        }
        assert log.message_counts() in (None, {1: 150, 2: 50, 3: 3})
        assert log.time_range_ns in (None, (lb.START_NS, lb.START_NS + 149_000_000))


def test_counts_and_times_come_from_statistics_or_from_reading(tmp_path: Path) -> None:
    for settings in ({}, NO_SUMMARY):
        with McapContainer.open(lb.write(tmp_path, lb.sample_log(**settings))) as log:
            assert log.message_counts() == {1: 150, 2: 50, 3: 3}
            assert log.time_range_ns == (lb.START_NS, lb.START_NS + 149_000_000)


def test_without_statistics_the_chunk_indexes_tell_the_times_but_not_the_counts(tmp_path: Path) -> None:
    with McapContainer.open(lb.write(tmp_path, lb.sample_log(use_statistics=False))) as log:
        assert log.message_counts() is None
        assert log.time_range_ns == (lb.START_NS, lb.START_NS + 149_000_000)


def test_channels_carry_schema_metadata_and_encoding(tmp_path: Path) -> None:
    with McapContainer.open(lb.write(tmp_path, lb.sample_log())) as log:
        channel = log.channels[2]
        assert (channel.id, channel.topic, channel.message_encoding, dict(channel.metadata)) == (
            2, "/text", "cdr", {},
        )  # fmt: skip
        assert channel.schema is not None
        assert (channel.schema.name, channel.schema.encoding, channel.schema.data) == ("s2", "ros2msg", b"x")
        assert (log.profile, log.library, log.path.name) == ("ros2", "sample", "log.mcap")


def test_an_empty_log_has_no_channels_and_no_times(tmp_path: Path) -> None:
    with McapContainer.open(lb.write(tmp_path, lb.log(summary=b""))) as log:
        assert dict(log.channels) == {}
        assert log.time_range_ns is None
        assert lb.messages(log) == []
        assert log.damage == ()


@pytest.mark.parametrize("settings", [{}, NO_SUMMARY, {"use_chunking": False}], ids=str)
def test_all_columns_agree_with_the_mcap_package(tmp_path: Path, settings: dict[str, object]) -> None:
    path = lb.write(tmp_path, lb.sample_log(**settings))
    with path.open("rb") as file:
        oracle = [one for _, _, one in make_reader(file).iter_messages(topics=["/imu"])]
    with McapContainer.open(path) as log:
        batches = list(log.batches([1]))
    for field, column in (
        ("log_time", "log_time_ns"),
        ("publish_time", "publish_time_ns"),
        ("sequence", "sequence"),
    ):
        found = np.concatenate([getattr(batch, column) for batch in batches]).tolist()
        assert found == [getattr(one, field) for one in oracle]


def test_batches_are_read_only_columns_with_a_constant_stride(tmp_path: Path) -> None:
    content = b"".join(lb.message(number) for number in range(50))
    path = lb.write(tmp_path, lb.log(lb.schema() + lb.channel(), lb.chunk(content) + lb.index_of(content)))
    with McapContainer.open(path) as log:
        (batch,) = log.batches([1])
    assert not batch.buffer.flags.writeable
    assert batch.buffer.dtype == np.uint8
    assert set(np.diff(batch.offsets)) == {9 + 22 + 20}
    assert batch.offsets.dtype == batch.lengths.dtype == batch.log_time_ns.dtype == np.int64
    assert (batch.sequence.dtype, len(batch)) == (np.uint32, 50)


@pytest.mark.parametrize("settings", [{}, NO_SUMMARY, {"use_chunking": False}], ids=str)
@pytest.mark.parametrize(
    ("start", "end"), [(None, 40), (40, None), (37, 90), (0, 150), (60, 60), (500, 900), (-50, 0)]
)
def test_a_time_window_takes_the_start_and_leaves_the_end(
    tmp_path: Path, settings: dict[str, object], start: int | None, end: int | None
) -> None:
    path = lb.write(tmp_path, lb.sample_log(**settings))
    start_ns = None if start is None else lb.START_NS + start * 1_000_000
    end_ns = None if end is None else lb.START_NS + end * 1_000_000
    with McapContainer.open(path) as log:
        found = lb.messages(log, start_time_ns=start_ns, end_time_ns=end_ns)
        everything = lb.messages(log)
        assert log.damage == ()
    chosen = [
        one for one in everything if (start_ns is None or one[1] >= start_ns) and (end_ns is None or one[1] < end_ns)
    ]
    assert found == chosen


def opened_chunks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Note the offset of every chunk that is decompressed."""
    opened = []
    original = log_pass.open_chunk
    monkeypatch.setattr(
        log_pass, "open_chunk", lambda head, *rest: opened.append(head.data_offset) or original(head, *rest)
    )
    return opened


def test_chunks_without_wanted_channels_or_times_are_not_decompressed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = opened_chunks(monkeypatch)
    path = lb.write(tmp_path, lb.sample_log())
    with McapContainer.open(path) as log:
        assert opened == []
        everything = lb.messages(log)
        all_chunks = len(opened)
        opened.clear()
        assert lb.messages(log, [3]) == [one for one in everything if one[0] == 3]
        assert 0 < len(opened) < all_chunks
        opened.clear()
        lb.messages(log, [1], end_time_ns=lb.START_NS + 1)
        assert len(opened) == 1
        assert log.damage == ()


def test_several_readers_of_one_log_do_not_disturb_each_other(tmp_path: Path) -> None:
    path = lb.write(tmp_path, lb.sample_log())
    with McapContainer.open(path) as log:
        one, other = log.batches([1]), log.batches([1])
        for batch, same in zip(one, other, strict=True):
            assert np.array_equal(batch.log_time_ns, same.log_time_ns)


def test_reading_may_stop_anywhere(tmp_path: Path) -> None:
    path = lb.write(tmp_path, lb.sample_log())
    with McapContainer.open(path) as log:
        batches = log.batches([1])
        next(batches)
        batches.close()
        assert len(lb.messages(log)) == 203


def test_a_closed_log_says_so(tmp_path: Path) -> None:
    log = McapContainer.open(lb.write(tmp_path, lb.sample_log()))
    log.close()
    with pytest.raises(LogError, match="the log is closed; open it again"):
        list(log.batches([1]))


def test_a_file_cut_short_while_it_is_read_gives_what_is_left(tmp_path: Path) -> None:
    path = lb.write(tmp_path, lb.sample_log(compression=CompressionType.NONE))
    with McapContainer.open(path) as log:
        whole = lb.messages(log)
        with path.open("r+b") as file:
            file.truncate(5000)
        found = lb.messages(log)
        assert 0 < len(found) < len(whole)
        assert set(found) < set(whole)
        assert log.damage


def test_a_file_without_chunks_cut_short_while_it_is_read(tmp_path: Path) -> None:
    content = b"".join(lb.message(number, size=1000) for number in range(300))
    path = lb.write(tmp_path, lb.log(lb.schema() + lb.channel(), content, summary=b""))
    with McapContainer.open(path) as log:
        with path.open("r+b") as file:
            file.truncate(100_500)
        assert lb.messages(log) == lb.expected(range(97), size=1000)
        assert any("shorter" in one.what or "cut off" in one.what or "ends within" in one.what for one in log.damage)


def test_long_stretches_outside_chunks_come_in_bounded_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.io.mcap.data_section._STRETCH_BYTES", 300_000)
    content = b"".join(lb.message(number, size=1000) for number in range(2000))
    path = lb.write(tmp_path, lb.log(lb.schema() + lb.channel(), content, summary=b""))
    with McapContainer.open(path) as log:
        sizes = [len(batch.buffer) for batch in log.batches([1])]
        assert len(sizes) > 5
        assert max(sizes) <= 300_000
        assert lb.messages(log) == lb.expected(range(2000), size=1000)
        assert log.damage == ()


def test_a_message_longer_than_a_stretch_is_read(tmp_path: Path) -> None:
    content = lb.message(1) + lb.message(2, size=200_000) + lb.message(3)
    path = lb.write(tmp_path, lb.log(lb.schema() + lb.channel(), content, summary=b""))
    assert [len(data) for _, _, data in lb.read(path)] == [20, 200_000, 20]


def test_measured_logs_agree_with_the_mcap_package(shared_data: Path) -> None:
    for name in ("hammer.mcap", "mr_1A.mcap", "real_ros2_bag.mcap"):
        path = shared_data / name
        with McapContainer.open(path) as log:
            assert in_channel_order(lb.messages(log)) == in_channel_order(lb.by_oracle(path)), name
            assert log.damage == ()
