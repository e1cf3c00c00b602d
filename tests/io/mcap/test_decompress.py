"""Bounded decompression."""

import lz4.frame
import numpy as np
import pytest
import zstandard

from chladni.io.mcap.decompress import DecompressError, decompress, decompress_start

NOISE = np.random.default_rng(1).bytes(300_000)
CONTENT = NOISE[:150_000] + bytes(150_000) + NOISE[150_000:]


def zstd_without_size(content: bytes) -> bytes:
    return zstandard.ZstdCompressor(write_content_size=False).compress(content)


def lz4_without_size(content: bytes) -> bytes:
    return lz4.frame.compress(content, store_size=False)


WAYS = {
    "plain": ("", bytes),
    "zstd": ("zstd", zstandard.compress),
    "zstd without size": ("zstd", zstd_without_size),
    "zstd in two frames": (
        "zstd",
        lambda content: zstandard.compress(content[:999]) + zstd_without_size(content[999:]),
    ),
    "lz4": ("lz4", lz4.frame.compress),
    "lz4 without size": ("lz4", lz4_without_size),
    "lz4 in two frames": (
        "lz4",
        lambda content: lz4.frame.compress(content[:999]) + lz4_without_size(content[999:]),
    ),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("content", [b"", b"x", CONTENT], ids=["empty", "byte", "long"])
def test_what_was_compressed_comes_back(way: str, content: bytes) -> None:
    if not content and "two frames" in way:
        content = b"y" * 1000
    name, squeeze = WAYS[way]
    assert bytes(decompress(squeeze(content), name, size=len(content))) == content
    assert decompress_start(squeeze(content), name, size=len(content)) == content


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("size", [len(CONTENT) - 1, len(CONTENT) + 1, 0, 1 << 40])
def test_a_size_that_is_not_the_declared_one_is_refused(way: str, size: int) -> None:
    name, squeeze = WAYS[way]
    with pytest.raises(DecompressError, match=rf"declares {size} bytes|zstd: |lz4: "):
        decompress(squeeze(CONTENT), name, size=size)


@pytest.mark.parametrize("way", WAYS)
def test_a_cut_chunk_gives_its_start(way: str) -> None:
    name, squeeze = WAYS[way]
    data = squeeze(CONTENT)
    start = decompress_start(data[: len(data) // 2], name, size=len(CONTENT))
    assert len(start) > 10_000
    assert CONTENT.startswith(start)


@pytest.mark.parametrize("way", [way for way in WAYS if way != "plain"])
def test_a_bomb_is_stopped_at_its_declared_size(way: str) -> None:
    name, squeeze = WAYS[way]
    bomb = squeeze(bytes(20_000_000))
    for opened in (decompress, decompress_start):
        with pytest.raises(DecompressError):
            opened(bomb, name, size=1000)


@pytest.mark.parametrize("name", ["zstd", "lz4"])
def test_a_frame_whose_own_size_is_absurd_takes_no_memory(name: str) -> None:
    if name == "zstd":
        # Magic, descriptor of an 8-byte content size in a single segment, the size, an empty last block.
        data = b"\x28\xb5\x2f\xfd\xe0" + (1 << 60).to_bytes(8, "little") + b"\x01\x00\x00"
    else:
        data = lz4.frame.compress(b"abc")[:100]
    with pytest.raises(DecompressError):
        decompress(data, name, size=1 << 60)


@pytest.mark.parametrize("name", ["zstd", "lz4"])
def test_bytes_that_are_not_compressed_at_all_are_refused(name: str) -> None:
    for opened in (decompress, decompress_start):
        with pytest.raises(DecompressError, match=name):
            opened(b"neither of them at all", name, size=100)


def test_an_unknown_compression_is_named() -> None:
    with pytest.raises(DecompressError, match="unknown compression 'bz2'"):
        decompress(b"", "bz2", size=0)
    assert decompress_start(b"abc", "bz2", size=3) == b""
