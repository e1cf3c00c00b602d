"""What claims too much is refused by name, and read when the limit is raised."""

import tracemalloc
from pathlib import Path

import pytest

from chladni.io.mcap.container import McapContainer
from chladni.io.mcap.damage import Damage
from chladni.io.mcap.limits import MIB, Limits
from tests.io.mcap import log_bytes as lb

DEFINITIONS = lb.schema() + lb.channel()
CONTENT = b"".join(lb.message(number) for number in range(100))


def damage_of(path: Path, limits: Limits | None = None) -> tuple[int, tuple[Damage, ...]]:
    with McapContainer.open(path, limits=limits) as log:
        return len(lb.messages(log)), log.damage


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_a_chunk_above_the_limit(tmp_path: Path, compression: str) -> None:
    data = lb.chunk(CONTENT, compression) + lb.index_of(CONTENT)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))
    found, (damage,) = damage_of(path, Limits(chunk_bytes=5000))
    assert found == 0
    assert damage.what == (
        "the chunk claims 5100 bytes, above the limit chunk_bytes=5000; raise it with "
        "open_log(..., limits=Limits(chunk_bytes=...)); none of the chunk's messages are given"
    )
    assert damage.lost_messages == 100
    assert damage_of(path, Limits(chunk_bytes=5100)) == (100, ())


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_a_chunk_that_declares_2_to_the_60(tmp_path: Path, compression: str) -> None:
    data = lb.chunk(CONTENT, compression, size=1 << 60)
    found, (damage,) = damage_of(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b"")))
    assert found == 0
    assert f"claims {1 << 60} bytes, above the limit chunk_bytes" in damage.what
    assert damage.lost_messages is None


def test_a_bomb_within_the_limit_of_its_lie(tmp_path: Path) -> None:
    bomb = lb.compress(bytes(10_000_000), "zstd")
    data = lb.chunk(b"", "zstd", size=200_000_000, data=bomb, crc=1)
    found, (damage,) = damage_of(lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b"")))
    assert found == 0
    assert "declares 200000000 bytes but 10000000 were found in it" in damage.what


@pytest.mark.parametrize("compression", [pytest.param("zstd", marks=pytest.mark.nightly), "lz4"])
def test_a_chunk_is_decompressed_once_in_memory(tmp_path: Path, compression: str) -> None:
    size = 128 * MIB
    bomb = chunk_of_one_record(size, compression)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, lb.chunk(CONTENT), bomb, lb.chunk(CONTENT), summary=b""))
    assert path.stat().st_size < size / 200
    # A fifth more for how a buffer grows.
    assert peak_memory_bytes(path) < 1.2 * size


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_all_chunks_together_stay_within_the_limit(tmp_path: Path, compression: str) -> None:
    bombs = [chunk_of_one_record(10 * MIB, compression)] * 8
    path = lb.write(tmp_path, lb.log(DEFINITIONS, *bombs, lb.chunk(CONTENT), summary=b""))
    allowed = 256 * path.stat().st_size
    found, damage = damage_of(path, Limits(expanded_bytes=35 * MIB))
    refused = 8 - max(allowed, 35 * MIB) // (10 * MIB)
    assert len(damage) == max(refused, 0)
    assert all("above the limit expanded_bytes=36700160; raise it with open_log" in one.what for one in damage)
    # Small chunks behind them are still read.
    assert found == 100
    assert damage_of(path) == (100, ())


def test_a_log_may_hold_many_times_the_limit_when_it_is_large_itself(tmp_path: Path) -> None:
    path = lb.write(tmp_path, lb.log(DEFINITIONS, *[lb.chunk(CONTENT, "zstd")] * 50, summary=b""))
    assert damage_of(path, Limits(expanded_bytes=1)) == (5000, ())


def chunk_of_one_record(size: int, compression: str) -> bytes:
    return lb.chunk(lb.record(0x0C, bytes(size - 9)), compression)


def peak_memory_bytes(path: Path) -> int:
    tracemalloc.start()
    try:
        damage_of(path)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_message_outside_chunks_above_the_limit(tmp_path: Path) -> None:
    data = lb.message(1) + lb.message(2, size=200_000) + lb.message(3)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))
    found, (damage,) = damage_of(path, Limits(record_bytes=100_000))
    assert found == 2
    assert "above the limit record_bytes=100000" in damage.what
    assert (damage.record, damage.lost_messages) == ("Message", 1)
    assert damage_of(path) == (3, ())


def test_large_records_that_nobody_reads_have_no_limit(tmp_path: Path) -> None:
    data = lb.message(1) + lb.record(9, bytes(200_000)) + lb.record(0x0C, bytes(200_000)) + lb.message(3)
    path = lb.write(tmp_path, lb.log(DEFINITIONS, data, summary=b""))
    assert damage_of(path, Limits(record_bytes=1000)) == (2, ())


def test_a_summary_above_the_limit_is_not_needed(tmp_path: Path) -> None:
    found, (damage,) = damage_of(lb.write(tmp_path, lb.sample_log()), Limits(summary_bytes=100))
    assert found == 203
    assert "above the limit summary_bytes=100" in damage.what
    assert (damage.record, damage.lost_messages) == ("Summary", 0)


def test_definitions_above_the_limit_are_left_out_with_their_messages(tmp_path: Path) -> None:
    data = DEFINITIONS + lb.channel(2, "/" + "long" * 1000) + lb.message(1) + lb.message(2, 2)
    path = lb.write(tmp_path, lb.log(data, summary=b""))
    found, damage = damage_of(path, Limits(definition_bytes=1000))
    assert found == 1
    assert any("above the limit definition_bytes=1000" in one.what for one in damage)
    assert sum(one.lost_messages or 0 for one in damage) == 1
    assert damage_of(path) == (2, ())
