"""The search for the next chunk behind damage."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.mcap.log_file import LogFile
from chladni.io.mcap.stepping_stones import find_chunk
from tests.io.mcap import log_bytes as lb

BLOCK_BYTES = 1 << 20
CHUNK = lb.chunk(b"".join(lb.message(number) for number in range(9)))


def search(folder: Path, content: bytes, start: int = 8, stop: int | None = None) -> int | None:
    file = LogFile(lb.write(folder, lb.MAGIC + content))
    try:
        return find_chunk(file, start=start, stop=file.size if stop is None else stop)
    finally:
        file.close()


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_a_chunk_is_found_in_noise(tmp_path: Path, compression: str) -> None:
    noise = np.random.default_rng(5).bytes(100_000)
    chunk = lb.chunk(b"".join(lb.message(number) for number in range(9)), compression)
    assert search(tmp_path, noise + chunk + noise) == 8 + 100_000
    assert search(tmp_path, noise + noise) is None


@pytest.mark.parametrize("shift", range(-60, 10, 7))
def test_a_header_across_the_border_of_two_blocks_is_found(tmp_path: Path, shift: int) -> None:
    content = b"\x06" * (BLOCK_BYTES + shift) + CHUNK
    assert search(tmp_path, content) == 8 + BLOCK_BYTES + shift


def test_the_first_of_two_counts_and_the_start_is_included(tmp_path: Path) -> None:
    assert search(tmp_path, CHUNK + CHUNK) == 8
    assert search(tmp_path, CHUNK + CHUNK, start=9) == 8 + len(CHUNK)


def test_a_chunk_that_reaches_over_the_end_is_not_one(tmp_path: Path) -> None:
    assert search(tmp_path, CHUNK[:-1]) is None
    assert search(tmp_path, CHUNK, stop=7 + len(CHUNK)) is None
    assert search(tmp_path, b"short") is None
