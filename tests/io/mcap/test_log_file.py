"""Files that are no MCAP logs are refused in one line that helps."""

import gzip
import os
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from chladni.io.mcap.container import McapContainer
from chladni.signals.errors import LogError


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        (b"#ROSBAG V2.0\n" + bytes(50), "a ROS 1 bag; convert it with 'mcap convert in.bag out.mcap'"),
        (b"SQLite format 3\0" + bytes(50), "a ROS 2 .db3 bag; convert it"),
        (gzip.compress(b"log", mtime=0), "gzip; unpack it with gunzip"),
        (zstandard.compress(b"log" * 10), "zstd; unpack it with 'zstd -d'"),
        (lz4.frame.compress(b"log" * 10), "lz4; unpack it with 'lz4 -d'"),
        (b"PK\x03\x04" + bytes(50), "a zip archive"),
        (b"\x89MCAP9\r\n" + bytes(50), "another version of MCAP"),
    ],
)
def test_what_the_file_looks_like_is_said(tmp_path: Path, content: bytes, hint: str) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError) as told:
        McapContainer.open(path)
    message = str(told.value)
    assert message.startswith(
        f"{path}: not an MCAP log: starts with {content[:8].hex(' ')}, expected the MCAP magic 89 4d"
    )
    assert "it looks like " in message
    assert hint in message
    assert "\n" not in message


def test_other_bytes_are_shown(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"hello")
    with pytest.raises(LogError, match=r"starts with 68 65 6c 6c 6f, expected .* 0d 0a$"):
        McapContainer.open(str(path))


def test_an_empty_file_is_called_empty(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.touch()
    with pytest.raises(LogError, match="the file is empty; expected an MCAP log"):
        McapContainer.open(path)


def test_a_folder_a_pipe_and_nothing_are_no_logs(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="not a file"):
        McapContainer.open(tmp_path)
    with pytest.raises(LogError, match=r"none\.mcap: can't be opened: No such file"):
        McapContainer.open(tmp_path / "none.mcap")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(LogError, match="not a file"):
            McapContainer.open(tmp_path / "pipe")


def test_only_the_magic_is_a_log_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"\x89MCAP0\r\n")
    with McapContainer.open(path) as log:
        assert dict(log.channels) == {}
        assert any("its recording was cut off" in one.what for one in log.damage)
